"""Runs one Co-Simulation FMU with another importer: python importers.py FOLDER.

The folder has the layout of `inside.py`; the values at the end are written to `meta.json`.
"""

from __future__ import annotations

import ctypes
import importlib.metadata
import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from modelica_like.fmi.inside import Job

PACKAGES = {"ecos": "ecospy", "libcosim": "libcosimpy"}
_INSTANCE = "model"
_TBB = "libtbb.so.12"
_NANOSECONDS = 1e9


class ImporterFailed(Exception):
    """An importer reported that it could not do a request."""


def installed(importer: str) -> bool:
    """Return whether an importer is installed."""
    return importlib.util.find_spec(PACKAGES[importer]) is not None


def load_tbb() -> None:
    """Load the thread library that ecos wants from the package `tbb`; without it the system must have one."""
    try:
        files = importlib.metadata.files("tbb") or ()
    except importlib.metadata.PackageNotFoundError:
        return
    for file in files:
        if file.name == _TBB:
            ctypes.CDLL(str(file.locate()), ctypes.RTLD_GLOBAL)


def run_ecos(fmu: str, step: float, steps: int, names: list[str]) -> dict[str, float]:
    """Return the values at the end."""
    load_tbb()
    import ecospy

    with ecospy.EcosSimulationStructure() as structure:
        structure.add_model(_INSTANCE, fmu)
        with ecospy.EcosSimulation(structure=structure, step_size=step) as simulation:
            if not simulation.init():
                raise ImporterFailed(ecospy.EcosLib.get_last_error())
            simulation.step(steps)
            values = {name: simulation.get_real(f"{_INSTANCE}::{name}") for name in names}
            simulation.terminate()
    return values


def run_libcosim(fmu: str, step: float, steps: int, names: list[str]) -> dict[str, float]:
    """Return the values at the end."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    nanoseconds = round(step * _NANOSECONDS)
    execution: Any = CosimExecution.from_step_size(nanoseconds)
    slave = execution.add_local_slave(CosimLocalSlave(fmu, _INSTANCE))
    observer: Any = CosimObserver.create_last_value()
    execution.add_observer(observer)
    if not execution.simulate_until(nanoseconds * steps):
        raise ImporterFailed(f"It stopped: {execution.status()}")
    references = {v.name.decode(): v.reference for v in execution.slave_variables(slave)}
    values = observer.last_real_values(slave, [references[name] for name in names])
    return dict(zip(names, map(float, values), strict=True))


RUN: dict[str, Callable[[str, float, int, list[str]], dict[str, float]]] = {
    "ecos": run_ecos,
    "libcosim": run_libcosim,
}


if __name__ == "__main__":
    _job = Job(Path(sys.argv[1]))
    _job.leave(RUN[_job.asked["importer"]](*(_job.asked[name] for name in ("fmu", "step", "steps", "names"))))
