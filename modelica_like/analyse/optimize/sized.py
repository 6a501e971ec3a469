"""Lines of the design checks of a drive's sizing file as outputs, `spindle.safety`, with derivatives by its loads."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from modelica_like.analyse.sizing.document import read_document
from modelica_like.analyse.sizing.formulas import Value
from modelica_like.analyse.sizing.run import Checks
from modelica_like.analyse.sizing.simulated import READERS, Simulations, name_of_load
from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import NetlistError
from modelica_like.language import Assembly
from modelica_like.language.inside import inside
from modelica_like.language.units import Unit, parse_unit
from modelica_like.runs.readings import read_output

_STEP, _ZERO = 1e-4, 1e-2
"""Steps relative to a load, and half of it: checks are formulas that are known to 1e-15, and extrapolation leaves the
fourth power. A load of 0 has steps as of one of 0.01 in SI units."""
_LOAD = "Of a load of this netlist the run of the optimisation counts, so it has neither `until` nor `set`."


class Sized:
    """The design checks of a drive's sizing file, as functions of the loads that its run gives them.

    Args:
        drive: the drive; without a sizing file there are no outputs.
        model: compiled.

    Attributes:
        loads: readings of the run that the file takes, each once.
    """

    def __init__(self, drive: Any, model: CompiledDae) -> None:
        path = Path(inside(drive).sizing) if isinstance(drive, Assembly) and inside(drive).sizing else None
        self._document = read_document(path) if path is not None else None
        self.loads: tuple[str, ...] = ()
        self._parts = {name.partition(".")[0] for name in model.units}
        if self._document is None or path is None:
            return
        origin = Path(inside(drive).origin).resolve()
        self._simulations = _Known(path.parent, origin)
        given = [*self._document.parameters.values(), *self._document.checks.values()]
        names = [name_of_load(table) for table in _tables(given) if self._simulations.is_own(table)]
        self.loads = tuple(dict.fromkeys(names))
        self._simulations.units = {name: parse_unit(str(read_output(model, name).unit)) for name in self.loads}

    def has(self, name: str) -> bool:
        """Return whether a name is that of a line of a check; a part of the drive comes first."""
        first = name.strip().partition(".")[0]
        return self._document is not None and first in self._document.checks and first not in self._parts

    def unit(self, name: str, loads: Vector) -> Unit:
        """Return the unit of a line.

        Raises:
            NetlistError: it is not a single number.
            ModelicaLikeError: the check has no such line, or the sizing file has an error.
        """
        value = self._checks(loads).lookup(name.strip())
        if np.ndim(value.number):
            raise NetlistError(f"'{name}' has {np.size(value.number)} values.", advice=f"Write one of them: {name}[0].")
        return value.unit

    def values(self, names: Sequence[str], loads: Vector) -> Vector:
        """Return lines of checks, shape (names,), at loads, shape (loads,)."""
        checks = self._checks(loads)
        return np.array([float(checks.lookup(name.strip()).number) for name in names])

    def slopes(self, names: Sequence[str], loads: Vector) -> Vector:
        """Return their derivatives by the loads, shape (names, loads), by extrapolated differences."""
        slopes = np.zeros((len(names), len(loads)))
        for k, load in enumerate(loads):
            differences: list[Vector] = []
            for step in _STEP * (abs(load) or _ZERO) * np.array([1.0, 0.5]):
                move = step * np.eye(len(loads))[k]
                differences.append((self.values(names, loads + move) - self.values(names, loads - move)) / (2.0 * step))
            slopes[:, k] = (4.0 * differences[1] - differences[0]) / 3.0
        return slopes

    def _checks(self, loads: Vector) -> Checks:
        assert self._document is not None
        self._simulations.values = dict(zip(self.loads, map(float, loads), strict=True))
        return Checks(self._document, self._simulations)


class _Known(Simulations):
    """Loads of one netlist that are known; those of others are simulated, once."""

    def __init__(self, folder: Path, origin: Path) -> None:
        super().__init__(folder)
        self._origin = origin
        self.values: dict[str, float] = {}
        self.units: dict[str, Unit] = {}

    def is_own(self, table: Mapping[str, Any]) -> bool:
        """Return whether a load is one of the netlist.

        Raises:
            NetlistError: it is that of another run of it.
        """
        own = (self.folder / str(table["from"])).resolve() == self._origin
        if own and not table.keys().isdisjoint(("until", "set")):
            raise NetlistError(f"A load of '{table['from']}' has a run of its own.", advice=_LOAD)
        return own

    def load(self, table: Mapping[str, Any], where: str) -> Value:
        if not self.is_own(table):
            return super().load(table, where)
        name = name_of_load(table)
        return Value(self.values[name], self.units[name])


def _tables(given: Any) -> Iterator[Mapping[str, Any]]:
    """Yield the loads from simulations in what a sizing file gives."""
    if isinstance(given, dict) and isinstance(given.get("from"), str) and len(given.keys() & READERS.keys()) == 1:
        yield given
    elif isinstance(given, dict | list):
        for inner in given.values() if isinstance(given, dict) else given:
            yield from _tables(inner)
