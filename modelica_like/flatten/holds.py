"""Which motions the modes of a component hold, found in its equations once for all instances."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, cast

import casadi as ca

from modelica_like.errors import LanguageError
from modelica_like.flatten.generic import spread
from modelica_like.language.component import Component
from modelica_like.language.equation import Equation
from modelica_like.language.expr import Symbol, flagged_motion, symbol_of, symbols_in
from modelica_like.language.fields import Variable
from modelica_like.language.functions import all_of, any_of
from modelica_like.language.holding import UNLIMITED, Hold
from modelica_like.language.mode import Mode, StartMode

TERMS = 4
"""Rows of the hold terms: gain, capacity forward, capacity backward, restitution."""


@dataclass(frozen=True)
class HoldForm:
    """A motion that a mode holds, without its expressions.

    Attributes:
        mode: name of the mode.
        number: number of the mode that holds.
        loose: number of a mode that does not hold it, or -1.
        motion: path of the held variable.
        reaction: path of the reaction, or an empty text.
        row: position of the equation that holds it.
        rigid: whether the equation only sets the derivative of the motion to zero; a creep has more terms.
    """

    mode: str
    number: int
    loose: int
    motion: str
    reaction: str
    row: int
    rigid: bool


@dataclass(frozen=True)
class IdealForm:
    """An ideal element: its mode, the paths of the variables that are zero in mode 0 and 1, and their equation."""

    mode: str
    zeros: tuple[str, str]
    row: int


@dataclass(frozen=True)
class LockForm:
    """What may be locked: its equation, the discrete variable that locks it, and whether it yields then."""

    row: int
    discrete: str
    creeps: bool


def lock_forms(equations: Iterable[Equation]) -> tuple[tuple[LockForm, ...], list[Any]]:
    """Return what equations may lock, and for each whether its limit falls once it slides."""
    locks = [(row, equation.lock) for row, equation in enumerate(equations) if equation.lock is not None]
    forms = tuple(LockForm(row, lock.discrete, lock.creeps) for row, lock in locks)
    return forms, [ca.SX(lock.falls) for _, lock in locks]


def ideal_forms(component: Component, residuals: list[Any]) -> tuple[IdealForm, ...]:
    """Find the equation of every ideal element.

    Raises:
        LanguageError: a declaration names no variable, or no equation sets it to zero.
    """
    forms: list[IdealForm] = []
    for mode in component.modes.values():
        if not mode.ideal:
            continue
        symbol = symbol_of(component, mode.name)
        zeros = [_variable(component, mode, mode.ideal[name], "variable") for name in mode.names]
        for row, residual in enumerate(residuals):
            cases = [ca.substitute(residual, symbol, ca.SX(k)) for k in range(2)]
            if all(
                _only(c, zero) and _number(ca.jacobian(c, zero)) != 0.0 for c, zero in zip(cases, zeros, strict=True)
            ):
                forms.append(IdealForm(mode.name, (zeros[0].name, zeros[1].name), row))
                break
        else:
            written = ", ".join(f"{name}=self.{mode.ideal[name]}" for name in mode.names)
            raise LanguageError(
                f"{mode.label} is ideal, but no equation sets {' and '.join(z.name for z in zeros)} to zero.",
                advice=f"Write {mode.name}.choose({written}) == 0.",
            )
    return tuple(forms)


def hold_forms(component: Component, residuals: list[Any]) -> tuple[tuple[HoldForm, ...], list[Any]]:
    """Find the equation behind every motion that a mode holds.

    Returns:
        The forms, and `TERMS` expressions for each: the slope of its equation by the derivative of the motion
        (zero where it holds nothing), the capacities and the restitution.

    Raises:
        LanguageError: a declaration names no variable, or no equation holds it.
    """
    forms: list[HoldForm] = []
    terms: list[Any] = []
    for mode in component.modes.values():
        for name, hold in mode.holds.items():
            motion = _variable(component, mode, hold.motion, "motion")
            reaction = _variable(component, mode, hold.reaction, "reaction") if hold.reaction else None
            row, gain, rigid = _equation(component, mode, name, motion, residuals)
            named = "" if reaction is None else reaction.name
            forms.append(HoldForm(mode.name, mode.number(name), _loose(mode), motion.name, named, row, rigid))
            forward, backward = _capacities(component, hold)
            restitution = _value(component, hold.restitution) if hold.restitution else 0.0
            terms += [gain, forward, backward, restitution]
    return tuple(forms), terms


def starts_at_rest(component: Component, declared: Iterable[StartMode]) -> Iterator[StartMode]:
    """Yield the start modes, which hold a motion only if it is at rest: what moves is met in an impact."""
    for transition in declared:
        mode = transition.mode.mode
        if hold := mode.holds.get(transition.target):
            motion = cast(Any, _variable(component, mode, hold.motion, "motion"))
            transition = replace(transition, when=all_of(transition.when, motion <= 0, motion >= 0))
        yield transition
    for mode in component.modes.values():
        loose = _loose(mode)
        if loose >= 0 and (hold := mode.holds.get(mode.start)):
            motion = cast(Any, _variable(component, mode, hold.motion, "motion"))
            yield getattr(component, mode.name).initially(mode.names[loose], when=any_of(motion < 0, motion > 0))


def _loose(mode: Mode) -> int:
    """Return the first value of a mode that holds nothing, or -1."""
    return next((k for k, other in enumerate(mode.names) if other not in mode.holds), -1)


def _value(component: Component, name: str) -> Any:
    value = getattr(component, name)
    return cast("Callable[[], Any]", value)() if callable(value) else value


def _variable(component: Component, mode: Mode, name: str, role: str) -> Symbol:
    symbol = _value(component, name) if hasattr(component, name) else None
    if isinstance(symbol, Symbol) and _is_variable(symbol) and symbol.owner is component and not symbol.order:
        return symbol
    raise LanguageError(
        f"{mode.label} holds the {role} '{name}', which is not a variable of {type(component).__name__}.",
        advice="Name a variable, or a property that returns one.",
    )


def _capacities(component: Component, hold: Hold) -> tuple[Any, Any]:
    given = _value(component, hold.capacity) if hold.capacity else None
    pair = given if isinstance(given, tuple) else (given, given)
    forward, backward = (UNLIMITED if side is None else side for side in cast("tuple[Any, Any]", pair))
    return forward, backward


def _equation(
    component: Component, mode: Mode, name: str, motion: Symbol, residuals: list[Any]
) -> tuple[int, Any, bool]:
    """Return the position of the equation that holds a motion, its slope, and whether it has no other terms."""
    rate, symbol = symbol_of(component, motion.name, 1), symbol_of(component, mode.name)
    number = mode.number(name)
    for row, residual in enumerate(residuals):
        slope = ca.jacobian(residual, rate)
        if ca.depends_on(residual, symbol) and _number(ca.substitute(slope, symbol, ca.SX(number))) != 0.0:
            # The derivative of the motion in another mode does not hold it.
            gain = ca.if_else(ca.SX(symbol) == number, slope, 0)
            return row, gain, _only(ca.substitute(residual, symbol, ca.SX(number)), rate)
    raise LanguageError(
        f"{mode.label} holds {motion.name} in '{name}', but no equation sets der({motion.name}) is zero.",
        advice=f"Write {mode.name}.choose(…, {name}=der(self.{motion.name})) == 0.",
    )


def _only(residual: Any, rate: Symbol) -> bool:
    """Whether an equation contains only one variable, if no motion is prescribed."""
    others = [s for s in symbols_in(residual) if s is not rate and _is_variable(s)]
    return all(_number(ca.jacobian(residual, other)) == 0.0 for other in others)


def _is_variable(symbol: Symbol) -> bool:
    return symbol.owner is not None and isinstance(symbol.owner.fields.get(symbol.name), Variable)


def _number(expression: Any) -> float:
    """Value of an expression at a generic point, without prescribed motions."""
    symbols = symbols_in(expression)
    points = zip(symbols, spread(0.0, 1.0, len(symbols)), strict=True)
    values = [0.0 if flagged_motion(symbol.name) else _generic(symbol, value) for symbol, value in points]
    return float(ca.Function("value", [ca.SX(ca.vertcat(*symbols))], [expression])(values))


def _generic(symbol: Symbol, chance: float) -> float:
    mode = getattr(symbol.owner, "modes", {}).get(symbol.name)
    return chance if mode is None else mode.number(mode.start)
