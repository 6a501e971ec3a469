"""Messages of ideal elements: conditions that the rest of the circuit contradicts, and that no modes meet."""

from __future__ import annotations

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import NoValidModes
from modelica_like.solve.initialize.point import Point, call, largest
from modelica_like.structure.ideal import IdealElement

_DEPENDENT = 1e-9
_SLOW = 1e3
"""Rate in 1/s, over the equation itself, of which a part of `_DEPENDENT` is rounding of faster ones."""
_IMPULSE = 1e12
"""Impulse over what contradicts its being zero: larger than all finite terms."""
_MET, _LOST = 1e-9, 1e-6
"""Current or voltage, over the largest one, that is rounding, and that an event may remove."""


def _zero(element: IdealElement, d: Vector) -> int:
    return element.zeros[int(d[element.mode])]


def refuse_contradiction(model: CompiledDae, point: Point) -> None:
    """Refuse modes in which an ideal element and the rest of the circuit ask for different voltages or currents.

    Args:
        model: the compiled model.
        point: with settled modes.

    Raises:
        NoValidModes: an element's voltage or current that its mode makes zero is not zero.
    """
    network = model.held.ideal
    if network is None:
        return
    by_norm = network.by_norm(point.d)
    if not by_norm.any():
        return
    values = call(model, model.equations.variables, point)
    for k in by_norm.nonzero()[0]:
        element = network.elements[k]
        node = _zero(element, point.d)
        if abs(values[node]) > _LOST * largest(model, np.abs(values), node):
            raise contradiction(model, point, int(k))


def contradiction(model: CompiledDae, point: Point, number: int) -> NoValidModes:
    """Return the error of an ideal element, given by its number, whose mode the rest of the circuit contradicts."""
    element, node, value = _wrong(model, point, number)
    mode = model.flat_discretes[element.mode].names[int(point.d[element.mode])]
    unit = str(model.flat_variables[node].unit)
    current = unit == "A"
    return NoValidModes(
        f"At t = {point.t:.9g} s {element.component} contradicts the rest of the circuit: it is ideal and {mode}, so "
        f"its {'current' if current else 'voltage'} is zero, but the rest makes it {value:.4g} {unit}.",
        advice=f"Put a resistance in {'parallel' if current else 'series'} with {element.component}, or take an "
        "element that is not ideal (Diode, Switch).",
    )


def _wrong(model: CompiledDae, point: Point, number: int) -> tuple[IdealElement, int, float]:
    """An element, and the node and value of what its mode makes zero."""
    assert model.held.ideal is not None
    element = model.held.ideal.elements[number]
    node = _zero(element, point.d)
    return element, node, float(call(model, model.equations.variables, point)[node])


def no_valid_modes(model: CompiledDae, point: Point, number: int) -> NoValidModes:
    """Return the error of an ideal element, given by its number, whose impulse no mode ends."""
    assert model.held.ideal is not None
    network, (_, node, value) = model.held.ideal, _wrong(model, point, number)
    combination = network.combinations(point.d)[number]
    parts = [element for element in network.elements if combination[element.row]]
    modes = [f"{e.component} {model.flat_discretes[e.mode].names[int(point.d[e.mode])]}" for e in parts]
    unit = model.flat_variables[node].unit
    what = "a current would stop at once" if str(unit) == "A" else "voltages would jump"
    return NoValidModes(
        f"At t = {point.t:.9g} s no combination of modes is valid: with {', '.join(modes)}, {abs(value):.4g} {unit} "
        "are left over.",
        why=f"The elements are ideal, and states change continuously; here {what}.",
        advice="Give the current another path (a freewheeling diode), or put a resistance in series with a capacitor.",
    )
