"""The terms of an optimisation: what is free, what is to be small, what is limited; read from texts and checked."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, cast

import numpy as np

from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import UnitError, UnknownName, ValueOutOfRange, did_you_mean
from modelica_like.language.units import ONE, Unit, read_quantity, same_dimension, to_si
from modelica_like.runs.calls import call_of

Sense = Literal["<=", ">=", "=="]
_CHANCE = re.compile(r"P\s*\((?P<inside>.+)\)\s*>=\s*(?P<share>[^<>=()]+)", re.DOTALL)
_LEAST_CHANCE = 0.5
"""At one half, and below, a limit need not keep a distance."""
UnitOf = Callable[[str], Unit]
_LIMIT = re.compile(r"(?P<left>.+?)(?P<sense><=|>=|==|<|>|=)(?P<right>.+)", re.DOTALL)


@dataclass(frozen=True)
class Free:
    """A parameter that is free between two bounds, in SI units; `value` is that of the drive."""

    name: str
    unit: Unit
    low: float
    high: float
    value: float

    @property
    def span(self) -> float:
        """Distance of the bounds."""
        return self.high - self.low


class Bounded:
    """Something that has free parameters.

    Attributes:
        free: what may change.
    """

    free: tuple[Free, ...]

    @property
    def low(self) -> Vector:
        """Lower bounds, shape (free,)."""
        return np.array([parameter.low for parameter in self.free])

    @property
    def span(self) -> Vector:
        """Distances of the bounds, shape (free,)."""
        return np.array([parameter.span for parameter in self.free])

    @property
    def begin(self) -> Vector:
        """Values of the drive, shape (free,)."""
        return np.array([parameter.value for parameter in self.free])

    def named(self, x: Vector) -> dict[str, float]:
        """Return values of what is free by name."""
        return dict(zip((parameter.name for parameter in self.free), map(float, x), strict=True))


@dataclass(frozen=True)
class Row:
    """A number of a run, times a sign: of an objective to be small, of a limit to be at most `most`, in SI units."""

    output: str
    sign: float
    most: float = 0.0


@dataclass(frozen=True)
class Aim:
    """An objective.

    Attributes:
        text: as written.
        unit: its unit.
        sign: 1 to minimise, -1 to maximise.
        rows: the numbers of which the largest is to be small.
    """

    text: str
    unit: Unit
    sign: float
    rows: tuple[Row, ...]

    def value(self, numbers: Sequence[float]) -> float:
        """Return the objective from its numbers, by row."""
        return self.sign * max(row.sign * number for row, number in zip(self.rows, numbers, strict=True))


@dataclass(frozen=True)
class Limit:
    """A limit of an output, in SI units.

    Attributes:
        text: as written.
        name: of the output.
        unit: its unit.
        sense: the relation.
        value: the limit.
        probability: with which it must hold; 1 for a plain limit.
        inner: the relation as written, without the probability.
    """

    text: str
    name: str
    unit: Unit
    sense: Sense
    value: float
    probability: float = 1.0
    inner: str = ""

    def rows(self) -> tuple[Row, ...]:
        """Return the numbers that must not be above theirs; both sides of an equation."""
        if self.sense == "<=":
            return tuple(replace(row, most=self.value) for row in _rows(self.name, 1.0))
        signs = {">=": (-1.0,), "==": (1.0, -1.0)}[self.sense]
        return tuple(Row(self.name, sign, sign * self.value) for sign in signs)

    def excess(self, value: float) -> float:
        """Return by how much a value of the output breaks the limit; at most 0 where it does not."""
        over = value - self.value
        return {"<=": over, ">=": -over, "==": abs(over)}[self.sense]


@dataclass(frozen=True)
class Case:
    """A load case: other values of parameters."""

    name: str
    values: Mapping[str, Any]

    @property
    def suffix(self) -> str:
        """Its name, for sentences."""
        return f" in the load case '{self.name}'" if self.name else ""


def starts_of(free: Sequence[Free], number: int, seed: int) -> list[Vector]:
    """Return starts of a search in SI units: the values of what is free, then a Latin hypercube between the bounds."""
    from modelica_like.analyse.sweeps.plan import LatinHypercube

    low, span = np.array([parameter.low for parameter in free]), np.array([parameter.span for parameter in free])
    cube = LatinHypercube(number - 1, seed).unit_cube(len(free)) if number > 1 else []
    return [np.array([parameter.value for parameter in free]), *(low + span * q for q in cube)]


def read_free(model: CompiledDae, given: Mapping[str, Any], *, moved: bool = False) -> tuple[Free, ...]:
    """Return the free parameters with their bounds.

    Args:
        model: compiled, with these parameters decoupled from formulas.
        given: lower and upper bound by path, numbers in SI units or quantities.
        moved: whether a value of the drive that is not between its bounds moves to the next one.

    Raises:
        UnknownName: there is no such parameter.
        ValueOutOfRange: there are no two bounds in order, or the drive's own value is not between them.
        UnitError: a bound has another unit.
    """
    if not given:
        raise ValueOutOfRange(
            "An optimisation needs something that is free.",
            advice='Give a parameter and its bounds: free = { "clutch.capacity" = ["20 N.m", "120 N.m"] }.',
        )
    return tuple(_free(model, name, bounds, moved=moved) for name, bounds in given.items())


def _free(model: CompiledDae, name: str, bounds: Any, *, moved: bool) -> Free:
    if isinstance(bounds, str) or not isinstance(bounds, Sequence) or len(bounds) != 2:
        raise ValueOutOfRange(
            f"{name}: the bounds must be two values, not {bounds!r}.", advice='Write ["20 N.m", "120 N.m"].'
        )
    if name in model.derived_position:
        model.with_parameters({name: 0.0})  # says why not
    if name not in model.fixed_position:
        near = did_you_mean(name, [*model.fixed_position, *model.derived_position]) or "."
        raise UnknownName(f"{model.name} has no parameter '{name}'{near}")
    unit, value = model.units[name], model_value(model, name)
    low, high = (to_si(bound, unit, name) for bound in bounds)
    if not low < high:
        raise ValueOutOfRange(f"{name}: the lower bound {low:g} is not below the upper bound {high:g}.")
    if moved:
        value = min(max(value, low), high)
    if not low <= value <= high:
        raise ValueOutOfRange(
            f"{name} = {value:g} {_text(unit)}".rstrip() + f" is not between its bounds {low:g} and {high:g}.",
            why="An optimisation begins with the drive as it is.",
            advice="Widen the bounds, or give the drive a value between them.",
        )
    for bound in (low, high):
        model.with_parameters({name: bound})
    return Free(name, unit, low, high, value)


def model_value(model: CompiledDae, name: str) -> float:
    """Return the value of a parameter or input in SI units."""
    return float(np.concatenate([model.p, model.u])[model.fixed_position[name]])


def read_aims(unit_of: UnitOf, minimize: Sequence[str], maximize: Sequence[str]) -> tuple[Aim, ...]:
    """Return the objectives; `unit_of` knows the outputs.

    Raises:
        UnknownName: the model has no such output.
        ValueOutOfRange: there is none, or it is a trajectory.
        UnitError: the largest of several outputs is asked for, and their units differ.
    """
    if not minimize and not maximize:
        raise ValueOutOfRange(
            "An optimisation needs an objective.", advice='Say what is to be small: minimize = "peak(shaft.tau)".'
        )
    return (*(_aim(unit_of, text, 1.0) for text in minimize), *(_aim(unit_of, text, -1.0) for text in maximize))


def _aim(unit_of: UnitOf, text: str, sign: float) -> Aim:
    """Read an output, or the largest (to maximise, the least) of several, `max(peak(a.tau), peak(b.tau))`."""
    called = call_of(text)
    names = split(called[1]) if called is not None and called[0] == ("max" if sign > 0 else "min") else [text]
    if len(names) == 1:
        names = [text.strip()]
    units = [unit_of(name) for name in names]
    for unit in units[1:]:
        if not same_dimension(unit, units[0]):
            raise UnitError(f"'{text}' compares {units[0]} with {unit}.")
    return Aim(text.strip(), units[0], sign, tuple(row for name in names for row in _rows(name, sign)))


def split(text: str) -> list[str]:
    """Split at the commas that are in no brackets."""
    parts, depth = [""], 0
    for char in text:
        depth += (char == "(") - (char == ")")
        parts = [*parts, ""] if char == "," and depth == 0 else [*parts[:-1], parts[-1] + char]
    return [part.strip() for part in parts]


def _rows(name: str, sign: float) -> tuple[Row, ...]:
    """Return the numbers of which the largest is to be small: a peak is the larger of two amounts."""
    called = call_of(name)
    if called is not None and called[0] == "peak" and sign > 0:
        return Row(f"max({called[1]})", 1.0), Row(f"min({called[1]})", -1.0)
    return (Row(name, sign),)


def read_limits(unit_of: UnitOf, texts: Sequence[str]) -> tuple[Limit, ...]:
    """Return the limits; `unit_of` knows the outputs.

    Raises:
        ValueOutOfRange: a text is no relation.
        UnknownName: the model has no such output.
        UnitError: the sides have different units.
    """
    return tuple(_with_probability(unit_of, text) for text in texts)


def _with_probability(unit_of: UnitOf, text: str) -> Limit:
    called = _CHANCE.fullmatch(text.strip())
    if called is None:
        return _limit(unit_of, text)
    number, limit = read_quantity(called["share"]), _limit(unit_of, called["inside"].strip())
    share = number[0] * number[1].factor if number is not None and same_dimension(number[1], ONE) else 0.0
    if not _LEAST_CHANCE < share < 1.0 or limit.sense == "==":
        raise ValueOutOfRange(
            f"'{text}': a probability must be between 50 % and 100 %, and that of a limit with <= or >=.",
            advice='Write "P(clutch.lock_time <= 0.4 s) >= 99.9 %".',
        )
    return replace(limit, text=text, probability=share, inner=called["inside"].strip())


def _limit(unit_of: UnitOf, text: str) -> Limit:
    sides = _LIMIT.fullmatch(text.strip())
    if sides is None or sides["sense"] == "=":
        raise ValueOutOfRange(
            f"'{text}' is no limit: it compares nothing.",
            advice='Write "clutch.lock_time <= 0.4 s", with <=, >= or ==.',
        )
    left, right = sides["left"].strip(), sides["right"].strip()
    sense = cast("Sense", {"<": "<=", ">": ">="}.get(sides["sense"], sides["sense"]))
    unit = unit_of(left)
    number = read_quantity(right)
    if number is None:
        name = f"{left} - ({right})"
        return Limit(text, name, unit_of(name), sense, 0.0)
    if number[1] == ONE and str(unit) not in ("1", "*"):
        raise UnitError(
            f"'{text}' compares a value in {unit} with a number without a unit.",
            advice=f'Write "{left} {sides["sense"]} {right} {unit}".',
        )
    return Limit(text, left, unit, sense, to_si(right, unit, left))


def read_cases(model: CompiledDae, given: Sequence[Mapping[str, Any]], free: Sequence[Free]) -> tuple[Case, ...]:
    """Return the load cases; one without other values if there are none.

    Raises:
        UnknownName: there is no such parameter.
        ValueOutOfRange: a value is out of range, or what is free has a value.
    """
    cases: list[Case] = []
    for number, table in enumerate(given, 1):
        values = dict(table)
        name = str(values.pop("name", f"case {number}"))
        for path in values.keys() & {parameter.name for parameter in free}:
            raise ValueOutOfRange(
                f"{path} is free, and has a value in the load case '{name}'.", advice="Leave out one of the two."
            )
        model.with_parameters(values)
        cases.append(Case(name, values))
    return tuple(cases) or (Case("", {}),)


def _text(unit: Unit) -> str:
    return "" if unit == ONE else str(unit)
