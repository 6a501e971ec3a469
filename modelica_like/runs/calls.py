"""Texts of readings, such as `rms(a.tau)`, and of the formulas beside them, before a model knows their names."""

from __future__ import annotations

import re
from itertools import accumulate

from modelica_like.errors import NetlistError, UnknownName
from modelica_like.language.formula import Formula
from modelica_like.runs.signals import formula_of

_KINDS = "max|min|peak|integral|mean|rms|at|first|duration|series|time"
_CALL = re.compile(rf"\s*({_KINDS})\s*\((.*)\)\s*$")
_INSIDE = re.compile(rf"\b({_KINDS})\s*\(")


def call_of(text: str) -> tuple[str, str] | None:
    """Return the kind and the argument of a reading; None of a name or formula, such as `max(a, b)` of two values."""
    called = _CALL.match(text)
    # `a)*max(b` is no argument: a bracket is closed that was not opened.
    if called is None or min(accumulate((char == "(") - (char == ")") for char in called[2]), default=0) < 0:
        return None
    return None if called[1] in ("max", "min") and _is_formula(text) else (called[1], called[2].strip())


def formula_beside(text: str) -> Formula | None:
    """Return the formula of a text that is no reading, None for a plain name.

    Raises:
        NetlistError, UnknownName: it is none, or calculates with readings.
    """
    try:
        return formula_of(text)
    except NetlistError as error:
        if _INSIDE.search(text) is None:
            raise
        raise UnknownName(
            f"'{text}' calculates with readings of a run, which formulas cannot.",
            advice="Ask for each reading and calculate with the numbers; a formula may stand inside: "
            "max(a.tau + b.tau).",
        ) from error


def _is_formula(text: str) -> bool:
    try:
        return formula_of(text) is not None
    except NetlistError:
        return False
