"""Eigenfrequencies and damping as outputs: `mode(1).frequency`, of the drive linearized where it starts."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from modelica_like.analyse.linear.linearize import linearize
from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import UnknownName
from modelica_like.language.units import ONE, Unit, parse_unit

_MODE = re.compile(r"\s*mode\(\s*(\d+)\s*\)\.(frequency|natural_frequency|damping|time_constant)\s*")
_UNITS = {"damping": ONE, "time_constant": parse_unit("s")}
_STEP = 1e-3
"""Of a parameter's bounds, and half of it: eigenvalues are known to 1e-12; extrapolation leaves the cube, or less."""


def modal_unit(name: str) -> Unit | None:
    """Return the unit of an output of a mode, None of another name."""
    match = _MODE.fullmatch(name)
    return None if match is None else _UNITS.get(match[2], parse_unit("Hz"))


def modal_values(model: CompiledDae, names: Sequence[str], start: Any) -> Vector:
    """Return outputs of modes, shape (names,).

    Raises:
        UnknownName: there are fewer modes.
        ModelicaLikeError: the drive has no start, or cannot be linearized.
    """
    modes = linearize(model, start).modes()
    values: list[float] = []
    for name in names:
        match = _MODE.fullmatch(name)
        assert match is not None
        number = int(match[1])
        if not 1 <= number <= len(modes):
            raise UnknownName(f"'{name}': {model.name} has {len(modes)} modes where it starts, counted from 1.")
        values.append(float(getattr(modes[number - 1], match[2])))
    return np.array(values)


def modal_slopes(
    model: CompiledDae, names: Sequence[str], start: Any, x: Mapping[str, float], low: Vector, span: Vector
) -> Vector:  # fmt: skip
    """Return their derivatives by parameters, shape (names, parameters), by extrapolated differences within bounds."""
    slopes = np.zeros((len(names), len(x)))
    for k, (path, value) in enumerate(x.items()):

        def at(moved: float, path: str = path) -> Vector:
            return modal_values(model.with_parameters({**x, path: moved}), names, start)

        far, near = (
            _difference(at, value, step, low[k], low[k] + span[k]) for step in (_STEP * span[k], 0.5 * _STEP * span[k])
        )
        slopes[:, k] = (4.0 * near - far) / 3.0
    return slopes


def _difference(at: Callable[[float], Vector], value: float, step: float, low: float, high: float) -> Vector:
    """Return a difference of second order: central, or one-sided at a bound."""
    if low <= value - step and value + step <= high:
        return (at(value + step) - at(value - step)) / (2.0 * step)
    h = step if value - step < low else -step
    return (-3.0 * at(value) + 4.0 * at(value + h) - at(value + 2.0 * h)) / (2.0 * h)
