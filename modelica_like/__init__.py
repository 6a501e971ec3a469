"""Acausal component models of drive-trains.

Written once, simulated, differentiated and exported from one description.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from modelica_like.compile.compiled import CompiledDae as CompiledDae
    from modelica_like.errors import ModelicaLikeError as ModelicaLikeError
    from modelica_like.language import Assembly as Assembly
    from modelica_like.language import Component as Component
    from modelica_like.netlist import load as load
    from modelica_like.simulation import build as build
    from modelica_like.simulation import simulate as simulate
    from modelica_like.solve.options import Options as Options
    from modelica_like.solve.solution import Solution as Solution

__version__ = "0.1.0"

_HOME = {
    "Assembly": "modelica_like.language",
    "CompiledDae": "modelica_like.compile.compiled",
    "Component": "modelica_like.language",
    "ModelicaLikeError": "modelica_like.errors",
    "Options": "modelica_like.solve.options",
    "Solution": "modelica_like.solve.solution",
    "build": "modelica_like.simulation",
    "load": "modelica_like.netlist",
    "simulate": "modelica_like.simulation",
}

__all__ = [
    "Assembly",
    "CompiledDae",
    "Component",
    "ModelicaLikeError",
    "Options",
    "Solution",
    "build",
    "load",
    "simulate",
]


def __getattr__(name: str) -> Any:
    # Loaded on first use: the command line and tools that only read netlists start faster.
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'modelica_like' has no attribute '{name}'")
