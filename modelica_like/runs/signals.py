"""What is shown of a run: variables by name or pattern, and formulas of variables."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.errors import NetlistError, UnitError, UnknownName, did_you_mean
from modelica_like.language.formula import Formula, parse_formula
from modelica_like.language.units import ANY, ONE, Unit, parse_unit, read_quantity, same_dimension
from modelica_like.runs.display import QUANTITIES, Display
from modelica_like.runs.trajectories import ENERGY_TERMS, Trajectories, fitting

_KEPT = ("rad/s", "rad", "rad/s2", "N.m")
"""Units with a dimension that has another meaning, too: a product of units is not called one of them."""


@dataclass(frozen=True)
class Signal:
    """A variable, or a formula of variables.

    Attributes:
        name: path, or text of the formula.
        unit: coherent SI unit.
        formula: of variables.
        driving: -1 if pictures show it with the other sign.
    """

    name: str
    unit: str
    formula: Formula
    driving: int = 1

    @property
    def label(self) -> str:
        """Name in pictures, with the sign in which it is shown."""
        return self.name if self.driving > 0 else f"\u2212{self.name}"

    @property
    def plain(self) -> bool:
        """Whether it is a variable."""
        return self.formula.operation == "name"

    def shown_in(self, display: Display) -> str:
        """Return the unit in which it is shown."""
        return display.of(self.name) if self.name in display else display.of_quantity(self.unit)

    def values(self, run: Trajectories) -> Vector:
        """Return its trajectory in SI units, shape (len(time),).

        Raises:
            UnknownName: the run has no such variable.
        """
        if self.plain:
            return run[self.name]
        names = list(dict.fromkeys(self.formula.names()))
        symbols = {name: ca.SX.sym(name) for name in names}
        value = self.formula.evaluate(symbols.__getitem__, lambda text: ca.SX(si_value(text)))
        columns = run.together(*names)
        result: Any = ca.Function("shown", list(symbols.values()), [value])(*(columns[name][None] for name in names))
        return np.asarray(result.full())[0]


def read_signals(model: Any, words: Iterable[str]) -> list[Signal]:
    """Read names, patterns (`*.w`) and formulas (`2*pi*motor.w`, `clutch.tau*clutch.w_rel`), before a run.

    Args:
        model: of the run.
        words: what matches no variable is read as a formula of variables, parameters, energies and `time`.

    Raises:
        UnknownName: nothing matches, or a formula names something that the model does not have.
        NetlistError: a text is no formula.
        UnitError: the units in a formula do not fit together.
    """
    unit_of_path = _units(model)
    terms = {f"{component}.{term}" for component in getattr(model, "components", ()) for term in ENERGY_TERMS}
    names = [variable.path for variable in (*model.flat_variables, *model.flat_discretes) if not variable.hidden]
    signs = {variable.path: getattr(variable, "driving", 1) for variable in model.flat_variables}
    signals: dict[str, Signal] = {}
    for word in words:
        pool = sorted(terms) if word.rpartition(".")[2] in ENERGY_TERMS else names
        try:
            paths = fitting(pool, [word], f"{model.name} has no variable")
        except UnknownName as error:
            formula = formula_of(word)
            if formula is None:
                raise error from None
            signals[word] = Signal(word, unit_of(formula, unit_of_path | _energies(terms), model.name), formula)
        else:
            units = unit_of_path | _energies(terms)
            signals |= {path: Signal(path, units[path], Formula("name", (path,)), signs.get(path, 1)) for path in paths}
    return list(signals.values())


def named(model: Any, paths: Sequence[str]) -> list[Signal]:
    """Return variables as signals."""
    variables = {variable.path: variable for variable in (*model.flat_variables, *model.flat_discretes)}
    pairs = ((path, variables[path]) for path in paths)
    return [Signal(p, str(v.unit), Formula("name", (p,)), getattr(v, "driving", 1)) for p, v in pairs]


def evaluated(run: Trajectories, signals: Sequence[Signal]) -> dict[str, Vector]:
    """Return the trajectories of signals by name, in SI units."""
    plain = run.together(*(signal.name for signal in signals if signal.plain))
    return {signal.name: plain[signal.name] if signal.plain else signal.values(run) for signal in signals}


def _units(model: Any) -> dict[str, str]:
    units = {parameter.path: str(parameter.unit) for parameter in getattr(model, "flat_parameters", ())} | {"time": "s"}
    return units | {variable.path: str(variable.unit) for variable in (*model.flat_variables, *model.flat_discretes)}


def _energies(terms: Iterable[str]) -> dict[str, str]:
    return {path: "J" if path.endswith(ENERGY_TERMS[0]) else "W" for path in terms}


def formula_of(word: str) -> Formula | None:
    """Read a formula that names something; None if the text is a name or a pattern.

    Raises:
        NetlistError: it can only be meant as a formula, but is none.
    """
    try:
        formula = parse_formula(word)
    except NetlistError:
        if set(word) & set("+-/(^ "):
            raise
        return None
    return formula if formula.operation != "name" and any(True for _ in formula.names()) else None


def unit_of(formula: Formula, units: dict[str, str], model: str) -> str:
    """Return the unit of a formula, by the units of its names; `*` if it is not known.

    Raises:
        UnknownName: it names something else.
        UnitError: the units do not fit together.
    """

    def unit(name: str) -> Unit:
        if name not in units:
            raise UnknownName(f"'{formula}': {model} has no variable '{name}'{did_you_mean(name, units) or '.'}")
        return parse_unit(units[name])

    formula_unit = formula.unit(unit)
    # What is not known fits every quantity.
    if str(formula_unit) in QUANTITIES or formula_unit == ANY:
        return str(formula_unit)
    return next(
        (q for q in QUANTITIES if q not in _KEPT and same_dimension(parse_unit(q), formula_unit)),
        str(formula_unit),
    )


def si_value(text: str) -> float:
    """Return the SI value of a quantity in a formula.

    Raises:
        UnitError: it is a temperature of a scale with a zero of its own.
    """
    number, unit = read_quantity(text) or (np.nan, ONE)
    if unit.offset:
        raise UnitError(f"'{text}' in a formula: give differences of temperature in K.")
    return number * unit.factor
