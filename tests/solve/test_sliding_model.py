"""Models with modes of sliding: which modes there are, and what holds in them, against numpy."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from modelica_like import build
from modelica_like.compile import CompiledDae
from modelica_like.compile.sliding import Pair, _borders, sliding
from modelica_like.compile.soon import time_resolution
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    all_of,
    any_of,
    boolean,
    clock,
    der,
    discrete,
    if_,
    param,
    var,
    when,
)

RETURN = 0.1
"""Time in s in which what slides comes back to its border."""


class Two(Component):
    """Two values with a border each, which act on each other; a flag, a sample and another mode look at them."""

    x: Variable = var("1", "one value")
    y: Variable = var("1", "another")
    u: Variable = var("1", "what acts on x", state="avoid")
    T: Parameter = param("s", "time", default=2.0)
    flag: Discrete = boolean("whether x is high")
    seen: Discrete = discrete("1", "u at ticks")
    one = Mode("up", "down")
    two = Mode("left", "right")
    level = Mode("low", "high")

    def equations(self) -> Equations:
        yield self.flag == (self.x > self.y**2)
        yield self.u == self.one.choose(up=2, down=-1) + if_(self.flag, 0.25, 0)
        yield self.T * der(self.x) == self.u + self.two.choose(left=0.5, right=0)
        yield self.T * der(self.y) == self.two.choose(left=1, right=-1.5) + 0.3 * self.u

    def events(self) -> Events:
        yield self.one.go("up", "down", when=self.x > self.y**2)
        yield self.one.go("down", "up", when=self.x < self.y**2)
        yield self.two.go("left", "right", when=2 * self.y + self.x > self.time / self.T)
        yield self.two.go("right", "left", when=2 * self.y + self.x < self.time / self.T)
        yield self.level.go("low", "high", when=any_of(self.u > 0.1, all_of(self.y > 1, self.u < -0.5)))
        yield self.level.go("high", "low", when=self.seen < -2, reset={self.y: self.u})
        yield when(clock(self.T), {self.seen: self.u})
        yield when(clock(3 * self.T), {self.y: self.x / 2})


def names(model: CompiledDae, borders: list[list[Pair]]) -> list[list[tuple[str, str, str]]]:
    """Mode, first and second value of all pairs."""
    discretes = model.flat_discretes
    return [
        [(discretes[p.mode].path, discretes[p.mode].names[p.first], discretes[p.mode].names[p.second]) for p in border]
        for border in borders
    ]


@pytest.fixture(scope="module")
def base() -> CompiledDae:
    return build(Two(x=1.0, y=0.0))


@pytest.fixture(scope="module")
def made(base: CompiledDae) -> CompiledDae:
    return sliding(base)


def test_pairs_with_one_border_are_together(base):
    """`flag` is a relation of its own, the other way round."""
    assert names(base, _borders(base)) == [
        [("one", "up", "down"), ("relation[1]", "false", "true")],
        [("two", "left", "right")],
    ]


class Plain(Component):
    """One border of three values, of which two may slide."""

    x: Variable = var("1", "value")
    T: Parameter = param("s", "time", default=2.0)
    more: str = ""
    out = Mode("up", "down", "off")

    def equations(self) -> Equations:
        drive = self.out.choose(up=1, down=-1, off=0)
        yield self.T * der(self.x) == (0 if self.more == "nothing" else drive)

    def events(self) -> Events:
        x = self.x * self.out.choose(up=1, down=1, off=0.5) if self.more == "itself" else self.x
        says: Any = {"notice": {"notice": "goes"}, "fails": {"notice": "ends", "fails": True}}
        says |= {"resets": {"reset": {self.x: 0}}}
        if self.more == "timed":
            yield self.out.go("up", "down", at=self.T)
            yield self.out.go("down", "up", at=2 * self.T)
        if self.more == "off":
            yield self.out.go("off", "up", when=x < 0)
        if self.more == "when":
            yield when(clock(self.T), {self.x: self.out.choose(up=1, down=2, off=3)})
        limit = {"shifted": 0.1, "almost": 1e-9}.get(self.more, 0)
        yield self.out.go("down", "up", when=x < 0, **says.get(self.more, {}))
        yield self.out.go("up", "down", when=x > limit)
        yield self.out.go("down", "off", when=x < -2)
        yield self.out.go("off", "down", when=x > 3)


@pytest.mark.parametrize("more", ["", "timed", "off"])
def test_values_with_opposite_guards_make_a_pair(more):
    model = build(Plain(x=1.0, more=more))
    assert names(model, _borders(model)) == [[("out", "down", "up")]]
    ((pair,),) = _borders(model)
    there, back = (model.events.transitions[k] for k in (pair.there, pair.back))
    assert (there.target, back.target, there.timed, back.timed) == (0, 1, False, False)
    assert (pair.first in there.sources, pair.second in back.sources, pair.number) == (True, True, 3)
    assert not np.isclose(there.index, back.index)


@pytest.mark.parametrize("more", ["notice", "fails", "resets", "shifted", "almost", "nothing", "itself", "when"])
def test_other_values_make_none(more):
    """A transition that says or resets something, guards that are not opposite, a mode without effect or on itself."""
    model = build(Plain(x=1.0, more=more))
    assert _borders(model) == []
    assert sliding(model) is model


def test_a_mode_that_holds_a_motion_does_not_slide():
    class Held(Component):
        v: Variable = var("1", "speed")
        f: Variable = var("1", "force")
        T: Parameter = param("s", "time", default=1.0)
        mode = Mode("free", "held", holds={"held": "v"})

        def equations(self) -> Equations:
            yield self.T * der(self.v) == self.f - 1
            yield self.mode.choose(free=self.f, held=self.T * der(self.v)) == 0

        def events(self) -> Events:
            yield self.mode.go("free", "held", when=self.v < 0)
            yield self.mode.go("held", "free", when=self.v > 0)

    assert _borders(build(Held(v=1.0))) == []


class Curved(Component):
    """The mode acts through an equation that stays implicit and is no straight line, or through a straight one."""

    x: Variable = var("1", "value")
    y: Variable = var("1", "what acts")
    T: Parameter = param("s", "time", default=2.0)
    k: Parameter = param("1", "curvature", default=0.1)
    on: str = "y"
    out = Mode("up", "down")

    def equations(self) -> Equations:
        drive = self.out.choose(up=1, down=-1)
        yield self.T * der(self.x) == (self.y if self.on == "y" else drive)
        yield self.y + self.k * self.y**5 == (drive if self.on == "y" else self.x)

    def events(self) -> Events:
        yield self.out.go("up", "down", when=self.x > 0)
        yield self.out.go("down", "up", when=self.x < 0)


@pytest.mark.parametrize(("on", "count"), [("y", 0), ("x", 1)])
def test_modes_act_through_straight_equations(on, count):
    model = build(Curved(x=1.0, on=on))
    assert model.implicit == ("y",)
    assert len(_borders(model)) == count


class Reference:
    """What holds in modes of sliding, by numbers from the model without them."""

    def __init__(self, base: CompiledDae, asked: tuple[bool, bool], seed: int) -> None:
        chance = np.random.default_rng(seed)
        self.base, self.borders, self.asked = base, _borders(base), asked
        self.t, self.x = float(chance.uniform(0.5, 3.0)), chance.normal(size=2)
        self.d = base.starts.discretes(self.t, self.x, [], base.p, base.u, np.zeros(base.discrete_size)).full().ravel()
        for border in self.borders:
            for pair in border:
                self.d[pair.mode] = pair.first
        self.d = self._followed(self.d)

    def _followed(self, d: Any) -> Any:
        """The flag follows its relation."""
        d = d.copy()
        d[self.base.discrete_position["flag"]] = d[self.base.discrete_position["relation[1]"]]
        return d

    def _in(self, number: int) -> Any:
        """Modes on the other side of one border."""
        d = self.d.copy()
        for pair in self.borders[number]:
            d[pair.mode] = pair.second
        return self._followed(d)

    def at(self, name: str, d: Any) -> Any:
        return self.base.functions[name](self.t, self.x, [], self.base.p, self.base.u, d).full().ravel()

    def turned(self) -> list[list[Pair]]:
        """The first border from its other side."""
        first = [replace(one, first=one.second, second=one.first) for one in self.borders[0]]
        for one in first:
            self.d[one.mode] = one.first
        self.d = self._followed(self.d)
        return [first, *self.borders[1:]]

    def gradients(self) -> tuple[Any, Any, Any]:
        """Values of x - y² and 2 y + x - t / T, their slopes by (x, y), and by time."""
        x, y = self.x
        values = np.array([x - y**2, 2 * y + x - self.t / 2.0])
        return values, np.array([[1, -2 * y], [1, 2]]), np.array([0, -1 / 2.0])

    def shares(self) -> Any:
        """Shares for which the borders that slide are approached: s' = -s / 0.1 s."""
        values, slopes, drift = self.gradients()
        ode = self.at("ode", self.d)
        matrix, wanted = np.eye(2), np.zeros(2)
        for row in np.flatnonzero(self.asked):
            matrix[row] = [slopes[row] @ (self.at("ode", self._in(k)) - ode) for k in range(2)]
            wanted[row] = -values[row] / RETURN - slopes[row] @ ode - drift[row]
        return np.linalg.solve(matrix, wanted)

    def mixed(self, name: str) -> Any:
        first = self.at(name, self.d)
        given = np.isfinite(first)  # infinity: a variable that is not set
        others = [self.at(name, self._in(k))[given] - first[given] for k in range(2)]
        first[given] += self.shares() @ others
        return first

    def sliding(self) -> Any:
        """Modes as the model with sliding has them."""
        d = self.d.copy()
        for slides, border in zip(self.asked, self.borders, strict=True):
            for pair in border:
                d[pair.mode] = pair.number if slides else pair.first
        return d


ASKED = pytest.mark.parametrize("asked", [(True, False), (False, True), (True, True), (False, False)])


@ASKED
@pytest.mark.parametrize("name", ["ode", "variables", "moments", "resets", "delays", "hold_terms"])
def test_everything_is_mixed_by_one_share_per_border(base, made, asked, name):
    for seed in range(3):
        one = Reference(base, asked, seed)
        found = made.functions[name](one.t, one.x, [], base.p, base.u, one.sliding()).full().ravel()
        np.testing.assert_allclose(found, one.mixed(name), rtol=1e-9, atol=1e-12)


@ASKED
def test_borders_that_slide_are_approached(base, made, asked):
    """By the slopes of the borders themselves, with no word about shares."""
    for seed in range(3):
        one = Reference(base, asked, seed)
        values, slopes, drift = one.gradients()
        ode = made.equations.ode(one.t, one.x, [], base.p, base.u, one.sliding()).full().ravel()
        rates = slopes @ ode + drift
        for slides, value, rate in zip(asked, values, rates, strict=True):
            assert not slides or rate == pytest.approx(-value / RETURN, rel=1e-9)


@ASKED
def test_what_follows_a_sliding_mode_has_its_first_value_and_samples_are_mixed(base, made, asked):
    for seed in range(3):
        one = Reference(base, asked, seed)
        found = made.events.updates(one.t, one.x, [], base.p, base.u, one.sliding()).full().ravel()
        rows = [row.reset for row in base.events.update_rows]
        targets = [base.flat_discretes[one.index].path if one.kind == "discrete" else one.kind for one in rows]
        values = dict(zip(targets, found, strict=True))
        assert values["state"] == np.inf
        assert values["flag"] == 0.0
        assert values["seen"] == pytest.approx(dict(zip(targets, one.mixed("updates"), strict=True))["seen"])


def entered(model: CompiledDae, at: Reference, offset: float) -> dict[str, str]:
    """Where every mode goes by its first open transition, with the first border at a distance."""
    x = at.x.copy()
    x[0] += offset - (x[0] - x[1] ** 2)
    d, found = at.sliding(), dict[str, str]()
    now, soon = (
        model.functions[name](at.t, x, [], model.p, model.u, d).full().ravel() for name in ("guards", "guards_soon")
    )
    plain = [one for one in model.events.transitions if not one.timed]
    assert sorted(one.index for one in plain) == [*range(len(now))]
    for one in plain:
        if d[one.mode] in one.sources and now[one.index] > 0 and soon[one.index] > 0:
            discrete = model.flat_discretes[one.mode]
            found.setdefault(discrete.path, discrete.names[one.target])
    return found


OWN = ("one", "relation[1]")
SLIDE, UP, DOWN = ("up ⇄ down", "false ⇄ true"), ("up", "false"), ("down", "true")


@pytest.mark.parametrize("side", [1, -1])
def test_near_a_border_that_leads_back_modes_slide(base, made, side):
    """Within ten changes of the time resolution; a mode that has jumped further goes to the other one."""
    at = next(one for one in (Reference(base, (False, False), seed) for seed in range(99)) if _leads_back(one))
    if side < 0:
        at.borders = at.turned()
    step = side * time_resolution(at.t)

    def goes(distance: float) -> tuple[Any, ...]:
        found = entered(made, at, distance * step)
        return tuple(found.get(name) for name in OWN)

    assert goes(-100) == (None, None)
    assert goes(0.5) == SLIDE
    assert goes(1000) == (DOWN if side > 0 else UP)


def test_what_slides_stays_until_it_is_far_away(base, made):
    at = next(one for one in (Reference(base, (True, False), seed) for seed in range(99)) if _leads_back(one))
    step = time_resolution(at.t)
    for distance in (0.0, 100 * step, -100 * step):
        assert not {*OWN} & entered(made, at, distance).keys()
    for distance, values in ((1e6 * step, DOWN), (-1e6 * step, UP)):
        found = entered(made, at, distance)
        assert tuple(found.get(name) for name in OWN) == values


def test_where_one_mode_leads_away_it_goes_there(base, made):
    """The share of a mode is no longer between 0 and 1."""
    ones = [one for one in (Reference(base, (True, False), seed) for seed in range(30)) if not _leads_back(one)]
    ways = set[tuple[Any, ...]]()
    for one in ones:
        share = one.shares()[0]
        if abs(share) > 1e-3 and abs(share - 1) > 1e-3:
            found = entered(made, one, 0.0)
            ways.add(way := tuple(found.get(name) for name in OWN))
            assert way == (DOWN if share > 1 else UP if share < 0 else (None, None))
    assert ways >= {UP, DOWN}


@pytest.mark.parametrize(("way", "values"), [(1, DOWN), (-1, (None, None))])
def test_where_both_modes_lead_on_the_border_is_passed_at_once(base, made, way, values):
    """Or not at all, where they lead back from what is left of sliding."""
    ones = [one for one in (Reference(base, (False, False), seed) for seed in range(30)) if _lead_on(one, way)]
    assert ones
    for one in ones:
        found = entered(made, one, 0.5 * time_resolution(one.t))
        assert tuple(found.get(name) for name in OWN) == values


def _lead_on(one: Reference, way: int) -> bool:
    return all(way * rate > 0.1 for rate in _rates(one))


def _leads_back(one: Reference) -> bool:
    before, after = _rates(one)
    return before > 0.1 and after < -0.1


def _rates(one: Reference) -> list[float]:
    """Put it on the first border; return how fast both modes lead across."""
    one.x[0] = one.x[1] ** 2
    _, slopes, drift = one.gradients()
    return [float(slopes[0] @ one.at("ode", d) + drift[0]) for d in (one.d, one._in(0))]
