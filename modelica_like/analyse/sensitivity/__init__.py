"""Exact derivatives of runs; runs as differentiable functions."""
