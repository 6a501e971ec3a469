"""Solve: pieces by IDAS, and the start."""

from modelica_like.options import Options as Options
from modelica_like.solve.recorder import Event as Event
