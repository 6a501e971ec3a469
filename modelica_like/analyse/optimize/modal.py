"""Outputs of the drive linearized where it starts: `mode(1).frequency`, `gain(force, mass.s, 5 Hz)`, `resonance(…)`."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from modelica_like.analyse.linear.linearize import linearize
from modelica_like.analyse.linear.model import LinearModel
from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import UnknownName, ValueOutOfRange, did_you_mean, extra_module
from modelica_like.language.units import ONE, Unit, parse_unit, to_si

_MODE = re.compile(r"\s*mode\(\s*(\d+)\s*\)\.(frequency|natural_frequency|damping|time_constant)\s*")
_RESPONSE = re.compile(r"\s*(gain|resonance)\(\s*([^,()]+?)\s*,\s*([^,()]+?)\s*(?:,\s*([^,()]+?)\s*)?\)\s*")
_HERTZ = parse_unit("Hz")
_UNITS = {"damping": ONE, "time_constant": parse_unit("s")}
_STEP = 1e-3
"""Of a parameter's bounds, and half of it: eigenvalues are known to 1e-12; extrapolation leaves the cube, or less."""
_AT_PEAK = 1e-9
"""Frequency of a peak, relative: its height is known to the square of that."""


def is_modal(name: str) -> bool:
    """Return whether an output is one of the linearized drive."""
    return _MODE.fullmatch(name) is not None or _RESPONSE.fullmatch(name) is not None


def modal_unit(model: CompiledDae, name: str) -> Unit:
    """Return the unit of an output of the linearized drive.

    Raises:
        UnknownName: a gain has no such input or output.
        ValueOutOfRange: a gain has no frequency, a resonance no number.
        UnitError: the frequency is none.
    """
    if (match := _MODE.fullmatch(name)) is not None:
        return _UNITS.get(match[2], _HERTZ)
    kind, given, output, number = _response(name)
    _place(kind, number, name)
    for path, names in ((given, model.fixed_position), (output, model.position)):
        if path not in names:
            raise UnknownName(f"'{name}': {model.name} has no '{path}'{did_you_mean(path, names) or '.'}")
    return parse_unit(f"({model.units[output]})/({model.units[given]})")


def modal_values(model: CompiledDae, names: Sequence[str], start: Any) -> Vector:
    """Return outputs of the linearized drive, shape (names,).

    Raises:
        UnknownName: there are fewer modes.
        ModelicaLikeError: the drive has no start, or cannot be linearized.
    """
    responses = {name: _response(name) for name in names if _MODE.fullmatch(name) is None}
    inputs, outputs = (list(dict.fromkeys(response[k] for response in responses.values())) for k in (1, 2))
    linear = linearize(model, start, inputs=inputs, outputs=outputs) if responses else linearize(model, start)
    modes = linear.modes()
    values: list[float] = []
    for name in names:
        match = _MODE.fullmatch(name)
        if match is None:
            values.append(_gain(linear, *responses[name], name))
            continue
        number = int(match[1])
        if not 1 <= number <= len(modes):
            raise UnknownName(f"'{name}': {model.name} has {len(modes)} modes where it starts, counted from 1.")
        values.append(float(getattr(modes[number - 1], match[2])))
    return np.array(values)


def _response(name: str) -> tuple[str, str, str, str]:
    """Return kind, input, output and number of a gain or resonance."""
    match = _RESPONSE.fullmatch(name)
    assert match is not None
    return match[1], match[2], match[3], match[4] or ""


def _place(kind: str, number: str, name: str) -> float:
    """Return the frequency of a gain in Hz, or the number of a peak; 0 for the largest one."""
    if kind == "gain":
        if not number:
            raise ValueOutOfRange(f"'{name}' has no frequency.", advice="Write gain(force, mass.s, 5 Hz).")
        return to_si(number, _HERTZ, f"The frequency of '{name}'")
    if number and not (number.isdecimal() and int(number) > 0):
        raise ValueOutOfRange(
            f"'{name}': peaks are counted from 1, not by '{number}'.", advice="Without a number it is the largest peak."
        )
    return float(number or 0)


def _gain(linear: LinearModel, kind: str, given: str, output: str, number: str, name: str) -> float:
    """Return a gain at a frequency, or at a peak of it."""
    row, column, place = linear.outputs.index(output), linear.inputs.index(given), _place(kind, number, name)

    def at(frequencies: Any) -> Vector:
        return np.abs(linear.response(frequencies)[row, column])

    if kind == "gain":
        return float(at(place)[0])
    frequencies = linear.around()
    heights = at(frequencies)
    bounded = extra_module("scipy.optimize", "analyse").minimize_scalar
    peaks: list[float] = []
    for k in np.flatnonzero((heights[1:-1] >= heights[:-2]) & (heights[1:-1] > heights[2:])) + 1:
        low, high = np.log(frequencies[k - 1]), np.log(frequencies[k + 1])
        best = bounded(lambda f: -float(at(np.exp(f))[0]), bounds=(low, high), method="bounded",
                       options={"xatol": _AT_PEAK})  # fmt: skip
        peaks.append(-float(best.fun))
    # A peak that is not there is as high as the highest one, so that a search for the lowest of several goes on.
    largest = max([*peaks, float(heights.max())])
    return peaks[int(place) - 1] if 1 <= place <= len(peaks) else largest


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
