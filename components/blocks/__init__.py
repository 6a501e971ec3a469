"""Signals and what computes with them: sources, controllers, linear and nonlinear blocks."""
