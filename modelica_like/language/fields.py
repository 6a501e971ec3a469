"""Declarations in a class body: parameters, variables, signals and discrete values."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, Self, overload

from modelica_like.errors import LanguageError, UnitError, ValueOutOfRange
from modelica_like.language.expr import Expr, symbol_of
from modelica_like.language.formula import Arithmetic, Formula, as_formula, in_brackets, parse_formula
from modelica_like.language.places import caller
from modelica_like.language.units import ANY, Unit, coherent, parse_unit, read_quantity, to_si

_CALCULATES = re.compile(r"\s[-+*/]\s")
"""A number continues as a formula instead of a unit."""

StatePreference = Literal["always", "prefer", "default", "avoid"]


@dataclass(frozen=True)
class Guess:
    """A start value that the initialization may change."""

    value: Any


def guess(value: Quantity) -> Any:
    """Mark a start value as a guess, which the solver may change.

    Args:
        value: a number in the declared unit, or a quantity.
    """
    return Guess(value)


@dataclass(frozen=True, slots=True)
class Value:
    """The given value of a parameter, input or start value.

    Attributes:
        given: as written by the user.
        number: value in SI units, or None if it follows from a formula.
        formula: of parameters of an owner, or None.
        unit: declared unit; for a declared unit `*` the unit of the given quantity.
        fixed: False for a guessed start value.
        levels: how far above the component the formula stands: its names are parameters there; 1 is the owner.
    """

    given: Any
    number: float | None
    formula: Formula | None
    unit: Unit
    fixed: bool = True
    levels: int = 1


class Field:
    """Base of all declarations with a unit."""

    name: str = ""
    owner: str = ""
    default: Any = None

    def __init__(
        self, unit: str, description: str = "", *, default: Any = None,
        min: float | None = None, max: float | None = None, nominal: float = 1.0,
    ) -> None:  # fmt: skip
        self.unit_text = unit
        self.description = description
        self.default = default
        self.min = min
        self.max = max
        self.nominal = nominal

    def __set_name__(self, owner: type, name: str) -> None:
        self.owner = owner.__name__
        self.name = name

    def check(self) -> None:
        """Check the nominal value, by which tolerances and steps of Newton's method are scaled.

        Raises:
            ValueOutOfRange: it is not positive and finite.
        """
        given: Any = self.nominal
        number = isinstance(given, int | float)
        if not number or not 0 < given < math.inf:
            shown = f"{given:g}" if number else repr(given)
            raise ValueOutOfRange(
                f"The nominal value of {self.label} must be a positive, finite number, not {shown}.", where=caller(),
                why="It is the order of magnitude of a variable, in SI units, which tells how exact a run must be.",
                advice="Give a typical magnitude, or leave it out: it is 1 then.",
            )  # fmt: skip

    @property
    def unit(self) -> Unit:
        """Declared unit; parsed on first use."""
        return parse_unit(self.unit_text)

    @cached_property
    def bounds(self) -> tuple[float | None, float | None]:
        """Smallest and largest value in SI units, or None."""
        low, high = (None if limit is None else to_si(limit, self.unit, self.label) for limit in (self.min, self.max))
        return low, high

    @property
    def label(self) -> str:
        """Name for messages: `Inertia.J`."""
        return f"{self.owner}.{self.name}"

    def read(self, given: Any) -> Value:
        """Read a value: a number, a quantity with a unit, or a formula.

        Raises:
            UnitError: the quantity has another dimension.
            ValueOutOfRange: not finite, or outside min and max.
            NetlistError: the text is neither a quantity nor a formula.
        """
        fixed = not isinstance(given, Guess)
        raw = given if fixed else given.value
        if isinstance(raw, Formula | Field):
            return Value(raw, None, as_formula(raw), self.unit, fixed)
        if isinstance(raw, str):
            quantity = self._quantity(raw)
            if quantity is None:
                return Value(raw, None, parse_formula(raw), self.unit, fixed)
            if self.unit == ANY:
                return Value(raw, self._checked(to_si(raw, quantity[1], self.label), raw), None, quantity[1], fixed)
        return Value(raw, self._checked(to_si(raw, self.unit, self.label), raw), None, self.unit, fixed)

    def _quantity(self, text: str) -> tuple[float, Unit] | None:
        try:
            return read_quantity(text)
        except UnitError as error:
            if _CALCULATES.search(text):
                return None
            advice = in_brackets(text) or error.advice
            what = f"{self.label} = '{text}': {error.what}"
            raise UnitError(what, advice=advice, word=error.word, instead=error.instead) from None

    def _checked(self, number: float, given: Any) -> float:
        return in_range(number, given, self.label, str(coherent(self.unit)), self.bounds)


def in_range(number: float, given: object, label: str, unit: str, bounds: tuple[float | None, float | None]) -> float:
    """Return a number after checking that it is finite and within its bounds.

    Args:
        number: in SI units.
        given: as written, for messages.
        label: name for messages.
        unit: of the bounds, likewise.
        bounds: smallest and largest value, in SI units, or None.

    Raises:
        ValueOutOfRange: it is not.
    """
    if not math.isfinite(number):
        raise ValueOutOfRange(f"{label} must be a finite number, not {number:g}.")
    low, high = bounds
    if (low is not None and number < low) or (high is not None and number > high):
        bound = ("least", low) if low is not None and number < low else ("most", high)
        raise out_of_range(given, label, unit, *bound)
    return number


def out_of_range(given: object, label: str, unit: str, most: str, bound: float | None) -> ValueOutOfRange:
    """Return the error of a value beyond the `least` or `most`; the others are those of `in_range`."""
    shown = "" if unit in ("1", "*") else f" {unit}"
    return ValueOutOfRange(f"{label} = {given} is out of range: it must be at {most} {bound:g}{shown}.")


if TYPE_CHECKING:
    Quantity = float | int | str | Formula | Field | Expr
else:
    Quantity = object


class _Symbolic(Field):
    """A declaration whose value in equations is a symbol."""

    if TYPE_CHECKING:

        @overload
        def __get__(self, instance: None, owner: type) -> Self: ...
        @overload
        def __get__(self, instance: object, owner: type) -> Expr: ...

    def __get__(self, instance: Any, owner: type) -> Any:
        return self if instance is None else symbol_of(instance, self.name)

    def __set__(self, instance: Any, value: Quantity) -> None:
        instance.set_value(self, value)


class Parameter(_Symbolic, Arithmetic):
    """Constant during a run; tunable, differentiable, an FMU parameter.

    Attributes:
        tunable: whether it can change after compilation.
        above: the parameter must exceed the one this many places before it; 0: none.
    """

    tunable = True
    above = 0


class Variable(_Symbolic):
    """Unknown that changes continuously; potential or flow in a connector.

    Args:
        unit: in Modelica notation.
        description: one phrase.
        state: preference as a state: `always`, `prefer`, `default` or `avoid`.
        guess: first guess of its start value (SI).
        is_flow: whether it sums to zero in a connection.
        bounds: as of `var`.

    Attributes:
        driving: sign of the torque or force between two ends while it drives the right one; pictures show it positive.
        difference: whether it is a difference, which is not counted from the zero of a temperature scale.
        constant: whether it keeps its start value: a parameter that initial equations determine.
    """

    driving = 1
    difference = False
    constant = False

    def __init__(
        self, unit: str, description: str = "", *, state: StatePreference = "default", guess: float = 0.0,
        is_flow: bool = False, **bounds: Any,
    ) -> None:  # fmt: skip
        super().__init__(unit, description, **bounds)
        self.state: StatePreference = state
        self.guess = guess
        self.is_flow = is_flow


class Input(Variable):
    """Causal signal from outside the component."""


class Output(Variable):
    """Causal signal that the component determines."""


class Discrete(_Symbolic):
    """Number that changes only at events; `boolean` and `integer` also say which numbers it can be."""

    kind: Literal["number", "boolean", "integer"] = "number"

    def read(self, given: Any) -> Value:
        """Read a start value, as `Field.read`; that of a Boolean is true or false.

        Raises:
            ValueOutOfRange: also, it is not a whole number where it should be one.
        """
        value = super().read(float(given) if self.kind == "boolean" and isinstance(given, bool) else given)
        if self.kind != "number" and value.number is not None and value.number % 1:
            wanted = "true or false" if self.kind == "boolean" else "a whole number"
            raise ValueOutOfRange(f"{self.label} = {given} must be {wanted}.")
        return value


def param(
    unit: str, description: str = "", *, default: Any = None,
    min: float | None = None, max: float | None = None, nominal: float = 1.0, tunable: bool = True, fixed: bool = True,
) -> Any:  # fmt: skip
    """Declare a parameter.

    Args:
        unit: in Modelica notation, e.g. `kg.m2`; `1` for none; `*` takes the unit of the value.
        description: one phrase.
        default: number in that unit, quantity or formula; without it the parameter is required, unless the class
            checks `given()`.
        min: smallest allowed value, SI.
        max: largest allowed value, SI.
        nominal: order of magnitude, SI.
        tunable: whether it can change after compilation.
        fixed: False: initial equations determine it, otherwise its default; it is a variable that keeps its value.
    """
    if not fixed:
        kept = Variable(unit, description, state="always", default=default, min=min, max=max, nominal=nominal)
        kept.constant = True
        return kept
    parameter = Parameter(unit, description, default=default, min=min, max=max, nominal=nominal)
    parameter.tunable = tunable
    return parameter


def var(
    unit: str, description: str = "", *, state: StatePreference = "default", guess: float = 0.0, default: Any = None,
    min: float | None = None, max: float | None = None, nominal: float = 1.0, driving: Literal[1, -1] = 1,
    difference: bool = False,
) -> Any:  # fmt: skip
    """Declare an unknown; as a keyword of the constructor it takes a fixed start value or a `guess(…)`.

    Args:
        unit: in Modelica notation.
        description: one phrase.
        state: preference as a state: `always`, `prefer`, `default` or `avoid`.
        guess: first guess of its start value, SI.
        default: start value if nothing else determines it, e.g. 0 for the angle of a prescribed speed, otherwise a
            first guess.
        min: smallest sensible value, SI.
        max: largest sensible value, SI.
        nominal: order of magnitude, SI.
        driving: sign of a torque or force while it drives what is on its right; pictures show that as positive.
        difference: a difference of temperatures, which is shown in K and not counted from the zero of degC.
    """
    variable = Variable(unit, description, state=state, guess=guess, default=default, min=min, max=max, nominal=nominal)
    variable.driving, variable.difference = driving, difference
    return variable


def flow(unit: str, description: str = "", *, nominal: float = 1.0) -> Any:
    """Declare a flow variable of a connector, positive into the component.

    Args:
        unit: in Modelica notation.
        description: one phrase.
        nominal: order of magnitude, SI.
    """
    return Variable(unit, description, is_flow=True, nominal=nominal)


def signal_in(
    unit: str, description: str = "", *, default: Any = None, min: float | None = None, max: float | None = None
) -> Any:
    """Declare a causal input.

    Args:
        unit: in Modelica notation; `*` takes the unit of the connected output.
        description: one phrase.
        default: value if unconnected; without it, a connection or a value is required.
        min: smallest allowed value, SI.
        max: largest allowed value, SI.
    """
    return Input(unit, description, default=default, min=min, max=max)


def signal_out(unit: str, description: str = "", *, nominal: float = 1.0) -> Any:
    """Declare a causal output.

    Args:
        unit: in Modelica notation; `*` takes the unit of its equation.
        description: one phrase.
        nominal: order of magnitude, SI.
    """
    return Output(unit, description, nominal=nominal)


def discrete(unit: str, description: str = "", *, start: Any = 0.0) -> Any:
    """Declare a number that changes only at events.

    Args:
        unit: in Modelica notation.
        description: one phrase.
        start: a number, a quantity or a formula of the component's parameters.
    """
    return Discrete(unit, description, default=start)


def boolean(description: str = "", *, start: bool = False) -> Any:
    """Declare a Boolean variable: 1 or 0, changed only at events, by its equation or a `when`.

    Args:
        description: one phrase.
        start: its `pre` at the start.
    """
    declared = Discrete("1", description, default=float(start), min=0.0, max=1.0)
    declared.kind = "boolean"
    return declared


def integer(description: str = "", *, start: Any = 0) -> Any:
    """Declare a whole number that is changed only at events, by its equation or a `when`.

    Args:
        description: one phrase.
        start: its `pre` at the start: a number or a formula of the component's parameters.
    """
    declared = Discrete("1", description, default=start)
    declared.kind = "integer"
    return declared


def require_identifier(name: str, where: str, *, element: bool = False) -> None:
    """Refuse names that are not public identifiers; those of elements of matrices may be, `wheel[1,2]`.

    Raises:
        LanguageError: the name is private, or not an identifier.
    """
    bare = re.sub(r"\[\d+(,\d+)+\]$", "", name) if element else name
    if name.startswith("_") or not bare.isidentifier():
        raise LanguageError(f"{where} declares '{name}'.", advice="A name is a letter, then letters, digits and _.")
