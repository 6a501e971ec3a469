"""Problems of a drive as data: its errors, and notes about what looks like a slip."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from modelica_like.errors import ModelicaLikeError, Source
from modelica_like.language.component import Component
from modelica_like.language.inside import inside
from modelica_like.netlist.further import thoroughly
from modelica_like.netlist.read import load_thoroughly
from modelica_like.show.report.plausible import drive_notes
from modelica_like.show.report.start import start_notes
from modelica_like.simulation import build

_PATH = re.compile(r"[A-Za-z_]\w*(?:\[\d+\])?(?:\.\w+(?:\[\d+\])?)*")


def note_problem(drive: Component, sentence: str) -> dict[str, Any]:
    """Return a note as data for JSON: an error's keys, with `note` as `kind`; its place is that of the part it names.

    Args:
        drive: the drive.
        sentence: about it.
    """
    names = (match.partition(".")[0].partition("[")[0] for match in _PATH.findall(sentence))
    places = (drive.source_of(f"parts.{name}") for name in names if name in inside(drive).parts)
    place = next((place for place in places if place.file), Source(""))
    return {**ModelicaLikeError(sentence, where=place).as_json(), "kind": "note"}


def netlist_problems(path: Path, text: str) -> list[dict[str, Any]]:
    """Return what `check` says about a netlist that is being written, as data for JSON.

    Args:
        path: of its file.
        text: what the file will be.
    """
    try:
        drive = load_thoroughly(path, text)
        with thoroughly(drive):
            model = build(drive)
        sentences = [*drive_notes(drive), *start_notes(model)]
    except ModelicaLikeError as error:
        return [problem.as_json() for problem in error.problems()]
    return [note_problem(drive, sentence) for sentence in sentences]
