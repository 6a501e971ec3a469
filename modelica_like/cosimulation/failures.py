"""What can go wrong in a co-simulation, in sentences."""

from __future__ import annotations

from pathlib import Path

from modelica_like.cosimulation.system import System
from modelica_like.errors import (
    FmuCrashed,
    FmuFailed,
    FmuRefused,
    FmuTimeout,
    ModelicaLikeError,
    StepFailed,
    UnknownName,
)
from modelica_like.fmi import failures


def tell_loss(system: System, calling: int, error: FmuCrashed | FmuTimeout) -> ModelicaLikeError:
    """Return the error of a lost process, with the name of the FMU that was called last."""
    unit = system.units[calling]
    if isinstance(error, FmuTimeout):
        return FmuTimeout(error.what, why=f"{unit.name} ({unit.file.name}) was at work.", advice=error.advice)
    what = f"{unit.name} ({unit.file.name}){error.what.removeprefix(system.name)}"
    return FmuCrashed(what, why=f"The FMUs of {system.name} ran in a process of their own.")


def tell_error(system: System, folder: Path) -> None:
    """Raise what the process has left to tell."""
    units = {unit.name: f"{unit.name} ({unit.file.name})" for unit in system.units}
    shorter = "If what the FMUs exchange grows without bounds, take a shorter step."
    failures.tell_error(folder, units, _FAILURES, system=system.name, shorter=shorter)


_FAILURES: failures.Failures = failures.FAILURES | {
    "no output": (UnknownName, "{system} has no variable '{name}'{hint}", "", ""),
    "too old": (FmuRefused, "{unit} is an FMU of FMI 1.0.", "", "Co-simulation takes FMI 2.0 and 3.0."),
    "no co-simulation": (
        FmuRefused, "{unit} has no Co-Simulation part.", "", "Export it as a Co-Simulation FMU.",
    ),
    "no rollback": (
        FmuRefused,
        "{unit} cannot go back to a saved state, or does not take steps of any length, so the step cannot vary.",
        "It needs both canGetAndSetFMUState and canHandleVariableCommunicationStepSize.",
        "Run with a fixed step, without tolerance.",
    ),
    "not settled": (
        FmuFailed,
        "{unit}: {name} does not come to rest at t = {time:.6g} s when inputs follow outputs.",
        "{system} has an algebraic loop: the output follows inputs at once that follow this output at once.",
        "Cut where a mass, a spring or a controller with a state is between the FMUs.",
    ),
    "not finite": (
        FmuFailed, "{unit}: {name} is not finite at t = {time:.6g} s.", "",
        "If the values before it grow without bounds, take a shorter step.",
    ),
    "step": (
        StepFailed, "{system}: after t = {time:.6g} s no step is short enough for the tolerance of the coupling.", "",
        "Give a larger tolerance, or a fixed step.",
    ),
    "ends": (FmuFailed, "{unit} wants to end the run after t = {time:g} s.", "", ""),
}  # fmt: skip
