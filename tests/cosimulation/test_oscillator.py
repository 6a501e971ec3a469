"""The two-mass oscillator in two FMUs against its closed form: orders of the masters, variable steps, energies."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import log2
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from two_masses import J1, J2, M, closed_form

from modelica_like import Trajectories, export_fmu
from modelica_like.errors import FmuCrashed, FmuFailed, FmuTimeout, StepFailed
from modelica_like.fmi.cosimulation.run import cosim
from modelica_like.fmi.cosimulation.split import Split, split
from modelica_like.fmi.cosimulation.system import System
from modelica_like.netlist import loads

MASTERS = pytest.mark.parametrize("master", ["jacobi", "gauss-seidel"])
SIGNALS = ("J2.w", "shaft.tau")
PRECISE = {"until": 0.2, "fmu_tolerance": 1e-9, "outputs": [*SIGNALS, "J1.w"]}


def error(run: Trajectories) -> float:
    """Largest deviation from the closed form, in parts of a signal's range."""
    truth = closed_form(run.time)
    return max(float(np.abs(run[name] - truth[name]).max() / np.ptp(truth[name])) for name in SIGNALS)


def test_the_closed_form_is_that_of_two_masses() -> None:
    """d'Alembert on J2, by central differences; the first instant by hand: nothing has moved."""
    step = 1e-6
    time = np.array([0.05 - step, 0.05, 0.05 + step])
    truth = closed_form(time)
    assert J2 * (truth["J2.w"][2] - truth["J2.w"][0]) / (2 * step) == pytest.approx(-truth["shaft.tau"][1], rel=1e-6)
    assert closed_form(np.zeros(1))["shaft.tau"][0] == pytest.approx(0.0, abs=1e-12)


@MASTERS
def test_inputs_on_straight_lines_make_the_second_order(oscillator: Split, master: str) -> None:
    coarse, fine = (error(cosim(oscillator.system, step=h, master=master, **PRECISE)) for h in (4e-4, 2e-4))
    assert fine < 1e-3
    assert log2(coarse / fine) == pytest.approx(2.0, abs=0.1)


def test_held_inputs_make_the_first_order(oscillator: Split) -> None:
    coarse, fine = (error(cosim(oscillator.system, step=h, inputs="hold", **PRECISE)) for h in (4e-5, 2e-5))
    assert log2(coarse / fine) == pytest.approx(1.0, abs=0.15)


@MASTERS
def test_a_variable_step_follows_its_tolerance(oscillator: Split, master: str) -> None:
    loose, tight = (cosim(oscillator.system, master=master, tolerance=tol, **PRECISE) for tol in (1e-4, 1e-6))
    assert error(loose) < 1e-2
    assert error(tight) < 1e-3
    assert error(tight) < error(loose) / 5
    assert tight.steps > 3 * loose.steps
    assert tight.shortest < tight.longest


def test_a_step_that_was_too_long_is_taken_back(oscillator: Split) -> None:
    """Without a trace: the run that began with 50 ms is as good as the one that began with a microsecond."""
    bold = cosim(oscillator.system, step=0.05, tolerance=1e-5, **PRECISE)
    careful = cosim(oscillator.system, step=1e-6, tolerance=1e-5, **PRECISE)
    assert bold.rejected > 0
    assert error(bold) < 2 * error(careful)
    assert (np.diff(bold.time) > 0).all()


def test_the_residual_vanishes_with_the_square_of_the_step(oscillator: Split) -> None:
    coarse, fine = (cosim(oscillator.system, step=h, **PRECISE).couplings[0] for h in (4e-4, 2e-4))
    assert abs(coarse.residual) < 2e-2 * coarse.throughput
    assert log2(coarse.residual / fine.residual) == pytest.approx(2.0, abs=0.2)
    assert fine.throughput == pytest.approx(coarse.throughput, rel=1e-2)


@MASTERS
def test_the_residual_is_the_energy_that_the_wheel_has_got_too_much(oscillator: Split, master: str) -> None:
    """What the wheel receives becomes its kinetic energy, whatever the coupling does on the way."""
    run = cosim(oscillator.system, step=1e-3, master=master, inputs="hold", **PRECISE)
    (coupling,) = run.couplings
    assert coupling.received == pytest.approx(J2 / 2 * run["J2.w"][-1] ** 2, rel=1e-3)
    assert abs(coupling.residual) > 0.05 * coupling.throughput
    assert run["shaft.residual_energy"][-1] == pytest.approx(coupling.residual)
    passed = float(np.trapezoid(run["shaft.power"], run.time))
    assert passed == pytest.approx((coupling.delivered + coupling.received) / 2, abs=2 * abs(coupling.residual))
    assert coupling.throughput >= (coupling.delivered + coupling.received) / 2 * (1 - 1e-12)
    assert abs(coupling.residual) <= coupling.mismatch < coupling.throughput


def test_held_inputs_pump_energy_into_an_undamped_oscillation(oscillator: Split) -> None:
    """They come half a step late, which works like negative damping; straight lines do not."""
    system = with_values(oscillator.system, {"motor": {"shaft.d": 1e-6}})
    amplitude = {}
    for inputs in ("hold", "linear"):
        run = cosim(system, step=2e-4, inputs=inputs, **PRECISE)
        amplitude[inputs] = np.ptp(run["shaft.tau"][run.time > 0.15]) / 2
    undamped = M * J2 / (J1 + J2)
    assert amplitude["hold"] > 1.05 * undamped
    assert amplitude["linear"] == pytest.approx(undamped, rel=5e-3)


def with_values(system: System, values: dict[str, dict[str, float]]) -> System:
    return replace(system, units=tuple(replace(u, parameters=values.get(u.name, {})) for u in system.units))


def test_parameters_are_those_of_the_fmus(oscillator: Split) -> None:
    """Half the motor's torque, half of everything."""
    whole, half = (
        cosim(oscillator.system, step=2e-4, parameters=values, **PRECISE) for values in ({}, {"motor.motor.tau": M / 2})
    )
    assert half["J2.w"] == pytest.approx(whole["J2.w"] / 2, abs=1e-6)


def test_fmi_3(oscillator: Split, tmp_path: Path) -> None:
    """Its inputs are held, so it is of the first order."""
    netlist = Path(__file__).parents[2] / "examples" / "two_mass.toml"
    cut = split(netlist, "shaft", tmp_path, version="3.0", check=False)
    third = cosim(cut.path, step=4e-5, **PRECISE)
    second = cosim(oscillator.system, step=4e-5, inputs="hold", **PRECISE)
    for name in SIGNALS:
        assert third[name] == pytest.approx(second[name], abs=1e-5 * np.ptp(second[name]))


def test_the_result_is_read_like_any_solution(oscillator: Split) -> None:
    run = cosim(oscillator.path, until="0.1 s", step="1 ms")
    assert isinstance(run, Trajectories)
    assert len(run.time) == 101
    assert run.at(0.05)["J2.w"] == pytest.approx(float(np.interp(0.05, run.time, run["J2.w"])))
    assert run["J2.J"][0] == J2
    assert {"J1.w", "J2.w", "shaft.tau", "shaft.power", "shaft.residual_energy"} <= set(run.names)
    assert run.steps == 100


def killed(pressed: list[float], now: float) -> None:
    """Kill the process of the FMUs, once."""
    if now > 0.01 and not pressed:
        pressed.append(now)
        os.kill(int(pgrep("-P", str(os.getpid()), "-f", "cosimulation/child.py")), signal.SIGKILL)


@pytest.mark.parametrize("how", ["timeout", "killed", "failed"])
def test_a_run_that_fails_keeps_what_it_has_come_to(how: str, oscillator: Split) -> None:
    """A step far too long for the spring: what the FMUs exchange grows until it is infinite."""
    errors = {"timeout": FmuTimeout, "killed": FmuCrashed, "failed": StepFailed}
    options: dict[str, Any] = {"step": "1 s" if how == "failed" else "10 us"}
    if how == "timeout":
        options["timeout"] = 3.0
    if how == "killed":
        if os.name != "posix":
            pytest.skip("processes are found and killed as in POSIX")
        options["progress"] = partial(killed, [])
    with pytest.raises(errors[how]) as told:
        cosim(oscillator.system, "100000 s", **options)
    kept = told.value.run
    assert kept.steps == len(kept.time) - 1
    whole = cosim(oscillator.system, until=float(kept.time[10]), step=options["step"])
    for name in ("J2.w", "shaft.power", "shaft.residual_energy"):
        assert np.array_equal(kept[name][:11], whole[name])


@MASTERS
def test_a_step_too_long_for_the_spring_ends_before_values_are_huge(oscillator: Split, master: str) -> None:
    with pytest.raises(StepFailed, match="grows without bounds") as told:
        cosim(oscillator.system, until=100.0, step=0.02, master=master)
    # Ten decades of energy are five of speed.
    assert np.abs(told.value.run["J2.w"]).max() < 1e9


def test_what_a_failed_fmu_says_is_told(tmp_path: Path) -> None:
    (tmp_path / "drive.toml").write_text("""
[parts]
push = { is = "Table", table = [[0, 0], [0.01, 1]], extrapolate = "error" }
torque = { is = "Torque" }
J1 = { is = "Inertia", J = "0.02 kg.m2" }
shaft = { is = "SpringDamper", c = "400 N.m/rad", d = "0.2 N.m.s/rad" }
J2 = { is = "Inertia", J = "0.08 kg.m2" }
[series]
line = ["torque", "J1", "shaft", "J2"]
[connect]
push = ["push.y", "torque.tau"]
[simulate]
until = "0.02 s"
start = "rest"
""")
    parts = split(tmp_path / "drive.toml", "shaft", tmp_path / "parts", check=False)
    with pytest.raises(FmuFailed, match=r"^push \(push.fmu\) failed") as told:
        cosim(parts.system, step=1e-4)
    # A run may end with its table.
    assert re.search(r"It reported: t = 0\.01000000\d* s: push has no more rows", str(told.value))


@pytest.mark.skipif(os.name != "posix", reason="processes are found and killed as in POSIX")
def test_fmus_end_with_the_process_that_runs_them(oscillator: Split) -> None:
    code = f"from modelica_like import cosim; cosim({str(oscillator.path)!r}, '100000 s', step='10 us')"
    with subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.DEVNULL) as caller:
        child = wait_for(lambda: pgrep("-P", str(caller.pid), "-f", "cosimulation/child.py"))
        caller.kill()
    wait_for(lambda: not pgrep("-g", child))


def pgrep(*arguments: str) -> str:
    return subprocess.run(["pgrep", *arguments], capture_output=True, text=True).stdout.strip()


def wait_for(condition: Callable[[], Any], seconds: float = 20.0) -> Any:
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end
        time.sleep(0.05)
    return found


SOURCE = '[parts]\nwave = { is = "Sine", amplitude = "2 N.m", f = "1 Hz" }\n'
WHEEL = '[parts]\nmotor = { is = "Torque" }\nwheel = { is = "Inertia", J = "2 kg.m2", phi = 0, w = 0 }\n'


@MASTERS
@pytest.mark.parametrize("order", [("wave", "wheel"), ("wheel", "wave")])
def test_a_variable_step_watches_what_drives_nothing(tmp_path: Path, master: str, order: tuple[str, str]) -> None:
    """The torque is exact at every communication point; w = (1 - cos(2 pi t)) / (2 pi) integrates what is between."""
    for name, text in (("wave", SOURCE), ("wheel", WHEEL + '[series]\nshaft = ["motor", "wheel"]\n')):
        export_fmu(loads(text + '[simulate]\nuntil = "1 s"\n'), tmp_path / f"{name}.fmu", check=False)
    fmus = "".join(f'{name} = "{name}.fmu"\n' for name in order)
    connect = '[connect]\ntorque = ["wave.wave.y", "wheel.motor.tau"]\n'
    (tmp_path / "system.toml").write_text(f"[fmus]\n{fmus}{connect}")

    def wrong(tolerance: float) -> float:
        run = cosim(tmp_path / "system.toml", "1 s", tolerance=tolerance, master=master)
        truth = (1 - np.cos(2 * np.pi * run.time)) / (2 * np.pi)
        return float(np.abs(run["wheel.wheel.w"] - truth).max() * np.pi)

    # Errors of steps add up: a hundred of them, of 1e-5 each, are 1e-3. They fall like tolerance^(2/3).
    assert wrong(1e-5) < 1e-3
    assert wrong(1e-6) < wrong(1e-5) / 3
