"""From a sizing file to results with verdicts."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like import upper
from modelica_like.analyse.sizing.checks import find_check, unit_of_line
from modelica_like.analyse.sizing.convert import Converter
from modelica_like.analyse.sizing.document import SizingDocument, parse_document, placed, read_document
from modelica_like.analyse.sizing.formulas import Value, read_value
from modelica_like.analyse.sizing.simulated import Simulations
from modelica_like.errors import (
    CyclicAssembly,
    ModelicaLikeError,
    NetlistError,
    Source,
    UnknownName,
    did_you_mean,
    unknown_name,
)
from modelica_like.language.units import ONE, to_si
from modelica_like.upper import Shown

if TYPE_CHECKING:
    from rich.console import RenderableType

    from modelica_like.runs.solution import Solution

_OWN = ("is", "note", "limits", "published")
_STEP = re.compile(r"([A-Za-z_]\w*)(?:\[(\d+)\])?")
Limits = dict[str, tuple[Any, Any]]


@dataclass(frozen=True)
class CheckedResult:
    """The result of one design check of a file.

    Attributes:
        check: name of the design check.
        limits: smallest and largest value in SI, or None, by line.
        published: values of a document in SI by line, for comparison.
        note: remark of the file.
    """

    name: str
    check: str
    result: Any
    limits: Limits
    published: dict[str, float]
    note: str

    @property
    def exceeded(self) -> int:
        """Number of lines that violate a limit."""
        return sum(line.exceeded for line in self.result.lines(self.limits))

    def deviation(self, line: str) -> float:
        """Return the deviation from the published value, relative to it."""
        value = float(np.ravel(getattr(self.result, line))[0])
        return (value - self.published[line]) / self.published[line] if self.published[line] else value


@dataclass(frozen=True)
class Sizing(Shown):
    """All design checks of a file in their order, and names of checks to compare, by heading."""

    name: str
    description: str
    checks: tuple[CheckedResult, ...]
    compare: dict[str, list[str]]

    def __rich__(self) -> RenderableType:
        return upper.sizing_report(self)

    @property
    def exceeded(self) -> int:
        """Number of lines that violate a limit."""
        return sum(check.exceeded for check in self.checks)

    def __getitem__(self, name: str) -> Any:
        """Return the result of a check.

        Raises:
            UnknownName: there is no such check.
        """
        results = {check.name: check.result for check in self.checks}
        if name not in results:
            raise UnknownName(f"{self.name} has no check '{name}'{did_you_mean(name, results) or '.'}")
        return results[name]


def size(path: str | Path, runs: Mapping[Path, Solution] | None = None) -> Sizing:
    """Run the design checks of a sizing file.

    Args:
        path: TOML file.
        runs: known runs by netlist; others are made.

    Raises:
        ModelicaLikeError: the file has an error; the message says what, where and what to do.
    """
    document = read_document(Path(path))
    run = Checks(document, Simulations(Path(path).parent, runs))
    checks = tuple(run.checked(name) for name in document.checks)
    for heading, names in document.compare.items():
        place = document.lines.source("compare", heading)
        for check in names:
            if check not in run.done:
                raise unknown_name(f"compare.{heading}: there is no check '{check}'", check, run.done, where=place)
        if len({type(run.done[check].result) for check in names}) != 1:
            raise NetlistError(f"compare.{heading} must name checks of one kind.", where=place)
    return Sizing(document.name, document.description, checks, document.compare)


class _Later(ModelicaLikeError):
    """Only a run shows it."""


class _NoRuns(Simulations):
    def load(self, table: Mapping[str, Any], where: str) -> Value:
        raise _Later(where)


def survey(path: Path, text: str) -> list[ModelicaLikeError]:
    """Return the errors of a sizing file that is being written, as far as they are seen without a simulation."""
    errors: dict[str, ModelicaLikeError] = {}
    try:
        document = parse_document(text, path)
    except ModelicaLikeError as error:
        return [*error.problems()]
    for name in document.checks:
        try:
            Checks(document, _NoRuns(path.parent)).checked(name)
        except _Later:
            continue
        except ModelicaLikeError as error:
            errors[str(error)] = error  # a wrong parameter is told once
            if error.where == (document.lines.source("checks", name),):
                key = "is" if error.word == document.checks[name]["is"] else error.word
                error.where = (document.lines.within("checks", name, key),)
    return [*errors.values()]


class Checks:
    """Computes checks and parameters on demand, each once."""

    def __init__(self, document: SizingDocument, simulations: Simulations) -> None:
        self.document = document
        self.done: dict[str, CheckedResult] = {}
        self.parameters: dict[str, Value] = {}
        self.open: list[str] = []
        self.converter = Converter(self.lookup, simulations.load, self.result)

    def lookup(self, path: str) -> Value:
        """Return a parameter, or a line of a check (`belt.shaft_load`, `shaft.reactions[0].radial`)."""
        name, dot, rest = path.partition(".")
        if not dot and name in self.document.parameters:
            return self._parameter(name)
        if dot and name in self.document.checks:
            return _line(self.checked(name).result, rest, path)
        names = [*self.document.parameters, *self.document.checks]
        raise unknown_name(f"There is no parameter or check '{name}'", name, names)

    def result(self, name: str) -> Any:
        """Return the result of a check, None if there is no such check."""
        return self.checked(name).result if name in self.document.checks else None

    def _parameter(self, name: str) -> Value:
        if name not in self.parameters:
            given = self.document.parameters[name]
            try:
                self._enter(name)
                self.parameters[name] = self._given(given, f"parameters.{name}")
                self.open.pop()
            except ModelicaLikeError as error:
                raise placed(error, self.document.lines.source("parameters", name)) from None
        return self.parameters[name]

    def _given(self, given: Any, where: str) -> Value:
        if isinstance(given, dict):
            return self.converter.simulated(given, where)
        if isinstance(given, str):
            return read_value(given, self.lookup)
        if isinstance(given, bool) or not isinstance(given, int | float):
            raise NetlistError(f'{where} must be a number or a text with a unit, such as "10 N.m".')
        return Value(to_si(given, ONE, where), ONE)

    def _enter(self, name: str) -> None:
        if name in self.open:
            chain = " needs ".join([*self.open[self.open.index(name) :], name])
            raise CyclicAssembly(
                f"Values depend on each other in a circle: {chain}.", advice="Give one of them a value."
            )
        self.open.append(name)

    def checked(self, name: str) -> CheckedResult:
        """Return the result of a check."""
        if name not in self.done:
            table = self.document.checks[name]
            try:
                self._enter(f"checks.{name}")
                self.done[name] = self._check(name, table)
                self.open.pop()
            except ModelicaLikeError as error:
                raise placed(error, self.document.lines.source("checks", name)) from None
        return self.done[name]

    def _check(self, name: str, table: Mapping[str, Any]) -> CheckedResult:
        where, check = f"checks.{name}", find_check(table["is"])
        given = {key: value for key, value in table.items() if key not in _OWN}
        arguments = self.converter.arguments(check, given, where, lambda key: self._source(name, key))
        try:
            with np.errstate(divide="raise", invalid="raise", over="raise"):
                result = check(**arguments)
        except (ValueError, ArithmeticError) as error:
            reason = (
                str(error) if isinstance(error, ValueError) else "it divides by zero or leaves the range of numbers."
            )
            raise NetlistError(f"{where} cannot be computed: {reason}") from None
        limits = self._each(name, "limits", lambda line, value: self._limit(result, line, value, where))
        published = self._each(
            name, "published", lambda line, value: self._on_line(result, line, value, f"{where}.published")
        )
        note = table.get("note", "")
        return CheckedResult(name, table["is"], result, limits, published, str(note))

    def _each(self, name: str, key: str, read: Callable[[str, Any], Any]) -> dict[str, Any]:
        """Read a table of a check with entries for some lines of its result."""
        table, values = self.document.checks[name].get(key, {}), {}
        try:
            if not isinstance(table, dict):
                raise NetlistError(f"checks.{name}.{key} must be a table by line of the result.")
            for line, value in table.items():
                values[line] = read(line, value)
        except ModelicaLikeError as error:
            raise placed(error, self._source(name, key)) from None
        return values

    def _source(self, name: str, key: str) -> Source:
        return self.document.lines.within("checks", name, key)

    def _limit(self, result: Any, name: str, value: Any, where: str) -> tuple[Any, Any]:
        if not isinstance(value, dict) or not value or set(value) - {"min", "max"}:
            raise NetlistError(
                f"{where}.limits.{name} must have min or max.", advice='Write { max = "100 N.m" } or { min = 1.5 }.'
            )
        place = f"{where}.limits"
        smallest, largest = (
            self._on_line(result, name, value[key], place) if key in value else None for key in ("min", "max")
        )
        return smallest, largest

    def _on_line(self, result: Any, name: str, value: Any, where: str) -> Any:
        """Return a value in SI units to compare with a line of a result."""
        names = [line.name for line in result.lines()]
        if name not in names:
            raise unknown_name(f"{where}: the result has no line '{name}'", name, names)
        if isinstance(value, list) or isinstance(getattr(result, name), str | bool | tuple):
            raise NetlistError(f"{where}.{name} needs a line with a number, and a number to compare it with.")
        return self.converter.quantity(unit_of_line(result, name), value, f"{where}.{name}")


def _line(result: Any, rest: str, path: str) -> Value:
    owner: Any = None
    value, last = result, ""
    for step in rest.split("."):
        match = _STEP.fullmatch(step)
        if match is None or not hasattr(value, match.group(1)):
            parameters = inspect.signature(type(value)).parameters
            raise unknown_name(f"'{path}': the result has no line '{step}'", step, parameters)
        owner, last = value, match.group(1)
        value = getattr(value, last)
        if match.group(2):
            value = _element(value, int(match.group(2)), path)
    if isinstance(value, str | bool | tuple):
        raise NetlistError(f"'{path}' is not a number.")
    return Value(value, unit_of_line(owner, last))


def _element(values: Any, index: int, path: str) -> Any:
    try:
        return values[index]
    except (IndexError, TypeError):
        raise UnknownName(f"'{path}': there is no element {index}.") from None
