"""What a co-simulation gives: trajectories, and the energy that each coupling has made or lost."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.cosimulation.system import Energies, System
from modelica_like.solve.recorded import RecordedModel, RecordedSolution, RecordedVariable


@dataclass
class Coupling(Energies):
    """Energy at a bond over a run.

    Attributes:
        name: of the bond.
    """

    name: str

    def __str__(self) -> str:
        share = self.residual / self.throughput if self.throughput else 0.0
        return (
            f"{self.name}: {self.throughput:.4g} J passed through, residual {self.residual:.3g} J ({share:.1e}), "
            f"mismatch {self.mismatch:.3g} J"
        )


class CosimSolution(RecordedSolution):
    """Trajectories of a system of FMUs.

    Each bond has two variables of its own: `….power` in W and `….residual_energy` in J. Modes have changed somewhere in
    the communication step before the time at which they are seen.

    Attributes:
        couplings: energies at the bonds.
        steps: number of communication steps.
        rejected: number of steps that were taken back.
        shortest: shortest communication step in s.
        longest: longest communication step in s.
        notices: what should be known about the run: inputs to which nothing is connected.
    """

    def __init__(
        self, model: RecordedModel, table: Vector, is_mode: list[bool], couplings: tuple[Coupling, ...],
        counts: dict[str, Any], notices: tuple[str, ...], seconds: float,
    ) -> None:  # fmt: skip
        modes = np.array(is_mode, dtype=bool)
        columns = table[:, 1:].T
        super().__init__(model, table[:, 0].copy(), columns[~modes], columns[modes], seconds)
        self.couplings, self.notices = couplings, notices
        self.steps, self.rejected = int(counts["steps"]), int(counts["rejected"])
        self.shortest, self.longest = float(counts["shortest"]), float(counts["longest"])


def cosim_solution(system: System, meta: dict[str, Any], table: Vector, seconds: float) -> CosimSolution:
    """Make the solution of what a run has left.

    Args:
        system: what was run.
        meta: columns, energies, counts.
        table: shape (times, 1 + columns), times in s first.
        seconds: wall time.
    """
    columns: list[RecordedVariable] = []
    constants: dict[str, float] = {}
    counts = Counter(entry["path"] for part in meta["units"] for entry in part["columns"])
    for unit, part in zip(system.units, meta["units"], strict=True):
        for entry in part["columns"]:
            path = entry["path"] if system.own_names and counts[entry["path"]] == 1 else f"{unit.name}.{entry['path']}"
            columns.append(RecordedVariable(**{**entry, "path": path, "names": dict(entry["names"])}))
        for name, value in part["constants"].items():
            constants[name if system.own_names else f"{unit.name}.{name}"] = value
    for bond in system.bonds:
        columns.append(RecordedVariable(f"{bond.name}.power", "W", "power through the coupling"))
        columns.append(RecordedVariable(f"{bond.name}.residual_energy", "J", "energy that the coupling has made"))
    modes = [column.kind == "discrete" for column in columns]
    continuous = tuple(column for column, mode in zip(columns, modes, strict=True) if not mode)
    discrete = tuple(column for column, mode in zip(columns, modes, strict=True) if mode)
    couplings = tuple(
        Coupling(bond.name, **{one.name: values[one.name] for one in fields(Energies)})
        for bond, values in zip(system.bonds, meta["balances"], strict=True)
    )
    model = RecordedModel(system.name, continuous, discrete, constants)
    return CosimSolution(model, table, modes, couplings, meta["counts"], tuple(map(_notice, meta["open"])), seconds)


def _notice(entry: dict[str, Any]) -> str:
    unit = "" if entry["unit"] == "1" else f" {entry['unit']}"
    return f"Nothing is connected to {entry['fmu']}.{entry['path']}: it stays at {entry['value']:g}{unit}."
