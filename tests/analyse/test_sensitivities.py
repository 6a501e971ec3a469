"""Sensitivities against Richardson-extrapolated differences of runs, and how parameters are named."""

from math import cos, pi
from pathlib import Path

import numpy as np
import pytest

from components import Fixed, Inertia, Spring
from modelica_like import Assembly, CompiledDae, Options, build, load, sensitivities, simulate, simulation_function
from modelica_like.analyse.sensitivity.derivatives import Sensitivities
from modelica_like.errors import NoGradient
from modelica_like.netlist import loads

EXAMPLES = Path(__file__).parents[2] / "examples"
EXACT = 1e-6
"""Largest error of a derivative, relative to the largest of its output."""


def relative_error(result: Sensitivities, expected: np.ndarray) -> float:
    """Largest error of normalised derivatives, relative to the largest of each output."""
    weights = np.array([one.value for one in result.parameters])
    scale = np.max(np.abs(expected * weights), axis=1, keepdims=True)
    return float(np.max(np.abs((result.derivatives - expected) * weights) / scale))


# -- against differences ---------------------------------------------------------------------------------------------


CASES = {
    "startup": (
        "machine_tool_startup",
        ("J4.w", "clutch.loss_energy", "clutch.lock_time", "min(shaft1.tau)", "max(shaft2.tau)", "at(J3.w, 0.2 s)"),
        ("h1", "k1", "load.a", "coil.T"), 0.35,
    ),
    "coupled": (
        "msl/rotational/CoupledClutches",
        ("J1.w", "clutch1.loss_energy", "time(clutch2.mode -> stuck)", "time(clutch1.mode: stuck -> start_backward)"),
        ("T2", "f", "clutch1.fn_max", "J2.J"), None,
    ),
    "friction": (
        "msl/rotational/Friction",
        ("inertia1.phi", "inertia3.w", "clutch.loss_energy", "brake.lock_time", "max(inertia2.w)"),
        ("startTime", "f", "clutch.fn_max", "inertia2.J", "spring.c"), 1.0,
    ),
    "bench": (
        "dc_bench",
        ("flywheel.w", "clutch.loss_energy", "clutch.lock_time", "battery.source_energy", "max(motor.ia)"),
        ("k", "R", "rotor", "capacity", "ratio"), 0.7,
    ),
    "shift": (
        "lepelletier",
        ("car.w", "box.clutch_a.loss_energy", "box.brake_d.loss_energy"),
        ("motor_torque", "car.J", "selector.time_scale", "box.brake_c.capacity"), 4.5,
    ),
}  # fmt: skip
TIGHT = Options(rtol=1e-11, atol=1e-12)


def values_at(model: CompiledDae, outputs: tuple[str, ...], given: dict[str, float], until: float | None) -> np.ndarray:
    result = sensitivities(
        model, outputs, [next(iter(given))], until=until, parameters=given, options=TIGHT, precision=1e-11
    )
    return np.array([one.value for one in result.outputs])


@pytest.mark.parametrize("case", CASES)
def test_derivatives_equal_extrapolated_differences_of_runs(case: str) -> None:
    netlist, outputs, parameters, until = CASES[case]
    model = build(EXAMPLES / f"{netlist}.toml")
    result = sensitivities(model, outputs, parameters, until=until, method="forward")
    values = np.array([one.value for one in result.parameters])
    # all parameters at once, each in its own proportion: an error of one cannot hide
    weights = values * np.cos(1.0 + np.arange(len(values)))
    step = 4e-4

    def difference(h: float) -> np.ndarray:
        ends = [
            values_at(model, outputs, dict(zip(parameters, values + s * h * weights, strict=True)), until)
            for s in (1, -1)
        ]
        return (ends[0] - ends[1]) / (2 * h)

    coarse, fine = difference(step), difference(step / 2)
    expected = (4 * fine - coarse) / 3
    along = result.derivatives @ weights
    scale = np.max(np.abs(result.derivatives * weights), axis=1)
    assert np.max(np.abs(along - expected) / scale) < EXACT


@pytest.mark.parametrize("case", CASES)
def test_forward_and_adjoint_agree(case: str) -> None:
    netlist, outputs, parameters, until = CASES[case]
    solution = simulate(EXAMPLES / f"{netlist}.toml", until)
    forward = sensitivities(solution, outputs, parameters, method="forward")
    adjoint = sensitivities(solution, outputs, parameters, method="adjoint")
    assert relative_error(adjoint, forward.derivatives) < 1e-8


@pytest.mark.parametrize("case", ["startup", "friction"])
def test_the_values_are_those_of_the_run(case: str) -> None:
    netlist, outputs, parameters, until = CASES[case]
    run = simulate(EXAMPLES / f"{netlist}.toml", until, options=TIGHT)
    result = sensitivities(run, outputs, parameters)
    for output in result.outputs:
        if output.name in run:
            assert output.value == pytest.approx(run.final[output.name], rel=1e-7)
        elif output.name.endswith("loss_energy"):
            assert output.value == pytest.approx(run.energy()[output.name.rpartition(".")[0]].lost, rel=1e-7)
        elif output.name.endswith("lock_time"):
            first = next(
                e for e in run.events if e.mode == output.name.replace("lock_time", "mode") and e.after == "stuck"
            )
            assert output.value == pytest.approx(first.time, abs=1e-9)


# -- parameters, their names and formulas ----------------------------------------------------------------------------


def test_a_start_value_carries_its_parameter() -> None:
    drive = load(EXAMPLES / "machine_tool_startup.toml")
    # At the start w = motor_speed - drag/h0 and phi_rel = -drag/k1.
    result = sensitivities(drive, ["at(J1.w, 0 s)", "at(shaft1.phi_rel, 0 s)"], ["motor_speed", "drag", "h0", "k1"])
    expected = [[1.0, -1 / 156, 2.5 / 156**2, 0.0], [0.0, -1 / 6120, 0.0, 2.5 / 6120**2]]
    assert result.derivatives == pytest.approx(np.array(expected), rel=1e-9, abs=1e-15)


def test_what_comes_to_rest_depends_on_no_parameter() -> None:
    """The spring is at rest, so that w_rel = 0 and b turns with w_0; its twist is zero, so that b.phi = phi_0."""
    drive = loads("""
        [parameters]
        w_0 = "3 rad/s"
        phi_0 = "2 rad"
        [parts]
        a = { is = "Inertia", J = 1, w = "w_0", phi = "phi_0" }
        e = { is = "SpringDamper", c = 200, d = 1 }
        b = { is = "Inertia", J = 2 }
        [series]
        shaft = ["a", "e", "b"]
        [simulate]
        start = "rest"
        until = "1 s"
        """)
    result = sensitivities(drive, ["at(b.w, 0 s)", "at(e.w_rel, 0 s)", "at(b.phi, 0 s)"], ["w_0", "phi_0"])
    assert result.derivatives == pytest.approx(np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]]), abs=1e-15)


def test_all_parameters_are_the_default_and_the_adjoint_is_chosen() -> None:
    result = sensitivities(EXAMPLES / "machine_tool_startup.toml", ["clutch.lock_time"], until="0.3 s")
    assert result.method == "adjoint"
    assert len(result.parameters) > 20
    best = result.ranking("clutch.lock_time")
    assert best[0][0].name == "motor_speed"
    sizes = [abs(parameter.value * slope) for parameter, slope, _ in best]
    # Those that agree in nine digits stand in the order of their declaration.
    assert sizes == pytest.approx(sorted(sizes, reverse=True), rel=1e-8)


def test_a_parameter_that_equals_another_stands_for_it() -> None:
    result = sensitivities(
        EXAMPLES / "machine_tool_startup.toml", ["clutch.lock_time"], ["shaft1.c", "k1"], until="0.3 s"
    )
    assert [one.name for one in result.parameters] == ["k1", "k1"]
    assert result.derivatives[0, 0] == result.derivatives[0, 1]


ACCELERATING = (0.018 + (0.023 + 500 * (0.015 / (2 * pi)) ** 2) / 0.24**2) * 1440 * pi / 30 / 0.2
"""Torque J w/0.2 s of document 000 with the gear."""


def test_a_parameter_with_a_formula_moves_on_its_own_and_follows_the_others() -> None:
    # The clutch torque is computed for an acceleration within 0.2 s: M_K = J w/0.2 + M_L/i, at any speed.
    netlist, output = EXAMPLES / "machine_table_geared.toml", "clutch.lock_time"
    result = sensitivities(netlist, [output], ["clutch_torque", "motor_speed"])
    assert result[output, "clutch_torque"] == pytest.approx(-0.2 / ACCELERATING, rel=1e-8)
    assert abs(result[output, "motor_speed"]) < 1e-12
    assert abs(sensitivities(netlist, [output], ["motor_speed"])[output, "motor_speed"]) < 1e-12


def test_one_name_needs_no_list() -> None:
    run = simulate(EXAMPLES / "machine_table_geared.toml")
    one, listed = sensitivities(run, "table.s", "lead"), sensitivities(run, ["table.s"], ["lead"])
    assert one["table.s", "lead"] == listed["table.s", "lead"]


def test_a_formula_takes_the_values_of_the_run() -> None:
    netlist, output = EXAMPLES / "machine_table_geared.toml", "clutch.lock_time"
    result = sensitivities(netlist, [output], ["clutch_torque"], parameters={"load_torque": 5.0})
    paper = ACCELERATING + 5.0 / 0.24
    assert result.parameters[0].value == pytest.approx(paper, rel=1e-12)
    assert result[output, "clutch_torque"] == pytest.approx(-0.2 / ACCELERATING, rel=1e-8)
    function = simulation_function(netlist, ["clutch_torque"], [output], parameters={"load_torque": 5.0})
    assert function.start_values == pytest.approx([paper], rel=1e-12)


def test_only_parameters_that_tell_coinciding_events_apart_are_refused() -> None:
    # A shift ends when its pressure is zero and when its time is over: a drag torque would tell them apart.
    netlist = EXAMPLES / "lepelletier.toml"
    result = sensitivities(netlist, ["car.w"], ["motor_torque"], until="4.5 s")
    assert result["car.w", "motor_torque"] > 0.0


def test_parameters_on_an_edge_are_refused_by_name_and_left_out_of_all() -> None:
    # Clutches 2 and 3 are open at the start, without any force: a drag torque or an offset of the force engages them.
    run = simulate(EXAMPLES / "msl" / "rotational" / "CoupledClutches.toml")
    # The wave that presses clutch 1 is at its crest at its start, and zero before: 25.6 W above, -5.5 W below.
    on_edge = {"step1.offset", "step2.offset", "clutch2.tau_drag", "clutch3.tau_drag", "sin2.start_time"}
    everything = sensitivities(run, "clutch1.loss_energy")
    assert set(everything.left_out) == on_edge
    assert "step1.offset is left out. No gradient from t = 0 s on: clutch2.mode stays free" in str(everything)
    known = [one.name for one in everything.parameters]
    assert not on_edge & set(known)
    assert relative_error(sensitivities(run, "clutch1.loss_energy", known), everything.derivatives) < 1e-12
    with pytest.raises(NoGradient, match=r"Leave out clutch2\.tau_drag, or move"):
        sensitivities(run, "clutch1.loss_energy", ["J1.J", "clutch2.tau_drag"])


@pytest.mark.parametrize("until", [0.01, 0.05])
def test_a_drive_at_rest_tells_nothing_about_what_a_parameter_excites(until: float) -> None:
    """A disc on a spring, both at rest: with another free angle it swings, by cos(w t) of the torque at the start."""
    parts = {"wall": Fixed(), "spring": Spring(c=1e4, phi_rel0=0.0), "disc": Inertia(J=0.01, phi=0.0, w=0.0)}
    drive = build(Assembly("resting", parts=parts, series={"s": list(parts)}))
    found = sensitivities(drive, "spring.tau", "spring.phi_rel0", until=until).derivatives
    assert found == pytest.approx(-1e4 * cos(1000.0 * until), abs=1e-3)
