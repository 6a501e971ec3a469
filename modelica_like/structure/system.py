"""The equation system after alias elimination: chains of derivatives, and residuals in them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import accumulate
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.flatten.generic import spread
from modelica_like.flatten.model import FlatModel, FlatVariable, Origin, evaluate
from modelica_like.structure.alias import PREFERENCES, Aliases


@dataclass(slots=True)
class Level:
    """One derivative of a chain: `order` times differentiated.

    Attributes:
        name: the shortest name of its variables.
        preference: as a state (0: avoid … 3: always).
        own: whether its chain begins with a variable of a component, not with one of connectors only.
    """

    chain: int
    order: int
    name: str
    preference: int
    nominal: float
    guess: float
    own: bool = False


@dataclass
class System:
    """Residuals over levels.

    Attributes:
        levels: all unknowns, highest derivatives included.
        chains: for every chain the numbers of its levels by order.
        symbols: one symbol per level.
        residual: column of residuals.
        origins: of each residual.
        node_level: for every node (level number, factor), or None if it is known.
        node_values: expression of every node in level symbols and parameters.
        inputs: level numbers of the model's inputs, in their order.
        linear_rows: levels in each linear equation with constant coefficients.
    """

    model: FlatModel
    levels: list[Level]
    chains: list[list[int]]
    symbols: list[Any]
    residual: Any
    origins: list[Origin]
    node_level: list[tuple[int, float] | None]
    node_values: Any
    inputs: list[int] = field(default_factory=list)
    linear_rows: list[list[int]] = field(default_factory=list)
    _joined: Any = field(default_factory=lambda: ca.SX(0, 1))

    def column(self, levels: Iterable[int]) -> Any:
        """Return the column of symbols of some levels."""
        places = list(levels)
        return self.everything[places] if places else ca.SX(0, 1)  # nothing of one symbol would be a row

    @property
    def everything(self) -> Any:
        """The column of all symbols."""
        # Symbols are only added; joining tens of thousands of them takes long.
        count = self._joined.numel()
        if count < len(self.symbols):
            self._joined = ca.vertcat(self._joined, *self.symbols[count:])
        return self._joined

    @property
    def flags(self) -> Any:
        """The column of the symbols that tell whether motions are prescribed, as long as the structure does not."""
        return ca.vertcat(ca.SX(0, 1), *(symbol for symbol, _ in self.model.flags))

    @property
    def volatile(self) -> Any:
        """The column of all symbols that change during a run, or that parameters do not decide."""
        return ca.vertcat(self.everything, self.model.d, self.model.time, self.flags)

    @property
    def constants(self) -> tuple[list[float], Any]:
        """Values of parameters, and of modes and discrete values at the start; those that are no numbers are zero."""
        starts = np.zeros(self.model.d.numel())
        for k, discrete in enumerate(self.model.discretes):
            if isinstance(discrete.start, int | float):
                starts[k] = discrete.start
        return [parameter.value for parameter in self.model.parameters], starts

    def generic(self, expressions: Any) -> ca.DM:
        """Return numbers at a point that is not special; parameters have their values, modes their starts."""
        model = self.model
        given = [self.everything, model.p, model.d, model.time, self.flags]
        function = ca.Function("generic", given, [expressions])
        # No two values are equal: the ends of a rod must not coincide.
        count = len(self.symbols)
        values = spread(0.0, 1.0, count + 1 + len(model.flags))
        return function(values[:count], *self.constants, values[count], values[count + 1 :])

    def add_level(self, chain: int) -> int:
        """Extend a chain by one derivative."""
        below = self.levels[self.chains[chain][-1]]
        number = len(self.levels)
        self.levels.append(Level(chain, below.order + 1, f"der({below.name})", 1, below.nominal, 0.0, below.own))
        self.symbols.append(ca.SX.sym(self.levels[-1].name))
        self.chains[chain].append(number)
        return number

    def derivative(self, level: int) -> int | None:
        """Return the next level of the chain, if there is one."""
        entry = self.levels[level]
        chain = self.chains[entry.chain]
        return chain[entry.order + 1] if entry.order + 1 < len(chain) else None


def build_system(model: FlatModel, aliases: Aliases) -> System:
    """Replace every node by its class, and collect the equations that remain."""
    chains, place = _chains(aliases)
    # Level and factor of every node, None where its value is known.
    pairs = ((place.get(root), factor) for root, factor in zip(aliases.root, aliases.factor, strict=True))
    node_level = [level and (level[0], factor * level[1]) for level, factor in pairs]
    # A state equals the variable after which its chain is named, with sign.
    ranked = _ranked(model, node_level)
    scale = {level: ranked[chain[0]][0][-1] for chain in chains for level in chain}
    node_level = [pair and (pair[0], pair[1] / scale[pair[0]]) for pair in node_level]
    levels = _levels(model, chains, _ranked(model, node_level))
    symbols = [ca.SX.sym(level.name) for level in levels]
    vector = ca.vertcat(ca.SX(0, 1), *symbols, *aliases.known.values())
    position = {root: len(symbols) + k for k, root in enumerate(aliases.known)}
    nodes = zip(node_level, aliases.root, aliases.factor, strict=True)
    placed = [pair or (position[root], factor) for pair, root, factor in nodes]
    # A vector of one entry, indexed by a list, gives a row.
    node_values = ca.vec(vector[[level for level, _ in placed]]) * ca.SX(ca.DM([factor for _, factor in placed]))
    system = System(model, levels, chains, symbols, None, [], node_level, node_values)
    system.inputs = [place[aliases.root[node]][0] for node in model.inputs]
    _collect_residuals(system, aliases)
    return system


def _chains(aliases: Aliases) -> tuple[list[list[int]], dict[int, tuple[int, float]]]:
    """Number the classes along their derivatives; `place` gives each class (level, factor)."""
    roots = dict.fromkeys(root for root in aliases.root if root not in aliases.known)
    below = {target for root, (target, _) in aliases.derivative.items() if root in roots}
    chains: list[list[int]] = []
    place: dict[int, tuple[int, float]] = {}
    for base in roots:
        if base in below:
            continue
        chains.append([])
        root: int | None = base
        factor = 1.0
        while root is not None:
            # The level's symbol is the exact derivative of the level above: root = symbol / factor.
            chains[-1].append(len(place))
            place[root] = (len(place), 1.0 / factor)
            root, times = aliases.derivative.get(root, (None, 1.0))
            factor *= times
    return chains, place


_Named = tuple[tuple[Any, ...], int, FlatVariable, float]
"""Rank of a node as the name of its level, the node, its variable, and its factor."""


def _ranked(model: FlatModel, node_level: list[tuple[int, float] | None]) -> dict[int, list[_Named]]:
    """Nodes of each level; what should name it comes first."""
    nodes_of: dict[int, list[_Named]] = {}
    for node, placed in enumerate(node_level):
        if placed is not None:
            level, factor = placed
            variable, order = model.nodes[node]
            variable_of = model.variables[variable]
            connected, preference = variable_of.kind in ("potential", "flow"), PREFERENCES.index(variable_of.state)
            rank = (order, connected, factor != 1.0, -preference, variable_of.path.count("."))
            nodes_of.setdefault(level, []).append((rank, node, variable_of, factor))
    return {level: sorted(nodes) for level, nodes in nodes_of.items()}


def _levels(model: FlatModel, chains: list[list[int]], ranked: dict[int, list[_Named]]) -> list[Level]:
    levels: list[Level] = []
    for chain, numbers in enumerate(chains):
        (_, connected, *_), *_ = ranked[numbers[0]][0]
        for order, number in enumerate(numbers):
            (_, node, named, _), *_ = nodes = ranked[number]
            base = [(variable, factor) for rank, _, variable, factor in nodes if rank[0] == 0]
            preference = max((PREFERENCES.index(variable.state) for variable, _ in base), default=0)
            # The name says nothing about the guess: any of them that has one knows more than zero.
            guess = next((variable.guess / factor for variable, factor in base if variable.guess), 0.0)
            # Variables may have two names, of which one is a state's: its derivative has the same.
            name = f"der({levels[-1].name})" if order and model.nodes[node][1] else model.node_name(node)
            levels.append(Level(chain, order, name, preference, named.nominal, guess, not connected))
    return levels


def _collect_residuals(system: System, aliases: Aliases) -> None:
    model = system.model
    columns = evaluate(model, "residual", system.node_values)
    *starts, count = accumulate((column.numel() for column in columns.values()), initial=0)
    first = dict(zip(columns, starts, strict=True))
    sums: list[Any] = []
    # Positions in all columns, then the sums; together this is cheaper than one by one.
    places = [first[instance] + row for instance, row in model.general]
    system.origins += [model.origin(instance, row) for instance, row in model.general]
    for number in aliases.remaining:
        equation = model.linear[number]
        placed = (system.node_level[node] for node, _ in equation.terms)
        system.linear_rows.append(list(dict.fromkeys(pair[0] for pair in placed if pair is not None)))
        if equation.row is not None:
            places.append(first[equation.row[0]] + equation.row[1])
        else:
            total = model.coefficient(equation.constant)
            for node, coefficient in equation.terms:
                total = total + model.coefficient(coefficient) * system.node_values[node]
            places.append(count + len(sums))
            sums.append(total)
        system.origins.append(equation.origin)
    stacked = ca.vertcat(ca.SX(0, 1), *columns.values(), *sums)
    # A vector of one entry, indexed by a list, gives a row.
    system.residual = ca.vec(stacked[places])
