"""Discrete equations: relations that make events, `when`, `pre`, `edge`, `change`, `initial`."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, cast

import casadi as ca

from modelica_like.errors import LanguageError, Source
from modelica_like.language.expr import TIME, Expr, Scalar, Symbol, symbols_in
from modelica_like.language.fields import Discrete, Variable
from modelica_like.language.inside import inside
from modelica_like.language.places import NOWHERE, caller

MarkerKind = Literal["relation", "floor", "was", "once", "clock", "delay", "sample", "previous", "ending"]


class Marker(Symbol):
    """A discrete value that an expression stands for, until the component's equations are read.

    Attributes:
        kind: `relation`: whether `of` is true, changed by events; `floor`: the whole number below `of`, changed by
            events; `was`: the condition `of` at the present instant; `once`: 1 where `of` has just become true;
            `clock`: number of ticks, `of` is their period; `delay`: see `delay.Part`; `sample` and
            `previous`: their arguments, until a `when` of a clock has replaced them; `ending`: see `Ending`.
        of: the condition or value.
        offset: time of the first tick of a clock, or a delay, in s.
        name: path from the component, given when its template is made.
        numbers: of a delay; see `delay.parts`.
    """

    kind: MarkerKind
    of: Expr
    offset: Expr
    numbers: Sequence[Any] = ()

    def __init__(self, kind: MarkerKind, of: Expr, offset: Scalar = 0.0) -> None:
        super().__init__(None, kind)
        self.kind, self.of, self.offset = kind, of, ca.SX(cast(Any, offset))


class Pre(Symbol):
    """A value before the present iteration of an event: of a discrete value, or of a variable in a new value."""

    of: Symbol

    def __init__(self, of: Symbol) -> None:
        super().__init__(of.owner, f"pre({of.name})")
        self.of = of


class Ending(Marker):
    """Becomes 1 where a `when` ends the run, for the reason `text`: regularly, or as an error."""

    def __init__(self, text: str, *, fails: bool = False) -> None:
        super().__init__("ending", cast(Expr, ca.SX(0)))
        self.text, self.fails = text, fails


INITIAL, TERMINAL, HOMOTOPY = (Symbol(None, name) for name in ("initial()", "terminal()", "homotopy()"))
"""Of the whole model: whether a run begins, whether it ends, and the share of the actual expressions: 1 in a run."""
_timed: list[Marker] = []
"""Markers of expressions of time alone, which no component owns."""


def marker(kind: MarkerKind, of: Expr, offset: Scalar = 0.0) -> Marker:
    """Return the marker for an expression, the same one for equal expressions."""
    wanted: Any = ca.vertcat(of, offset)
    owner = _owner_in(of)
    markers: list[Marker] = _timed if owner is None else inside(owner).markers
    same = (m for m in markers if m.kind == kind and ca.is_equal(ca.vertcat(m.of, m.offset), wanted, 99))
    match = next(same, None)
    if match is None:
        markers.append(match := Marker(kind, of, offset))
    return match


def _owner_in(expression: Expr) -> Any:
    """Return the owner of a symbol in an expression, or None where time decides alone."""
    owners = (_owner_in(symbol.of) if isinstance(symbol, Marker) else symbol.owner for symbol in symbols_in(expression))
    return next((owner for owner in owners if owner is not None), None)


def moves(expression: Expr) -> bool:
    """Return whether an expression changes between events: it has time or a variable in it."""
    return any(s is TIME or is_a(s, Variable) for s in symbols_in(expression))


def is_a(symbol: Symbol, kind: type | tuple[type, ...]) -> bool:
    """Return whether a symbol stands for a field of a kind itself."""
    owner = None if isinstance(symbol, Pre) else symbol.owner
    return owner is not None and isinstance(owner.fields.get(symbol.name), kind)


_JOINS, _EQUALITIES = (ca.OP_AND, ca.OP_OR), (ca.OP_EQ, ca.OP_NE)
_CONDITIONS = (*_JOINS, *_EQUALITIES, ca.OP_NOT, ca.OP_LT, ca.OP_LE)
SILENT, CONTINUOUS = 2.0, 3.0
"""Marks of conditions without events: asked for, or with branches that meet wherever the condition changes."""


def silent(condition: Expr | bool, mark: float = SILENT) -> Expr:
    """Return a condition that makes no event: an `and` with a true number that nobody else writes.

    Args:
        condition: relations and Boolean variables, joined.
        mark: `SILENT` or `CONTINUOUS`.
    """
    expression: Any = ca.SX(cast(Any, condition))
    return expression if expression.is_constant() else ca.logic_and(expression, mark)


def silence(node: Any) -> float:
    """Return the mark of a condition without events, or 0."""
    mark = node.dep(1) if node.op() == ca.OP_AND else None
    return float(mark) if mark is not None and mark.is_constant() and float(mark) in (SILENT, CONTINUOUS) else 0.0


def eventful(condition: Expr | bool) -> Expr:
    """Return a condition whose relations change at events only, each located exactly.

    Args:
        condition: relations and Boolean variables, joined with `all_of`, `any_of`, `negate`.

    Raises:
        LanguageError: it compares values that change continuously by `==`, or is no condition; two conditions may be.
    """
    expression: Any = ca.SX(cast(Any, condition))
    operation = expression.op()
    if silence(expression) or not moves(expression):
        return expression
    if operation == ca.OP_NOT:
        return ca.logic_not(cast(Any, eventful(expression.dep(0))))
    if operation in (ca.OP_LT, ca.OP_LE):
        return marker("relation", expression)
    sides = [expression.dep(k) for k in range(expression.n_dep())]
    equals = operation in _EQUALITIES and all(side.op() in _CONDITIONS or not moves(side) for side in sides)
    if operation in _JOINS or equals:
        return ca.SX.binary(operation, *map(eventful, sides))
    if operation in _EQUALITIES:
        what = f"{expression} compares values that change continuously: they are equal at single instants only."
        raise LanguageError(what, where=caller(), advice="Write a relation with < or >.")
    what = f"{expression} is not a condition: it changes continuously."
    raise LanguageError(what, where=caller(), advice="Write a relation, as in `self.w > 0`, or a Boolean variable.")


def if_(condition: Expr | bool, then: Scalar, otherwise: Scalar) -> Expr:
    """Choose by a condition whose relations make events; `where` is the form without an event.

    Args:
        condition: a relation, or several joined with `all_of` and the like. The instants at which its relations change
            are located, and the integrator begins anew there.
        then: value if it is true.
        otherwise: value if it is false; the branch not taken may be undefined.

    Raises:
        LanguageError: it is no condition.
    """
    return ca.if_else(cast(Any, eventful(condition)), ca.SX(cast(Any, then)), ca.SX(cast(Any, otherwise)))


def pre(value: Expr) -> Expr:
    """Return a discrete value as it was before the present event, or before the present iteration of it.

    It belongs in equations of discrete variables and in `when`; in equations of variables it is the value itself.

    Args:
        value: a discrete, Boolean or integer variable.

    Raises:
        LanguageError: it is something else.
    """
    if not isinstance(value, Marker) and not (isinstance(value, Symbol) and is_a(value, Discrete)):
        what = f"pre({value}): only a discrete, Boolean or integer variable has a value before an event."
        raise LanguageError(what, where=caller(), advice="For a mode, declare boolean(…) and set it by an equation.")
    return before(cast(Symbol, value))


def before(symbol: Symbol) -> Expr:
    """Return what a symbol was before an event; that of a variable belongs in the new values of a `when`."""
    symbol.before = Pre(symbol) if symbol.before is None else symbol.before
    return symbol.before


def edge(condition: Expr) -> Expr:
    """Return a condition that is true where another one has just become true.

    Args:
        condition: a Boolean variable or a relation, or several joined.

    Raises:
        LanguageError: it is no condition.
    """
    single = isinstance(condition, Symbol) and not isinstance(condition, Pre) and condition.owner is not None
    before = condition if single and not moves(condition) else marker("was", eventful(condition))
    return ca.logic_and(cast(Any, before), ca.logic_not(cast(Any, pre(before))))


def change(value: Expr) -> Expr:
    """Return a condition that is true where a discrete value has just changed.

    Args:
        value: a discrete, Boolean or integer variable.

    Raises:
        LanguageError: it is something else.
    """
    return value != pre(value)


def clock(period: Expr, offset: Scalar = 0.0) -> Expr:
    """Return a condition that becomes true every period, exactly at `offset + k * period`; for `when`.

    Where a run starts later, earlier ticks count as one at the start. Clocks whose ticks fall together tick at one
    instant, and their whens use each other's new values.

    Args:
        period: time between two ticks in s: a parameter, or an expression of parameters and discrete variables.
        offset: time of the first tick in s.

    Raises:
        LanguageError: a time is a text, or changes between events.
    """
    text = next((value for value in (period, offset) if isinstance(value, str)), None)
    if text is not None:
        what = f"A time of a clock is an expression of parameters, not the text '{text}'."
        advice = f'Declare it, T = param("s", "period", default="{text}"), and use self.T.'
        raise LanguageError(what, where=caller(), advice=advice)
    if moves(period) or moves(ca.SX(cast(Any, offset))):
        what = f"The ticks of clock({period}) are not known in advance, because they move between events."
        raise LanguageError(what, where=caller(), advice="Use parameters or discrete variables.")
    return change(marker("clock", ca.SX(cast(Any, period)), offset))


def sample(value: Expr) -> Expr:
    """Return a value as it is at a tick: in new values of a `when` of a clock, and nowhere else.

    Args:
        value: any expression. There, the expression itself means the same.
    """
    return marker("sample", ca.SX(cast(Any, value)))


def previous(value: Expr) -> Expr:
    """Return a discrete value as the tick before has left it: `pre(value)`, in a `when` of a clock and nowhere else.

    Args:
        value: a discrete, Boolean or integer variable.

    Raises:
        LanguageError: it is something else.
    """
    return marker("previous", cast(Pre, pre(value)).of)


def hold(value: Expr) -> Expr:
    """Return what ticks have set, for equations of variables: it is held until the next one.

    Args:
        value: an expression of discrete variables and parameters, which means the same itself.

    Raises:
        LanguageError: it changes between ticks.
    """
    if moves(value):
        what = f"hold({value}): this changes between ticks, so it is not held."
        advice = "Take it at the ticks: when(clock(…), {self.held: sample(…)})."
        raise LanguageError(what, where=caller(), advice=advice)
    return value


def initial() -> Expr:
    """Return a condition that is true at the start of a run."""
    return INITIAL


def homotopy(actual: Scalar, simplified: Scalar) -> Expr:
    """Return `actual`, to which the start is led from `simplified`: for equations that are hard to solve from guesses.

    The system at the start is solved with all simplified expressions first, then with growing shares of the actual
    ones, each from the solution before. In a run it is `actual`. An FMU holds the solution for the values with which
    it was exported, and solves the actual system from there.

    Args:
        actual: what holds.
        simplified: the same quantity, by a law that is easy to solve, such as a linear one.
    """
    a, s = ca.SX(cast(Any, actual)), ca.SX(cast(Any, simplified))
    share: Any = HOMOTOPY
    return ca.if_else(share < 1, share * a + (1 - share) * s, a)


def terminal() -> Expr:
    """Return a condition that becomes true at the end of a run: for `when`."""
    return TERMINAL


@dataclass(frozen=True, eq=False)
class When:
    """New values of discrete variables, and of states, where conditions become true; the first one counts.

    Attributes:
        branches: pairs of an active condition, true at one instant, and the new values.
        conditions: as they were written.
    """

    branches: tuple[tuple[Expr, Mapping[Expr, Any]], ...]
    conditions: tuple[Expr, ...]
    source: Source = NOWHERE

    def elsewhen(self, condition: Expr | tuple[Expr, ...], values: Mapping[Expr, Scalar]) -> When:
        """Add a condition that counts only where no earlier one becomes true at the same instant.

        Args:
            condition: as of `when`.
            values: as of `when`.

        Raises:
            LanguageError: as of `when`.
        """
        other = when(condition, values)
        before = functools.reduce(ca.logic_or, [cast(Any, active) for active, _ in self.branches])
        ((active, new),) = other.branches
        last = cast(Expr, ca.logic_and(cast(Any, active), ca.logic_not(before))), new
        return replace(self, branches=(*self.branches, last), conditions=self.conditions + other.conditions)


def when(condition: Expr | tuple[Expr, ...], values: Mapping[Expr, Scalar]) -> When:
    """Set values at the instant at which a condition becomes true: not while it is true, nor if it is from the start.

    Args:
        condition: a relation, a Boolean variable, or several joined with `all_of`, `any_of`, `negate`; `initial()`
            is true at the start. Of a tuple, any condition that becomes true counts, whether others are true or not.
        values: new values by variable: discrete variables, which are determined by this alone, and states. A discrete
            variable in a new value is the one after the event; `pre(n)` is the one before.

    Raises:
        LanguageError: it is no condition, or has no edge because it is constant during a run.
    """
    conditions = condition if isinstance(condition, tuple) else (condition,)
    edges, clocked = list[Any](), False
    for part in conditions:
        symbols = symbols_in(part)
        if not any(symbol is TIME or symbol.owner is None or not is_fixed(symbol) for symbol in symbols):
            what = f"when({part}, …) has no edge: its condition is the same during the whole run."
            raise LanguageError(what, where=caller(), advice="Compare what changes, such as a variable or time.")
        clocked |= (ticks := any(isinstance(symbol, Marker) and symbol.kind == "clock" for symbol in symbols))
        edges.append(part if part is INITIAL or (ticks and cast(Any, part).op() == ca.OP_NE) else edge(part))
    active = cast(Expr, functools.reduce(ca.logic_or, edges))
    new = {key: _at_tick(value) for key, value in values.items()} if clocked else dict(values)
    return When(((active, new),), conditions)


def _at_tick(value: Scalar) -> Expr:
    """Return a new value with what `sample` and `previous` mean at a tick."""
    whole: Any = ca.SX(cast(Any, value))
    marked = [s for s in symbols_in(whole) if isinstance(s, Marker) and s.kind in ("sample", "previous")]
    if not marked:
        return whole
    meant = (pre(marker_.of) if marker_.kind == "previous" else _at_tick(marker_.of) for marker_ in marked)
    return ca.substitute(whole, ca.vertcat(*marked), ca.vertcat(*meant))


@dataclass(frozen=True, eq=False)
class Assertion:
    """A condition that must hold, and what to say where it does not."""

    condition: Expr
    text: str
    source: Source = NOWHERE


def assert_(condition: Expr, text: str) -> Assertion:
    """End the run with an error where a condition becomes false, or is false at the start.

    Args:
        condition: relations and Boolean variables, joined with `all_of`, `any_of`, `negate`.
        text: goes on after the name of the component, such as "turns with {w} rad/s, more than its {w_max} rad/s";
            names in braces become numbers in SI units.
    """
    return Assertion(condition, text)


def terminate(text: str) -> dict[Expr, Scalar]:
    """Return what ends the run regularly, for `when`: what else happens at that instant still happens.

    Beside new values, write `when(condition, {self.n: 1, **terminate("is at the top")})`.

    Args:
        text: the reason; it goes on after the name of the component, such as "is at the top, {x_top} m"; names in
            braces become numbers in SI units.
    """
    return {Ending(text): 1.0}


def is_fixed(symbol: Symbol) -> bool:
    """Return whether the symbol of a field keeps its value during a run."""
    return symbol.order == 0 and not is_a(symbol, (Variable, Discrete)) and symbol.name in symbol.owner.fields
