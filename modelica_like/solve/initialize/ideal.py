"""Ideal elements in the present modes: equations that replace dependent ones, impulses, conditions that states meet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import NoValidModes
from modelica_like.solve.initialize.point import Point, call, largest, solve_implicit
from modelica_like.structure.ideal import HEAD, IdealElement, IdealNetwork

_DEPENDENT = 1e-9
_SLOW = 1e3
"""Rate in 1/s, over the equation itself, of which a part of `_DEPENDENT` is rounding of faster ones."""
_IMPULSE = 1e12
"""Impulse over what contradicts its being zero: larger than all finite terms."""
_MET, _LOST = 1e-9, 1e-6
"""Current or voltage, over the largest one, that is rounding, and that an event may remove."""


def replace_dependent(model: CompiledDae, point: Point) -> None:
    """Replace equations of ideal elements that depend on others in the present modes.

    Where states do not meet the condition that the modes put on them, an impulse acts; its sign tells which elements
    have to change their modes.
    """
    network = model.ideal
    if network is None:
        return
    rows = np.zeros((len(network.elements), network.width))
    point.d[network.entries] = rows.ravel()
    _write(model, point, network, rows)
    moved = _moved(rows)
    if not moved:
        return
    trial = point.copy()
    solve_implicit(model, trial)
    trial.d[network.entries] = 0.0
    left, sizes = call(model, model.alg, trial), np.abs(call(model, model.variables, trial))
    for k in moved:
        node = _zero(network.elements[k], point.d)
        missed = float(rows[k, HEAD:] @ left)
        if sizes[node] > _MET * largest(model, sizes, node):
            rows[k, 1] = _IMPULSE * missed
    point.d[network.entries] = rows.ravel()


def _write(model: CompiledDae, point: Point, network: IdealNetwork, rows: Vector) -> None:
    """Write the rows of the elements whose equations are dependent."""
    own = {one.row: k for k, one in enumerate(network.elements)}
    size = len(model.implicit)
    others = [row for row in range(size) if row not in own]
    matrix = _jacobian(model, point)
    sizes = np.abs(matrix).max(axis=1)
    found = dict(_dependences(matrix, [*others, *own], sizes))
    if not (found and own.keys() >= found.keys()):
        return
    least = sizes.copy()
    for row, weights in found.items():
        rows[own[row], 0], rows[own[row], HEAD:] = 1.0, weights
        least[row] = _SLOW * np.max(np.abs(weights) * sizes)
    point.d[network.entries] = rows.ravel()
    matrix = _jacobian(model, point)
    sizes = np.maximum(least, np.abs(matrix).max(axis=1))
    order = [*others, *(row for row in own if row not in found), *found]
    for row, weights in _dependences(matrix, order, sizes):
        if row in found:
            rows[own[row], HEAD - 1] = 1.0
            rows[own[row], HEAD:] = weights[list(found)] @ np.array(list(found.values()))
    point.d[network.entries] = rows.ravel()


def _jacobian(model: CompiledDae, point: Point) -> Any:
    at = (point.t, point.x, point.z, model.p, model.u, point.d)
    return model.alg_jacobian(*at).full()


def _dependences(matrix: Any, order: Sequence[int], sizes: Vector) -> list[tuple[int, Vector]]:
    """Find rows that depend on earlier ones, by Gaussian elimination.

    Args:
        matrix: square.
        order: of the rows.
        sizes: of the rows, above rounding.

    Returns:
        For every such row, the combination of all rows that vanishes; its own part is one.
    """
    sizes = np.where(sizes, sizes, 1.0)
    work = matrix / sizes[:, None]
    columns = np.abs(work).max(axis=0)
    work /= np.where(columns, columns, 1.0)
    turns, pivots, found = np.eye(len(work)), list[tuple[int, int]](), list[tuple[int, Vector]]()
    for row in order:
        for earlier, column in pivots:
            factor = work[row, column] / work[earlier, column]
            work[row] -= factor * work[earlier]
            turns[row] -= factor * turns[earlier]
        column = int(np.argmax(np.abs(work[row])))
        if abs(work[row, column]) > _DEPENDENT:
            pivots.append((row, column))
        else:
            found.append((row, np.where(np.abs(turns[row]) > _DEPENDENT, turns[row] / sizes, 0.0) * sizes[row]))
    return found


def _moved(rows: Vector) -> list[int]:
    """Elements whose equation is that for a derivative."""
    return [k for k, row in enumerate(rows) if row[0] and not row[HEAD - 1]]


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
    network = model.ideal
    if network is None:
        return
    rows = point.d[network.entries].reshape(len(network.elements), network.width)
    if not rows[:, HEAD - 1].any():
        return
    values = call(model, model.variables, point)
    for k in rows[:, HEAD - 1].nonzero()[0]:
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
    assert model.ideal is not None
    element = model.ideal.elements[number]
    node = _zero(element, point.d)
    return element, node, float(call(model, model.variables, point)[node])


def no_valid_modes(model: CompiledDae, point: Point, number: int) -> NoValidModes:
    """Return the error of an ideal element, given by its number, whose impulse no mode ends."""
    assert model.ideal is not None
    network, (_, node, value) = model.ideal, _wrong(model, point, number)
    row = point.d[network.entries].reshape(len(network.elements), network.width)[number]
    parts = [one for one in network.elements if row[HEAD + one.row]]
    modes = [f"{one.component} {model.flat_discretes[one.mode].names[int(point.d[one.mode])]}" for one in parts]
    unit = model.flat_variables[node].unit
    what = "a current would stop at once" if str(unit) == "A" else "voltages would jump"
    return NoValidModes(
        f"At t = {point.t:.9g} s no combination of modes is valid: with {', '.join(modes)}, {abs(value):.4g} {unit} "
        "are left over.",
        why=f"The elements are ideal, and states change continuously; here {what}.",
        advice="Give the current another path (a freewheeling diode), or put a resistance in series with a capacitor.",
    )
