"""Alias elimination: variables that are equal up to a factor are merged, together with their derivatives."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Any

from modelica_like.flatten.model import Coefficient, FlatModel, LinearEquation

PREFERENCES = ("avoid", "default", "prefer", "always")
"""Preferences of states, in rising order."""
PREFERRED = PREFERENCES.index("prefer")

_ROUNDING = 1e-13


@dataclass(frozen=True)
class Aliases:
    """Result of the alias elimination.

    Attributes:
        root: class representative of every node.
        factor: value of a node = factor * value of its root.
        known: roots whose value is a number or an expression of parameters.
        derivative: root -> (root, factor) of its derivative: der(root) = factor * root.
        remaining: positions in `FlatModel.linear` of the equations that are left.
        contradictions: groups of equations that fix a value more than once.
    """

    root: list[int]
    factor: list[float]
    known: dict[int, Any]
    derivative: dict[int, tuple[int, float]]
    remaining: list[int]
    contradictions: list[tuple[int, ...]]


def find_aliases(model: FlatModel) -> Aliases:
    """Merge nodes by the linear equations with one or two unknowns and numeric coefficients."""
    return _Elimination(model).run()


def _is_zero(value: Any) -> bool:
    return value == 0.0 if isinstance(value, float | int) else bool(value.is_zero())


class _Elimination:
    """Union-find with factors; merging two classes also merges their derivatives."""

    def __init__(self, model: FlatModel) -> None:
        count = len(model.nodes)
        self.model = model
        self.parent = list(range(count))
        self.factor = [1.0] * count
        self.known: dict[int, Any] = {}
        self.derivative: dict[int, tuple[int, float]] = {n: (d, 1.0) for n, d in model.derivative.items()}
        self.integral: dict[int, int] = {d: n for n, d in model.derivative.items()}
        self.watchers: dict[int, set[int]] = {}
        self.queue = deque(range(len(model.linear)))
        self.remaining: set[int] = set()
        self.used: set[int] = set()
        self.cause: dict[int, int] = {}
        self.contradictions: list[tuple[int, ...]] = []
        self.inputs = set(model.inputs)
        self.preference = [PREFERENCES.index(model.variables[variable].state) for variable, _ in model.nodes]

    def run(self) -> Aliases:
        queue, used = self.queue, self.used
        queued = set(queue)
        while queue:
            number = queue.popleft()
            queued.discard(number)
            for affected in self._consider(number):
                if affected not in queued and affected not in used:
                    queued.add(affected)
                    queue.append(affected)
        roots = [self.find(node) for node in range(len(self.model.nodes))]
        return Aliases(
            root=[root for root, _ in roots], factor=[factor for _, factor in roots], known=self.known,
            derivative={n: self._derivative(n) for n in self.derivative if self.parent[n] == n},
            remaining=sorted(self.remaining), contradictions=self.contradictions,
        )  # fmt: skip

    def _derivative(self, root: int) -> tuple[int, float]:
        node, factor = self.derivative[root]
        target, more = self.find(node)
        return target, factor * more

    def find(self, node: int) -> tuple[int, float]:
        """Return root and factor of a node, with path compression."""
        above = self.parent[node]
        if self.parent[above] == above:
            return above, self.factor[node]
        trail: list[int] = []
        while self.parent[node] != node:
            trail.append(node)
            node = self.parent[node]
        factor = 1.0
        for step in reversed(trail):
            factor *= self.factor[step]
            self.parent[step], self.factor[step] = node, factor
        return node, factor

    def _reduce(self, equation: LinearEquation) -> tuple[dict[int, float | None], list[tuple[Any, Any]]]:
        """Return coefficients by root, None for one that is not a number, and coefficients with known values."""
        terms: dict[int, float | None] = {}
        sizes: dict[int, float] = {}
        products: list[tuple[Any, Any]] = []
        find, values = self.find, self.known
        for node, coefficient in equation.terms:
            root, factor = find(node)
            if root in values:
                products.append((coefficient, factor * values[root]))
                continue
            before = terms.get(root, 0.0)
            if before is None or isinstance(coefficient, Coefficient):
                terms[root] = None
            else:
                term = coefficient * factor
                terms[root] = before + term
                sizes[root] = sizes.get(root, 0.0) + abs(term)
        # Terms that cancel within rounding leave no unknown.
        left = {root: c for root, c in terms.items() if c is None or abs(c) > _ROUNDING * sizes[root]}
        return left, products

    def _sum(self, constant: Any, products: list[tuple[Any, Any]]) -> Any:
        total = self.model.coefficient(constant)
        for coefficient, value in products:
            total = total + self.model.coefficient(coefficient) * value
        return total

    def _consider(self, number: int) -> set[int]:
        """Use an equation if it is simple enough; return the equations that it simplifies."""
        equation = self.model.linear[number]
        terms, products = self._reduce(equation)
        self.remaining.discard(number)
        if not terms:
            causes = [number]
            for linear in causes:
                for node, _ in self.model.linear[linear].terms:
                    cause = self.cause.get(self.find(node)[0])
                    if cause is not None and cause not in causes:
                        causes.append(cause)
            ends = [c for c in causes if len(self.model.linear[c].terms) == 1]
            self.contradictions.append(tuple(ends if len(ends) > 1 else dict.fromkeys([number, *ends])))
            return set()
        match [*terms.items()]:
            case [(root, float(slope))] if root not in self.integral and root not in self.inputs:
                constant = self._sum(equation.constant, products)
                self.used.add(number)
                self.cause[root] = number
                return self._learn(root, 0.0 if _is_zero(constant) else -constant / slope)
            case [(first, float(a)), (second, float(b))] if self._may_merge(first, second, -b / a) and _is_zero(
                self._sum(equation.constant, products)
            ):
                self.used.add(number)
                return self._merge(first, second, -b / a)
            case _:
                pass
        self.remaining.add(number)
        for root in terms:
            self.watchers.setdefault(root, set()).add(number)
        return set()

    def _learn(self, root: int, value: Any) -> set[int]:
        """Store the constant value of a class; its derivatives are zero."""
        self.known[root] = value
        affected = self.watchers.pop(root, set())
        if root in self.derivative:
            below, _ = self._derivative(root)
            self.integral.pop(below, None)
            if below not in self.known:
                self.cause[below] = self.cause[root]
                affected |= self._learn(below, 0.0)
        return affected

    def _may_merge(self, first: int, second: int, ratio: float) -> bool:
        """First = ratio * second."""
        if first in self.inputs and second in self.inputs:
            return False
        # As a derivative, an input would take the factor of the integral's name; only that of another input has none.
        for node, other, times in ((first, second, 1.0 / ratio), (second, first, ratio)):
            if node in self.inputs and other in self.integral:
                base = self._integral_root(other)
                if base not in self.inputs or self._derivative(base)[1] * times != 1.0:
                    return False
        # der(x) = -x remains an equation: a class is not its own derivative.
        if second in self._integrals(first) or first in self._integrals(second):
            return False
        # A class that is the derivative of two unknowns would have two integrals; such an equation stays.
        both = first in self.integral and second in self.integral
        return not both or self._integral_root(first) == self._integral_root(second)

    def _integral_root(self, root: int) -> int:
        return self.find(self.integral[root])[0]

    def _integrals(self, root: int) -> set[int]:
        integrals: set[int] = set()
        while root in self.integral and (root := self._integral_root(root)) not in integrals:
            integrals.add(root)
        return integrals

    def _merge(self, first: int, second: int, ratio: float) -> set[int]:
        """First = ratio * second."""
        keep, drop, factor = (
            (first, second, 1.0 / ratio) if self._rank(first) >= self._rank(second) else (second, first, ratio)
        )
        self.parent[drop], self.factor[drop] = keep, factor
        affected = self.watchers.pop(drop, set())
        self.watchers.setdefault(keep, set()).update(affected)
        if drop in self.inputs:
            self.inputs.add(keep)
        if drop in self.integral:
            self.integral.setdefault(keep, self.integral.pop(drop))
        if drop in self.derivative:
            node, times = self.derivative.pop(drop)
            if keep in self.derivative:
                affected |= self._merge_derivatives(keep, node, times / factor)
            else:
                # der(keep) = der(drop) / factor = times / factor * node
                self.derivative[keep] = (node, times / factor)
                below, _ = self.find(node)
                self.integral[below] = keep
                affected |= self.watchers.get(below, set())
        return affected

    def _merge_derivatives(self, keep: int, node: int, times: float) -> set[int]:
        """der(keep) is known twice: times * node, and the stored value."""
        first, a = self._derivative(keep)
        second, more = self.find(node)
        b = times * more
        if first == second:
            return set()
        return self._merge(first, second, b / a)

    def _rank(self, root: int) -> tuple[bool, bool, int]:
        return root in self.inputs, root in self.integral, self.preference[root]
