"""Sizing files: design checks of installed libraries, their loads from formulas and simulations, their verdicts."""

from modelica_like.analyse.sizing.run import CheckedResult as CheckedResult
from modelica_like.analyse.sizing.run import Sizing as Sizing
from modelica_like.analyse.sizing.run import size as size
from modelica_like.analyse.sizing.simulated import load_of as load_of

__all__ = ["CheckedResult", "Sizing", "load_of", "size"]
