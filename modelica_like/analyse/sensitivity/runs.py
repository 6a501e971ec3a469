"""Runs that only numbers are read off."""

from __future__ import annotations

from typing import Any

from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import ExportError, InitializationError, LanguageError, MissingExtra, SolveError
from modelica_like.simulation import simulate
from modelica_like.solve.solution import Solution


def quick_run(model: CompiledDae, **run: Any) -> Solution:
    """Simulate by the compiled run-time, and by IDAS where that is not there or cannot do it.

    Args:
        model: the compiled model.
        run: further arguments of `simulate`.

    Raises:
        ModelicaLikeError: IDAS cannot do it either; the error is that of IDAS.
    """
    try:
        return simulate(model, **run, solver="native")
    except (ExportError, InitializationError, LanguageError, MissingExtra, SolveError):
        return simulate(model, **run, solver="idas")
