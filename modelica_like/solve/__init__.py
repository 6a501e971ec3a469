"""Solve: segments by IDAS, events between them, and the solution."""

from modelica_like.options import Options as Options
from modelica_like.solve.events import EventLoop as EventLoop
from modelica_like.solve.recorder import Event as Event
