"""Ideal elements: combinations of modes, conditions on states; against closed forms and a mode machine by hand."""

from math import atan, cos, exp, pi, sin
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from ideal_networks import circuit, network
from scipy.linalg import expm
from scipy.optimize import brentq

from components import (
    Capacitor,
    ConstantVoltage,
    Freewheel,
    IdealDiode,
    IdealSwitch,
    IdealThyristor,
    Inductor,
    Inertia,
    Pulse,
    Resistor,
    SignalVoltage,
    Sine,
    Torque,
)
from modelica_like import Assembly, Component, Solution, build, export_fmu, sensitivities, simulate
from modelica_like.errors import MissingStart, NoValidModes
from modelica_like.language.inside import inside

Solver = Literal["idas", "native"]
TIGHT: dict[str, Any] = {"rtol": 1e-10, "atol": 1e-12}
DIODES = ("D1", "D2", "D3", "D4")
W = 100 * pi


def bridge(*, thyristors: bool = False, **load: Component) -> Assembly:
    """10 V at 50 Hz on a bridge; the load lies between `plus` and `minus`."""
    kind = IdealThyristor if thyristors else IdealDiode
    parts = {name: kind() for name in DIODES} | {"s": Sine(amplitude=10.0, f=50.0), "u": SignalVoltage()}
    connect = {
        "s": ["s.y", "u.v_ref"], "a": ["u.p", "D1.p", "D3.n"], "b": ["u.n", "D2.p", "D4.n"],
        "plus": ["D1.n", "D2.n", *(f"{name}.p" for name in load)],
        "minus": ["D3.p", "D4.p", "earth.p", *(f"{name}.n" for name in load)],
    }  # fmt: skip
    if thyristors:
        parts["gate"] = Pulse(period=0.01, start_time=0.0025, width=0.1)
        connect["gate"] = ["gate.y", *(f"{name}.fire" for name in DIODES)]
    return circuit(connect, **parts, **load)


def buck(R: float = 200.0) -> Assembly:
    return circuit(
        {
            "gate": ["p.y", "S.closed"], "in": ["U.p", "S.p"], "x": ["S.n", "D.n", "L.p"],
            "out": ["L.n", "C.p", "R.p"], "minus": ["U.n", "D.p", "C.n", "R.n", "earth.p"],
        },
        U=ConstantVoltage(V=24.0), p=Pulse(period=1e-4, width=0.4), S=IdealSwitch(), D=IdealDiode(),
        L=Inductor(L=2e-4, i=0.0), C=Capacitor(C=1e-4, v=0.0), R=Resistor(R=R),
    )  # fmt: skip


def switched(run: Solution, mode: str) -> list[tuple[float, str]]:
    return [(event.time, event.after) for event in run.events if event.mode == f"{mode}.state"]


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_either_current_or_voltage_is_zero(solver: Solver) -> None:
    run = simulate(bridge(R=Resistor(R=10.0), C=Capacitor(C=1e-3, v=3.0)), 0.05, solver=solver, **TIGHT)
    for name in DIODES:
        v, i = run[f"{name}.v"], run[f"{name}.i"]
        assert np.max(np.abs(v * i)) < 1e-7  # the capacitor follows the source within the tolerance
        assert v.max() < 1e-7
        assert i.min() > -1e-8


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_capacitor_on_an_ideal_source_is_no_state_while_the_diodes_conduct(solver: Solver) -> None:
    R, C = 10.0, 1e-3
    run = simulate(bridge(R=Resistor(R=R), C=Capacitor(C=C, v=0.0)), 0.02, solver=solver, **TIGHT)
    # C·u' + u/R = 0 ends the first conduction; then u decays until it meets |u| again.
    stops = (pi - atan(W * R * C)) / W
    left = lambda t: 10 * sin(W * stops) * exp(-(t - stops) / (R * C))  # noqa: E731
    starts = brentq(lambda t: left(t) + 10 * sin(W * t), 0.01, 0.015, xtol=1e-14)
    assert switched(run, "D1")[1] == (pytest.approx(stops, rel=1e-7), "off")
    assert switched(run, "D2")[0] == (pytest.approx(starts, rel=1e-7), "on")
    assert run.at(0.004)["C.v"] == pytest.approx(10 * sin(W * 0.004), rel=1e-8)
    assert run.at(0.009)["C.v"] == pytest.approx(left(0.009), rel=1e-7)
    assert run.at(0.014)["C.v"] == pytest.approx(-10 * sin(W * 0.014), rel=1e-8)


def buck_by_hand(periods: int, R: float) -> list[float]:
    """Choke and capacitor of the buck converter: on, freewheeling, and empty where the current has ended."""
    L, C, U = 2e-4, 1e-4, 24.0
    flows = np.array([[0, -1 / L, U / L], [1 / C, -1 / (R * C), 0], [0, 0, 0]])
    free = flows * [[1, 1, 0], [1, 1, 1], [1, 1, 1]]
    x = np.array([0.0, 0.0, 1.0])
    for _ in range(periods):
        x, rest = expm(flows * 4e-5) @ x, 6e-5
        empties = lambda t, x=x: (expm(free * t) @ x)[0]  # noqa: E731
        if empties(rest) < 0:
            ends: Any = brentq(empties, 0, rest, xtol=1e-18)
            x, rest = (expm(free * ends) @ x) * [0, 1, 1], rest - ends
            x = x * [1, exp(-rest / (R * C)), 1]
        else:
            x = expm(free * rest) @ x
    return x[:2].tolist()


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_discontinuous_converter_is_the_mode_machine_by_hand(solver: Solver) -> None:
    run = simulate(buck(), 0.01, solver=solver, **TIGHT)
    assert len([one for one in switched(run, "D") if one[1] == "off"]) == 100
    assert [run.final["L.i"], run.final["C.v"]] == pytest.approx(buck_by_hand(100, 200.0), rel=1e-7, abs=1e-9)


def test_thyristors_cut_the_beginning_of_every_half_wave() -> None:
    run = simulate(bridge(thyristors=True, R=Resistor(R=10.0)), 0.02)
    times = np.linspace(0, 0.02, 4001)
    wanted = np.where(times % 0.01 > 0.0025, 10 * np.abs(np.sin(W * times)), 0.0)
    found = np.array([run.at(t)["R.v"] for t in times])
    assert np.abs(found - wanted)[times % 0.0025 > 1e-6].max() < 1e-6
    assert np.trapezoid(found, times) / 0.02 == pytest.approx(10 / pi * (1 + cos(pi / 4)), rel=1e-3)


def freewheeling(i: float) -> Assembly:
    return circuit(
        {"x": ["S.n", "D.n", "L.p"], "in": ["U.p", "S.p"], "l": ["L.n", "R.p"], "g": ["gate.y", "S.closed"],
         "minus": ["U.n", "D.p", "R.n", "earth.p"]},
        U=ConstantVoltage(V=24.0), S=IdealSwitch(), D=IdealDiode(), L=Inductor(L=1e-3, i=i), R=Resistor(R=5.0),
        gate=Pulse(period=1.0, start_time=0.5),
    )  # fmt: skip


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("i", [5.0, 1e-5])
def test_current_at_the_start_finds_its_diode(solver: Solver, i: float) -> None:
    run = simulate(freewheeling(i), 1e-3, solver=solver, **TIGHT)
    assert switched(run, "D") == [(0.0, "on")]
    assert run.final["L.i"] == pytest.approx(i * exp(-5), rel=1e-7, abs=1e-11)


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_current_that_ends_within_the_time_resolution_is_none(solver: Solver) -> None:
    """Where an importer stops late, a diode takes the rest over and would give it back at once."""
    left = circuit(
        {"x": ["L.n", "D.p"], "in": ["U.p", "D.n"], "minus": ["U.n", "L.p", "earth.p"]},
        U=ConstantVoltage(V=24.0), D=IdealDiode(), L=Inductor(L=1e-3, i=1.2e-6),
    )  # fmt: skip
    run = simulate(left, 1e-3, solver=solver)
    assert switched(run, "D") == [(0.0, "on"), (0.0, "off")]
    assert run.final["L.i"] == pytest.approx(0, abs=1e-15)


def test_inputs_may_not_move_what_modes_fix() -> None:
    """A step of the voltage behind the diode: it blocks; one beyond the capacitor's voltage would take all at once."""
    model = circuit(
        {"a": ["U.p", "D.p"], "b": ["D.n", "C.p", "R.p"], "minus": ["U.n", "C.n", "R.n", "earth.p"]},
        U=SignalVoltage(v_ref=1.0), D=IdealDiode(), C=Capacitor(C=1e-3, v=1.0), R=Resistor(R=10.0),
    )  # fmt: skip
    handle = build(model).native(["U.v_ref"], ["C.v", "D.i"])
    handle.reset(until=1.0)
    assert handle.step(0.001).tolist() == pytest.approx([1.0, 0.1])
    handle.inputs[0] = 0.5
    assert handle.step(0.002).tolist() == pytest.approx([exp(-0.1), 0.0])
    handle.inputs[0] = 2.0
    with pytest.raises(NoValidModes, match=f"is valid: with D on, {2.0 - exp(-0.1):.4g} V are left over"):
        handle.step(0.003)


def test_parallel_elements_share_the_current() -> None:
    parts = {"E": IdealDiode(), "F": IdealDiode(), "G": IdealDiode(), "U": ConstantVoltage(V=6.0), "R": Resistor(R=1.0)}
    connect = {"in": ["U.p", "E.p", "F.p", "G.n"], "out": ["E.n", "F.n", "G.p", "R.p"], "0": ["U.n", "R.n", "earth.p"]}
    run = simulate(circuit(connect, **parts), 1.0)
    assert [run.final[f"{name}.i"] for name in "EFG"] == pytest.approx([3.0, 3.0, 0.0], abs=1e-9)


def test_derivatives_are_differences_of_runs() -> None:
    """Also where the modes take a state away: with an empty choke, and with a capacitor on an ideal source."""
    charged = bridge(R=Resistor(R=10.0), C=Capacitor(C=1e-3, v=0.0))
    for model, until, by in ((buck(), 1.5e-3, ["L.L", "C.C", "R.R", "U.V"]), (charged, 0.018, ["C.C", "R.R"])):
        compiled = build(model)
        found = sensitivities(simulate(compiled, until, solver="native", rtol=1e-11), ["C.v"], by).derivatives[0]
        for name, slope in zip(by, found, strict=True):
            value = compiled.p[compiled.parameter_position[name]]
            sides = [compiled.with_parameters({name: value * (1 + k * 1e-4)}) for k in (-2, -1, 1, 2)]
            ends = [simulate(one, until, solver="native", rtol=1e-11).final["C.v"] for one in sides]
            difference = (8 * (ends[2] - ends[1]) - (ends[3] - ends[0])) / (12e-4 * value)
            assert slope == pytest.approx(difference, rel=1e-7)


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_ring_of_freewheels_turns_as_one(solver: Solver) -> None:
    """Each shaft may overrun the one before it; so none can, and after an impact they have their common momentum."""
    J, w = (1.0, 1.3, 1.6), (3.0, 1.0, 2.0)
    parts: dict[str, Component] = {f"J{k}": Inertia(J=J[k], w=w[k], phi=0.0) for k in range(3)}
    parts |= {f"F{k}": Freewheel() for k in range(3)}
    parts |= {"s": Sine(amplitude=5.0, f=1.0), "T": Torque(), "r": Sine(amplitude=-4.0, f=1.7), "M": Torque()}
    connect = {f"n{k}": [f"J{k}.flange_a", f"F{k}.flange_a", f"F{k - 1 if k else 2}.flange_b"] for k in range(3)}
    connect["n0"].append("T.flange")
    connect["n1"].append("M.flange")
    connect |= {"s": ["s.y", "T.tau"], "r": ["r.y", "M.tau"]}
    run = simulate(Assembly("ring", parts=parts, connect=connect), 2.3, solver=solver, **TIGHT)
    impulse = 5 * (1 - cos(2 * pi * 2.3)) / (2 * pi) - 4 * (1 - cos(3.4 * pi * 2.3)) / (3.4 * pi)
    wanted = (np.dot(J, w) + impulse) / sum(J)
    assert [run.final[f"J{k}.w"] for k in range(3)] == pytest.approx([wanted] * 3, rel=1e-8)


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("seed", [3, 48, 100, 150, 248, 400])
def test_random_networks_are_complementary(seed: int, solver: Solver) -> None:
    """Found among 600: rounding of rates, drift at a threshold, a loop that hangs at one node."""
    run = simulate(network(seed), 0.05, solver=solver)
    for name in [name for name in run.model.components if name.startswith("D")]:
        v, i = run[f"{name}.v"], run[f"{name}.i"]
        assert max(v.max(), -i.min(), np.abs(v * i).max()) < 1e-5


def chopper(**given: float) -> Assembly:
    parts = circuit(
        {
            "gate": ["p.y", "S.closed"], "in": ["U.p", "S.p"], "x": ["S.n", "D.n", "R.p"], "y": ["R.n", "L.p"],
            "minus": ["U.n", "D.p", "L.n", "earth.p"],
        },
        U=ConstantVoltage(V=48.0), p=Pulse(period=1.0, width=0.05), S=IdealSwitch(), D=IdealDiode(),
        R=Resistor(R=2.0), L=Inductor(L=0.1, **given),
    )  # fmt: skip
    inside(parts).simulate["start"] = "rest"
    return parts


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_a_current_that_open_elements_block_is_zero_at_rest(solver: Solver, tmp_path: Path) -> None:
    # All elements start open: then the current is zero whatever its start, and the potential between them is open.
    run = simulate(chopper(), 0.1, solver=solver, **TIGHT)
    rises = 24 * (1 - np.exp(-20 * run.time))
    falls = 24 * (1 - exp(-1)) * np.exp(-20 * (run.time - 0.05))
    assert run["L.i"] == pytest.approx(np.where(run.time <= 0.05, rises, falls), abs=1e-6)
    assert not export_fmu(chopper(), tmp_path / "chopper.fmu").check.differs


def test_without_a_start_from_rest_that_current_is_named() -> None:
    with pytest.raises(MissingStart, match=r"lacks one equation: give R\.i a start value"):
        simulate(chopper(), 0.1, start="given")
