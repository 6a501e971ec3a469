"""Ideal elements in the equations of the whole model: diodes and switches without resistance and leakage.

The equation of an ideal element sets its current or its voltage to zero, by its mode. In some modes these equations
depend on each other: an inductor whose current no element takes, a capacitor in parallel with a source, contacts in
parallel, a part of a circuit that all its elements cut off. With `l` the combination of equations that gives zero for
all implicit unknowns, l·alg(t, x) = 0 is then a condition on states and time. One of the elements gets another
equation, by values that only events change and that follow the others in d:

- l·d(alg)/dt = 0, if that contains an unknown: the states stay where the condition is met. Where they do not meet it,
  an impulse is added, of which only the sign matters.
- otherwise what no equation determines has the least norm; where the condition is not met, it is as if the elements
  had a tiny resistance and leakage, so that one of them changes its mode.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import casadi as ca

from modelica_like.flatten.model import FlatModel
from modelica_like.structure.discretes import Part

HEAD = 3
"""Values of a row before the combination."""
_BACK = 1e4
"""Rate in 1/s at which states come back to the condition: unknowns that are known within tolerances let them drift."""
_CONDUCTANCE = 1e6
"""Reaction over what contradicts its being zero, where nothing else determines the reaction."""

if TYPE_CHECKING:
    from modelica_like.structure.reduce import ReducedDae


@dataclass(frozen=True)
class IdealElement:
    """An element with a variable that is zero.

    Attributes:
        component: path of the component.
        mode: position of its mode in d.
        zeros: variables that are zero in mode 0 and in mode 1; the other one reacts.
        row: position of its equation in `alg`; in the residual before.
    """

    component: str
    mode: int
    zeros: tuple[int, int]
    row: int


@dataclass(frozen=True)
class IdealNetwork:
    """All ideal elements of a model.

    Attributes:
        elements: the elements.
        rows: one per element: whether its equation is replaced, an impulse, whether the norm or a derivative replaces
            it, and the combination of equations.
    """

    elements: tuple[IdealElement, ...]
    rows: Part

    def by_norm(self, d: Any) -> Any:
        """Return whether the norm replaces the equation of each element, among the values of d; shape (elements,)."""
        return self.rows.of(d)[:, HEAD - 1]

    def combinations(self, d: Any) -> Any:
        """Return the combinations of equations among the values of d; shape (elements, equations)."""
        return self.rows.of(d)[:, HEAD:]


def find_ideals(model: FlatModel) -> list[IdealElement]:
    """Find the ideal elements of all components."""
    row_of = {pair: row for row, pair in enumerate(model.general)}
    ideals: list[IdealElement] = []
    for number, instance in enumerate(model.instances):
        template = instance.template
        node = {slot.path: instance.nodes[k] for k, slot in enumerate(template.slots) if slot.order == 0}
        discrete = dict(zip(template.discretes, instance.discretes, strict=True))
        for form in template.ideals:
            zeros = node[form.zeros[0]], node[form.zeros[1]]
            ideals.append(IdealElement(instance.path, discrete[form.mode], zeros, row_of[number, form.row]))
    return ideals


def complete(reduced: ReducedDae, ideals: list[IdealElement], rows: list[int]) -> ReducedDae:
    """Make the equations of ideal elements replaceable.

    Args:
        reduced: the reduced system.
        ideals: its ideal elements.
        rows: positions in the residual of the equations in `alg`.
    """
    flat, size = reduced.flat, len(rows)
    elements = tuple(replace(ideal, row=rows.index(ideal.row)) for ideal in ideals)
    network = IdealNetwork(elements, Part(flat.d.numel(), len(elements), HEAD + size))
    table = ca.SX.sym("ideal", network.rows.columns, network.rows.rows)
    rates = ca.jtimes(reduced.alg, reduced.x, reduced.ode) + ca.jtimes(reduced.alg, flat.time, ca.SX(1))
    rates += _BACK * reduced.alg
    missed = ca.substitute(reduced.alg, reduced.z, ca.SX.zeros(size))  # linear: what is left of it is the condition
    zeros = [reduced.values[list(e.zeros)] for e in elements]
    reactions = [ca.if_else(flat.d[e.mode] == 0, pair[1], pair[0]) for e, pair in zip(elements, zeros, strict=True)]
    reacting = [e.row for e in elements]
    alg = ca.SX(reduced.alg)
    for k, element in enumerate(elements):
        replaced, impulse, is_norm, weights = *ca.vertsplit(table[:HEAD, k]), table[HEAD:, k]
        # The sums one by one: reactions are lost in terms that are a million times as large.
        norm = ca.dot(weights[reacting], ca.vertcat(*reactions)) - _CONDUCTANCE * ca.dot(weights, missed)
        equation = ca.if_else(is_norm, norm, ca.dot(weights, rates) + impulse)
        alg[element.row] = ca.if_else(replaced, equation, alg[element.row])
    flat = replace(flat, d=ca.vertcat(flat.d, ca.vec(table)))
    return replace(reduced, flat=flat, alg=alg, ideal=network)
