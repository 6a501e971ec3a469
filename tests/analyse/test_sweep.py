"""Sweeps against closed forms; stopped, resumed, on processes and on a Dask cluster that loses a worker."""

import math
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from components import ConstantTorque, Inertia
from modelica_like import build
from modelica_like.analyse.sweeps.importance import importance
from modelica_like.analyse.sweeps.plan import LatinHypercube, Sobol
from modelica_like.analyse.sweeps.sweep import sweep
from modelica_like.errors import CheckpointMismatch, UnknownName, ValueOutOfRange
from modelica_like.language import Component, Equations, series


class Accelerated(Component):
    """An inertia under constant torque: w = w0 + tau/J t."""

    def build(self) -> None:
        self.torque = ConstantTorque(tau_constant=2.0)
        self.mass = Inertia(J=4.0, w=1.0, phi=0.0)

    def equations(self) -> Equations:
        yield from series(self.torque, self.mass)


TORQUES, INERTIAS = np.array([1.0, 2.0, 5.0]), np.array([0.5, 4.0])
OVER = {"torque.tau_constant": TORQUES, "mass.J": INERTIAS}


@pytest.fixture(scope="module")
def model():
    return build(Accelerated())


def final_speed(torque, inertia, t=3.0):
    return 1.0 + torque / inertia * t


def test_grid(model):
    found = sweep(model, OVER, ["mass.w", "max(mass.phi)"], until=3.0)
    torque, inertia = np.meshgrid(TORQUES, INERTIAS, indexing="ij")
    np.testing.assert_allclose(found["mass.w"], final_speed(torque, inertia), rtol=1e-7)
    np.testing.assert_allclose(found["max(mass.phi)"], 3.0 + 0.5 * torque / inertia * 9.0, rtol=1e-6)
    assert found["mass.w"].dims == tuple(OVER)
    assert found["mass.w"].attrs["units"] == "rad/s"
    assert found["mass.J"].attrs["units"] == "kg.m2"
    assert not np.any(found["failure"].to_numpy() != "")


@pytest.mark.parametrize("sampling", [LatinHypercube(20, seed=3), Sobol(16, seed=3)])
def test_samples(model, sampling):
    found = sweep(
        model, {"mass.J": (0.5, 4.0), "torque.tau_constant": (1.0, 5.0)}, ["mass.w"], sampling=sampling, until=3.0
    )
    inertia, torque = found["mass.J"].to_numpy(), found["torque.tau_constant"].to_numpy()
    assert found.sizes == {"sample": sampling.count}
    assert np.all((inertia >= 0.5) & (inertia <= 4.0))
    # One sample in each of as many strips.
    strips = np.floor((inertia - 0.5) / 3.5 * sampling.count).astype(int)
    assert sorted(strips) == list(range(sampling.count))
    np.testing.assert_allclose(found["mass.w"], final_speed(torque, inertia), rtol=1e-7)


def test_failed_runs_are_told_and_not_fatal(model):
    found = sweep(model, {"mass.J": [1.0, -1.0, 2.0]}, ["mass.w"], until=3.0)
    np.testing.assert_allclose(found["mass.w"], [7.0, np.nan, 4.0], rtol=1e-7)
    assert found["failure"].to_numpy().tolist() == [
        "",
        "mass.J = -1.0 is out of range: it must be at least 0 kg.m2.",
        "",
    ]


def test_processes_do_the_same(model):
    one = sweep(model, OVER, ["mass.w"], until=3.0, processes=1)
    two = sweep(model, OVER, ["mass.w"], until=3.0, processes=2, chunk=2)
    np.testing.assert_array_equal(one["mass.w"], two["mass.w"])


class Stopped(Exception):
    pass


def test_checkpoint_goes_on_where_it_stopped(model, tmp_path):
    path, seen = tmp_path / "sweep.zarr", []

    def stop(done: int, total: int) -> None:
        seen.append((done, total))
        if done >= 4:
            raise Stopped

    over = {"torque.tau_constant": np.linspace(1.0, 5.0, 11)}
    with pytest.raises(Stopped):
        sweep(model, over, ["mass.w"], until=3.0, chunk=2, checkpoint=path, progress=stop, processes=1)
    assert seen == [(2, 11), (4, 11)]
    seen.clear()
    found = sweep(
        model,
        over,
        ["mass.w"],
        until=3.0,
        chunk=2,
        checkpoint=path,
        progress=lambda done, total: seen.append((done, total)),
        processes=1,
    )
    assert seen == [(6, 11), (8, 11), (10, 11), (11, 11)]
    np.testing.assert_allclose(found["mass.w"], final_speed(over["torque.tau_constant"], 4.0), rtol=1e-7)
    with pytest.raises(CheckpointMismatch, match="another sweep"):
        sweep(model, {"mass.J": [1.0]}, ["mass.w"], until=3.0, checkpoint=path)
    again = sweep(
        model, over, ["mass.w"], until=3.0, chunk=2, checkpoint=path, progress=lambda *_: pytest.fail("again")
    )
    np.testing.assert_array_equal(again["mass.w"], found["mass.w"])


def test_a_foreign_folder_is_not_touched(model, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(CheckpointMismatch, match="not the checkpoint"):
        sweep(model, {"mass.J": [1.0]}, ["mass.w"], until=3.0, checkpoint=tmp_path)
    assert (tmp_path / "notes.txt").read_text() == "mine"


@pytest.fixture
def cluster(tmp_path):
    """A scheduler and two workers, each a process of its own."""
    address_file = tmp_path / "scheduler.json"
    dask = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
    scheduler = subprocess.Popen(
        [*dask, "--port", "0", "--no-dashboard", "--host", "127.0.0.1", "--scheduler-file", str(address_file)],
        stderr=subprocess.DEVNULL,
    )
    worker = [sys.executable, "-m", "distributed.cli.dask_worker", "--nthreads", "1", "--no-nanny", "--no-dashboard"]
    workers = [
        subprocess.Popen(
            [*worker, "--scheduler-file", str(address_file), "--local-directory", str(tmp_path / f"worker{k}")],
            stderr=subprocess.DEVNULL,
        )
        for k in range(2)
    ]
    try:
        yield _address(address_file), workers
    finally:
        for process in (*workers, scheduler):
            process.kill()
        for process in (*workers, scheduler):
            process.wait(timeout=20)


def _address(file) -> str:
    import json

    for _ in range(300):
        if file.exists() and file.stat().st_size:
            return json.loads(file.read_text())["address"]
        time.sleep(0.1)
    raise AssertionError("The Dask scheduler did not start.")


@pytest.mark.slow
def test_a_cluster_that_loses_a_worker_loses_and_doubles_nothing(model, cluster, tmp_path):
    from distributed import Client

    address, workers = cluster
    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=60)
    over = {"torque.tau_constant": np.linspace(1.0, 5.0, 120), "mass.J": INERTIAS}
    counts: list[int] = []

    def told(done: int, total: int) -> None:
        counts.append(done)
        if len(counts) == 5:
            os.kill(workers[0].pid, signal.SIGKILL)

    found = sweep(
        model, over, ["mass.w"], until=3.0, scheduler=address, chunk=4, progress=told, checkpoint=tmp_path / "c.zarr"
    )
    assert counts == list(range(4, 241, 4))
    assert workers[0].poll() is not None
    torque, inertia = np.meshgrid(*over.values(), indexing="ij")
    np.testing.assert_allclose(found["mass.w"], final_speed(torque, inertia), rtol=1e-7)


def test_importance_of_a_linear_output(model):
    """phi = w0 t + tau/(2 J) t²: linear in w0 and tau; the shares of the variance are those of the squared ranges."""
    ranges = {"torque.tau_constant": (1.0, 3.0), "mass.J": (4.0, 4.000001)}
    found = importance(model, ranges, ["mass.w"], samples=64, until=3.0)
    assert found["S1", "mass.w", "torque.tau_constant"] == pytest.approx(1.0, abs=0.02)
    assert found["ST", "mass.w", "mass.J"] == pytest.approx(0.0, abs=1e-6)
    effects = importance(model, ranges, ["mass.w"], method="morris", samples=8, until=3.0)
    # Over the whole range of the torque the speed changes by 2/4 · 3.
    assert effects["mu_star", "mass.w", "torque.tau_constant"] == pytest.approx(1.5, rel=1e-6)
    assert math.isclose(effects["sigma", "mass.w", "torque.tau_constant"], 0.0, abs_tol=1e-5)


def test_importance_of_a_quotient(model):
    """w = w0 + 3 tau/J: a product of tau from (1, 3) and 1/J from (2, 10); the shares of its variance by hand."""
    found = importance(
        model, {"torque.tau_constant": (1.0, 3.0), "mass.J": (2.0, 10.0)}, ["mass.w"], samples=1024, until=3.0
    )
    mean, square = 2.0, (3.0**3 - 1.0) / 3 / 2  # of the torque
    inverse, inverse_square = math.log(5.0) / 8, (1 / 2 - 1 / 10) / 8
    both = square * inverse_square - (mean * inverse) ** 2
    first = (square - mean**2) * inverse**2 / both, (inverse_square - inverse**2) * mean**2 / both
    for name, own, other in zip(("torque.tau_constant", "mass.J"), first, first[::-1], strict=True):
        # Half of the 95 % interval that 1024 samples leave is about 0.06; Sobol's points are ten times as near.
        assert found["S1", "mass.w", name] == pytest.approx(own, abs=0.02)
        assert found["ST", "mass.w", name] == pytest.approx(1 - other, abs=0.02)


@pytest.mark.parametrize(
    ("over", "outputs", "error"),
    [
        ({}, ["mass.w"], ValueOutOfRange),
        ({"mass.J": []}, ["mass.w"], ValueOutOfRange),
        ({"mass.j": [1.0]}, ["mass.w"], UnknownName),
        ({"mass.J": [1.0]}, [], ValueOutOfRange),
        ({"mass.J": [1.0]}, ["mass.x"], UnknownName),
    ],
)
def test_wrong_calls(model, over, outputs, error):
    with pytest.raises(error):
        sweep(model, over, outputs, until=3.0)
