"""Messages for errors reported by processes that run FMUs."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from modelica_like.errors import FmuFailed, FmuRefused, ModelicaLikeError, UnknownName, ValueOutOfRange, did_you_mean
from modelica_like.fmi.unpack import printable

Failures = dict[str, tuple[type[ModelicaLikeError], str, str, str]]
"""Error class and the sentences what, why and advice, by the kind of failure."""

FAILURES: Failures = {
    "unknown": (UnknownName, "{unit} has no variable '{name}'{hint}", "", ""),
    "no input": (UnknownName, "{unit}: '{name}' is not an input but {causality}. {has}", "", ""),
    "shape": (
        ValueOutOfRange, "{unit}: '{name}' takes {wanted}, not {given}.",
        "", "Numbers of an array are given as rows, or one behind the other.",
    ),
    "scheduled": (
        FmuRefused,
        "{unit} is for Scheduled Execution only: its importer activates its tasks one by one, by a schedule.",
        "", "Also export it for Model Exchange or Co-Simulation.",
    ),
    "no kind": (FmuRefused, "{unit} has no {wanted} part.", "", "Choose the other kind, or none."),
    "failed": (FmuFailed, "{unit} failed: {text}.", "{said}", "{shorter}"),
}  # fmt: skip


def tell_error(folder: Path, units: Mapping[str, str], failures: Failures = FAILURES, **words: str) -> None:
    """Raise the error that the process has reported.

    Args:
        folder: of the process.
        units: names of the FMUs for messages, by their names in the job.
        failures: known kinds of failure.
        words: more values for the sentences.
    """
    if not (folder / "error.json").exists():
        return
    error: dict[str, Any] = json.loads((folder / "error.json").read_text())
    names = error.get("known", [])
    causality = error.get("causality") or "local"
    details = error | words | {
        "unit": units.get(error.get("unit", ""), ""),
        "hint": did_you_mean(error["name"], names) or "." if names else ".",
        "has": f"It has {', '.join(names)}." if names else "It has none.",
        "causality": f"{'an' if causality[0] in 'aeiou' else 'a'} {causality}",
        "text": printable(error.get("text", "")).strip().rstrip("."),
        "shorter": words.get("shorter", "") if "DoStep" in error.get("text", "") else "",  # advice for steps only
        "said": "\n".join(f"It reported: {printable(text)}" for text in error.get("messages", ())[-3:]),
    }  # fmt: skip
    kind, *sentences = failures[error["kind"]]
    what, why, advice = (sentence.format(**details) for sentence in sentences)
    raise kind(what, why=why, advice=advice)
