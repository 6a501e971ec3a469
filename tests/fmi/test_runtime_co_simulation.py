"""Co-Simulation: the same trajectory as IDAS, whatever the communication steps."""

import itertools
import threading

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from components import Fixed, Inertia, Spring, Torque
from modelica_like import simulate
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Input,
    Mode,
    Parameter,
    Variable,
    connect,
    der,
    discrete,
    param,
    pre,
    series,
    signal_in,
    var,
    when,
)

CLUTCHES = "msl/rotational/CoupledClutches.toml"
DRIVES = [
    (CLUTCHES, 1.5),
    ("msl/rotational/Friction.toml", 3.0),
    ("msl/rotational/Backlash.toml", 1.0),
    ("msl/rotational/LossyGearDemo1.toml", 0.5),
    ("dc_bench.toml", 2.0),
]


def largest_error(fmu, case, reference, until, steps):
    """Largest deviation of all states at the communication points, relative to each one's range."""
    names = [name for name in case.model.states if name in case.face.by_name]
    found, exact = [], []
    for k in range(steps):
        fmu.doStep(until * k / steps, until / steps)
        found.append(case.states(fmu))
        here = reference.at(until * (k + 1) / steps)
        exact.append([here[name] for name in names])
    scale = np.maximum(np.ptp(exact, axis=0), 1.0)
    return np.max(np.abs(np.array(found) - exact) / scale)


@pytest.mark.parametrize(("netlist", "until"), DRIVES, ids=[name for name, _ in DRIVES])
def test_the_trajectory_is_that_of_idas(exported, netlist, until):
    case = exported(netlist)
    fmu = case.started(until=until)
    reference = simulate(case.model, until, rtol=1e-10, atol=1e-12, points=200)
    assert largest_error(fmu, case, reference, until, 50) < 1e-6
    fmu.freeInstance()


def run(case, fmu, points):
    """States at communication points."""
    rows = []
    for first, last in itertools.pairwise(points):
        fmu.doStep(first, last - first)
        rows.append(case.states(fmu))
    return np.array(rows)


def test_communication_steps_do_not_matter(exported):
    case = exported(CLUTCHES)
    until = 1.5
    whole = case.started(until=until)
    whole.doStep(0.0, until)
    end = np.array(case.states(whole))
    random = np.random.default_rng(3)
    for points in (np.linspace(0, until, 1001), np.concatenate([[0], np.sort(random.uniform(0, until, 300)), [until]])):
        fmu = case.started(until=until)
        assert np.allclose(run(case, fmu, points)[-1], end, rtol=1e-12, atol=1e-13)


def test_steps_of_a_microsecond(exported):
    case = exported(CLUTCHES)
    start, count = 0.5, 20_000
    coarse, fine = case.started(until=1.5), case.started(until=1.5)
    for fmu in (coarse, fine):
        fmu.doStep(0.0, start)
    points = start + 1e-6 * np.arange(count + 1)
    for first, last in itertools.pairwise(points):
        fine.doStep(first, last - first)
    coarse.doStep(start, points[-1] - start)
    assert case.states(fine) == pytest.approx(case.states(coarse), rel=1e-12, abs=1e-14)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8])
def test_errors_follow_the_tolerance(exported, tolerance):
    case = exported("msl/rotational/Friction.toml")
    reference = simulate(case.model, 3.0, rtol=1e-11, atol=1e-13)
    fmu = case.started(until=3.0, tolerance=tolerance)
    fmu.doStep(0.0, 3.0)
    exact = [reference.final[name] for name in case.model.states]
    assert case.states(fmu) == pytest.approx(exact, rel=10 * tolerance, abs=10 * tolerance)


def test_start_values_are_honoured(exported):
    case = exported(CLUTCHES)
    other = {"J1.J": 3.0, "J1.w": 5.0}
    reference = simulate(case.model.with_parameters({"J1.J": 3.0}), 1.0, rtol=1e-10, atol=1e-12)
    fmu = case.started(until=1.0, **{"J1.J": 3.0})
    fmu.doStep(0.0, 1.0)
    names = case.model.states
    assert case.states(fmu) == pytest.approx([reference.final[name] for name in names], rel=1e-7, abs=1e-7)
    fast = case.started(until=1.0, **other)
    assert fast.getReal([case.ref("J1.w")]) == [5.0]


class Counts(Component):
    """Counts and doubles at its own times."""

    x: Variable = var("s", "time since the start", default=0.0)
    n: Discrete = discrete("1", "count", start=2.0)
    d: Discrete = discrete("1", "doubled", start=4.0)
    t_count: Parameter = param("s", default=0.5)
    t_double: Parameter = param("s", default=0.7)
    lamp = Mode("off", "red", "green")

    def equations(self) -> Equations:
        yield der(self.x) == 1.0

    def events(self) -> Events:
        yield when(self.x > self.t_count, {self.n: pre(self.n) + 1})
        yield when(self.x > self.t_double, {self.d: 2 * pre(self.d)})
        yield self.lamp.go("off", "red", when=self.x > self.t_count)


COUNTS = Counts()


@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize("kind", ["cs", "me"])
@pytest.mark.parametrize("early", [True, False])
def test_start_values_of_discrete_variables_are_honoured(exported, version, kind, early):
    case = exported(COUNTS, version)
    fmu, given, of_reals = case.instance(kind), {"n": 10.0, "d": 7.0}, [case.ref("n"), case.ref("d")]
    reals, set_reals = (fmu.getReal, fmu.setReal) if version == "2.0" else (fmu.getFloat64, fmu.setFloat64)
    if early:
        set_reals(of_reals, [*given.values()])
    case.initialize(fmu, until=1.0, **({} if early else given))
    assert list(reals(of_reals)) == [10.0, 7.0]
    if kind == "cs":
        fmu.doStep(0.0, 1.0)
        assert list(reals(of_reals)) == [10 + 1, 2 * 7]
    fmu.reset()
    case.initialize(fmu, until=1.0)
    assert list(reals(of_reals)) == [2.0, 4.0]


def test_modes_that_were_given_are_those_of_the_start(exported):
    case = exported(COUNTS, "3.0")
    fmu = case.instance()
    fmu.setInt64([case.ref("lamp")], [2])
    case.initialize(fmu, until=1.0)
    fmu.doStep(0.0, 1.0)
    assert list(fmu.getInt64([case.ref("lamp")])) == [2]


def logged(case, categories, until, **instantiate):
    """Messages of a run by one step, as (category, text)."""
    lines = []

    def keep(_environment, _status, category, message):
        lines.append((category.decode(), message.decode()))

    fmu = case.instance(logMessage=keep, **instantiate)
    fmu.setDebugLogging(True, categories)
    case.initialize(fmu, until=until)
    fmu.doStep(0.0, until)
    fmu.freeInstance()
    return lines


def test_events_are_told_in_their_order(exported):
    case = exported(CLUTCHES, "3.0")
    reference = simulate(case.model, 1.5, rtol=1e-10, atol=1e-12)
    lines = [text.removeprefix("t = ").split(" s: ") for _, text in logged(case, ["logEvents"], 1.5)]
    assert [text for _, text in lines] == [f"{e.mode}: {e.before} -> {e.after}" for e in reference.events]
    assert [float(time) for time, _ in lines] == pytest.approx([e.time for e in reference.events], abs=1e-6)


def test_error_control_is_seen_in_the_log(exported):
    case = exported(CLUTCHES, "3.0")
    lines = [text for category, text in logged(case, ["logIntegrator"], 1.5) if category == "logIntegrator"]
    errors = [float(line.split("error ")[1].split()[0]) for line in lines]
    assert len(lines) > 50
    assert max(errors) <= 1.0


def test_a_state_copied_back_gives_the_same_bits(exported):
    for version in ("2.0", "3.0"):
        case = exported(CLUTCHES, version)
        fmu = case.started(until=1.5)
        fmu.doStep(0.0, 0.7)
        get, put = (fmu.getFMUstate, fmu.setFMUstate) if version == "2.0" else (fmu.getFMUState, fmu.setFMUState)
        copy = get()
        first = run(case, fmu, np.linspace(0.7, 1.5, 30))
        put(copy)
        assert np.array_equal(run(case, fmu, np.linspace(0.7, 1.5, 30)), first)
        if version == "2.0":
            put(copy)
            number = fmu.serializeFMUstate(copy)
            twin = case.started(until=1.5)
            twin.setFMUstate(twin.deSerializeFMUstate(number))
            assert np.array_equal(run(case, twin, np.linspace(0.7, 1.5, 30)), first)


def test_instances_in_threads_do_not_know_each_other(exported):
    case = exported(CLUTCHES)
    results = {}

    def work(number):
        fmu = case.started(until=1.0, **{"J1.J": 1.0 + number})
        results[number] = run(case, fmu, np.linspace(0, 1.0, 11))

    threads = [threading.Thread(target=work, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    together = dict(results)
    for number in range(4):
        work(number)
        assert np.array_equal(results[number], together[number])


def test_reset_gives_a_new_run(exported):
    case = exported(CLUTCHES)
    fmu = case.started(until=1.0, **{"J1.J": 3.0})
    fmu.doStep(0.0, 0.9)
    fmu.reset()
    case.initialize(fmu, until=1.0)
    assert np.array_equal(run(case, fmu, [0.0, 0.5, 1.0]), run(case, case.started(until=1.0), [0.0, 0.5, 1.0]))


def test_event_mode_and_early_return(exported):
    case = exported(CLUTCHES, "3.0")
    reference = simulate(case.model, 1.5, rtol=1e-10, atol=1e-12)
    fmu = case.instance(eventModeUsed=True, earlyReturnAllowed=True)
    case.initialize(fmu, until=1.5)
    times, time = [], 0.0
    fmu.updateDiscreteStates()
    fmu.enterStepMode()
    while time < 1.5:
        event, terminate, early, time = fmu.doStep(time, 1.5 - time)
        assert not terminate
        assert early == (time < 1.5)
        if event:
            times.append(time)
            fmu.enterEventMode()
            assert not fmu.updateDiscreteStates()[0]
            fmu.enterStepMode()
    assert times == pytest.approx(sorted({round(e.time, 9) for e in reference.events if e.time > 0}), abs=1e-6)
    exact = [reference.final[name] for name in case.model.states]
    assert case.states(fmu) == pytest.approx(exact, rel=1e-7, abs=1e-7)


def test_intermediate_updates_follow_the_steps_and_may_return_early(exported):
    case = exported(CLUTCHES, "3.0")
    seen = []

    def update(_environment, time, _set, _get, _finished, can_return_early, early, until):
        seen.append(time)
        assert can_return_early
        if time > 0.6:
            early[0], until[0] = True, time

    fmu = case.instance(earlyReturnAllowed=True, intermediateUpdate=update)
    case.initialize(fmu, until=1.5)
    _, _, early, time = fmu.doStep(0.0, 1.0)
    assert early
    assert time == seen[-1] > 0.6
    assert seen == sorted(seen)
    assert len(seen) > 20


class Driven(Component):
    """Mass of 2 kg.m2 under a torque from outside, with a brake that sticks until 1 N.m."""

    tau: Input = signal_in("N.m", "torque")
    rotor = Inertia(J=2.0, phi=0.0, w=0.0)
    source = Torque()

    def equations(self) -> Equations:
        yield from series(self.source, self.rotor)
        yield connect(self.tau, self.source.tau)


DRIVEN = Driven()


@pytest.mark.parametrize("slope_first", [False, True])
def test_inputs_on_straight_lines_are_exact(exported, slope_first):
    case = exported(DRIVEN)
    fmu = case.started(until=1.0, tau=0.0)
    torque, speed, angle = case.ref("tau"), case.ref("rotor.w"), case.ref("rotor.phi")
    for k in range(10):
        if slope_first:
            fmu.setRealInputDerivatives([torque], [1], [3.0])
        fmu.setReal([torque], [0.3 * k])
        if not slope_first:
            fmu.setRealInputDerivatives([torque], [1], [3.0])
        fmu.doStep(k / 10, 0.1)
    # 2 w' = 3 t
    assert fmu.getReal([speed, angle]) == pytest.approx([0.75, 0.25], rel=1e-9)
    assert fmu.getRealOutputDerivatives([speed, angle], [1, 1]) == pytest.approx([1.5, 0.75], rel=1e-9)


def test_inputs_move_at_intermediate_updates(exported):
    """2 w' = tau, where tau = 4 - 3 w is given anew whenever an internal step has ended."""
    case = exported(DRIVEN, "3.0")
    torque, speed = [case.ref("tau")], [case.ref("rotor.w")]
    given, requested = [(0.0, 4.0)], []

    def update(_environment, time, asked, _get, _finished, _can, _early, _until):
        requested.append(asked)
        given.append((time, 4.0 - 3.0 * fmu.getFloat64(speed)[0]))
        fmu.setFloat64(torque, [given[-1][1]])

    fmu = case.instance(intermediateUpdate=update, requiredIntermediateVariables=torque)
    case.initialize(fmu, until=1.0, tau=4.0)
    for k in range(10):
        fmu.doStep(k / 10, 0.1)
    times, values = np.transpose(given)
    exact = np.sum(values * np.diff([*times, 1.0])) / 2
    assert all(requested)
    assert len(given) > 10
    assert fmu.getFloat64(speed) == pytest.approx([exact], rel=1e-12)
    assert len(set(values)) > 5


def test_held_inputs_jump_between_steps(exported):
    case = exported(DRIVEN)
    fmu = case.started(until=2.0, tau=4.0)
    speed = case.ref("rotor.w")
    fmu.doStep(0.0, 0.5)
    fmu.setReal([case.ref("tau")], [-2.0])
    for k in range(15):
        fmu.doStep(0.5 + k / 10, 0.1)
    assert fmu.getReal([speed]) == pytest.approx([0.5 * 2.0 - 1.5 * 1.0], rel=1e-9)


def test_a_wrong_input_derivative_is_refused(exported):
    case = exported(DRIVEN)
    fmu = case.started(until=1.0)
    for reference, order, value in (("tau", 2, 1.0), ("rotor.w", 1, 1.0), ("tau", 1, float("nan"))):
        with pytest.raises(FMICallException):
            fmu.setRealInputDerivatives([case.ref(reference)], [order], [value])


def test_a_tunable_parameter_changes_between_steps(exported):
    case = exported(DRIVEN)
    fmu = case.started(until=2.0, tau=4.0)
    fmu.doStep(0.0, 1.0)
    fmu.setReal([case.ref("rotor.J")], [4.0])
    fmu.doStep(1.0, 1.0)
    assert fmu.getReal([case.ref("rotor.w")]) == pytest.approx([3.0], rel=1e-9)


def test_a_parameter_out_of_range_is_refused_and_changes_nothing(exported):
    case = exported(DRIVEN)
    fmu = case.started(until=2.0)
    for value in (-1.0, float("nan"), float("inf")):
        with pytest.raises(FMICallException):
            fmu.setReal([case.ref("rotor.J")], [value])
    assert fmu.getReal([case.ref("rotor.J")]) == [2.0]


def test_values_before_the_initialization_are_refused(exported):
    case = exported(DRIVEN)
    fmu = case.instance()
    with pytest.raises(FMICallException):
        fmu.getReal([case.ref("rotor.w")])
    case.initialize(fmu, until=1.0)
    assert fmu.getReal([case.ref("rotor.w")]) == [0.0]


class Still(Component):
    """Nothing moves: a spring between two walls, without states."""

    left, spring, right = Fixed(), Spring(c=2.0), Fixed(phi0=0.5)

    def equations(self) -> Equations:
        yield from series(self.left, self.spring, self.right)


STILL = Still()


def test_a_model_without_states(exported):
    case = exported(STILL)
    fmu = case.started(until=2.0)
    assert case.model.states == ()
    for k in range(4):
        fmu.doStep(0.5 * k, 0.5)
    assert fmu.getReal([case.ref("spring.tau"), case.ref("time")]) == [1.0, 2.0]
