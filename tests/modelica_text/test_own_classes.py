"""Classes of the user: their equations, events, arrays, functions and records, against closed forms."""

import pickle
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from scipy.optimize import brentq

from modelica_like import Assembly, build, export_fmu, load, run_fmu, simulate
from modelica_like.errors import LimitPassed, ModelicaTextError
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    any_of,
    der,
    discrete,
    floor,
    param,
    terminate,
    var,
    when,
)
from modelica_like.netlist import loads
from modelica_like.netlist.modelica.netlist_form import netlist_text
from modelica_like.netlist.modelica.write import modelica_text

DRIVES = Path(__file__).with_name("drives.mo")


class Rising(Component):
    a: Parameter = param("m/s2", "acceleration", default=2.0)
    x_top: Parameter = param("m", "height", default=1.0)
    x: Variable = var("m", "position", state="always", default=0.0)
    v: Variable = var("m/s", "speed", state="always", default=0.0)

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield der(self.v) == self.a

    def events(self) -> Events:
        yield when(self.x > self.x_top, terminate("is at the top, {x_top} m"))


class Begins(Component):
    """A decay whose start, offset and rate are determined by initial equations."""

    T: Parameter = param("s", "unit of time", default=0.5)
    a: Parameter = param("1", "value at the start", default=3.0)
    n: Discrete = discrete("1", "whole units of time before the start")
    x: Variable = var("1", "decays")
    offset: Variable = param("1", "offset", fixed=False)
    y: Variable = var("1", "with the offset")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == -self.n * self.x
        yield self.y == self.x + self.offset

    def initial_equations(self) -> Equations:
        yield self.n == floor(self.time / self.T) + 1
        yield self.x == self.a
        yield self.y == 5.0


def drive(name: str):
    return load(f"{DRIVES}:{name}")


def run(name: str, until: float, **options):
    return simulate(drive(name), until, rtol=1e-10, atol=1e-12, **options)


def test_own_connectors_with_flows_make_a_circuit() -> None:
    # v = 3·exp(-t/(R·C)) with R = 4, C = 0.5; the start value is an initial equation
    result = run("Discharge", 2.0)
    assert result["store.v"] == pytest.approx(3 * np.exp(-result.time / 2), rel=1e-8)


def test_a_when_reinitializes_and_counts() -> None:
    result = run("Ball", 1.2)
    fall = np.sqrt(2 / 9.80665)
    # impacts at fall, fall + 2·e·fall = 1.084 s
    assert result["n"][-1] == 2
    assert result["last"][-1] == pytest.approx(fall * (1 + 2 * 0.7), rel=1e-8)
    assert result["fastest"][-1] == pytest.approx(9.80665 * fall, rel=1e-8)
    rest = 1.2 - result["last"][-1]
    speed = 9.80665 * fall * 0.7**2
    assert result["h"][-1] == pytest.approx(speed * rest - 9.80665 / 2 * rest**2, rel=1e-7)


def lies_still(e: float) -> float:
    """Time at which a ball that falls from 1 m has rebounded without end: the first fall times (1 + e) / (1 - e)."""
    return float(np.sqrt(2 / 9.81) * (1 + e) / (1 - e))


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("e", [0.2, 0.3, 0.5, 0.7, 0.8, 0.9])
def test_the_ball_of_the_textbooks_comes_to_rest(solver, e) -> None:
    result = run("TextbookBall", 10.0, parameters={"e": e}, solver=solver)
    assert result.events[-1].time == pytest.approx(lies_still(e), rel=3e-7)
    assert result["flying"][-1] == 0
    assert abs(result["h"][-1]) < 1e-9  # it lies for some seconds: a speed of rounding would carry it no further
    assert abs(result["v"][-1]) < 1e-10
    assert result["h"].min() > -1e-9


def test_the_ball_of_the_textbooks_comes_to_rest_in_an_fmu(tmp_path) -> None:
    export_fmu(drive("TextbookBall"), tmp_path / "ball.fmu")
    result = run_fmu(tmp_path / "ball.fmu", stop=10.0, outputs=["h", "v"])
    assert result.at(lies_still(0.7) * 0.3)["h"] == pytest.approx(0.49, rel=1e-3)  # the top after the first rebound
    assert abs(result.final["h"]) < 1e-9
    assert result.final["v"] == 0


def test_two_whens_of_one_variable_switch_a_thermostat() -> None:
    result = run("Thermostat", 40.0)
    assert set(np.round(result["on"])) == {0.0, 1.0}
    late = result.time > 15
    assert result["T"][late].min() == pytest.approx(292, abs=1e-6)
    assert result["T"][late].max() == pytest.approx(294, abs=1e-6)
    # heating from 292 to 294 towards 300 and cooling back towards 280: T = 10 s
    period = 10 * np.log(8 / 6) + 10 * np.log(14 / 12)
    switched = result.time[1:][np.diff(result["on"]) > 0.5]
    assert np.diff(switched) == pytest.approx(period, rel=1e-7)


def test_cold_is_a_condition_with_an_event() -> None:
    result = run("Thermostat", 1.0)
    # 290 to 291 towards 300
    event = 10 * np.log(10 / 9)
    assert set(result["signal"][result.time < event - 1e-6]) == {2.0}
    assert set(result["signal"][result.time > event + 1e-6]) == set()  # it ends before
    later = run("Thermostat", 3.0)
    assert set(later["signal"][later.time > event + 1e-6]) == {1.0}


def test_samples_branches_and_functions() -> None:
    result = run("Sampled", 1.0)
    x = np.exp(-result.time)
    ticks = np.floor((result.time + 1e-12) / 0.25) * 0.25
    inside = np.abs(result.time / 0.25 - np.round(result.time / 0.25)) > 1e-9
    assert result["held"][inside] == pytest.approx(np.exp(-ticks[inside]), rel=1e-8)
    away = np.abs(x - 0.5) > 1e-7
    assert np.array_equal(result["y"][away], np.where(x > 0.5, 1.0, -1.0)[away])
    assert result["smoothed"] == pytest.approx(np.maximum(x, 0.5), rel=1e-8)
    assert result["table[3]"] == pytest.approx(x**3, rel=1e-7)
    assert result["limited"] == pytest.approx(np.minimum(3 * x, 0.75), rel=1e-8)


def test_a_clock_samples_and_holds() -> None:
    result = run("Clocked", 1.05)
    x = total = 0.0
    for k in range(11):
        total += 1 - x
        x = total + (x - total) * np.exp(-(0.1 if k < 10 else 0.05))
    assert result["n"][-1] == 11
    assert result["s"][-1] == pytest.approx(total, abs=1e-8)
    assert result["x"][-1] == pytest.approx(x, abs=1e-8)


def test_a_delay_by_the_method_of_steps() -> None:
    result = run("Late", 2.0)
    t = result.time
    assert result["y"] == pytest.approx(1 - t + np.maximum(t - 1, 0) ** 2 / 2, abs=1e-9)


def test_own_masses_obey_their_laws_of_drag() -> None:
    result = run("Coupled", 1.0)
    for k in (1, 2):
        w = result[f"rotor[{k}].w"]
        law = w if k == 1 else w * np.abs(w)
        assert result[f"rotor[{k}].drag[1]"] == pytest.approx(0.1 * law)
        assert result[f"rotor[{k}].drag[2]"] == pytest.approx(0.2 * law)
    assert str(drive("Coupled").find("rotor[1]").value("J").formula) == "data.J"
    assert drive("Coupled").data.value("J").number == 4
    # The spring between them is internal: momentum changes by the drags alone.
    momentum = 4 * (result["rotor[1].w"] + result["rotor[2].w"])
    drags = sum(result[f"rotor[{k}].drag[{n}]"] for k in (1, 2) for n in (1, 2))
    lost = np.concatenate([[0], np.cumsum(np.diff(result.time) * (drags[1:] + drags[:-1]) / 2)])
    assert momentum == pytest.approx(momentum[0] - lost, abs=1e-5)


def test_a_redeclared_coupling_damps() -> None:
    assert type(drive("Redeclared").find("coupling")).__name__ == "SpringDamper"
    assert drive("Redeclared").find("coupling").value("d").number == 20


def test_a_redeclared_part_and_what_follows_it() -> None:
    assert [type(drive(name).k).__name__ for name in ("Chain", "Rearranged")] == ["Spring", "SpringDamper"]
    assert ["damper" in drive(name).parts for name in ("Chain", "Rearranged")] == [True, False]
    result = run("Rearranged", 2.0)
    # x = phi_rel: 1·x'' + 0.5·x' + 50·x = 0 with the reduced inertia 1, x(0) = -0.1
    t, w = result.time, np.sqrt(50 - 0.25**2)
    x = -0.1 * np.exp(-0.25 * t) * (np.cos(w * t) + 0.25 / w * np.sin(w * t))
    assert result["k.phi_rel"] == pytest.approx(x, abs=1e-8)
    speed = result["k.w_rel"]
    assert result["energy"] == pytest.approx(0.5 * speed**2 + 25 * x**2, abs=1e-8)


def test_an_acceleration_at_the_start_is_an_initial_equation() -> None:
    result = run("Accelerated", 1.0)  # 2·3 = -60·phi
    assert result["mass.phi"] == pytest.approx(-0.1 * np.cos(np.sqrt(30) * result.time), abs=1e-8)
    with pytest.raises(ModelicaTextError, match="Accelerated has equations of its own"):
        netlist_text(drive("Accelerated"), DRIVES.parent, [])


def test_a_block_between_signals() -> None:
    result = run("Signals", 1.0)
    y = 1 - np.exp(-result.time / 0.2)
    assert result["gain.y"] == pytest.approx(np.pi * y, abs=1e-8)
    away = np.abs(y - 0.5) > 1e-7
    assert np.array_equal(result["filter.high"][away], (y > 0.5)[away].astype(float))


def test_friction_by_booleans_with_a_memory() -> None:
    result = run("Sledge", 4.0)
    w, leaves = np.pi / 2, np.arcsin(0.6) / (np.pi / 2)  # 5·sin(w·t) = 3

    def speed(t: float, begin: float, friction: float) -> float:
        return 5 / w * (np.cos(w * begin) - np.cos(w * t)) - friction * (t - begin)

    turns = brentq(lambda t: speed(t, leaves, 2), 1.5, 3.0)  # the force is -4.07 N then: it goes back at once
    changes = np.flatnonzero(np.diff(result["mode"]))
    assert result.time[changes] == pytest.approx([leaves, turns], abs=1e-8)
    assert result["mode"][[0, changes[0] + 1, -1]].tolist() == [0, 1, -1]
    assert result.final["v"] == pytest.approx(speed(4.0, turns, -2), abs=1e-7)
    assert result.final["turns"] >= 2


def test_initial_equations_determine_a_preload() -> None:
    result = run("Steady", 3.0)
    assert result["preload"][0] == pytest.approx(6.0)
    before = result.time < 1
    assert result["x"][before] == pytest.approx(2.0)
    # x'' + x' + 3·x = 6 + 1 from time 1
    t, w = np.maximum(result.time - 1, 0), np.sqrt(3 - 0.25)
    step = (1 - np.exp(-t / 2) * (np.cos(w * t) + np.sin(w * t) / (2 * w))) / 3
    assert result["x"] == pytest.approx(2 + step, abs=1e-8)
    inside = np.abs(4 * result.time - np.round(4 * result.time)) > 1e-9
    assert np.array_equal(result["steps"][inside], np.floor(4 * result.time)[inside])


def test_initial_equations_are_written(tmp_path: Path) -> None:
    part = Assembly("drive", parts={"part": Begins()})
    (tmp_path / "drive.mo").write_text(modelica_text(part))
    for model in (part, load(tmp_path / "drive.mo")):
        result = simulate(model, 1.75, t0=1.25, rtol=1e-10)
        # T·x' = -3·x, y - x = 5 - 3
        assert result.final["part.y"] == pytest.approx(2 + 3 * np.exp(-3 * 0.5 / 0.5), rel=1e-8)


def test_the_energy_balance_closes_with_own_classes() -> None:
    assert run("Coupled", 1.0).energy().drift < 1e-7


def test_a_part_of_a_netlist_is_a_class_of_a_text(tmp_path: Path) -> None:
    netlist = f"""
    [parts]
    left = {{ is = "{DRIVES}:Rotor", J = "2 kg.m2" }}
    right = {{ is = "Inertia", J = "1 kg.m2" }}
    [series]
    shaft = ["left", "right"]
    [start]
    "left.phi" = 0
    "left.w" = 1
    """
    result = simulate(loads(netlist, str(tmp_path / "drive.toml")), 1.0, rtol=1e-10)
    # (2 + 1)·dw/dt = -0.3·w
    assert result["left.w"] == pytest.approx(np.exp(-0.1 * result.time), rel=1e-8)


def test_another_process_gets_the_model() -> None:
    twin = pickle.loads(pickle.dumps(drive("Thermostat")))
    assert simulate(twin, 5.0)["T"][-1] == pytest.approx(simulate(drive("Thermostat"), 5.0)["T"][-1], abs=1e-9)


def test_a_broken_assertion_ends_the_run(tmp_path: Path) -> None:
    text = DRIVES.read_text().replace("n < 1000", "n < 2")
    (tmp_path / "drives.mo").write_text(text)
    with pytest.raises(Exception, match="too many bounces"):
        simulate(load(f"{tmp_path / 'drives.mo'}:Ball"), 2.0)


LIFT = """
model Lift
  parameter Real a = 3;
  Real x(start = 0, fixed = true);
  Real v(start = 0, fixed = true);
  Integer n(start = 0, fixed = true);
equation
  der(x) = v;
  der(v) = a;
  when {x > 1, x < -1} then
    n = pre(n) + 1;
    terminate("the lift is at the top");
  elsewhen time > 5 then
    terminate("too late");
  end when;
end Lift;
"""


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize(
    ("a", "end", "count", "reason"),
    [(3.0, np.sqrt(2 / 3), 1, "says: the lift is at the top"), (0.01, 5.0, 0, "says: too late")],
)
def test_terminate_ends_the_run(
    tmp_path: Path, solver: Literal["idas", "native"], a: float, end: float, count: int, reason: str
) -> None:
    (tmp_path / "Lift.mo").write_text(LIFT)
    result = simulate(load(tmp_path / "Lift.mo"), 10.0, parameters={"a": a}, solver=solver, rtol=1e-10)
    assert result.time[-1] == pytest.approx(end, rel=1e-8)
    assert result.final["n"] == count
    assert result.ended is not None
    assert result.ended.reason == reason


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("level", ["", ", AssertionLevel.error", ", level = AssertionLevel.error"])
def test_an_assertion_in_a_when_is_judged_at_the_instant(
    tmp_path: Path, solver: Literal["idas", "native"], level: str
) -> None:
    text = LIFT.replace('terminate("the lift is at the top")', f'assert(v < v_max, "too fast"{level})')
    (tmp_path / "Lift.mo").write_text(text.replace("Real a = 3;", "Real a = 3, v_max = 1;"))
    drive = load(tmp_path / "Lift.mo")
    # At 1 m it has sqrt(2 a x) = 2.449 m/s. Later it is faster, which is asked at that instant only.
    assert simulate(drive, 3.0, parameters={"v_max": 2.5}, solver=solver, rtol=1e-10).final["n"] == 1
    with pytest.raises(LimitPassed, match="too fast") as caught:
        simulate(drive, 3.0, parameters={"v_max": 2.4}, solver=solver, rtol=1e-10)
    assert caught.value.run is not None
    assert caught.value.run.time[-1] == pytest.approx(np.sqrt(2 / 3), rel=1e-8)


def test_a_warning_is_no_assertion(tmp_path: Path) -> None:
    (tmp_path / "Lift.mo").write_text(
        LIFT.replace('terminate("the lift is at the top")', 'assert(v < 1, "fast", AssertionLevel.warning)')
    )
    assert simulate(load(tmp_path / "Lift.mo"), 3.0).time[-1] == 3.0


def test_terminate_is_written(tmp_path: Path) -> None:
    text = modelica_text(Assembly("drive", parts={"lift": Rising(a=3.0)}))
    (tmp_path / "drive.mo").write_text(text)
    assert 'terminate("is at the top, x_top m");' in text
    result = simulate(load(tmp_path / "drive.mo"), 10.0, rtol=1e-10)
    assert result.time[-1] == pytest.approx(np.sqrt(2 / 3), rel=1e-8)


def test_an_fmu_of_a_text_agrees_with_idas(tmp_path: Path) -> None:
    done = export_fmu(drive("Thermostat"), tmp_path / "thermostat.fmu", "2.0", ("me",))
    assert not done.check.differs


def test_derivatives_by_parameters_exist() -> None:
    model = build(drive("Discharge"))
    assert {one.path for one in model.flat_parameters} >= {"store.C", "wire.R"}


BOUND = """
class Sum "A rate, and its sum over time."
  {kind} s(unit = "m/s");
  Real y(unit = "m", start = 0, fixed = true);
equation
  der(y) = s;
end Sum;
model M
  parameter Real k(unit = "m/s2") = 3;
  Real x(unit = "m/s", start = 1, fixed = true), one_s;
  Sum pair[2](each s = k*time + x), one(s = pair[1].y / T), constant_rate(s = 4);
  parameter Real T(unit = "s") = 1;
equation
  T*der(x) = -x;
  one_s = 2;
end M;
"""


@pytest.mark.parametrize("kind", ["input Real", "Modelica.Blocks.Interfaces.RealInput"])
def test_the_value_of_an_input_is_an_equation(kind: str, tmp_path: Path) -> None:
    """y' = 3·t + exp(-t), and its sum; a signal that drives an input takes no name of others."""
    (tmp_path / "m.mo").write_text(BOUND.replace("{kind}", kind))
    result = simulate(load(tmp_path / "m.mo:M"), 2.0, rtol=1e-10, atol=1e-12)
    t = result.time
    for k in (1, 2):
        assert result[f"pair[{k}].s"] == pytest.approx(3 * t + np.exp(-t), rel=1e-8)
        assert result[f"pair[{k}].y"] == pytest.approx(1.5 * t**2 + 1 - np.exp(-t), rel=1e-8, abs=1e-10)
    assert result["one.y"] == pytest.approx(0.5 * t**3 + t - 1 + np.exp(-t), rel=1e-8, abs=1e-10)
    assert result["constant_rate.y"] == pytest.approx(4 * t, rel=1e-10, abs=1e-12)
    assert result["one_s"] == pytest.approx(2.0)


REMAINDERS = """model Remainders
  Real x(start = 0, fixed = true);
  Integer n, k;
equation
  der(x) = 1;
  when sample(0.35, 0.2) then
    n = pre(n) + 1;
  end when;
  when x > 0.3 + 0.2*mod(pre(n), 3) then
    k = pre(k) + 1;
  end when;
end Remainders;
"""


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_a_remainder_of_a_count_changes_with_it(solver, tmp_path: Path) -> None:
    """The border is 0.3, then 0.5 from 0.35 s, 0.7 from 0.55 s, and 0.3 again from 0.75 s: x passes it three times."""
    (file := tmp_path / "remainders.mo").write_text(REMAINDERS)
    assert simulate(load(file), 1.0, solver=solver).final["k"] == 3


class Thrown(Component):
    """Begins beyond the wall, where it turns at once, and comes back to the other one."""

    x: Variable = var("1", "position", state="always", default=1.5)
    v: Variable = var("1", "speed", state="always", default=1.0)
    rate: Parameter = param("1/s", "unit of speed", default=1.0)
    way = Mode("right", "left")

    def equations(self) -> Equations:
        yield der(self.x) == self.rate * self.v
        yield der(self.v) == 0

    def events(self) -> Events:
        yield self.way.go("right", "left", when=self.x > 1, reset={self.v: -self.v})
        yield self.way.go("left", "right", when=self.x < 0, reset={self.v: -0.5 * self.v})


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_what_happens_at_the_start_happens_in_the_text_too(solver, tmp_path: Path) -> None:
    """1.5 s to the left with the speed 1, then 0.5 s to the right with half of it."""
    (file := tmp_path / "thrown.mo").write_text(modelica_text(Assembly("d", parts={"ball": Thrown()})))
    for drive in (Thrown(), load(file)):
        end = simulate(drive, 2.0, solver=solver).final
        x, v = (end[next(name for name in end if name.rpartition(".")[2] == last)] for last in ("x", "v"))
        assert (x, v) == pytest.approx((0.25, 0.5), abs=1e-9)


class Counting(Component):
    """Conditions as numbers, as the language has them: x climbs by 1 before 1, by 3 before 2, and then by 2."""

    x: Variable = var("1")

    def equations(self) -> Equations:
        before = [self.x < bound for bound in (1.0, 2.0)]
        yield der(self.x) == 2 + before[1] - 2 * before[0] * any_of(before[0], self.x < 0)


def test_a_condition_that_is_a_number_is_written_with_if(tmp_path: Path) -> None:
    (tmp_path / "counting.mo").write_text(modelica_text(Assembly("drive", parts={"law": Counting()})), encoding="utf-8")
    run = simulate(load(tmp_path / "counting.mo"), 2)
    assert run["law.x"][-1] == pytest.approx(2 + 2 * (2 - 1 - 1 / 3), abs=1e-6)
