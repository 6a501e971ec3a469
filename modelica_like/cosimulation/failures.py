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
    error: dict[str, Any] = json.loads((folder / "error.json").read_text())
    files = {unit.name: unit.file.name for unit in system.units}
    known, name = error.get("known", []), error.get("unit", "")
    in_a_step = "DoStep" in error.get("text", "")
    words = error | {
        "system": system.name,
        "unit": f"{name} ({files[name]})" if name else "",
        "hint": did_you_mean(error["name"], known) or "." if known else ".",
        "has": f"It has {', '.join(known)}." if known else "It has none.",
        "causality": article(error.get("causality") or "local"),
        "text": printable(error.get("text", "")).rstrip("."),
        "said": "\n".join(f"It said: {printable(text)}" for text in error.get("messages", ())[-3:]),
        "shorter": "If what the FMUs exchange grows without bounds, take a shorter step." if in_a_step else "",
    }
    too_old = error["kind"] == "no co-simulation" and error["version"] == "1.0"
    kind, *sentences = _ERRORS["too old" if too_old else error["kind"]]
    what, why, advice = (sentence.format(**words) for sentence in sentences)
    raise kind(what, why=why, advice=advice)


_ERRORS: dict[str, tuple[type[ModelicaLikeError], str, str, str]] = {
    "unknown": (UnknownName, "{unit} has no variable '{name}'{hint}", "", ""),
    "no output": (UnknownName, "{system} has no variable '{name}'{hint}", "", ""),
    "no input": (UnknownName, "{unit}: '{name}' is no input but {causality}. {has}", "", ""),
    "too old": (FmuRefused, "{unit} is an FMU of FMI 1.0.", "", "Co-simulation takes FMI 2.0 and 3.0."),
    "no co-simulation": (
        FmuRefused, "{unit} has no Co-Simulation part.", "", "Export it as a Co-Simulation FMU.",
    ),
    "no rollback": (
        FmuRefused,
        "{unit} cannot go back to a saved state, or does not take steps of any length, so the step cannot vary.",
        "It has not both of canGetAndSetFMUState and canHandleVariableCommunicationStepSize.",
        "Run with a fixed step, without tolerance.",
    ),
    "not settled": (
        FmuFailed,
        "{unit}: {name} does not come to rest at t = {time:.6g} s when inputs follow outputs.",
        "{system} has an algebraic loop: the output follows inputs at once that follow this output at once.",
        "Cut where a mass, a spring or a controller with a state is between the FMUs.",
    ),
    "not finite": (
        FmuFailed, "{unit}: {name} is no finite number at t = {time:.6g} s.", "",
        "If the values before it grow without bounds, take a shorter step.",
    ),
    "step": (
        StepFailed, "{system}: after t = {time:.6g} s no step is short enough for the tolerance of the coupling.", "",
        "Give a larger tolerance, or a fixed step.",
    ),
    "ends": (FmuFailed, "{unit} wants to end the run after t = {time:g} s.", "", ""),
    "failed": (FmuFailed, "{unit} failed: {text}.", "{said}", "{shorter}"),
}  # fmt: skip
"""What it is, and the sentences what, why and what to do, by the kind of failure."""
