"""Problems of a drive as data: its errors, and notes about what looks like a slip."""

from __future__ import annotations

import re
from typing import Any

from modelica_like.errors import ModelicaLikeError, Source
from modelica_like.language.component import Component
from modelica_like.language.inside import inside

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
