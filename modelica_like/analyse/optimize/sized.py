"""Lines of the design checks of a drive's sizing file as outputs, `spindle.safety`, with derivatives by its loads."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from modelica_like.analyse.sizing.document import SizingDocument, read_document
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
from modelica_like.runs.solution import Solution

_LINE = re.compile(r"\s*([A-Za-z_]\w*)\.[\w.\[\]]+\s*")
_STEP, _ZERO = 1e-4, 1e-2
"""Steps relative to a load, and half of it: checks are formulas that are known to 1e-15, and extrapolation leaves the
fourth power. A load of 0 has steps as of one of 0.01 in SI units."""
_LOAD = "Of a load of this netlist the run of the optimisation counts, so it has neither `until` nor `set`."


class Sized:
    """The design checks of a drive's sizing file, as functions of the loads that its run gives them.

    The file is read when a line of it is asked for, and only what that line takes counts.

    Args:
        drive: the drive; without a sizing file there are no outputs.
        model: compiled.
        simulate: runs the model as it is; once, for the loads that a line takes.

    Attributes:
        loads: readings of the run that the lines asked for take, each once.
    """

    def __init__(self, drive: Any, model: CompiledDae, simulate: Callable[[], Solution]) -> None:
        self._drive, self._simulate = drive, simulate
        self._parts = {name.partition(".")[0] for name in model.units}
        self._run: Solution | None = None
        self.loads: tuple[str, ...] = ()

    def __getstate__(self) -> dict[str, Any]:
        """Return what another process needs: the run is read by then, and its document it reads itself."""
        return {name: value for name, value in vars(self).items() if name != "_document"} | {"_run": None}

    @cached_property
    def _document(self) -> SizingDocument | None:
        path = inside(self._drive).sizing if isinstance(self._drive, Assembly) else ""
        return read_document(Path(path)) if path else None

    @cached_property
    def _simulations(self) -> _Known:
        known = inside(self._drive)
        return _Known(Path(known.sizing).parent, Path(known.origin).resolve())

    def has(self, name: str) -> bool:
        """Return whether a name is that of a line of a check; a part of the drive comes first.

        Raises:
            NetlistError: it is no part, and the sizing file has an error.
        """
        match = _LINE.fullmatch(name)
        if match is None or match[1] in self._parts:
            return False
        return self._document is not None and match[1] in self._document.checks

    def unit(self, name: str) -> Unit:
        """Return the unit of a line, whose loads are known from now on.

        Raises:
            NetlistError: it is not a single number, or one of its loads has a run of its own.
            ModelicaLikeError: the check has no such line, the sizing file has an error, or the drive does not run.
        """
        value = self._checks(self._read).lookup(name.strip())
        if np.ndim(value.number):
            raise NetlistError(f"'{name}' has {np.size(value.number)} values.", advice=f"Write one of them: {name}[0].")
        return value.unit

    def values(self, names: Sequence[str], loads: Vector) -> Vector:
        """Return lines of checks, shape (names,), at loads, shape (loads,)."""
        given = dict(zip(self.loads, map(float, loads), strict=True))
        checks = self._checks(given.__getitem__)
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

    def _read(self, name: str) -> float:
        """Read a load off the drive as it is, and remember that it counts."""
        if self._run is None:
            self._run = self._simulate()
        self.loads = tuple(dict.fromkeys([*self.loads, name]))
        self._simulations.units[name] = parse_unit(str(read_output(self._run.model, name).unit))
        return float(self._run.read(name)[0])

    def _checks(self, value_of: Callable[[str], float]) -> Checks:
        assert self._document is not None
        self._simulations.value_of = value_of
        return Checks(self._document, self._simulations)


class Outputs:
    """Outputs of runs, of which some are lines of design checks.

    Args:
        names: of the outputs; the units of lines were asked for.
        sized: the design checks.

    Attributes:
        read: what is read off a run, each once: outputs, and loads of lines.
    """

    def __init__(self, names: Sequence[str], sized: Sized) -> None:
        self._sized = sized
        self._lines = [name for name in names if sized.has(name)]
        self.read = list(dict.fromkeys([*(name for name in names if name not in self._lines), *sized.loads]))
        self._loads = [self.read.index(name) for name in sized.loads]
        every = [*self.read, *self._lines]
        self._places = [every.index(name) for name in names]

    def values(self, numbers: Vector) -> Vector:
        """Return outputs, shape (runs, outputs), from what was read, shape (runs, read); nan where loads are."""
        lines = np.full((len(numbers), len(self._lines)), np.nan)
        for k, loads in enumerate(numbers[:, self._loads] if self._lines else ()):
            if np.all(np.isfinite(loads)):
                lines[k] = self._sized.values(self._lines, loads)
        return np.hstack([numbers, lines])[:, self._places]

    def slopes(self, numbers: Vector, derivatives: Vector) -> Vector:
        """Return derivatives, shape (outputs, parameters), from those of what was read; `numbers` has its values."""
        if self._lines:
            by_loads = self._sized.slopes(self._lines, numbers[self._loads])
            derivatives = np.vstack([derivatives, by_loads @ derivatives[self._loads]])
        return derivatives[self._places]


class _Known(Simulations):
    """Loads of one netlist that are known; those of others are simulated, once."""

    def __init__(self, folder: Path, origin: Path) -> None:
        super().__init__(folder)
        self._origin = origin
        self.value_of: Callable[[str], float] = _unknown
        self.units: dict[str, Unit] = {}

    def load(self, table: Mapping[str, Any], where: str) -> Value:
        own = (self.folder / str(table.get("from", ""))).resolve() == self._origin
        if not own or len(table.keys() & READERS.keys()) != 1:  # which the other ones refuse
            return super().load(table, where)
        if not table.keys().isdisjoint(("until", "set")):
            raise NetlistError(f"A load of '{table['from']}' has a run of its own.", advice=_LOAD)
        name = name_of_load(table)
        number = self.value_of(name)
        return Value(number, self.units[name])


def _unknown(_: str) -> float:
    return np.nan
