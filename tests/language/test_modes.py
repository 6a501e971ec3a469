"""Modes, transitions, and functions of expressions."""

import casadi as ca
import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from modelica_like.errors import LanguageError, UnknownName
from modelica_like.flatten import flatten
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Mode,
    Variable,
    absolute,
    all_of,
    any_of,
    atan2,
    cos,
    discrete,
    exp,
    interpolate,
    log,
    maximum,
    minimum,
    negate,
    sign,
    sin,
    sqrt,
    tan,
    tanh,
    var,
    where,
)


class Valve(Component):
    x: Variable = var("1", "x")
    y: Variable = var("1", "y")
    n: Discrete = discrete("1", "count", start=2.0)
    gate = Mode("shut", "ajar", "open", start="ajar")

    def equations(self) -> Equations:
        yield self.x == 1
        yield self.y == self.gate.choose(shut=0, ajar=self.x, open=2 * self.x)


def value(expression: object, **given: float) -> float:
    symbols = ca.symvar(ca.SX(expression))
    return float(ca.Function("f", [ca.vertcat(*symbols)], [ca.SX(expression)])([given[s.name()] for s in symbols]))


def test_choose_takes_the_branch_of_the_mode_and_no_other():
    valve = Valve()
    chosen = valve.gate.choose(shut=1 / (valve.x - valve.x * 1), ajar=sqrt(-valve.x), open=log(valve.x - valve.x) + 3)
    assert np.isnan(value(chosen, gate=1, x=1.0))
    safe = valve.gate.choose(shut=7, ajar=1 / valve.x, open=log(valve.x))
    assert [value(safe, gate=k, x=0.0) for k in (0, 1)] == [7.0, np.inf]
    # The branch that is not taken may be infinite or undefined: products with zero would give nan here.
    assert value(valve.gate.choose(shut=7, ajar=1 / valve.x, open=log(-1 + valve.x)), gate=0, x=0.0) == 7.0


def test_choose_needs_every_mode_or_otherwise():
    valve = Valve()
    with pytest.raises(LanguageError, match=r"Valve.gate.choose\(\) lacks an expression for ajar, open"):
        valve.gate.choose(shut=0)
    expression = valve.gate.choose(shut=5, otherwise=valve.x)
    assert [value(expression, gate=k, x=3.0) for k in range(3)] == [5.0, 3.0, 3.0]


def test_choose_refuses_a_mode_that_does_not_exist():
    with pytest.raises(UnknownName, match=r"Valve.gate has no mode 'opne'; did you mean 'open'\?"):
        Valve().gate.choose(shut=0, ajar=1, open=2, opne=3)


def test_is_compares_with_any_of_the_names():
    valve = Valve()
    assert [value(valve.gate.is_("shut", "open"), gate=k) for k in range(3)] == [1, 0, 1]
    with pytest.raises(UnknownName):
        valve.gate.is_("closed")


def test_a_mode_is_not_compared_with_a_text():
    gate = Valve().gate
    with pytest.raises(LanguageError) as caught:
        where(gate == "open", 1, 0)
    said, place, advice = str(caught.value).splitlines()
    assert said == 'Valve.gate == "open" is no condition: the mode changes while the model runs.'
    assert place.endswith('`gate == "open"`')
    assert advice == 'Write self.gate.is_("open").'
    assert gate != 1


def test_go_takes_one_name_a_tuple_or_all():
    valve = Valve()
    condition = valve.x > 1
    assert valve.gate.go("shut", "open", when=condition).sources == ("shut",)
    assert valve.gate.go(("shut", "ajar"), "open", when=condition).sources == ("shut", "ajar")
    assert valve.gate.go("*", "open", when=condition).sources == ("shut", "ajar", "open")


@pytest.mark.parametrize("names", [("shutt", "open"), ("shut", "opn"), (("shut", "ajr"), "open")])
def test_go_refuses_unknown_modes(names):
    valve = Valve()
    with pytest.raises(UnknownName, match=r"Valve.gate has no mode '.*'; did you mean"):
        valve.gate.go(*names, when=valve.x > 1)


def test_go_needs_when_or_at():
    valve = Valve()
    for arguments in ({}, {"when": valve.x > 1, "at": 1.0}):
        with pytest.raises(LanguageError, match="needs either `when=` or `at=`"):
            valve.gate.go("shut", "open", **arguments)


def with_event(event: object) -> Component:
    class Eventful(Valve):
        def events(self) -> Events:
            yield event(self)  # type: ignore[operator]

    return Eventful()


@pytest.mark.parametrize(
    ("event", "message"),
    [
        (lambda c: c.x > 1, "Eventful.events() yields SX instead of a transition."),
        (lambda c: None, "Eventful.events() yields NoneType instead of a transition."),
        (lambda c: c.gate.go("shut", "open", when=c.x), "The condition of a transition is not a relation."),
        (lambda c: c.gate.go("shut", "open", when=True), "The condition of a transition is not a relation."),
        (lambda c: c.gate.go("shut", "open", at=c.x), "Eventful: the time of an event depends on"),
        (lambda c: c.gate.go("shut", "open", at=c.time + 1), "Eventful: the time of an event depends on"),
        (lambda c: c.gate.go("shut", "open", when=c.x > 1, reset={c.gate.symbol: 1}), "reset"),
        (lambda c: c.gate.go("shut", "open", when=c.x > 1, reset={2 * c.x: 1}), "reset"),
    ],
)
def test_events_that_mean_nothing_are_refused(event, message):
    with pytest.raises(LanguageError) as caught:
        flatten(with_event(event))
    assert message in caught.value.what
    assert caught.value.where[0].file == __file__


POINTS = {"x": 0.3, "y": -1.7}


@pytest.mark.parametrize(
    ("function", "expected"),
    [
        (lambda x, y: sin(x) + cos(y) + tan(x), np.sin(0.3) + np.cos(-1.7) + np.tan(0.3)),
        (lambda x, y: exp(x) + log(x) + sqrt(x) + tanh(y), np.exp(0.3) + np.log(0.3) + np.sqrt(0.3) + np.tanh(-1.7)),
        (lambda x, y: absolute(y) + sign(y) + sign(x) + sign(0), 1.7 - 1 + 1 + 0),
        (lambda x, y: minimum(x, y) + 10 * maximum(x, y), -1.7 + 3.0),
        (lambda x, y: atan2(y, x), np.arctan2(-1.7, 0.3)),
        (lambda x, y: where(x > y, 5, 7) + where(x < y, 50, 70), 75),
        (lambda x, y: where(x > 0, x, sqrt(y)), 0.3),
        (lambda x, y: all_of(x > 0, y < 0, x < 1) + 2 * any_of(x < 0, y > 0) + 4 * negate(x < 0), 5),
    ],
)
def test_functions(function, expected):
    valve = Valve()
    assert value(function(valve.x, valve.y), **POINTS) == pytest.approx(expected, rel=1e-15)


XS, YS = [0.0, 1.0, 2.5, 4.0, 5.0], [0.0, 2.0, 2.0, 3.5, 1.0]


def test_linear_interpolation_goes_through_the_points_and_on_along_the_last_slope():
    valve = Valve()
    table = interpolate(valve.x, XS, YS)
    inside = np.linspace(0, 5, 41)
    assert [value(table, x=x) for x in inside] == pytest.approx(np.interp(inside, XS, YS), rel=1e-12)
    assert value(table, x=-1.0) == pytest.approx(-2.0)
    assert value(table, x=6.0) == pytest.approx(-1.5)


def test_smooth_interpolation_has_no_overshoot_and_a_continuous_slope():
    valve = Valve()
    table = interpolate(valve.x, XS, YS, smooth=True)
    inside = np.linspace(0, 5, 101)
    mine = np.array([value(table, x=x) for x in inside])
    # SciPy's monotone cubic has the same slopes at inner points (Fritsch-Butland); at the ends it takes others.
    reference = PchipInterpolator(XS, YS)(inside)
    middle = (inside >= 1) & (inside <= 4)
    assert mine[middle] == pytest.approx(reference[middle], abs=1e-12)
    assert mine.max() <= 3.5 + 1e-12
    slope = ca.Function("slope", [valve.x], [ca.jacobian(table, valve.x)])
    for x in XS:
        assert float(slope(x - 1e-9)) == pytest.approx(float(slope(x + 1e-9)), abs=1e-6)


def test_a_table_with_one_point_is_constant():
    assert value(interpolate(Valve().x, [3.0], [2.0]), x=9.0) == 2.0


@pytest.mark.parametrize(("xs", "ys"), [([0, 1], [1]), ([0, 0], [1, 2]), ([1, 0], [1, 2]), ([], [])])
def test_wrong_tables_are_refused(xs, ys):
    with pytest.raises(LanguageError, match="A table has the abscissae"):
        interpolate(Valve().x, xs, ys)
