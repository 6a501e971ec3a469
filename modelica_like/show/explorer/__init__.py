"""Explore a drive in the browser: sliders, curves, sensitivities, and the changed drive as files."""

from modelica_like.show.explorer.server import Explorer, explore

__all__ = ["Explorer", "explore"]
