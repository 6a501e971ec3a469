"""Sweeps by the compiled run-time: against closed forms and IDAS, in threads, with failures, without a library."""

import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from components import Clutch, ConstantTorque, Fixed, Inertia
from modelica_like import build, simulate
from modelica_like.analyse.sweeps import workers
from modelica_like.analyse.sweeps.native_runs import NativeRuns
from modelica_like.analyse.sweeps.sweep import sweep
from modelica_like.errors import ExportError
from modelica_like.language import Assembly
from modelica_like.native.batch import Batch
from modelica_like.netlist import loads
from modelica_like.runs.readings import read_output
from tests.analyse.test_impacts import engaged

ROOT = Path(__file__).parents[2]
SOLVERS = ("native", "idas")
STARTUP = ROOT / "examples" / "machine_tool_startup.toml"


def braked() -> Assembly:
    """A clutch to the housing stops an inertia: w = 10 rad/s - tau/J t until it stands."""
    parts = {"mass": Inertia(J=2.0, w=10.0, phi=0.0), "brake": Clutch(capacity=4.0), "housing": Fixed()}
    return Assembly("braked", parts=parts, series={"shaft": [*parts]})


def test_every_kind_of_reading_of_a_dog_clutch_against_closed_forms():
    """Two inertias meet at t = 0.4 s: half the reduced mass times the squared difference of speeds is lost."""
    begin, tau, end, b = 0.4, 2.0, 1.0, 3.0
    a = np.array([1.0, 2.0, 4.0])
    outputs = [
        "b.w", "at(a.w, 0.2 s)", "at(a.w, 1 s)", "at(a.w, 0 s)", "max(a.w)", "min(b.w)", "integral(push.source_power)",
        "dog.lock_time", "time(dog.teeth: open -> waiting)", "dog.loss_energy", "push.source_energy", "loss_energy",
    ]  # fmt: skip
    found = sweep(build(engaged()), {"a.J": a}, outputs, until=end)
    before = 5.0 + tau / a * begin
    after = (a * before + b) / (a + b)
    last = after + tau / (a + b) * (end - begin)
    angle = 5.0 * begin + tau / a * begin**2 / 2 + (after + last) / 2 * (end - begin)
    lost = 0.5 * a * b / (a + b) * (before - 1.0) ** 2
    expected = [
        last, 5.0 + tau / a * 0.2, last, np.full(3, 5.0), before, np.full(3, 1.0), tau * angle, np.full(3, begin),
        np.full(3, np.nan), lost, tau * angle, lost,
    ]  # fmt: skip
    for name, values in zip(outputs, expected, strict=True):
        np.testing.assert_allclose(found[name], values, rtol=1e-7, err_msg=name)
    assert (found.attrs["solver"], found.attrs["notice"]) == ("native", "")
    # The first run and the last one have the extremes; rounding decides where all are equal.
    assert found.attrs["checked"] in (2, 3)


def test_friction_work_against_its_closed_form():
    torques = np.array([2.0, 4.0, 8.0])
    found = sweep(
        build(braked()),
        {"brake.capacity": torques},
        ["brake.loss_energy", "max(brake.loss_power)", "mass.w"],
        until=5.0,
    )
    left = np.maximum(10.0 - torques / 2.0 * 5.0, 0.0)
    np.testing.assert_allclose(found["brake.loss_energy"], 0.5 * 2.0 * (100.0 - left**2), rtol=1e-7)
    np.testing.assert_allclose(found["max(brake.loss_power)"], 10.0 * torques, rtol=1e-7)
    np.testing.assert_allclose(found["mass.w"], left, atol=1e-9)


def test_document_003_is_the_same_with_idas():
    outputs = [
        "max(shaft1.tau)", "min(shaft1.tau)", "clutch.lock_time", "clutch.loss_energy", "at(shaft1.tau, 0.3 s)",
        "integral(shaft1.tau)", "source_energy", "stored_energy", "time(load.mode -> forward)",
    ]  # fmt: skip
    over = {"h1": [1.0, 10.0], "k1": ["5000 N.m/rad", "6120 N.m/rad"]}
    native, idas = (sweep(STARTUP, over, outputs, solver=solver, rtol=1e-10, atol=1e-12) for solver in SOLVERS)
    for name in outputs:
        np.testing.assert_allclose(native[name], idas[name], rtol=1e-7, err_msg=name)
    assert native.attrs["notice"] == ""
    assert native.attrs["checked"] >= 3
    assert (idas.attrs["solver"], idas.attrs["checked"]) == ("idas", 0)


def test_threads_do_not_disturb_each_other():
    model = build(STARTUP)
    outputs = [read_output(model, name) for name in ("max(shaft1.tau)", "clutch.loss_energy")]
    runs = NativeRuns(model, ("k1",), outputs, {"points": 20})
    chunks = [np.linspace(5000.0, 7000.0, 5)[:, None] + k for k in range(8)]
    alone = [runs.run(chunk)[0] for chunk in chunks]
    with ThreadPoolExecutor(4) as pool:
        together = [values for values, _, _ in pool.map(runs.run, chunks)]
    np.testing.assert_array_equal(together, alone)
    # A run does not depend on those before it.
    np.testing.assert_array_equal(runs.run(chunks[3][4:])[0][0], alone[3][4])


def test_what_the_run_time_cannot_do_idas_does_and_what_cannot_be_is_told():
    found = sweep(build(braked()), {"mass.J": [2.0, 0.0, -1.0, 4.0]}, ["mass.w"], until=1.0)
    reference = sweep(build(braked()), {"mass.J": [2.0, 0.0, -1.0, 4.0]}, ["mass.w"], until=1.0, solver="idas")
    np.testing.assert_allclose(found["mass.w"], [8.0, np.nan, np.nan, 9.0], rtol=1e-9)
    told = found["failure"].to_numpy().tolist()
    assert told == reference["failure"].to_numpy().tolist()
    assert told[2] == "mass.J = -1.0 is out of range: it must be at least 0 kg.m2."
    assert told[1]
    assert found.attrs["notice"] == "IDAS did 1 of 4 runs, where the native run-time failed."


def test_runs_that_are_others_with_idas_are_told(monkeypatch):
    right = Batch.run

    def wrong(self, parameters, inputs, stop=None):
        values, failed = right(self, parameters, inputs, stop)
        return values + 0.01, failed

    monkeypatch.setattr(Batch, "run", wrong)
    found = sweep(build(braked()), {"mass.J": np.linspace(2.0, 4.0, 150)}, ["mass.w"], until=1.0)
    assert found.attrs["checked"] == 3
    assert found.attrs["notice"] == (
        "In 3 of 3 repeated runs IDAS has other results:\n"
        "  run 0: mass.w = 8.01 instead of 8\n"
        f"  run 100: mass.w = {10 - 4 / (2 + 200 / 149) + 0.01:.9g} instead of {10 - 4 / (2 + 200 / 149):.9g}\n"
        "  run 149: mass.w = 9.01 instead of 9"
    )


def test_without_a_library_there_are_no_runs(monkeypatch):
    def none():
        raise ExportError("There is no C compiler.")

    monkeypatch.setattr("modelica_like.native.model.library", none)
    workers._model.cache_clear()
    with pytest.raises(ExportError, match=r"There is no C compiler\."):
        sweep(build(braked()), {"mass.J": [2.0, 4.0]}, ["mass.w"], until=1.0)


LONG = """
import signal, sys, threading, time
signal.signal(signal.SIGINT, signal.default_int_handler)
from modelica_like.analyse.sweeps.sweep import sweep

def watch():
    while threading.active_count() < 4:  # this one, that of the sweep, and two for its runs
        time.sleep(0.05)
    print("runs", flush=True)

threading.Thread(target=watch, daemon=True).start()
sweep(sys.argv[1], {"k1": [6120.0 + k for k in range(100_000)]}, ["shaft1.tau"], chunk=50_000, processes=2)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals to processes")
def test_an_interrupt_does_not_wait_for_runs_in_c():
    """A chunk takes minutes."""
    words = [sys.executable, "-c", LONG, str(STARTUP)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == b"runs\n"
            time.sleep(1.0)
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=20)
        finally:
            process.kill()
    assert b"KeyboardInterrupt" in errors
    assert b"0 of 100000 runs are lost without a checkpoint." in errors


def test_a_constant_torque_on_threads_with_inputs_and_limits_of_formulas():
    parts = {"push": ConstantTorque(tau_constant=1.0), "mass": Inertia(J=2.0, w=0.0, phi=0.0)}
    model = build(Assembly("pushed", parts=parts, series={"shaft": [*parts]}))
    over = {"push.tau_constant": np.linspace(-1.0, 1.0, 2001)}
    found = sweep(model, over, ["mass.w"], until=2.0, processes=3, chunk=70)
    np.testing.assert_allclose(found["mass.w"], over["push.tau_constant"], atol=1e-12)
    # One in a hundred of 2000, and the extremes: the first run, and the last one.
    assert found.attrs["checked"] == 21


def test_many_runs_are_compared_less_often():
    """20 of the first 2,000, one in a thousand of the 3,000 others, and the last one."""
    parts = {"push": ConstantTorque(tau_constant=1.0), "mass": Inertia(J=2.0, w=0.0, phi=0.0)}
    model = build(Assembly("pushed", parts=parts, series={"shaft": [*parts]}))
    found = sweep(model, {"push.tau_constant": np.linspace(0.0, 1.0, 5000)}, ["mass.w"], until=1.0)
    assert found.attrs["checked"] == 20 + 3 + 1


def test_the_report_tells_what_idas_had_to_do(capsys):
    from rich.console import Console

    from modelica_like.show.report.analysis import sweep_report

    found = sweep(build(braked()), {"mass.J": [2.0, 0.0]}, ["mass.w"], until=1.0)
    Console(width=200).print(sweep_report(found))
    assert "IDAS did 1 of 2 runs, where the native run-time failed." in capsys.readouterr().out


def test_the_last_digits_of_the_time_are_read():
    """The table's edge at 1.2 s leaves a step of 1e-12 s, in which the torque jumps: its halves had no length."""
    model = build(ROOT / "examples" / "components" / "screw_lift.toml")
    names = ["peak(motor.flange.tau)", "integral(motor.flange.tau)"]
    table = sweep(model, {"weight": [2000.0]}, names)
    run = simulate(model, solver="idas", readings=names)
    for name, tolerance in zip(names, (1e-6, 1e-5), strict=True):
        assert float(table[name][0]) == pytest.approx(run.readings[name], rel=tolerance)


def test_readings_are_taken_from_kink_to_kink():
    """A curve over an angle that turns steadily: 10 per rad up to 1 rad, then down by 6 per rad."""
    drive = loads("""
[parts]
shaft = { is = "ConstantSpeed", w_fixed = 2, phi = 0 }
wheel = { is = "Inertia", J = 1 }
angle = { is = "AngleSensor" }
curve = { is = "Table1D", table = [[0, 0], [1, 10], [2, 4]] }
[series]
line = ["shaft", "wheel", "angle"]
[connect]
angle = ["angle.phi", "curve.u"]
[simulate]
until = "0.9 s"
""")
    speeds = np.linspace(1.5, 2.2, 60)
    names = ["max(curve.y)", "integral(curve.y)", "first(curve.y > 9.999)"]
    table = sweep(drive, {"shaft.w_fixed": [*speeds]}, names)
    peak, integral, first = (np.asarray(table[name], float) for name in names)
    np.testing.assert_allclose(peak, 10.0, rtol=1e-12)
    after = 0.9 - 1 / speeds
    np.testing.assert_allclose(integral, 5 / speeds + 10 * after - 3 * speeds * after**2, rtol=1e-11)
    np.testing.assert_allclose(first, 0.9999 / speeds, rtol=1e-11)
