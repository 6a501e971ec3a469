"""What a process that runs FMUs has left to tell, in sentences."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from modelica_like.errors import FmuFailed, FmuRefused, ModelicaLikeError, UnknownName, ValueOutOfRange, did_you_mean
from modelica_like.fmi.unpack import printable

Failures = dict[str, tuple[type[ModelicaLikeError], str, str, str]]
"""What it is, and the sentences what, why and what to do, by the kind of failure."""

FAILURES: Failures = {
    "unknown": (UnknownName, "{unit} has no variable '{name}'{hint}", "", ""),
    "no input": (UnknownName, "{unit}: '{name}' is no input but {causality}. {has}", "", ""),
    "shape": (
        ValueOutOfRange, "{unit}: '{name}' takes {wanted}, not {given}.",
        "", "Numbers of an array are given as rows, or one behind the other.",
    ),
    "scheduled": (
        FmuRefused,
        "{unit} is for Scheduled Execution only: its importer activates its tasks one by one, by a schedule.",
        "", "Export it for Model Exchange or Co-Simulation, too.",
    ),
    "no kind": (FmuRefused, "{unit} has no {wanted} part.", "", "Ask for the other kind, or for none."),
    "failed": (FmuFailed, "{unit} failed: {text}.", "{said}", "{shorter}"),
}  # fmt: skip


def tell_error(folder: Path, units: Mapping[str, str], failures: Failures = FAILURES, **words: str) -> None:
    """Raise what the process has left to tell.

    Args:
        folder: its workplace.
        units: what to call the FMUs, by their names in the job.
        failures: what can go wrong.
        words: further words of the sentences.
    """
    if not (folder / "error.json").exists():
        return
    error: dict[str, Any] = json.loads((folder / "error.json").read_text())
    known = error.get("known", [])
    causality = error.get("causality") or "local"
    told = error | words | {
        "unit": units.get(error.get("unit", ""), ""),
        "hint": did_you_mean(error["name"], known) or "." if known else ".",
        "has": f"It has {', '.join(known)}." if known else "It has none.",
        "causality": f"{'an' if causality[0] in 'aeiou' else 'a'} {causality}",
        "text": printable(error.get("text", "")).strip().rstrip("."),
        "shorter": words.get("shorter", "") if "DoStep" in error.get("text", "") else "",  # advice for steps only
        "said": "\n".join(f"It said: {printable(text)}" for text in error.get("messages", ())[-3:]),
    }  # fmt: skip
    kind, *sentences = failures[error["kind"]]
    what, why, advice = (sentence.format(**told) for sentence in sentences)
    raise kind(what, why=why, advice=advice)
