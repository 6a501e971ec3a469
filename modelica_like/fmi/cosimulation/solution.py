"""Results of a co-simulation: trajectories, and the energy that each coupling has created or lost."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.fmi.cosimulation.described import described
from modelica_like.fmi.cosimulation.system import Energies, System
from modelica_like.runs.recorded import RecordedModel, RecordedSolution, RecordedVariable
from modelica_like.solve.recorder import TERMINATED, Ended

_TOLD = 5
"""Numbers of a bond in a row: power, energies delivered and received, throughput, mismatch."""


@dataclass
class Coupling(Energies):
    """Energy at a bond over a run."""

    name: str

    def __str__(self) -> str:
        share = self.residual / self.throughput if self.throughput else 0.0
        return (
            f"{self.name}: {self.throughput:.4g} J passed through, residual {self.residual:.3g} J ({share:.1e}), "
            f"mismatch {self.mismatch:.3g} J"
        )


class CosimSolution(RecordedSolution):
    """Trajectories of a system of FMUs.

    Each bond has two variables: `….power` in W and `….residual_energy` in J. Modes change at some time in the
    communication step before their recorded time.

    Args:
        system: the system.
        left: columns and parameters of each FMU, and the unconnected inputs.
        table: shape (times, columns): the time in s, the variables, the energies of each bond, the counts.
        seconds: wall time.

    Attributes:
        couplings: energies at the bonds.
        steps: number of communication steps.
        rejected: number of rejected steps.
        shortest: shortest communication step in s.
        longest: longest communication step in s.
        notices: messages about the run: unconnected inputs.
    """

    advice = "Ask before the run: cosim(…, readings=[…]), or simulate the whole netlist."

    def __init__(self, system: System, left: Mapping[str, Any], table: Vector, seconds: float) -> None:
        columns = _columns(system, [part["columns"] for part in left["units"]])
        constants = {
            name if system.own_names else f"{unit.name}.{name}": value
            for unit, part in zip(system.units, left["units"], strict=True)
            for name, value in part["constants"].items()
        }
        modes = np.array([column.kind == "discrete" for column in columns], dtype=bool)
        continuous = (*(column for column in columns if column.kind != "discrete"), *bond_columns(system))
        model = RecordedModel(
            system.name, continuous, tuple(column for column in columns if column.kind == "discrete"), constants
        )
        rows, values = table.T, table.T[1 : 1 + len(columns)]
        bonds = rows[1 + len(columns) : -4].reshape(-1, _TOLD, len(table))
        energies = np.stack([bonds[:, 0], bonds[:, 2] - bonds[:, 1]], axis=1).reshape(-1, len(table))
        super().__init__(model, rows[0].copy(), np.concatenate([values[~modes], energies]), values[modes], seconds)
        self.couplings = tuple(
            Coupling(bond.name, **dict(zip(vars(Energies()), map(float, last[1:]), strict=True)))
            for bond, last in zip(system.bonds, bonds[:, :, -1], strict=True)
        )
        self.notices = tuple(map(_notice, left["open"]))
        if (end := left.get("ended")) is not None:
            self._ended = Ended(end["time"], end["unit"], TERMINATED)
        self.shortest, self.longest = map(float, table[-1, -2:])
        self.steps, self.rejected = map(int, table[-1, -4:-2])


def described_model(system: System) -> RecordedModel:
    """Return the names of the results of a run, as far as the descriptions of the FMUs give them."""
    fmus = [described(unit.file).variables.values() for unit in system.units]
    columns = _columns(system, [[{"path": variable.name} for variable in fmu if variable.varies] for fmu in fmus])
    return RecordedModel(system.name, (*columns, *bond_columns(system)), (), {})


def _columns(system: System, units: Sequence[Sequence[Mapping[str, Any]]]) -> list[RecordedVariable]:
    counts = Counter(entry["path"] for unit in units for entry in unit)
    columns: list[RecordedVariable] = []
    for unit, entries in zip(system.units, units, strict=True):
        for entry in entries:
            short = system.own_names and counts[entry["path"]] == 1
            path = entry["path"] if short else f"{unit.name}.{entry['path']}"
            columns.append(RecordedVariable(**{**entry, "path": path, "names": dict(entry.get("names", ()))}))
    return columns


def bond_columns(system: System) -> list[RecordedVariable]:
    """Return the variables of the couplings, which no FMU has."""
    terms = ("power", "W", "power through the coupling"), ("residual_energy", "J", "energy created by the coupling")
    return [RecordedVariable(f"{bond.name}.{name}", unit, text) for bond in system.bonds for name, unit, text in terms]


def _notice(entry: dict[str, Any]) -> str:
    unit = "" if entry["unit"] == "1" else f" {entry['unit']}"
    return f"Nothing is connected to {entry['fmu']}.{entry['path']}: it stays at {entry['value']:g}{unit}."
