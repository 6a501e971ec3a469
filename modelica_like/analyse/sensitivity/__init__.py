"""Exact derivatives of runs, and runs as differentiable functions."""
