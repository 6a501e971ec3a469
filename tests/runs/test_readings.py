"""Readings: closed forms, document 003, the same number everywhere, whatever is written of a run."""

import contextlib
import gc
import math
import os
import pickle
import tomllib
import tracemalloc
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from components import (
    Clutch,
    ConstantSpeed,
    Fixed,
    Inertia,
    Pulse,
    PulseCounter,
    Ramp,
    RigidBacklash,
    Sine,
    SpringDamper,
    Step,
    Table,
    Torque,
    TorqueStep,
)
from modelica_like import Assembly, build, load_spectrum, sensitivities, simulate, simulation_function, sweep
from modelica_like.analyse.sizing import load_of, size
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import MissingValue, NoGradient
from modelica_like.runs import polynomials
from modelica_like.runs.display import Display
from modelica_like.runs.signals import read_signals
from modelica_like.show.report.run import values_table

ROOT = Path(__file__).parents[2]
STARTUP = ROOT / "examples" / "machine_tool_startup.toml"
SOLVERS = ("idas", "native")
LARGEST = 494.850227
"""N.m in shaft 1 of document 003: explicit and implicit steps at relative tolerances of 1e-12, mode by mode."""
RUN = 1e-6
"""What both engines keep at default tolerances."""
SAME = 1e-8

AMPLITUDE, OMEGA = 0.3, math.sqrt(2e3 / 5.0)
ANGLE = "spring.phi_rel"


@pytest.fixture(scope="module")
def swinging() -> CompiledDae:
    """phi = A cos(w t) without damping."""
    parts = {"wall": Fixed(), "spring": SpringDamper(c=2e3, d=0.0), "mass": Inertia(J=5.0, phi=AMPLITUDE, w=0.0)}
    return build(Assembly("swinging", parts=parts, series={"shaft": [*parts]}))


def closed_forms(end: float) -> dict[str, float]:
    """By the integrals of powers of cosines; the torque of the spring is c phi."""
    c, sine = 2e3 * AMPLITUDE, math.sin(OMEGA * end) / OMEGA
    square = end / 2 + math.sin(2 * OMEGA * end) / (4 * OMEGA)
    return {
        "max(spring.tau)": c,
        "min(spring.tau)": -c,
        "peak(mass.w)": AMPLITUDE * OMEGA,
        "integral(spring.tau)": c * sine,
        "mean(spring.tau)": c * sine / end,
        "rms(spring.tau)": c * math.sqrt(square / end),
        "at(spring.tau, 0.1 s)": c * math.cos(0.1 * OMEGA),
        "spring.tau": c * math.cos(OMEGA * end),
        "first(spring.tau < -100 N.m)": math.acos(-100 / c) / OMEGA,
        "max(-spring.tau)": c,
        "max(abs(spring.tau) - 100 N.m)": c - 100,
        "min(abs(spring.tau))": 0.0,
        "integral(spring.tau**2)": c**2 * square,
    }


@pytest.mark.parametrize("points", [5, 50, 500])
@pytest.mark.parametrize("solver", SOLVERS)
def test_closed_forms_of_an_oscillation(swinging: CompiledDae, solver: Any, points: int) -> None:
    end = 1.7
    expected = closed_forms(end)
    run = simulate(swinging, end, points=points, solver=solver, readings=[*expected])
    after = run.read(*expected)
    for k, (name, value) in enumerate(expected.items()):
        size = max(abs(value), 2e3 * AMPLITUDE if "tau" in name and "first" not in name else 0.0)
        assert run.readings[name] == pytest.approx(value, abs=2 * RUN * size), name
        assert after[k] == run.readings[name]
    first = simulate(swinging, 0.2, points=points, solver=solver).read(
        "min(spring.tau)", "peak(spring.tau)", "max(mass.w)"
    )
    assert first[0].time == pytest.approx(math.pi / OMEGA, rel=1e-4)  # flat there: the root of the tolerance
    assert (first[0].unit, first[1].sign, first[2].sign) == ("N.m", 1, 1)


def test_a_sweep_has_the_closed_forms(swinging: CompiledDae) -> None:
    expected = closed_forms(1.7)
    found = sweep(swinging, {"spring.c": [2e3]}, [*expected], until=1.7)
    for name, value in expected.items():
        size = max(abs(value), 2e3 * AMPLITUDE if "tau" in name and "first" not in name else 0.0)
        assert float(found[name][0]) == pytest.approx(value, abs=2 * RUN * size), name


@pytest.mark.parametrize("solver", SOLVERS)
def test_kinks_jumps_and_modes(solver: Any) -> None:
    """A brake of 4 N.m stops 2 kg.m2 from 10 rad/s at 5 s; a table of straight lines; a sine beside longer steps."""
    lines = Table(table=((0, 0), (1.3, 2), (1.7, -3), (6, 0)))
    parts = {"mass": Inertia(J=2.0, w=10.0, phi=0.0), "brake": Clutch(capacity=4.0), "housing": Fixed(),
             "lines": lines, "fast": Sine(amplitude=2.0, f=40.0)}  # fmt: skip
    drive = Assembly("braked", parts=parts, series={"shaft": ["mass", "brake", "housing"]})
    expected = {
        "duration(brake.mode: stuck)": 1.0, "max(abs(lines.y))": 3.0, "integral(abs(lines.y))": 1.3 + 0.52 + 6.45,
        "first(lines.y < 0)": 1.3 + 0.4 * 2 / 5, "max(lines.y)": 2.0, "peak(fast.y)": 2.0, "rms(fast.y)": math.sqrt(2),
        "brake.loss_energy": 100.0, "integral(brake.loss_power)": 100.0, "mean(mass.w)": 25 / 6, "max(mass.w)": 10.0,
        "first(mass.w < 5 rad/s)": 2.5, "time(brake.mode -> stuck)": 5.0,
    }  # fmt: skip
    model = build(drive)
    run = simulate(model, 6.0, points=7, solver=solver)
    for name, number in zip(expected, run.read(*expected), strict=True):
        assert number == pytest.approx(expected[name], rel=RUN), name
    if solver == "native":
        found = sweep(model, {"mass.J": [2.0]}, [*expected], until=6.0)
        for name, value in expected.items():
            assert float(found[name][0]) == pytest.approx(value, rel=RUN), name


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("until", [1, 9, 30, 300])
def test_the_largest_torque_of_document_003(startup: CompiledDae, until: float, solver: Any) -> None:
    for points in (5, 50, 500):
        run = simulate(startup, until, points=points, solver=solver)
        (largest,) = run.read("peak(shaft1.tau)")
        assert largest == pytest.approx(LARGEST, rel=RUN)
        assert largest.sign == -1
        assert run.read("integral(clutch.loss_power)")[0] == pytest.approx(run.energy()["clutch"].lost, rel=RUN)


@pytest.fixture(scope="module")
def startup() -> CompiledDae:
    return build(STARTUP)


def test_a_design_check_of_a_long_run(tmp_path: Path) -> None:
    (tmp_path / "shaft.toml").write_text(
        'name = "shaft"\n[checks.shaft]\nis = "shaft_stress"\nbending = "0 N.m"\ndiameter = "40 mm"\n'
        'yield_strength = "275 N/mm2"\nrequired_safety = 5\n'
        f'torque = {{ from = "{STARTUP.as_posix()}", peak = "shaft1.tau", until = "30 s" }}\n'
    )
    made = size(tmp_path / "shaft.toml")
    assert made["shaft"].torque == pytest.approx(LARGEST, rel=RUN)
    # Equivalent stress sqrt(3) tau with tau = 16 T/(pi d^3).
    assert made["shaft"].safety == pytest.approx(275e6 * math.pi * 0.04**3 / (16 * math.sqrt(3) * LARGEST), rel=RUN)
    assert made.exceeded == 1


QUICK = ("machine_table_direct", "machine_tool_startup", "two_mass", "winch", "CoupledClutches")
EXAMPLES = [
    path
    for path in sorted((ROOT / "examples").rglob("*.toml"))
    if path.parent.name != "cosim"
    and {"parts", "simulate"} <= set(content := tomllib.loads(path.read_text()))
    and "until" in content["simulate"]
    and (path.stem in QUICK or os.environ.get("EVERY_EXAMPLE"))
]


KINDS = ("peak", "max", "min", "integral", "mean", "rms")


def loads_of(model: CompiledDae) -> list[str]:
    """All torques and forces."""
    return [one.path for one in model.flat_variables if str(one.unit) in ("N.m", "N") and not one.hidden]


def some_readings(model: CompiledDae) -> list[str]:
    """A reading of each kind of a torque or force, or of what there is."""
    path = (loads_of(model) or [one.path for one in model.flat_variables if not one.hidden])[0]
    return [f"{kind}({path})" for kind in KINDS]


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_no_torque_depends_on_what_is_written(path: Path, solver: Any) -> None:
    """Six numbers of every torque and force with 5, 50 and 500 results, within one engine."""
    model = build(path)
    loads = loads_of(model)
    names = [f"{kind}({load})" for load in loads for kind in KINDS]
    runs = [simulate(model, points=points, solver=solver, readings=names) for points in (500, 50, 5)]
    many, *fewer = np.array([run.read(*names) for run in runs]).reshape(3, -1, len(KINDS))
    span, rounding = float(runs[0].time[-1]), SAME * many[:, 0].max(initial=0.0)
    largest, rms = many[:, 0], many[:, 5]
    allowed = RUN * np.stack([largest, largest, largest, rms * span, rms, rms], axis=1) + rounding * max(span, 1.0)
    for few in fewer:
        assert (np.abs(few - many) <= allowed).all()


@pytest.mark.parametrize(
    "path",
    [pytest.param(path, marks=[] if path.stem in QUICK[:3] else pytest.mark.slow, id=path.stem) for path in EXAMPLES],
)
def test_a_name_has_one_number_in_every_example(path: Path) -> None:
    model = build(path)
    names = some_readings(model)
    variable = names[0][len("peak(") : -1]
    run = simulate(model, solver="native", readings=names)
    expected = np.array([run.readings[name] for name in names])
    scale = SAME * np.array([abs(expected[0])] * 3 + [abs(expected[5]) * float(run.time[-1]), *[abs(expected[5])] * 2])
    few = simulate(model, solver="native", points=11)
    np.testing.assert_array_less(np.abs(few.read(*names) - expected), scale + 1e-12)
    name = next((one.path for one in model.flat_parameters if one.tunable), None)
    if name is not None:
        value = float(model.p[model.parameter_position[name]])
        found = sweep(model, {name: [value]}, names)
        if "IDAS did" not in found.attrs["notice"]:
            np.testing.assert_array_less(
                [abs(float(found[n][0]) - e) for n, e in zip(names, expected, strict=True)], scale + 1e-12
            )
        with contextlib.suppress(NoGradient):  # at a kink there is no derivative, and so no table of them
            made = sensitivities(model, names, [name])
            np.testing.assert_array_less(np.abs([one.value for one in made.outputs] - expected), scale + 1e-12)
    told = values_table(run, [variable]).records[0]
    shown = Display(model).converted(expected[[2, 1]], str(model.units[variable]), told["unit"] or "1")
    assert (told["smallest"], told["largest"]) == pytest.approx(tuple(shown), rel=1e-15)
    keys = ("peak", "largest", "smallest", "integral", "mean", "rms")
    assert [load_of(run, variable, key) for key in keys] == expected.tolist()


def test_what_is_not_kept_is_read_on_the_way_or_refused(startup: CompiledDae, monkeypatch: pytest.MonkeyPatch) -> None:
    names = ["peak(shaft1.tau)", "integral(clutch.loss_power)", "at(shaft1.tau, 0.3 s)", "first(shaft1.tau > 100 N.m)"]
    for solver in SOLVERS:
        whole = simulate(startup, 2.0, solver=solver).read(*names)
        with monkeypatch.context() as patch:
            patch.setattr("modelica_like.native.buffers.MOST_KEPT", 5000)
            patch.setattr("modelica_like.solve.dense.MOST_KEPT", 500)
            tracemalloc.start()
            run = simulate(startup, 2.0, solver=solver, readings=names)
            assert tracemalloc.get_traced_memory()[1] < 20e6  # only what is full gets more room
            tracemalloc.stop()
            other = simulate(startup, 2.0, solver=solver)
        assert run.dense is None
        np.testing.assert_allclose(run.read(*names), whole, rtol=SAME)
        with pytest.raises(Exception, match="what happens between its results was not kept"):
            other.read(names[0])
    kept = simulate(startup, 0.3, readings=names[:1])
    assert pickle.loads(pickle.dumps(kept)).read(names[0]) == [kept.readings[names[0]]]


def test_a_run_keeps_its_polynomials_only(startup: CompiledDae) -> None:
    """Five columns of coefficients a step; neither the instance of the run-time nor its buffers."""

    def used() -> int:
        gc.collect()
        return tracemalloc.get_traced_memory()[0]

    simulate(startup, 30.0, solver="native")
    tracemalloc.start()
    before = used()
    run = simulate(startup, 30.0, solver="native")
    with_dense = used()
    run.dense = None
    kept = with_dense - used()
    numbers = run.statistics.steps * (3 + 5 * (len(startup.states) + len(startup.implicit)))
    assert 8 * numbers <= kept < 1.1 * 8 * numbers + 1e4
    del run
    left = used() - before
    tracemalloc.stop()
    assert left < kept / 5


def test_turning_points_do_not_depend_on_the_results() -> None:
    """20 periods of a sine with 7 results: 20 cycles of its amplitude, less what begins and ends at zero."""
    drive = Assembly("d", parts={"s": Sine(amplitude="100 N.m", f=10.0)})
    spectrum = load_spectrum(simulate(drive, 2.0, points=7), "s.y")
    assert spectrum.amplitudes[0] == pytest.approx(100.0, rel=RUN)
    assert spectrum.counts[spectrum.amplitudes > 99].sum() == pytest.approx(19.5)


def test_derivatives_of_every_kind_against_closed_forms(swinging: CompiledDae) -> None:
    """By c, with w = sqrt(c/J): torque c A cos(w t)."""
    end, c = 1.7, 2e3
    kinds = [
        "peak(spring.tau)",
        "min(spring.tau)",
        "mean(spring.tau)",
        "rms(spring.tau)",
        "first(spring.tau < -100 N.m)",
    ]
    made = sensitivities(simulate(swinging, end), kinds, ["spring.c"])
    w = OMEGA
    dw = w / (2 * c)
    mean = c * AMPLITUDE * math.sin(w * end) / (w * end)
    d_mean = mean / c + c * AMPLITUDE * (math.cos(w * end) / w - math.sin(w * end) / (w * w * end)) * dw
    square = 0.5 + math.sin(2 * w * end) / (4 * w * end)
    rms = c * AMPLITUDE * math.sqrt(square)
    d_square = (math.cos(2 * w * end) / (2 * w) - math.sin(2 * w * end) / (4 * w * w * end)) * dw
    d_rms = rms / c + rms * d_square / (2 * square)
    share = 100 / (c * AMPLITUDE)
    t = math.acos(-share) / w
    d_first = -share / c / math.sqrt(1 - share**2) / w - t / w * dw
    expected = [AMPLITUDE, -AMPLITUDE, d_mean, d_rms, d_first]
    for name, value in zip(kinds, expected, strict=True):
        assert made[name, "spring.c"] == pytest.approx(value, rel=1e-6), name


def test_functions_and_readings_have_the_same_values(startup: CompiledDae) -> None:
    names = ["peak(shaft1.tau)", "mean(shaft1.tau)"]
    function = simulation_function(startup, ["h1"], names)
    run = simulate(startup, solver="native", rtol=1e-10)
    assert function.values_at([10.0]) == pytest.approx(run.read(*names), rel=SAME)


def test_second_derivatives_of_parameters_of_any_size(swinging: CompiledDae) -> None:
    """By c = 2000 N.m/rad and J = 5 kg.m2, of the torque c A cos(sqrt(c/J) t)."""
    function = simulation_function(swinging, ["spring.c", "mass.J"], ["spring.tau"], until=0.2)
    p, c, inertia = ca.MX.sym("p", 2), ca.SX.sym("c"), ca.SX.sym("J")
    found = ca.Function("found", [p], [ca.hessian(function(p), p)[0]])([2e3, 5.0])
    torque = c * AMPLITUDE * ca.cos(ca.sqrt(c / inertia) * 0.2)
    expected = ca.Function("e", [c, inertia], [ca.hessian(torque, ca.vertcat(c, inertia))[0]])(2e3, 5.0)
    assert np.array(found) == pytest.approx(np.array(expected), rel=1e-5)


@pytest.fixture(scope="module")
def stepping() -> CompiledDae:
    """A step of 3 at 0.5 s, a pulse of 4 from the start on, a counter of rises, a ramp that stays at 2, and a sine."""
    parts = {"step": Step(height=3.0, start_time=0.5), "pulse": Pulse(amplitude=4.0, width=0.25, period=0.2),
             "counter": PulseCounter(u_high=0.5), "ramp": Ramp(height=2.0, duration=0.32, start_time=0.1),
             "sine": Sine(amplitude=2.0, f=1.0), "torque": Torque(),
             "mass": Inertia(J=1.0, phi=0.0, w=0.0)}  # fmt: skip
    connect = {"pulses": ["pulse.y", "counter.u"], "drive": ["sine.y", "torque.tau"]}
    return build(Assembly("stepping", parts=parts, series={"shaft": ["torque", "mass"]}, connect=connect))


FIRST = {
    "first(step.y >= 3)": 0.5, "first(step.y > 3)": math.nan, "first(3 <= step.y)": 0.5,
    "first(step.y >= 3.5)": math.nan, "first(pulse.y <= 4)": 0.0, "first(pulse.y < 4)": 0.05,
    "first(counter.y >= 3)": 0.6, "first(counter.y > 3)": 0.8, "first(mass.w >= 0 rad/s)": 0.0,
    "first(ramp.y >= 2)": 0.42, "first(ramp.y >= 1)": 0.26, "first(ramp.y > 1)": 0.26, "first(sine.y >= 1)": 1 / 12,
    "first(sine.y > 1)": 1 / 12, "first(sine.y >= 0)": 0.0, "first(sine.y <= -1)": 7 / 12,
}  # fmt: skip


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_condition_with_equality_is_true_where_a_signal_stays(stepping: CompiledDae, solver: Any) -> None:
    before = simulate(stepping, 0.95, points=7, solver=solver, readings=[*FIRST]).readings
    after = simulate(stepping, 0.95, solver=solver).read(*FIRST)
    found = sweep(stepping, {"step.height": [3.0]}, [*FIRST], until=0.95, solver=solver)
    assert not found.attrs.get("differences")
    for number, (name, value) in zip(after, FIRST.items(), strict=True):
        for one in (number, before[name], float(found[name][0])):
            assert one == pytest.approx(value, abs=1e-9, nan_ok=True), name


def test_derivatives_of_conditions_with_equality(stepping: CompiledDae) -> None:
    """Jumps move with their events; A sin(w t) = 1 moves by -sin/(A w cos), whoever has met it before."""
    names = ["first(step.y >= 3)", "first(counter.y >= 3)", "first(sine.y >= 1)", "first(sine.y > 1)"]
    made = sensitivities(stepping, names, ["step.start_time", "pulse.period", "sine.amplitude"], until=0.95)
    expected = np.zeros((4, 3))
    expected[0, 0], expected[1, 1] = 1.0, 3.0
    expected[2:, 2] = -math.tan(math.pi / 6) / (2 * 2 * math.pi)
    np.testing.assert_allclose(made.derivatives, expected, atol=1e-9)


def test_a_formula_of_a_signal_without_a_unit_has_none(stepping: CompiledDae) -> None:
    names = ["step.y", "2*step.y", "step.y**2", "step.y*mass.w", "max(2*step.y)", "2*mass.w", "mass.w*torque.tau"]
    run = simulate(stepping, 0.95)
    assert [number.unit for number in run.read(*names)] == ["*", "*", "*", "*", "*", "rad/s", "W"]
    assert [signal.unit for signal in read_signals(stepping, names[:4])] == ["*"] * 4
    assert float(sweep(stepping, {"step.height": [3.0]}, ["2*step.y"], until=0.95)["2*step.y"][0]) == 6.0


@pytest.mark.parametrize("solver", SOLVERS)
def test_waves_along_a_long_steady_turn(solver: Any) -> None:
    """One step has the whole turn, and 4,000 waves lie in it: sin⁴ = 3/8 - cos(2wt)/2 + cos(4wt)/8."""
    w, end = 300.0, 90.0
    parts = {"motor": ConstantSpeed(w_fixed=w, phi=0.0), "J": Inertia(J=1.0)}
    run = simulate(Assembly("turning", parts=parts, series={"shaft": [*parts]}), end, solver=solver)
    wave = "sin(J.phi/(1 rad))**4"
    mean = 3 / 8 - math.sin(2 * w * end) / (4 * w * end) + math.sin(4 * w * end) / (32 * w * end)
    # The angle of 27,000 rad is rounded to 4e-12.
    assert run.read(f"mean({wave})", f"max({wave})") == pytest.approx([mean, 1.0], rel=1e-10)


def test_what_would_take_too_many_polynomials_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    parts = {"motor": ConstantSpeed(w_fixed=300.0, phi=0.0), "J": Inertia(J=1.0)}
    run = simulate(Assembly("turning", parts=parts, series={"shaft": [*parts]}), 90.0)
    monkeypatch.setattr(polynomials, "MOST_KEPT", 2**16)
    with pytest.raises(MissingValue, match=r"^sin\(J\.phi/\(1 rad\)\) cannot be read off turning: from t = 0 s on"):
        run.read("max(sin(J.phi/(1 rad)))")


@pytest.fixture(scope="module")
def claws() -> CompiledDae:
    """Flanks meet backward at half the play over 5 rad/s; a torque of -3 N.m from 0.5 s on takes them to the others."""
    parts = {"torque": TorqueStep(step_torque=-3.0, start_time=0.5), "rotor": Inertia(J=0.02, phi=0.0, w=5.0),
             "claw": RigidBacklash(b=0.1, e=0.0), "wheel": Inertia(J=0.05, phi=0.0, w=0.0)}  # fmt: skip
    return build(Assembly("claws", parts=parts, series={"shaft": [*parts]}))


ACROSS = math.sqrt(2 * 0.1 * 0.02 / 3)
"""Time over the whole play at the acceleration of the rotor."""
LOCKS = {
    "claw.lock_time": 0.01, "claw.unlock_time": 0.5, "time(claw.contact -> forward)": 0.5 + ACROSS,
    "claw.unlock_time - claw.lock_time": 0.49,
}  # fmt: skip


@pytest.mark.parametrize("solver", SOLVERS)
def test_backlash_locks_in_each_direction(claws: CompiledDae, solver: Any) -> None:
    run = simulate(claws, 1.0, solver=solver)
    found = sweep(claws, {"rotor.J": [0.02]}, [*LOCKS], until=1.0, solver=solver)
    for number, (name, value) in zip(run.read(*LOCKS), LOCKS.items(), strict=True):
        for one in (number, float(found[name][0])):
            assert one == pytest.approx(value, rel=RUN), name


def test_derivatives_of_the_locks_of_backlash(claws: CompiledDae) -> None:
    made = sensitivities(claws, [*LOCKS], ["claw.b", "torque.start_time"], until=1.0)
    expected = [[0.1, 0], [0, 1], [ACROSS / 0.2, 1], [-0.1, 1]]
    np.testing.assert_allclose(made.derivatives, expected, rtol=RUN, atol=RUN)
