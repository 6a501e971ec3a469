"""Run a system of FMUs in a separate process, and read it like any other solution."""

from __future__ import annotations

import json
import threading
import time as clock
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from modelica_like.arguments import checked
from modelica_like.errors import (
    FmuCrashed,
    FmuFailed,
    FmuRefused,
    FmuTimeout,
    Interrupted,
    MissingValue,
    ModelicaLikeError,
    SolveError,
    StepFailed,
    UnknownName,
    ValueOutOfRange,
    did_you_mean,
)
from modelica_like.fmi import failures
from modelica_like.fmi.cosimulation.files import opened
from modelica_like.fmi.cosimulation.solution import CosimSolution, Coupling, bond_columns
from modelica_like.fmi.cosimulation.system import Inputs, Master, Settings, System, check_system
from modelica_like.fmi.inside import PLACE
from modelica_like.fmi.process import run_child, workplace
from modelica_like.runs.collect import Number
from modelica_like.runs.results import needed_outputs, settled
from modelica_like.simulation import seconds
from modelica_like.solve.panels import Progress

__all__ = ["CosimSolution", "Coupling", "cosim"]

TIMEOUT = 600.0
_FIXED_PART = 1e-3
_FIRST_PART = 1e-6
_INNER_PART = 0.1
_LEAST_TOLERANCE = 1e-12
_WATCH = 0.1
_CHILD = Path(__file__).with_name("child.py")


@checked
def cosim(
    system: System | str | Path, until: float | str | None = None, *, step: float | str | None = None,
    master: Master | str | None = None, inputs: Inputs | str | None = None, tolerance: float | None = None,
    parameters: Mapping[str, float] | None = None, fmu_tolerance: float | None = None,
    outputs: Sequence[str] | None = None, interval: float = 0.0, timeout: float = TIMEOUT,
    progress: Progress | None = None, readings: Sequence[str] = (),
) -> CosimSolution:  # fmt: skip
    """Run a system of FMUs, all in one separate process.

    The times of mode changes are known to one communication step.

    Args:
        system: a system, its TOML file, an SSP, or a netlist with FMUs as parts.
        until: end time, a number in s or a quantity; by default that of the system.
        step: communication step, likewise; by default that of the system, or a thousandth of the run.
        master: `jacobi` or `gauss-seidel`.
        inputs: `linear` (FMUs get the slopes of their inputs if they support it) or `hold`.
        tolerance: relative, for a variable step: of what FMUs exchange, and of states and outputs of driven FMUs.
        parameters: start values and parameters, by the FMU's name and the variable's: `motor.J1.J`.
        fmu_tolerance: relative tolerance inside the FMUs; by default their own, or a tenth of `tolerance`.
        outputs: names or patterns (`load.*`) of variables to record; by default all that are not parameters.
        interval: shortest time between two results, in s.
        timeout: time limit in s.
        progress: called with the time reached.
        readings: numbers to read off the run, `max(load.J4.tau)`. Between communication points FMUs tell nothing, and
            the step has its own error. So the run is repeated with half the step, or a quarter of the tolerance, until
            a number changes by less than 1e-5 of the largest amount twice in a row; `change` of a number is what it
            was. The results stay those of the step that is asked for.

    Raises:
        NetlistError, UnknownName, ValueOutOfRange: the system or a value is wrong.
        FmuRefused: an FMU cannot be run this way.
        FmuFailed: an FMU reported an error; FmuCrashed: it crashed the process; FmuTimeout: the run did not finish.
        MissingValue: a reading still changes with 100,000 results, or with the tolerance 1e-12.
        Interrupted: the run was interrupted. `run` of this and of a `SolveError` is the solution up to then.
        OSError: a file cannot be read.
    """
    with nullcontext(system) if isinstance(system, System) else opened(Path(system)) as loaded:
        checked = _checked(loaded, parameters or {}, timeout)
        settings = _settings(checked, until, step, master, inputs, tolerance)
        job = _job(checked, settings) | {"interval": interval, "outputs": outputs, "fmu_tolerance": fmu_tolerance}
        run = _solution(checked, _tolerant(job), timeout, progress)
        if readings:
            run.readings = _read(checked, job, timeout, run, readings)
        return run


def _read(
    system: System, job: dict[str, Any], timeout: float, run: CosimSolution, readings: Sequence[str]
) -> dict[str, Number]:
    """Return readings of a run that is repeated with shorter steps."""
    always = {column.path for column in bond_columns(system)}  # recorded with every run
    needed = [name for name in needed_outputs(run, readings) if name not in always]

    def again(times: int) -> CosimSolution:
        finer = _finer(system.name, job, times, readings[0]) | {"outputs": needed}
        return _solution(system, _tolerant(finer), timeout, None)

    return settled(run, again, readings)


def _tolerant(job: dict[str, Any]) -> dict[str, Any]:
    """Return a job whose FMUs have a tolerance: their errors must not look like those of the coupling."""
    if job["fmu_tolerance"] is not None or job["tolerance"] is None:
        return job
    return job | {"fmu_tolerance": _INNER_PART * job["tolerance"]}


def _finer(name: str, job: dict[str, Any], times: int, reading: str) -> dict[str, Any]:
    """Return a job with so many times as many results."""
    finer = {"step": job["step"] / times, "interval": job["interval"] / times}
    if job["tolerance"] is None:
        return job | finer
    tolerance = job["tolerance"] / times**2
    if tolerance < _LEAST_TOLERANCE:
        raise MissingValue(
            f"{reading} of {name} is not known: it still changes with the tolerance {4 * tolerance:.2g}.",
            advice="Ask with a fixed step, without a tolerance, or simulate the whole netlist.",
        )
    return job | finer | {"tolerance": tolerance}


def _solution(system: System, job: dict[str, Any], timeout: float, progress: Progress | None) -> CosimSolution:
    begin = clock.perf_counter()
    with workplace(job, [unit.file for unit in system.units]) as folder:
        try:
            _run(system, folder, timeout, progress)
        except SolveError as error:
            error.run = _so_far(system, folder, begin)
            raise
        except KeyboardInterrupt as interrupt:
            raise Interrupted.after(_so_far(system, folder, begin)) from interrupt
        return CosimSolution(system, *_left(folder, "meta.json"), clock.perf_counter() - begin)


def _so_far(system: System, folder: Path, begin: float) -> CosimSolution | None:
    """Return the results of an unfinished run, if it has made a step."""
    if not (folder / "columns.json").exists():
        return None
    columns, table = _left(folder, "columns.json")
    return CosimSolution(system, columns, table, clock.perf_counter() - begin) if len(table) > 1 else None


def _left(folder: Path, columns: str) -> tuple[dict[str, Any], Any]:
    """Return the columns and the complete rows written by the process."""
    about, numbers = json.loads((folder / columns).read_text()), np.fromfile(folder / "rows")
    width = about["width"]
    return about, numbers[: len(numbers) // width * width].reshape(-1, width)


def _checked(system: System, given: Mapping[str, float], timeout: float) -> System:
    """Return a system that can run, with other parameters."""
    check_system(system)
    if timeout <= 0:
        raise ValueOutOfRange(f"{system.name}: the time limit must be positive, not {timeout:g} s.")
    units = {unit.name: unit for unit in system.units}
    for name, value in given.items():
        unit, _, variable = name.partition(".")
        if unit not in units:
            raise UnknownName(f"{system.name} has no FMU '{unit}'{did_you_mean(unit, units) or '.'}")
        units[unit] = replace(units[unit], parameters={**units[unit].parameters, variable: float(value)})
    return replace(system, units=tuple(units.values()))


def _settings(
    system: System, until: float | str | None, step: float | str | None, master: str | None, inputs: str | None,
    tolerance: float | None,
) -> Settings:  # fmt: skip
    base = system.settings
    if until is None and base.until is None:
        raise ValueOutOfRange(
            f"{system.name}: there is no end time.",
            advice="Give `until`, or put it under [simulate] in the system's file.",
        )
    end = seconds(until if until is not None else base.until)
    chosen = tolerance if tolerance is not None else base.tolerance
    part = _FIXED_PART if chosen is None else _FIRST_PART
    size = seconds(step, "step") if step is not None else base.step or end * part
    for what, value in (("end time", end), ("step", size)):
        if not 0 < value < np.inf:
            raise ValueOutOfRange(f"The {what} must be positive, not {value:g} s.")
    if chosen is not None and not _LEAST_TOLERANCE <= chosen <= 0.1:
        raise ValueOutOfRange(f"tolerance = {chosen:g} must be a number from 1e-12 to 0.1.")
    return Settings(end, min(size, end), master or base.master, inputs or base.inputs, chosen)


def _job(system: System, settings: Settings) -> dict[str, Any]:
    number = {unit.name: k for k, unit in enumerate(system.units)}
    links = {link.name: k for k, link in enumerate(system.links)}
    return {
        "units": [{"name": u.name, "parameters": dict(u.parameters)} for u in system.units],
        "links": [
            {"ends": [[number[p.unit], p.variable] for p in (link.source, *link.targets)]} for link in system.links
        ],
        "bonds": [{"flow": links[bond.flow], "rate": links[bond.rate], "name": bond.name} for bond in system.bonds],
        "own_names": system.own_names, "start": 0.0, **vars(settings),
    }  # fmt: skip


def _run(system: System, folder: Path, timeout: float, progress: Progress | None) -> None:
    done = threading.Event()
    watcher = threading.Thread(target=_watch, args=(folder, done, progress), daemon=True)
    watcher.start()
    try:
        run_child(system.name, _CHILD, folder, timeout)
    except (FmuCrashed, FmuTimeout) as error:
        raise tell_loss(system, _place(folder)[1], error) from None
    finally:
        done.set()
        watcher.join()
    tell_error(system, folder)


def _watch(folder: Path, done: threading.Event, progress: Progress | None) -> None:
    """Report the time reached at intervals."""
    while progress is not None and not done.wait(_WATCH):
        time, _ = _place(folder)
        if not np.isnan(time):
            progress(time)


def _place(folder: Path) -> tuple[float, int]:
    """Return the time reached, and the number of the FMU that was called last."""
    return PLACE.unpack((folder / "progress").read_bytes())


# -- what can go wrong -------------------------------------------------------------------------------------------------


def tell_loss(system: System, calling: int, error: FmuCrashed | FmuTimeout) -> ModelicaLikeError:
    """Return the error of a lost process, with the name of the FMU that was called last."""
    unit = system.units[calling]
    if isinstance(error, FmuTimeout):
        return FmuTimeout(error.what, why=f"{unit.name} ({unit.file.name}) was running.", advice=error.advice)
    what = f"{unit.name} ({unit.file.name}){error.what.removeprefix(system.name)}"
    return FmuCrashed(what, why=f"The FMUs of {system.name} ran in a process of their own.")


def tell_error(system: System, folder: Path) -> None:
    """Raise the error that the process has reported."""
    units = {unit.name: f"{unit.name} ({unit.file.name})" for unit in system.units}
    shorter = "If the exchanged values grow without bounds, choose a shorter step."
    failures.tell_error(folder, units, _FAILURES, system=system.name, shorter=shorter)


_FAILURES: failures.Failures = failures.FAILURES | {
    "no output": (UnknownName, "{system} has no variable '{name}'{hint}", "", ""),
    "too old": (FmuRefused, "{unit} is an FMU of FMI 1.0.", "", "Co-simulation supports FMI 2.0 and 3.0."),
    "no co-simulation": (
        FmuRefused, "{unit} has no Co-Simulation part.", "", "Export it as a Co-Simulation FMU.",
    ),
    "no rollback": (
        FmuRefused,
        "{unit} cannot restore a saved state, or cannot take steps of any length, so the step cannot vary.",
        "It needs both canGetAndSetFMUState and canHandleVariableCommunicationStepSize.",
        "Run with a fixed step, without tolerance.",
    ),
    "not settled": (
        FmuFailed,
        "{unit}: {name} does not settle at t = {time:.6g} s when inputs follow outputs.",
        "{system} has an algebraic loop: the output depends directly on inputs that depend directly on this output.",
        "Cut where a mass, a spring or a controller with a state is between the FMUs.",
    ),
    "not finite": (
        FmuFailed, "{unit}: {name} is not finite at t = {time:.6g} s.", "",
        "If the values before it grow without bounds, choose a shorter step.",
    ),
    "unstable": (
        StepFailed, "{system}: at t = {time:.6g} s the energy that the coupling {bond} makes grows without bounds.",
        "The values that the FMUs exchange swing against each other: the step of {size:.6g} s is too long.",
        "Choose a shorter step, or give a tolerance.",
    ),
    "step": (
        StepFailed, "{system}: after t = {time:.6g} s no step is short enough for the tolerance of the coupling.", "",
        "Give a larger tolerance, or a fixed step.",
    ),
}  # fmt: skip
