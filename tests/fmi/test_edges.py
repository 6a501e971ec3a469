"""FMUs at the edges of what holds and what turns: agreement with the simulation, and no detours."""

import pytest

from components import Constant, FirstOrder, Force, Inertia, MassWithStopAndFriction, Step, Torque
from modelica_like import Assembly, simulate
from modelica_like.fmi.export import export_fmu
from modelica_like.fmi.run import run_fmu
from tests.solve.test_discrete import Ball, Counter


@pytest.mark.parametrize("kind", ["me", "cs"])
def test_a_state_named_after_a_variable_with_the_other_sign(tmp_path, kind):
    """The torque on the flange is minus the signal: w = t - T (1 - exp(-t/T)) for J = 1 kg.m2 and 1 N.m."""
    parts = {"one": Constant(k="1 N.m"), "lag": FirstOrder(T="0.1 s"), "torque": Torque(), "rotor": Inertia(J=1.0)}
    wires = {
        "wish": ["one.y", "lag.u"],
        "signal": ["lag.y", "torque.tau"],
        "shaft": ["torque.flange", "rotor.flange_a"],
    }
    drive = Assembly("lagging", parts=parts, connect=wires)
    drive.simulate.update(start="rest", until=1.0)
    fmu = export_fmu(drive, tmp_path / "lagging.fmu", "3.0", check=False).path
    ours, run = simulate(drive), run_fmu(fmu, kind=kind, tolerance=1e-9)
    assert run.final["lag.y"] == pytest.approx(1.0 - 4.5399929762484854e-05, rel=1e-7)
    assert run.final["rotor.w"] == pytest.approx(0.9 + 0.1 * 4.5399929762484854e-05, rel=1e-7)
    for name in ("lag.y", "torque.flange.tau", "rotor.w"):
        assert run.final[name] == pytest.approx(ours.final[name], rel=1e-6)


@pytest.mark.parametrize(("side", "sign"), [("left", 1.0), ("right", -1.0)])
@pytest.mark.parametrize("kind", ["me", "cs"])
def test_a_mass_leaves_its_stop_at_once(tmp_path, side, sign, kind):
    """It stops at a position that binary numbers do not have; a rounding beyond, it is not caught again."""
    parts = {
        "step": Step(height=9.0 * sign, start_time=3.3, offset=-3.0 * sign),
        "force": Force(),
        "mass": MassWithStopAndFriction(m=2.0, L=0.2, smin=-1.1, smax=1.1, F_Coulomb=1.0, s=0.0, v=0.0),
    }
    wires = {"signal": ["step.y", "force.f"], "slide": ["force.flange", "mass.flange_a"]}
    drive = Assembly("stopping", parts=parts, connect=wires)
    drive.simulate.update(until=4.0)
    fmu = export_fmu(drive, tmp_path / "stopping.fmu", "3.0", check=False).path
    run = run_fmu(fmu, kind=kind, tolerance=1e-9)
    later = [one for one in run.events if one.time > 1.0]
    way = "forward" if sign > 0 else "backward"
    assert [one.after for one in later if one.mode == "mass.mode"] == ["stuck", way]
    assert [one.after for one in later if one.mode == "mass.stop"] == [side, "none"]
    assert run.final["mass.s"] == pytest.approx(sign * (-1.0 + 0.5 * 2.5 * 0.7**2), abs=1e-7)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize("kind", ["me", "cs"])
def test_discrete_equations_at_the_edges_of_a_sine(tmp_path, version, kind):
    """Three rises above one quarter, three edges, six changes, and one priority of 100 at 2.6 s."""
    drive = Assembly("counting", parts={"counter": Counter(), "ball": Ball(h=1.0, v=0.0)})
    drive.simulate.update(until=2.9)
    exported = export_fmu(drive, tmp_path / "counting.fmu", version, check=kind == "cs")
    assert not exported.check.sentence
    run = run_fmu(exported.path, kind=kind, tolerance=1e-9)
    names = ("ups", "both", "changes", "firsts", "latched", "high")
    assert [run.final[f"counter.{name}"] for name in names] == [13, 103, 6, 1, 1, 0]
    assert run.final["ball.n"] == 6  # bounces at 0.4515236 s times 1, 2.6, 3.88, 4.904, 5.7232, 6.37856 = 2.8801 s
    assert not [name for name in run.names if "relation" in name or "pre(" in name]
