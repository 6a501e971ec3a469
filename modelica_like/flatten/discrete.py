"""Discrete equations of a component: what its discrete variables become at events, and what its relations need."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, cast

import casadi as ca

from modelica_like.errors import LanguageError, Source, did_you_mean
from modelica_like.flatten.at_once import at_once, between_events
from modelica_like.flatten.steps import with_events
from modelica_like.language.component import Component
from modelica_like.language.delay import Part, parts
from modelica_like.language.discrete import (
    INITIAL,
    Assertion,
    Ending,
    Marker,
    Pre,
    When,
    edge,
    eventful,
    is_a,
    is_fixed,
    moves,
)  # fmt: skip
from modelica_like.language.equation import Equation
from modelica_like.language.expr import TIME, Expr, Symbol, is_expression, symbol_of, symbols_in
from modelica_like.language.fields import Discrete, Input, Variable
from modelica_like.language.inside import inside
from modelica_like.language.mode import BoundMode, Mode, StartMode, Transition
from modelica_like.language.transition import NAME_IN_NOTICE

Located = tuple[Any, Source]
_ONE: Any = ca.SX(1)
_PLAIN = {"sample": "{} itself", "previous": "pre({}), the value before an event"}


@dataclass(frozen=True)
class Hidden:
    """A discrete value that relations and edges need: a mode if it has names."""

    path: str
    description: str
    names: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Update:
    """A new value at events.

    Attributes:
        target: a discrete variable, or a variable that a `when` sets.
        active: whether it gets the value.
        value: the value.
        at_start: whether it is also determined when start values are: equations are, a `when` is not.
    """

    target: Symbol
    active: Any
    value: Any
    source: Source
    at_start: bool


@dataclass(frozen=True)
class UpdateForm:
    """An update without its expressions: path of the target from the component."""

    target: str
    source: Source
    at_start: bool


class DiscreteEquations:
    """The discrete equations of a component, written out.

    Args:
        component: of the class.
        equations: those of discrete variables.
        events: transitions, start modes and whens.
        others: other expressions of the component with their places.
        initial: initial equations of discrete variables.

    Attributes:
        starts: discrete variables and their values at the start, of parameters and time, by initial equations.
        updates: new values at events.
        events: transitions and start modes, with those of relations.
        hidden: discrete values that these need.
        delays: delayed values, with their places.

    Raises:
        LanguageError: an equation of a discrete variable changes between events, an initial one has more than
            parameters and time, or `pre(…)` is in the wrong place.
    """

    def __init__(
        self, component: Component, equations: list[Equation], events: list[Any], others: Iterable[Located],
        initial: Iterable[Equation],
    ) -> None:  # fmt: skip
        self._component, self._kind = component, type(component).__name__
        self.starts = [self._of_start(equation) for equation in initial]
        self.updates = [self._of_equation(equation) for equation in equations]
        self.events: list[Transition | StartMode] = [e for e in events if isinstance(e, Transition | StartMode)]
        self.hidden: list[Hidden] = []
        self.delays: list[tuple[Marker, Source]] = []
        self._kept: list[Symbol] = []
        for number, event in enumerate(events, 1):
            if isinstance(event, When):
                self.updates += self._of_when(event)
            elif isinstance(event, Assertion):
                self._write_assertion(event, f"assertion[{number}]")
        expressions = [(expression, e.source) for e in self.events for expression in _expressions(e)]
        for expression, source in expressions:
            for symbol in symbols_in(expression) if is_expression(expression) else ():
                if isinstance(symbol, Pre):
                    raise LanguageError(
                        f"{self._kind}: {symbol.name} is in a transition, where it never differs from "
                        f"{symbol.of.name}.",
                        where=source,
                        advice=f"Write {symbol.of.name}: in a reset it is the value before. For an edge, write "
                        "once=True.",
                    )
        self._write_markers(
            [*others, *expressions, *((e, u.source) for u in self.updates for e in (u.active, u.value))]
        )
        self.events = [_in_a_round(event) if isinstance(event, Transition) else event for event in self.events]
        self.updates = [replace(u, active=at_once(u.active), value=at_once(u.value)) for u in self.updates]

    def forms(self, path: Any) -> tuple[UpdateForm, ...]:
        """Return the updates without their expressions; `path` names a symbol from the component."""
        return tuple(UpdateForm(path(update.target), update.source, update.at_start) for update in self.updates)

    def _of_equation(self, equation: Equation) -> Update:
        target = symbols_in(equation.left)[0]
        field = target.owner.fields[target.name]
        value = eventful(equation.right) if field.kind == "boolean" else equation.right
        if moves(value):
            raise LanguageError(
                f"{self._kind}: {target.name} changes at events only, but its equation follows "
                f"{next(leaf.name for leaf in symbols_in(value) if leaf is TIME or moves(ca.SX(leaf)))} all the time.",
                where=equation.source,
                advice="Take the value in a `when`, or choose with if_(…): its relations make events.",
            )
        return Update(target, _ONE, value, equation.source, at_start=True)

    def _of_start(self, equation: Equation) -> tuple[Symbol, Any]:
        target, value = symbols_in(equation.left)[0], ca.SX(cast(Any, equation.right))
        while steps := [s for s in symbols_in(value) if isinstance(s, Marker) and s.kind in ("relation", "floor")]:
            plain = [ca.floor(s.of) if s.kind == "floor" else s.of for s in steps]
            value = ca.substitute([value], [ca.SX(s) for s in steps], [ca.SX(one) for one in plain])[0]
        for symbol in symbols_in(value):
            if symbol is not TIME and (symbol.owner is None or not is_fixed(symbol)):
                raise LanguageError(
                    f"{self._kind}: the initial equation of {target.name} has {symbol.name}; what is discrete starts "
                    "before states and other variables do.",
                    where=equation.source, advice="Use parameters and time only.",
                )  # fmt: skip
        return target, value

    def _of_when(self, event: When) -> list[Update]:
        targets: dict[int, tuple[Symbol, Any, Any]] = {}
        for active, values in reversed(event.branches):
            for key, value in values.items():
                target = key if isinstance(key, Ending) else _target(key)
                if target is None:
                    what = f"{self._kind}: a `when` gives {key} a value, which is neither a variable nor discrete."
                    raise LanguageError(what, where=event.source, advice="Name variables, as in {self.n: pre(self.n)}.")
                _, before, later = targets.get(id(target), (target, 0, 0))
                flag: Any = active
                chosen = ca.SX(value) if id(target) not in targets else ca.if_else(flag, ca.SX(value), later)
                targets[id(target)] = target, ca.logic_or(flag, before), chosen
        for target, *_ in reversed(targets.values()):
            if isinstance(target, Ending):
                self._write_ending(target, event.source)
        return [Update(*parts, event.source, at_start=False) for parts in targets.values()]

    def check_determined(self, used: Iterable[str]) -> None:
        """Check that every discrete variable of the component is determined once; a number by its start value at least.

        Args:
            used: paths of the discrete values in its expressions.

        Raises:
            LanguageError: it is not, or twice.
        """
        places: dict[int, Source] = {}
        for update in self.updates:
            if id(update.target) in places:
                what = f"{self._kind}: {update.target.name} is determined twice."
                advice = "Join them: when(…).elsewhen(…), or one equation."
                raise LanguageError(what, where=[places[id(update.target)], update.source], advice=advice)
            places[id(update.target)] = update.source
        resets = [(symbols_in(key)[0], t) for t in self.events if isinstance(t, Transition) for key in t.reset]
        for target, transition in resets:
            if id(target) in places and not isinstance(target, Marker) and is_a(target, Discrete):
                what = f"{self._kind}: {target.name} is set by a transition and determined by an equation or a `when`."
                raise LanguageError(what, where=[places[id(target)], transition.source], advice="Keep one of the two.")
        begun = [id(target) for target, _ in self.starts]
        for target, _ in self.starts:
            if begun.count(id(target)) > 1:
                what = f"{self._kind}: {target.name} has more than one initial equation."
                raise LanguageError(what, advice="Keep one of them.")
        determined = {id(target) for target, _ in resets} | {*places, *begun}
        for name, field in self._component.fields.items():
            if not isinstance(field, Discrete) or id(symbol_of(self._component, name)) in determined:
                continue
            if name in inside(self._component).elsewhere:
                continue
            if field.kind != "number" or (name in used and field.default == 0.0):
                what = f"{self._kind}: nothing determines the discrete variable {name}."
                raise LanguageError(what, advice=f"Yield self.{name} == …, or set it in a `when` or a reset.")

    def _write_markers(self, pending: list[Located]) -> None:
        """Name the markers in expressions, and write what determines them."""
        seen: set[int] = set()
        counts: dict[str, int] = {}
        while pending:
            expression, source = pending.pop(0)
            for symbol in symbols_in(expression) if is_expression(expression) else ():
                marker = symbol.of if isinstance(symbol, Pre) else symbol
                if not isinstance(marker, Marker) or isinstance(marker, Ending) or id(marker) in seen:
                    continue
                if isinstance(marker, Part):
                    seen.update(map(id, parts(marker.whole)))
                    # Before the start, a delay is its value at the start.
                    marker.whole.of = with_events(between_events(marker.whole.of))
                    self.delays.append((marker.whole, source))
                    for k, part in enumerate(parts(marker.whole)):
                        part.name = f"delay[{len(self.delays)}][{k}]"
                        self.hidden.append(Hidden(part.name, f"delay {marker.whole.of}"))
                    self.updates.append(Update(parts(marker.whole)[0], INITIAL, marker.whole.of, source, at_start=True))
                    pending += [(marker.whole.of, source), (marker.whole.offset, source), (INITIAL, source)]
                    continue
                if marker.kind in ("sample", "previous"):
                    what = (
                        f"{self._kind}: {marker.kind}({marker.of}) is outside of the new values of a when(clock(…), …)."
                    )
                    advice = f"Elsewhere write {_PLAIN[marker.kind].format(marker.of)}."
                    raise LanguageError(what, where=source, advice=advice)
                seen.add(id(marker))
                if marker.kind == "floor":  # what is counted has the steps of its value, not others beside them
                    marker.of = with_events(marker.of)
                counts[marker.kind] = counts.get(marker.kind, 0) + 1
                counts_up = marker.kind in ("floor", "clock")
                marker.name = f"{'count of ' * counts_up}{marker.kind}[{counts[marker.kind]}]"
                pending += [(marker.of, source), *((e, source) for e in self._write_marker(marker, source))]

    def _write_marker(self, marker: Marker, source: Source) -> Iterable[Any]:
        """Write what determines a marker; return further expressions."""
        argument: Any = marker.of
        if marker.kind == "relation":
            mode = self._mode(marker.name, str(marker.of), marker, ("false", "true"))
            opposite = cast(Expr, ca.logic_not(marker.of))
            self.events += [
                replace(mode.go("false", "true", when=marker.of), source=source),
                replace(mode.go("true", "false", when=opposite), source=source),
                replace(mode.initially("true", when=marker.of), source=source),
            ]
            return ()
        self.hidden.append(Hidden(marker.name, f"{marker.kind} {argument}"))
        if marker.kind in ("floor", "clock"):
            (self._write_floor if marker.kind == "floor" else self._write_clock)(marker, source)
            return ()
        value = argument if marker.kind == "was" else edge(argument)
        self.updates.append(Update(marker, _ONE, value, source, at_start=marker.kind == "was"))
        return (value,)

    def _write_floor(self, marker: Marker, source: Source) -> None:
        """Count up and down by what is passed; the value itself may still be on the other side by rounding."""
        value, number = cast(Any, marker.of), cast(Any, marker)
        mode = self._counting(marker, f"floor({value})")
        up, down = ca.fmax(number + 1, ca.floor(value)), ca.fmin(number - 1, ca.floor(value))
        self.events += [
            replace(mode.go("counting", "counting", when=value >= number + 1, reset={marker: up}), source=source),
            replace(mode.go("counting", "counting", when=value < number, reset={marker: down}), source=source),
        ]
        self.updates.append(Update(marker, INITIAL, ca.floor(value), source, at_start=True))

    def _check_text(self, text: str, what: str, source: Source) -> None:
        for name in NAME_IN_NOTICE.findall(text):
            if name not in self._component.fields:
                what = f"{self._kind}: the text of {what} names {name}, which is not declared"
                raise LanguageError(f"{what}{did_you_mean(name, self._component.fields) or '.'}", where=source)

    def _write_ending(self, ending: Ending, source: Source) -> None:
        """Declare the mode that ends the run where a `when` has set the ending: the instant is completed before."""
        self._check_text(ending.text, "an assertion" if ending.fails else "terminate(…)", source)
        path = f"terminate[{sum(hidden.path.startswith('terminate[') for hidden in self.hidden) + 1}]"
        ending.name = f"reached {path}"
        self.hidden.append(Hidden(ending.name, "whether the run ends"))
        symbol = Marker("ending", ending.of)
        symbol.name = path
        self._kept += [ending, symbol]
        mode = self._mode(path, ending.text, symbol, ("runs", "ended"))
        go = mode.go("runs", "ended", when=cast(Expr, cast(Any, ending) > 0), notice=ending.text, fails=ending.fails)
        self.events.append(replace(go, source=source, ends=not ending.fails))

    def _write_assertion(self, assertion: Assertion, path: str) -> None:
        self._check_text(assertion.text, "an assertion", assertion.source)
        symbol = Marker("relation", assertion.condition)
        symbol.name = path
        self._kept.append(symbol)
        mode = self._mode(path, str(assertion.condition), symbol, ("holds", "broken"))
        broken = cast(Expr, ca.logic_not(cast(Any, assertion.condition)))
        self.events.append(
            replace(mode.go("holds", "broken", when=broken, notice=assertion.text, fails=True), source=assertion.source)
        )

    def _write_clock(self, marker: Marker, source: Source) -> None:
        """Count ticks; where a run starts late, all earlier ones at once."""
        number, period, offset = cast(Any, marker), cast(Any, marker.of), cast(Any, marker.offset)
        mode = self._counting(marker, f"clock({period}, {offset})")
        ticks = ca.fmax(number + 1, ca.floor((cast(Any, TIME) - offset) / period) + 1)
        tick = mode.go("counting", "counting", at=offset + number * period, reset={marker: ticks})
        self.events.append(replace(tick, source=source))

    def _counting(self, marker: Marker, description: str) -> BoundMode:
        """Declare the mode whose transitions count."""
        self._kept.append(symbol := Marker(marker.kind, marker.of))
        symbol.name = marker.name.removeprefix("count of ")
        return self._mode(symbol.name, description, symbol, ("counting",))

    def _mode(self, path: str, description: str, symbol: Symbol, names: tuple[str, ...]) -> BoundMode:
        mode = Mode(*names, description=description)
        mode.name, mode.owner = path, self._kind
        self.hidden.append(Hidden(path, description, names))
        return BoundMode(mode, symbol)


def _in_a_round(transition: Transition) -> Transition:
    """Return a transition as a round of an instant sees it, before the updates: there `pre(v)` of a relation is v."""
    whole = {name: between_events(e) for name in ("when", "at") if (e := getattr(transition, name)) is not None}
    reset = {key: between_events(value) for key, value in transition.reset.items()}
    return replace(transition, reset=reset, **cast(Any, whole))


def is_discrete(equation: Equation) -> bool:
    """Return whether an equation determines a discrete variable: it stands alone on the left."""
    return cast(Any, equation.left).is_symbolic() and is_a(symbols_in(equation.left)[0], Discrete)


def _target(key: Any) -> Symbol | None:
    """Return what a `when` may set, or None."""
    plain = isinstance(key, Symbol) and key.owner is not None and key.order == 0
    return key if plain and is_a(key, (Variable, Discrete)) and not is_a(key, Input) else None


def _expressions(event: Transition | StartMode) -> Iterable[Any]:
    resets = event.reset.values() if isinstance(event, Transition) else ()
    return (expression for expression in (event.when, getattr(event, "at", None), *resets) if expression is not None)
