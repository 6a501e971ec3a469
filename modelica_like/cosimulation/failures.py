"""What can go wrong in a co-simulation, in sentences."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from modelica_like.cosimulation.system import System
from modelica_like.errors import (
    FmuCrashed,
    FmuFailed,
    FmuRefused,
    FmuTimeout,
    ModelicaLikeError,
    StepFailed,
    UnknownName,
    did_you_mean,
)
from modelica_like.fmi.run import article
from modelica_like.fmi.unpack import printable


def tell_loss(system: System, calling: int, error: FmuCrashed | FmuTimeout) -> ModelicaLikeError:
    """Return the error of a lost process, with the name of the FMU that was called last."""
    unit = system.units[calling]
    if isinstance(error, FmuTimeout):
        return FmuTimeout(error.what, why=f"{unit.name} ({unit.file.name}) was at work.", advice=error.advice)
    what = f"{unit.name} ({unit.file.name}){error.what.removeprefix(system.name)}"
    return FmuCrashed(what, why=f"The FMUs of {system.name} ran in a process of their own.")


def tell_error(system: System, folder: Path) -> None:
    """Raise what the process has left to tell."""
    if not (folder / "error.json").exists():
        return
    error = json.loads((folder / "error.json").read_text())
    files = {unit.name: unit.file.name for unit in system.units}
    name = error.get("unit", "")
    raise _ERRORS[error["kind"]](system.name, f"{name} ({files[name]})" if name else "", error)


def _unknown(system: str, unit: str, error: dict[str, Any]) -> ModelicaLikeError:
    hint = did_you_mean(error["name"], error["known"]) or "."
    return UnknownName(f"{unit} has no variable '{error['name']}'{hint}")


def _no_output(system: str, unit: str, error: dict[str, Any]) -> ModelicaLikeError:
    hint = did_you_mean(error["name"], error["known"]) or "."
    return UnknownName(f"{system} has no variable '{error['name']}'{hint}")


def _no_input(system: str, unit: str, error: dict[str, Any]) -> ModelicaLikeError:
    has = f"It has {', '.join(error['known'])}." if error["known"] else "It has none."
    return UnknownName(f"{unit}: '{error['name']}' is no input but {article(error['causality'] or 'local')}. {has}")


def _no_cosimulation(system: str, unit: str, error: dict[str, Any]) -> ModelicaLikeError:
    if error["version"] == "1.0":
        return FmuRefused(f"{unit} is an FMU of FMI 1.0.", advice="Co-simulation takes FMI 2.0 and 3.0.")
    return FmuRefused(f"{unit} has no Co-Simulation part.", advice="Export it as a Co-Simulation FMU.")


def _no_rollback(system: str, unit: str, error: dict[str, Any]) -> ModelicaLikeError:
    return FmuRefused(
        f"{unit} cannot go back to a saved state, or does not take steps of any length, so the step cannot vary.",
        why="It has not both of canGetAndSetFMUState and canHandleVariableCommunicationStepSize.",
        advice="Run with a fixed step, without tolerance.",
    )


def _not_settled(system: str, unit: str, error: dict[str, Any]) -> ModelicaLikeError:
    return FmuFailed(
        f"{unit}: {error['name']} does not come to rest at t = {error['time']:.6g} s when inputs follow outputs.",
        why=f"{system} has an algebraic loop: the output follows inputs at once that follow this output at once.",
        advice="Cut where a mass, a spring or a controller with a state is between the FMUs.",
    )


def _not_finite(system: str, unit: str, error: dict[str, Any]) -> ModelicaLikeError:
    return FmuFailed(
        f"{unit}: {error['name']} is no finite number at t = {error['time']:.6g} s.",
        advice="If the values before it grow without bounds, take a shorter step.",
    )


def _step(system: str, unit: str, error: dict[str, Any]) -> ModelicaLikeError:
    return StepFailed(
        f"{system}: after t = {error['time']:.6g} s no step is short enough for the tolerance of the coupling.",
        advice="Give a larger tolerance, or a fixed step.",
    )


def _ends(system: str, unit: str, error: dict[str, Any]) -> ModelicaLikeError:
    return FmuFailed(f"{unit} wants to end the run after t = {error['time']:g} s.")


def _failed(system: str, unit: str, error: dict[str, Any]) -> ModelicaLikeError:
    said = [printable(text) for text in error["messages"]]
    in_a_step = "DoStep" in error["text"]
    return FmuFailed(
        f"{unit} failed: {printable(error['text']).rstrip('.')}.",
        why="\n".join(f"It said: {text}" for text in said[-3:]),
        advice="If what the FMUs exchange grows without bounds, take a shorter step." if in_a_step else "",
    )


_ERRORS = {
    "unknown": _unknown, "no output": _no_output, "no input": _no_input, "no co-simulation": _no_cosimulation,
    "no rollback": _no_rollback, "not settled": _not_settled,
    "not finite": _not_finite, "step": _step, "ends": _ends, "failed": _failed,
}  # fmt: skip
