"""The result: trajectories by name, grid, instants, tables, pickles; and compile once, run often."""

import pickle

import numpy as np
import pytest

from components import Clutch, Inertia, TorqueStep
from modelica_like import Options, Solution, build, simulate
from modelica_like.errors import LanguageError, UnitError, UnknownName, ValueOutOfRange
from modelica_like.language import Component, Equations, Parameter, Variable, connect, der, param, series, var
from modelica_like.netlist import loads


class Drive(Component):
    """Two inertias slide on each other until they stick: 10 rad/s and 0 become 5 rad/s after 1 s."""

    grip: Parameter = param("N.m", "capacity of the clutch", default=5.0)
    left = Inertia(J=1.0, phi=0.0, w=10.0)
    clutch = Clutch(capacity="grip", phi_rel=0.0)
    right = Inertia(J="half*2", w=0.0)
    half: Parameter = param("kg.m2", "half the inertia", default=0.5)

    def equations(self) -> Equations:
        yield from series(self.left, self.clutch, self.right)


@pytest.fixture(scope="module")
def drive() -> Drive:
    return Drive()


@pytest.fixture(scope="module")
def run(drive: Drive) -> Solution:
    return simulate(drive, 2.0, points=8, rtol=1e-9, atol=1e-11)


# -- access ----------------------------------------------------------------------------------------------------------


def test_a_variable_by_its_path_or_as_an_attribute(drive, run):
    assert np.array_equal(run["clutch.tau"], run[drive.clutch.tau])
    assert np.array_equal(run["left.w"], run[drive.left.w])
    assert np.array_equal(run["clutch.flange_a.tau"], run[drive.clutch.flange_a.tau])
    assert np.array_equal(run["clutch.mode"], run[drive.clutch.mode])
    assert np.array_equal(run["time"], run.time)


def test_the_values_are_right(run):
    before = run.time < 1.0
    np.testing.assert_allclose(run["left.w"][before], 10 - 5 * run.time[before], atol=1e-9)
    np.testing.assert_allclose(run["right.w"][before], 5 * run.time[before], atol=1e-9)
    assert run.final["left.w"] == pytest.approx(5.0, rel=1e-9)
    assert run.final["clutch.tau"] == pytest.approx(0.0, abs=1e-12)
    assert run.final["right.phi"] == pytest.approx(2.5 + 5.0, rel=1e-8)


def test_every_variable_of_the_unreduced_model_is_there(run):
    flanges = [
        f"{part}.flange_{end}.{name}" for part in ("left", "clutch", "right") for end in "ab" for name in ("phi", "tau")
    ]
    own = [
        "left.phi",
        "left.w",
        "right.phi",
        "right.w",
        "clutch.phi_rel",
        "clutch.tau",
        "clutch.w_rel",
        "clutch.f_normalized",
    ]
    assert set(run.names) == {*flanges, *own, "clutch.mode", "clutch.command"}
    for name in run.names:
        assert run[name].shape == run.time.shape
        assert name in run
    np.testing.assert_array_equal(run["left.flange_b.phi"], run["clutch.flange_a.phi"])
    np.testing.assert_array_equal(run["left.flange_b.tau"], -run["clutch.flange_a.tau"])


def test_parameters_are_constant_columns(drive, run):
    assert np.all(run["grip"] == 5.0)
    assert np.all(run["clutch.capacity"] == 5.0)  # follows from grip
    assert np.all(run["right.J"] == 1.0)
    assert np.array_equal(run[drive.clutch.capacity], run["clutch.capacity"])
    assert "clutch.capacity" in run


def test_energy_terms_are_results(run):
    np.testing.assert_allclose(run["left.stored_energy"], 0.5 * run["left.w"] ** 2, atol=1e-12)
    np.testing.assert_allclose(run["clutch.loss_power"], run["clutch.tau"] * run["clutch.w_rel"], atol=1e-12)


def test_energy_terms_at_one_instant_are_those_of_that_instant(run):
    """10 rad/s at the start, 5 rad/s from 1 s on: 0.5 J w²."""
    assert run.final["left.stored_energy"] == pytest.approx(12.5, rel=1e-6)
    assert run.at(0.5)["left.stored_energy"] == pytest.approx(0.5 * 7.5**2, rel=1e-6)
    assert run.at(0.5)["clutch.loss_power"] == pytest.approx(5.0 * 5.0, rel=1e-6)


def test_a_time_far_from_every_result() -> None:
    """160 periods are thousands of steps, to a result as well as to a time in between."""

    class Swing(Component):
        x: Variable = var("1", "position", default=1.0)
        v: Variable = var("1/s", "velocity", default=0.0)
        w: Parameter = param("1/s", "angular frequency", default=1e3)

        def equations(self) -> Equations:
            yield der(self.x) == self.v
            yield der(self.v) == -(self.w**2) * self.x

    swing = simulate(Swing(), 2.0, points=1, rtol=1e-9, atol=1e-12)
    assert swing.at(1.0)["x"] == pytest.approx(np.cos(1000.0), abs=1e-4)
    assert swing.final["x"] == pytest.approx(np.cos(2000.0), abs=2e-4)


def test_unknown_names_are_told_with_a_suggestion(run):
    with pytest.raises(UnknownName, match=r"^Drive has no variable 'clutch\.tua'; did you mean 'clutch\.tau'\?"):
        run["clutch.tua"]
    assert "clutch.tua" not in run
    with pytest.raises(UnknownName):
        run.final["clutch.tua"]


def test_time_derivatives_by_name() -> None:
    """Of states, of what follows from them, and of what implicit equations determine, on both sides of an event."""
    run = simulate(Drive(), 2.0, rtol=1e-9)
    slides = run.time < 0.999
    np.testing.assert_allclose(run["der(left.w)"][slides], -5.0, rtol=1e-9)
    np.testing.assert_allclose(run["der(right.flange_a.phi)"], run["right.w"], rtol=1e-9, atol=1e-9)
    assert run["der(left.w)"][-1] == pytest.approx(0.0, abs=1e-12)
    assert run.at(0.5)["der(right.w)"] == pytest.approx(5.0, rel=1e-9)
    assert run.final["der(clutch.w_rel)"] == pytest.approx(0.0, abs=1e-12)
    drive = Drive()
    again = simulate(drive, 2.0)
    assert np.array_equal(again[der(drive.left.w)], again["der(left.w)"])
    assert "der(left.w)" in run
    assert "der(left.v)" not in run
    with pytest.raises(UnknownName, match=r"did you mean 'left\.w'"):
        run["der(left.v)"]


# -- events and grid -------------------------------------------------------------------------------------------------


def test_events_say_when_what_and_where(run):
    (event,) = run.events
    assert event.time == pytest.approx(1.0, abs=1e-10)
    assert (event.mode, event.before, event.after) == ("clutch.mode", "backward", "stuck")
    assert event.source.file.endswith("friction.py")
    assert str(event) == "1 s  clutch.mode: backward → stuck"


def grid(run: Solution) -> list[float]:
    """Expected times: equal intervals, and both sides of every event."""
    regular = [
        run.time[0] + (run.time[-1] - run.time[0]) * k / run.options.points for k in range(run.options.points + 1)
    ]
    moments = sorted({event.time for event in run.events})
    on_grid = [t for t in regular if not any(abs(t - m) < 1e-9 for m in moments)]
    return sorted([*on_grid, *moments, *moments])


@pytest.mark.parametrize("points", [1, 2, 3, 7, 8, 100, 499])
def test_the_grid_has_equal_intervals_and_both_sides_of_every_event(points):
    found = simulate(Drive(), 2.2, points=points)
    np.testing.assert_allclose(found.time, grid(found), rtol=0, atol=1e-9)
    assert len(found.time) == points + 1 + 2 * len(found.events)


def test_an_event_on_the_grid_takes_the_place_of_its_point():
    class Stepped(Component):
        push = TorqueStep(step_torque=1.0, start_time=0.5)
        rotor = Inertia(J=1.0, phi=0.0, w=0.0)

        def equations(self) -> Equations:
            yield from series(self.push, self.rotor)

    found = simulate(Stepped(), 1.0, points=4)
    assert list(found.time) == [0.0, 0.25, 0.5, 0.5, 0.75, 1.0]
    assert list(found["push.flange.tau"]) == [0, 0, 0, -1, -1, -1]


def test_both_sides_of_an_event_differ(run):
    k = np.flatnonzero(np.diff(run.time) == 0)[-1]
    assert run["clutch.mode"][k] != run["clutch.mode"][k + 1]
    assert run["clutch.tau"][k : k + 2] == pytest.approx([-5.0, 0.0], abs=1e-9)


# -- instants --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("t", [0.0, 0.123, 0.25, 0.999, 1.5, 2.0])
def test_at_integrates_to_the_instant(run, t):
    values = run.at(t)
    assert values.time == t
    expected = 10 - 5 * t if t < 1 else 5.0
    assert values["left.w"] == pytest.approx(expected, rel=1e-8)
    assert values["left.phi"] == pytest.approx(10 * t - 2.5 * t**2 if t < 1 else 7.5 + 5 * (t - 1), rel=1e-8)


def test_a_time_may_be_a_quantity(run):
    assert run.at("500 ms")["left.w"] == pytest.approx(7.5, rel=1e-8)
    with pytest.raises(UnitError, match="t expects s; '1 m' is m"):
        run.at("1 m")


def test_at_an_event_it_is_the_right_side(run):
    moment = run.events[0].time
    assert run.at(moment)["clutch.tau"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("t", [-0.1, 2.1, np.nan])
def test_an_instant_outside_the_run_is_refused(run, t):
    with pytest.raises(ValueOutOfRange, match="is not within the run, 0 s to 2 s"):
        run.at(t)


def test_the_final_values_are_a_mapping(drive, run):
    final = run.final
    assert set(final) == set(run.names)
    assert len(final) == len(run.names)
    assert final.time == 2.0
    assert dict(final)["left.w"] == final["left.w"] == final[drive.left.w] == run["left.w"][-1]
    assert final["clutch.mode"] == 1.0
    assert final["grip"] == final["clutch.capacity"] == 5.0


# -- tables and pickles ----------------------------------------------------------------------------------------------


def test_to_pandas(run):
    table = run.to_pandas()
    assert list(table.columns) == list(run.names)
    assert table.index.name == "time"
    assert np.array_equal(table["clutch.tau"].to_numpy(), run["clutch.tau"])


def test_to_xarray(run):
    data = run.to_xarray()
    assert data["clutch.tau"].attrs["units"] == "N.m"
    assert data["left.w"].attrs["long_name"] == "speed"
    assert np.array_equal(data["left.w"].values, run["left.w"])
    assert data["time"].attrs["units"] == "s"


def test_a_solution_pickles(run):
    twin = pickle.loads(pickle.dumps(run))
    assert np.array_equal(twin.time, run.time)
    for name in run.names:
        assert np.array_equal(twin[name], run[name])
    assert np.array_equal(twin["clutch.loss_power"], run["clutch.loss_power"])
    assert twin.events == run.events
    assert twin.at(0.3)["left.w"] == run.at(0.3)["left.w"]


def test_a_compiled_model_pickles():
    model = build(Drive())
    twin = pickle.loads(pickle.dumps(model))
    first, second = simulate(model, 1.5, points=5), simulate(twin, 1.5, points=5)
    assert np.array_equal(first.time, second.time)
    assert np.array_equal(first["left.w"], second["left.w"])
    assert np.array_equal(first["clutch.loss_power"], second["clutch.loss_power"])
    assert second.model.with_parameters({"grip": 2.0}).p[twin.parameter_position["grip"]] == 2.0


def test_statistics_and_representation(run):
    counts = run.statistics
    assert counts.events == 1
    assert counts.steps > 0
    assert counts.evaluations >= counts.steps
    assert counts.seconds > 0
    assert repr(run).startswith("<Solution of Drive: 21 variables") or "variables, t = 0 … 2 s, 1 mode changes" in repr(
        run
    )
    assert "CompiledDae Drive: 4 states" in repr(run.model)


# -- compile once, run often -----------------------------------------------------------------------------------------


def test_a_second_run_with_other_values_builds_nothing(monkeypatch):
    """An IDAS instance is kept for every number of results at once (powers of two), also for later values."""
    model = build(Drive())
    first = simulate(model, 2.0, points=8)
    for other in ({"grip": 9.0}, {"grip": 11.0, "left.J": 2.1}):  # all numbers of looks that are needed
        simulate(model, 2.0, points=8, parameters=other)
    built = len(model._cache)
    for module in (
        "modelica_like.simulation.flatten",
        "modelica_like.simulation.reduce",
        "modelica_like.simulation.compile",
    ):
        monkeypatch.setattr(module, lambda *_: pytest.fail("a stage ran again"))
    import casadi

    monkeypatch.setattr(casadi, "integrator", lambda *_: pytest.fail("an integrator was built again"))
    second = simulate(model, 2.0, points=8, parameters={"grip": "10 N.m", "left.J": 2.0})
    assert second.model._cache is model._cache
    assert len(model._cache) == built
    # 10 N.m on 2 and 1 kg.m2: the speeds meet after 10 / (5 + 10) s.
    assert second.events[0].time == pytest.approx(10 / 15, abs=1e-7)
    assert first.events[0].time == pytest.approx(1.0, abs=1e-7)
    assert np.array_equal(simulate(model, 2.0, points=8)["left.w"], first["left.w"])


def test_a_parameter_that_others_follow_from():
    model = build(Drive())
    found = simulate(model, 1.0, points=2, parameters={"half": 1.0})
    assert np.all(found["right.J"] == 2.0)


@pytest.mark.parametrize(
    ("values", "kind", "message"),
    [
        ({"gripp": 1.0}, UnknownName, "Drive has no parameter 'gripp'; did you mean 'grip'?"),
        ({"clutch.tau": 1.0}, UnknownName, "Drive has no parameter 'clutch.tau'"),
        ({"right.J": 1.0}, LanguageError, "right.J follows from other parameters."),
        ({"grip": "5 N"}, UnitError, "grip expects N.m; '5 N' is N."),
        ({"left.J": -1.0}, ValueOutOfRange, "left.J = -1.0 is out of range: it must be at least 0 kg.m2."),
        ({"half": -1.0}, ValueOutOfRange, "right.J = -2 is out of range: it must be at least 0 kg.m2."),
        ({"grip": float("nan")}, ValueOutOfRange, "grip must be a finite number, not nan."),
    ],
)
def test_wrong_parameter_values(values, kind, message):
    model = build(Drive())
    with pytest.raises(kind) as caught:
        model.with_parameters(values)
    assert message in caught.value.what


def test_a_parameter_that_is_not_tunable():
    class Frozen(Component):
        n: Parameter = param("1", "number", default=2.0, tunable=False)
        x: Variable = var("1", "x")

        def equations(self) -> Equations:
            yield self.x == self.n

    with pytest.raises(LanguageError, match=r"^n cannot change after compilation\."):
        build(Frozen()).with_parameters({"n": 3.0})


# -- options ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("until", ["0.5 s", "500 ms", 0.5])
def test_the_end_may_be_a_quantity(until):
    assert simulate(Drive(), until, points=1).time[-1] == 0.5


@pytest.mark.parametrize(
    ("arguments", "kind", "message"),
    [
        ({}, ValueOutOfRange, "There is no end time."),
        ({"until": "5 m"}, UnitError, "until expects s; '5 m' is m."),
        ({"until": 0.0}, ValueOutOfRange, "The end time 0 s is not after the start time 0 s."),
        ({"until": 1.0, "t0": 2.0}, ValueOutOfRange, "The end time 1 s is not after the start time 2 s."),
        (
            {"until": 1.0, "points": 0},
            ValueOutOfRange,
            "points = 0 is out of range: it must be between 1 and 10,000,000.",
        ),
        (
            {"until": 1.0, "points": 10_000_001},
            ValueOutOfRange,
            "points = 10,000,001 is out of range: it must be between 1 and 10,000,000.",
        ),
        ({"until": 1.0, "rtol": 1.0}, ValueOutOfRange, "rtol = 1 is out of range: it must be between 1e-14 and 0.1."),
        ({"until": 1.0, "atol": -1.0}, ValueOutOfRange, "atol = -1 is out of range: it must be between 1e-20 and 1."),
        ({"until": 1.0, "rtol": "1e-6"}, ValueOutOfRange, "simulate: rtol = '1e-6' is no number."),
        ({"until": 1.0, "points": 2.5}, ValueOutOfRange, "simulate: points = 2.5 is no whole number."),
        ({"until": float("nan")}, ValueOutOfRange, "until must be a finite number, not nan."),
        ({"until": float("inf")}, ValueOutOfRange, "until must be a finite number, not inf."),
    ],
)
def test_wrong_options(arguments, kind, message):
    with pytest.raises(kind) as caught:
        simulate(Drive(), **arguments)
    assert caught.value.what == message


def test_wrong_limits():
    with pytest.raises(ValueOutOfRange, match=r"^max_steps = 0 is out of range: it must be between 1 and 1,000,000,"):
        Options(max_steps=0)
    with pytest.raises(ValueOutOfRange, match=r"^iterations = 1\.5 is no whole number\.\nGive one, such as 1\.$"):
        Options(iterations=1.5)  # type: ignore[arg-type]


def test_arguments_win_over_options():
    found = simulate(Drive(), 0.5, options=Options(points=3, rtol=1e-5), points=2)
    assert (found.options.points, found.options.rtol) == (2, 1e-5)


def test_options_win_over_the_netlist():
    drive = loads(
        '[simulate]\nuntil = 0.1\nrtol = 1e-5\npoints = 7\n[parts]\nw = { is = "Inertia", J = 1, phi = 0, w = 1 }'
    )
    assert (simulate(drive).options.rtol, simulate(drive).options.points) == (1e-5, 7)
    found = simulate(drive, options=Options(rtol=1e-9))
    assert (found.options.rtol, found.options.points) == (1e-9, 7)


def test_progress_is_told():
    seen: list[float] = []
    simulate(Drive(), 2.0, points=50, progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 2.0
    assert connect is not None
