"""Runs and handles of the compiled run-time inside Python."""

import re
from concurrent.futures import ThreadPoolExecutor
from ctypes import CDLL
from pathlib import Path

import numpy as np
import pytest

from components import Mass, MassWithStopAndFriction, TranslationalSpring
from modelica_like import build, sensitivities, simulate
from modelica_like.errors import (
    Chattering,
    ModelicaLikeError,
    StepFailed,
    UnknownName,
    ValueOutOfRange,
)
from modelica_like.fmi import sources
from modelica_like.fmi.build import build as compiled
from modelica_like.fmi.build import native_platform
from modelica_like.language import (
    Assembly,
    Component,
    Discrete,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    der,
    discrete,
    integer,
    param,
    pre,
    sin,
    var,
    when,
)
from modelica_like.native import buffers, model
from modelica_like.native.library import Run, declared

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
STARTUP = EXAMPLES / "machine_tool_startup.toml"
CLUTCHES = EXAMPLES / "msl" / "rotational" / "CoupledClutches.toml"


def at_the_stop():
    """A mass meets its stops and leaves them, another one goes on behind a spring."""
    parts = {
        "stopped": MassWithStopAndFriction(m=1.0, smin=-1.0, smax=1.0, F_Coulomb=0.5, s=0.0, v=3.0),
        "spring": TranslationalSpring(c=40.0, s_rel0=0.0),
        "other": Mass(m=2.0, v=3.0, s=0.0),
    }
    drive = Assembly("at_the_stop", parts=parts, series={"line": [*parts]})
    drive.simulate.update(until=2.5)
    return drive


def test_the_structure_of_a_run_is_that_of_c():
    text = (sources._ENGINE / "native.c").read_text()
    body = re.sub(r"/\*.*?\*/", "", re.search(r"typedef struct \{([^}]*)\} NativeRun;", text)[1], flags=re.S)
    found = []
    for kind, names in re.findall(r"(const uint32_t|double|int64_t) ([^;]*);", body):
        pointers = kind == "const uint32_t" or "*" in names
        size = {"double": "c_double", "int64_t": "c_long"}.get(kind) if not pointers else "c_void_p"
        found += [(name.strip(" *"), size) for name in names.split(",")]
    assert [(name, kind.__name__) for name, kind in Run._fields_] == found


def test_a_solution_has_energies_impacts_and_notices():
    drive = build(at_the_stop())
    first, second = (simulate(drive, rtol=1e-9, atol=1e-11, solver=solver) for solver in ("idas", "native"))
    assert [one.component for one in second.impacts] == [one.component for one in first.impacts] != []
    for ours, theirs in zip(second.impacts, first.impacts, strict=True):
        assert ours.energy == pytest.approx(theirs.energy, rel=1e-6)
        assert ours.time == pytest.approx(theirs.time, abs=1e-6)
    for ours, theirs in zip(second.energy().rows, first.energy().rows, strict=True):
        assert ours.lost == pytest.approx(theirs.lost, rel=1e-6, abs=1e-8)
        assert ours.stored == pytest.approx(theirs.stored, rel=1e-6, abs=1e-6)
    assert np.array_equal(first.time[first.time % 0.5 == 0], second.time[second.time % 0.5 == 0])


def test_results_lie_on_the_grid_and_on_both_sides_of_events():
    run = simulate(CLUTCHES, solver="native", points=30)
    grid = np.arange(31) / 30 * 1.5
    assert np.all(np.abs(run.time[:, None] - grid).min(axis=0) < 1e-12)
    inner = {one.time for one in run.events if one.time > 0}
    assert all(np.count_nonzero(run.time == time) == 2 for time in inner)
    assert [one.segment for one in run.events] == sorted(one.segment for one in run.events)


def test_little_room_changes_nothing(monkeypatch):
    drive = build(CLUTCHES)
    run = simulate(drive, solver="native", points=50)
    monkeypatch.setattr(buffers, "_LEAST", 1)
    monkeypatch.setattr(buffers, "_BREATH", 7)
    reached = []
    again = simulate(drive, solver="native", points=50, progress=reached.append)
    assert np.array_equal(run.time, again.time)
    assert np.array_equal(run["J4.w"], again["J4.w"])
    assert run.events == again.events
    assert len(reached) > 10
    assert reached == sorted(reached)
    assert reached[-1] == 1.5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "text", "other"),
    [
        ("special.c", "#define WORTH_IT 6 ", "#define WORTH_IT 2000000000 "),
        ("types.h", "N_SETS = 256, MORE_SETS = 36", "N_SETS = 2, MORE_SETS = 1"),
    ],
)
def test_specialised_tapes_change_nothing(file, text, other, monkeypatch, tmp_path):
    """The same run-time that never specialises, or keeps few tapes, gives the same numbers."""
    texts = sources.runtime_sources(("native",))
    assert text in texts[file]
    texts[file] = texts[file].replace(text, other)
    plain = declared(CDLL(str(compiled(texts, native_platform(), tmp_path))))
    for netlist in (STARTUP, CLUTCHES, EXAMPLES / "lepelletier.toml"):
        special = simulate(netlist, 2.0, solver="native")
        with monkeypatch.context() as patch:
            patch.setattr(model, "library", lambda: plain)
            full = simulate(netlist, 2.0, solver="native")
        assert special.events == full.events
        assert np.array_equal(special.time, full.time)
        assert all(np.array_equal(a.x, b.x) for a, b in zip(special.segments, full.segments, strict=True))


@pytest.mark.parametrize("method", ["forward", "adjoint"])
def test_gradients_of_a_native_run(method):
    drive = build(STARTUP)
    outputs = ["J2.w", "clutch.loss_energy", "max(shaft1.tau)"]
    first, second = (
        sensitivities(
            simulate(drive, rtol=1e-9, atol=1e-11, solver=solver), outputs, ["k1", "J1.J", "force"], method=method
        ).derivatives
        for solver in ("idas", "native")
    )
    assert np.all(np.abs(first - second) <= 1e-6 * np.abs(first))


class Trembling(Component):
    """Each mode drives the other on."""

    x: Variable = var("1", "error")
    T: Parameter = param("s", "time", default=1.0)
    side = Mode("above", "below")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.side.choose(above=-1, below=1)

    def events(self) -> Events:
        yield self.side.go("above", "below", when=self.x < 0)
        yield self.side.go("below", "above", when=self.x > 0)


class Exploding(Component):
    """Infinite in finite time: x = 1 / (1 - t)."""

    x: Variable = var("1", "grows")
    T: Parameter = param("s", "time", default=1.0)

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.x**2


class Teeth(Component):
    """Straight motion, over teeth of which its integrator knows nothing."""

    x: Variable = var("1", "way")
    T: Parameter = param("s", "time", default=1.0)
    n: Parameter = param("1", "phase per way")
    level: Parameter = param("1", "height at which they count")
    place = Mode("between", "on")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == 1

    def events(self) -> Events:
        height = sin(self.n * self.x)
        yield self.place.go("between", "on", when=height > self.level)
        yield self.place.go("on", "between", when=height < 0.9 * self.level - 0.1)


@pytest.mark.parametrize("n", [7.0, 40.0])
@pytest.mark.parametrize("level", [0.5, 0.9, 0.999])
def test_guards_do_not_hide_between_long_steps(n, level):
    run = simulate(Teeth(x=0.0, n=n, level=level), 1.0, solver="native")
    expected = np.arange(np.arcsin(level) / n, 1.0, 2 * np.pi / n)
    assert [one.time for one in run.events if one.after == "on"] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(("part", "kind"), [(Trembling, Chattering), (Exploding, StepFailed)])
def test_errors_are_those_of_idas(part, kind):
    drive = build(part(x=1.0))
    for solver in ("idas", "native"):
        with pytest.raises(kind) as caught:
            simulate(drive, 2.0, solver=solver)
        assert caught.value.run.time[-1] == pytest.approx(1.0, abs=0.01)


def test_a_run_that_idas_gives_up_is_done_by_the_run_time():
    """At 1e-14 the equations of a step of the gearbox do not converge; at 1e-9 IDAS itself runs, for comparison."""
    gearbox = build(EXAMPLES / "lepelletier.toml")
    run, near = simulate(gearbox, rtol=1e-14, atol=1e-16), simulate(gearbox, rtol=1e-9, atol=1e-11)
    assert [(one.mode, one.after) for one in run.events] == [(one.mode, one.after) for one in near.events]
    for name in gearbox.states:
        np.testing.assert_allclose(run[name][-1], near[name][-1], rtol=0, atol=1e-7 * np.abs(near[name]).max())
    (told,) = run.notices
    assert told.startswith("IDAS gave up at about t = ")
    assert told.endswith("The whole run was done by the compiled run-time instead (solver native).")

    with pytest.raises(StepFailed):
        simulate(gearbox, rtol=1e-14, atol=1e-16, solver="idas")


def test_an_unknown_solver():
    with pytest.raises(UnknownName, match=r"There is no solver 'nativ'; did you mean 'native'\?"):
        simulate(STARTUP, solver="nativ")


def test_an_interrupt_keeps_what_was_done(monkeypatch):
    monkeypatch.setattr(buffers, "_BREATH", 50)

    def stop(time: float) -> None:
        if time > 0.3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        simulate(STARTUP, solver="native", progress=stop)
    run = caught.value.run
    assert 0.3 < run.time[-1] < 0.6
    assert run.events[0].time < 0.3


# -- handles -----------------------------------------------------------------------------------------------------------


def test_a_handle_runs_as_simulate_does():
    drive = build(STARTUP)
    run = simulate(drive, solver="native", points=100)
    handle = drive.native(outputs=["J3.w", "clutch.mode", "der(load.w)"])
    handle.reset(until=1.0)
    times, values = handle.run(1.0, 100)
    assert times == pytest.approx(run.time, abs=1e-8)
    assert values[:, 0] == pytest.approx(run["J3.w"], abs=1e-5)
    assert np.array_equal(values[:, 1], run["clutch.mode"])
    assert handle.time == 1.0
    assert handle.get("J3.w", "J2.w") == pytest.approx([run.final["J3.w"], run.final["J2.w"]], abs=1e-5)


def test_steps_and_going_back():
    handle = build(STARTUP).native(inputs=["force"], outputs=["J3.w", "shaft2.tau"])
    for k in range(1, 301):
        handle.step(1e-3 * k)
    here, there = handle.outputs.copy(), handle.copy()
    ends = []
    for _ in range(2):
        handle.inputs[0] = 4000.0
        for k in range(301, 601):
            handle.step(1e-3 * k)
        ends.append(handle.outputs.copy())
        handle.restore(there)
        assert handle.time == pytest.approx(0.3)
        assert np.array_equal(handle.outputs, here)
    assert np.array_equal(*ends)
    handle.inputs[0] = 5256.25
    assert not np.array_equal(handle.step(0.6), ends[0])


class Stairs(Component):
    """Counts every 0.3 that x rises, and keeps the time of the last count."""

    rate: Parameter = param("1/s", "rate", default=1.0)
    x: Variable = var("1", "rises", default=0)
    n: Discrete = integer("counts")
    last: Discrete = discrete("s", "time of the last count")

    def equations(self) -> Equations:
        yield der(self.x) == self.rate

    def events(self) -> Events:
        yield when(self.x > 0.3 * (pre(self.n) + 1), {self.n: pre(self.n) + 1, self.last: self.time})


@pytest.mark.parametrize("begin", np.arange(0.05, 1.0, 0.1))
def test_a_run_from_the_middle_of_a_step_does_not_hurry_its_event(begin):
    """A step to the next event has been done when the run begins before it."""
    drive = build(Stairs()).native(outputs=["n", "last"])
    drive.reset(until=1.0)
    drive.step(begin)
    times, values = drive.run(1.0, points=4)
    counts = np.array([int(t / 0.3 + 1e-9) for t in times])
    away = np.min(np.abs(times[:, None] - 0.3 * np.arange(1, 4)), axis=1) > 1e-6
    assert values[away, 0].tolist() == counts[away].tolist()
    assert values[away, 1] == pytest.approx(0.3 * counts[away], abs=1e-9)


def test_tuned_steps_are_those_of_pieces():
    """A parameter that moves from step to step: the same as one run per piece."""
    drive = build(EXAMPLES / "two_mass.toml")
    handle = drive.native(inputs=["shaft.c"], outputs=["J2.w"])
    values = [1.0, 1.5, 0.5]
    stiffness = handle.inputs[0]
    found = []
    for k, factor in enumerate(values):
        handle.inputs[0] = factor * stiffness
        found.append(handle.step(0.01 * (k + 1))[0])
    fresh = drive.native(inputs=["shaft.c"], outputs=["J2.w"])
    for k, factor in enumerate(values):
        fresh.set({"shaft.c": factor * stiffness})
        fresh.inputs[0] = factor * stiffness
        assert fresh.run(0.01 * (k + 1), 3)[1][-1, 0] == pytest.approx(found[k], rel=1e-6)


def test_start_values_and_parameters_at_the_reset():
    drive = build(EXAMPLES / "two_mass.toml")
    other = drive.with_parameters({"J1.J": "0.05 kg.m2"})
    handle = drive.native(outputs=["J1.J", "J2.w"])
    handle.reset({"J1.J": 0.05})
    handle.step(0.02)
    assert handle.outputs[1] == pytest.approx(simulate(other, 0.02, solver="native").final["J2.w"], rel=1e-7)
    handle.reset()
    assert handle.get("J1.J") == drive.p[drive.parameter_position["J1.J"]]


class Counts(Component):
    """Counts once."""

    x: Variable = var("s", "time since the start", default=0.0)
    t_count: Parameter = param("s", default=0.5)
    n: Discrete = discrete("1", "count", start=2.0)

    def equations(self) -> Equations:
        yield der(self.x) == 1.0

    def events(self) -> Events:
        yield when(self.x > self.t_count, {self.n: pre(self.n) + 1})


def test_start_values_of_discrete_variables_at_the_reset():
    handle = build(Counts()).native(outputs=["n"])
    for given, expected in (({"n": 10}, 10 + 1), ({"n": 2}, 2 + 1), ({}, 2 + 1)):
        handle.reset(given)
        handle.step(1.0)
        assert handle.outputs == [expected]


def test_threads_share_a_model():
    drive = build(CLUTCHES)

    def end(_: int) -> float:
        handle = drive.native(outputs=["J4.w"])
        handle.reset(until=1.5)
        return handle.run(1.5)[1][-1, 0]

    expected = end(0)
    with ThreadPoolExecutor(4) as pool:
        assert set(pool.map(end, range(16))) == {expected}


def test_what_a_handle_refuses():
    drive = build(STARTUP)
    with pytest.raises(UnknownName, match=r"machine_tool_startup has no variable 'J3.v'"):
        drive.native(outputs=["J3.v"])
    handle = drive.native(inputs=["force"])
    with pytest.raises(ValueOutOfRange, match="it must be at least 0"):
        handle.set({"J1.J": -1.0})
    with pytest.raises(ModelicaLikeError, match="start values are settable"):
        handle.set({"J1.w": 1.0})
    handle.inputs[0] = np.nan
    with pytest.raises(ValueOutOfRange, match="not a finite number"):
        handle.step(0.1)
    with pytest.raises(ValueOutOfRange, match="another model"):
        build(CLUTCHES).native().restore(handle.copy())


@pytest.mark.parametrize("time", [np.inf, -np.inf, np.nan, "0.3 s", None, 0.1])
def test_a_handle_refuses_what_is_no_time_from_now_on(time):
    """It would run for ever, or stay where it is and return what is there."""
    handle = build(CLUTCHES).native(outputs=["J2.w"])
    handle.step(0.2)
    handle.step(0.2 - 1e-12)  # rounding
    for go in (handle.step, handle.run):
        with pytest.raises(ValueOutOfRange, match=r"time must be|is before the present one"):
            go(time)
    assert handle.time == 0.2
    if time not in (0.1, np.inf, -np.inf):
        with pytest.raises(ValueOutOfRange, match="until must be a number of seconds"):
            handle.reset(until=time)
    for points in (0, 2.5, None):
        with pytest.raises(ValueOutOfRange, match="points must be a positive whole number"):
            handle.run(0.3, points)  # type: ignore[arg-type]


class Turning(Component):
    """A value whose rate changes its sign once."""

    turned = Mode("no", "yes")
    x: Variable = var("1", "a value", default=0.0)
    T: Parameter = param("s", "time constant", default=1.0)

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.turned.choose(no=1.0, yes=-1.0)

    def events(self) -> Events:
        yield self.turned.go("no", "yes", when=self.x > 0.5)


@pytest.mark.parametrize("before", [0, 1, 29, 30, 31])
@pytest.mark.parametrize("together", [4, 100])
def test_an_instant_may_have_more_events_than_there_is_room_for(before: int, together: int) -> None:
    """Some turn one by one, then many at one instant: at 1 s these are back where they began."""
    parts: dict[str, Component] = {f"a{k}": Turning(x=0.4 - 0.01 * k) for k in range(before)}
    parts |= {f"b{k}": Turning(x=0.0) for k in range(together)}
    run = simulate(Assembly("many", parts=parts), 1.0, solver="native")
    assert len(run.events) == before + together
    assert [run.final[f"b{k}.x"] for k in (0, together - 1)] == pytest.approx([0.0, 0.0], abs=1e-6)
