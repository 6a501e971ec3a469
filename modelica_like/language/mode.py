"""Modes: discrete states that switch equations at events."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self, cast, overload

import casadi as ca

from modelica_like.errors import LanguageError, Source, unknown_name
from modelica_like.language.discrete import eventful, marker
from modelica_like.language.expr import Expr, Scalar, Symbol, symbol_of
from modelica_like.language.holding import Hold
from modelica_like.language.inside import inside
from modelica_like.language.places import NOWHERE, caller


class Mode:
    """A discrete state with named values.

    Args:
        names: the modes; their position is their number.
        start: the mode at the start, unless `initially` chooses another.
        description: one phrase.
        holds: motion that a mode holds, by the name of the mode; a name is short for `Hold(motion)`. In such a mode
            the component's equations set the derivative of the motion to zero. The motion itself is zero, too: a
            component that enters the mode with a motion stops by an impact.
        ideal: for one of two modes each, the variable that its equation sets to zero: the current of a blocking diode,
            the voltage of a conducting one. Where such equations do not determine all unknowns, those for the
            derivatives of states that the modes fix, or the least norm of what they leave open, do.
        hysteresis: the parameters to set, and how, so that the modes do not switch without end: completes "set …".
    """

    name: str = ""
    owner: str = ""

    def __init__(
        self,
        *names: str,
        start: str | None = None,
        description: str = "",
        holds: Mapping[str, str | Hold] | None = None,
        ideal: Mapping[str, str] | None = None,
        hysteresis: str = "",
    ) -> None:
        self.names = names
        self.start = names[0] if start is None else start
        self.description = description
        self.hysteresis = hysteresis
        self.holds = {name: Hold(hold) if isinstance(hold, str) else hold for name, hold in (holds or {}).items()}
        self.ideal = dict(ideal or {})

    def __set_name__(self, owner: type, name: str) -> None:
        self.owner = owner.__name__
        self.name = name

    def check(self) -> None:
        """Check the declaration; not in `__set_name__`, because Python 3.11 wraps exceptions there.

        Raises:
            LanguageError: no names, a duplicate name, or an ideal element without two modes.
            UnknownName: the start, or a mode in `holds` or `ideal`, does not exist.
        """
        if len(set(self.names)) != len(self.names) or not self.names:
            raise LanguageError(f"{self.label} needs distinct names, not {self.names}.")
        for name in (self.start, *self.holds, *self.ideal):
            self.number(name)
        if self.ideal and not len(self.ideal) == len(self.names) == 2:
            raise LanguageError(f"{self.label} needs two modes with one zero variable each to be ideal.")

    @property
    def label(self) -> str:
        """Name for messages: `Clutch.plates`."""
        return f"{self.owner}.{self.name}"

    if TYPE_CHECKING:

        @overload
        def __get__(self, instance: None, owner: type) -> Self: ...
        @overload
        def __get__(self, instance: object, owner: type) -> BoundMode: ...

    def __get__(self, instance: Any, owner: type) -> Any:
        return self if instance is None else BoundMode(self, symbol_of(instance, self.name))

    def __set__(self, instance: Any, value: str) -> None:
        self.number(value)
        inside(instance).start_modes[self.name] = value

    def number(self, name: str) -> int:
        """Return the number of a mode.

        Raises:
            UnknownName: there is no such mode.
        """
        if name not in self.names:
            raise unknown_name(
                f"{self.label} has no mode '{name}'", name, self.names, f" It has {', '.join(self.names)}."
            )
        return self.names.index(name)


class BoundMode:
    """The mode of one component in `equations()` and `events()`.

    Args:
        mode: its declaration.
        symbol: its symbol in expressions, the number of the mode.
    """

    def __init__(self, mode: Mode, symbol: Symbol) -> None:
        self.mode = mode
        self.symbol = symbol

    def __eq__(self, other: object) -> bool:
        """Refuse `mode == "stuck"`, which Python would answer with False, once and for all."""
        if isinstance(other, str):
            what = f'{self.mode.label} == "{other}" is no condition: the mode changes while the model runs.'
            raise LanguageError(what, where=caller(), advice=f'Write self.{self.mode.name}.is_("{other}").')
        return self is other

    __hash__ = object.__hash__

    def is_(self, *names: str) -> Expr:
        """Return a condition that is true in some modes.

        Args:
            names: of these modes.
        """
        condition: Any = None
        for name in names:
            this: Any = self.symbol == self.mode.number(name)
            condition = this if condition is None else ca.logic_or(condition, this)
        return condition

    def choose(self, *, otherwise: Scalar | None = None, **expressions: Scalar) -> Expr:
        """Return the expression of the active mode; the others may be undefined.

        Args:
            otherwise: expression of all other modes.
            expressions: one expression per mode.

        Raises:
            LanguageError: a mode has no expression.
        """
        missing = [name for name in self.mode.names if name not in expressions]
        if missing and otherwise is None:
            raise LanguageError(
                f"{self.mode.label}.choose() lacks an expression for {', '.join(missing)}.",
                advice="Give one for each mode, or `otherwise=`.",
            )
        total: Any = 0
        for name, expression in expressions.items():
            total = total + ca.if_else(self.symbol == self.mode.number(name), cast(Any, expression), 0)
        if missing and otherwise is not None:
            total = total + ca.if_else(self.is_(*missing), cast(Any, otherwise), 0)
        return total

    def go(
        self, source: str | tuple[str, ...], target: str, *, when: Expr | None = None, at: Scalar | None = None,
        reset: Mapping[Expr, Scalar] | None = None, notice: str = "", because: str = "", fails: bool = False,
        once: bool = False,
    ) -> Transition:  # fmt: skip
        """Declare a transition: a state event (`when`) or a time event (`at`).

        Args:
            source: the mode to leave, a tuple of modes, or `*` for all.
            target: the mode to enter.
            when: condition of a state event.
            at: time of a time event in s, which depends on parameters and discrete values.
            reset: new values of variables and discrete values, in SI units.
            notice: message in the report of a run, such as "exceeds {w_max} rad/s"; the name of the component comes
                first, and names in braces become values of its parameters.
            because: why it happens, in a few words, such as "slip reached zero" or "is beyond {limit}" (the report
                adds the value of the parameter); without it the report puts the condition into words.
            fails: whether the run ends there, with the notice as an error.
            once: fire where the condition becomes true, not while it is true in the source mode.

        Raises:
            UnknownName: a mode does not exist.
            LanguageError: neither or both of `when` and `at` are given.
        """
        sources = self.mode.names if source == "*" else (source,) if isinstance(source, str) else source
        for name in (*sources, target):
            self.mode.number(name)
        if (when is None) == (at is None):
            raise LanguageError(f"{self.mode.label}.go(…, '{target}') needs either `when=` or `at=`.")
        if once and when is not None:
            when = marker("once", eventful(when))
        moment = None if at is None else cast(Expr, ca.SX(cast(Any, at)))
        return Transition(self, sources, target, when, moment, dict(reset or {}), NOWHERE, notice, because, fails)

    def initially(self, target: str, *, when: Expr) -> StartMode:
        """Declare the mode at the start.

        Args:
            target: name of the mode.
            when: condition under which it is chosen, unless an earlier choice was.
        """
        self.mode.number(target)
        return StartMode(self, target, when)


@dataclass(frozen=True, eq=False)
class Transition:
    """Change of a mode at an event.

    Attributes:
        mode: the mode that changes.
        sources: names of the modes to leave.
        target: name of the mode to enter.
        when: condition of a state event, or None.
        at: time of a time event in s, or None.
        reset: new values of states and discrete values.
        notice: message for the user, without the name of the component.
        because: reason in a few words.
        fails: whether the run ends there, with an error.
        ends: whether the run ends there regularly, with the notice as the reason.
    """

    mode: BoundMode
    sources: tuple[str, ...]
    target: str
    when: Expr | None
    at: Expr | None
    reset: Mapping[Expr, Any]
    source: Source = NOWHERE
    notice: str = ""
    because: str = ""
    fails: bool = False
    ends: bool = False


@dataclass(frozen=True, eq=False)
class StartMode:
    """Choice of a mode at the start."""

    mode: BoundMode
    target: str
    when: Expr
    source: Source = NOWHERE
