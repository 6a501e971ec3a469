"""Random hybrid automata against exact arithmetic: variables that run at constant rates, thresholds, resets."""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from modelica_like import simulate
from modelica_like.errors import Chattering
from modelica_like.language import Assembly, Component, Equations, Events, Mode, Parameter, Variable, der, param, var

END = Fraction(401, 97)
"""No event lies there: their times are multiples of 1/48."""


@dataclass(frozen=True)
class Rule:
    """In mode `source`, when x passes `level` upwards or downwards: go to `target`, set x unless `reset` is None."""

    source: int
    target: int
    level: Fraction
    upwards: bool
    reset: Fraction | None

    def guard(self, x: Fraction) -> Fraction:
        return x - self.level if self.upwards else self.level - x


Plan = tuple[tuple[int, ...], tuple[Rule, ...]]


class Automaton(Component):
    plan: Plan = ((1, 1, 1), ())
    mode = Mode("a", "b", "c")
    x: Variable = var("s", "runs at a constant rate in each mode")
    unit: Parameter = param("s", "unit", default=1.0)

    def equations(self) -> Equations:
        yield der(self.x) == self.mode.choose(
            **{name: float(rate) for name, rate in zip("abc", self.plan[0], strict=True)}
        )

    def events(self) -> Events:
        for rule in self.plan[1]:
            level = float(rule.level) * self.unit
            condition = self.x > level if rule.upwards else self.x < level
            reset = {} if rule.reset is None else {self.x: float(rule.reset) * self.unit}
            yield self.mode.go("abc"[rule.source], "abc"[rule.target], when=condition, reset=reset)


def by_hand(plan: Plan, x: Fraction) -> list[tuple[Fraction, str]] | None:
    """Times and new modes, exactly; None if modes switch on without end."""
    rates, rules = plan
    mode, t, found, rounds = 0, Fraction(0), [], 0
    while True:
        active = [rule for rule in rules if rule.source == mode]
        speed = {rule: rates[mode] if rule.upwards else -rates[mode] for rule in active}
        # A guard that is zero counts by its direction.
        now = [r for r in active if r.guard(x) > 0 or (r.guard(x) == 0 and speed[r] > 0)]
        if now:
            rounds += 1
            if rounds >= 20:
                return None
        else:
            rounds = 0
            ahead = [(-r.guard(x) / speed[r], k, r) for k, r in enumerate(active) if speed[r] > 0]
            if not ahead or t + min(ahead)[0] >= END:
                return found
            wait, _, rule = min(ahead, key=lambda one: one[:2])
            t, x, now = t + wait, x + rates[mode] * wait, [rule]
            rounds = 1
        rule = now[0]
        mode = rule.target
        x = x if rule.reset is None else rule.reset
        found.append((t, "abc"[mode]))
        if len(found) > 60:
            return None


eighths = st.integers(-8, 8).map(lambda k: Fraction(k, 8))
rules = st.builds(Rule, st.integers(0, 2), st.integers(0, 2), eighths, st.booleans(), st.none() | eighths)
plans = st.tuples(
    st.tuples(*[st.sampled_from([-2, -1, 1, 2, 3])] * 3),
    st.lists(rules, min_size=1, max_size=5, unique=True).map(tuple),
)


@given(plans, plans, eighths, st.sampled_from([1, 7, 50]))
@settings(deadline=None, max_examples=50)
def test_two_automata_beside_each_other(first, second, x, points):
    expected = {"one": by_hand(first, x), "two": by_hand(second, -x)}
    parts = {"one": Automaton(plan=first, x=float(x)), "two": Automaton(plan=second, x=float(-x))}
    try:
        run = simulate(Assembly("pair", parts=parts), float(END), points=points)
    except Chattering:
        assert None in expected.values()
        return
    for name, story in expected.items():
        if story is None:
            continue
        events = [event for event in run.events if event.mode == f"{name}.mode"]
        assert [event.after for event in events] == [mode for _, mode in story]
        np.testing.assert_allclose([event.time for event in events], [float(t) for t, _ in story], rtol=0, atol=1e-9)
