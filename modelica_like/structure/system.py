"""The equation system after alias elimination: chains of derivatives, and residuals in them."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import accumulate
from typing import Any

import casadi as ca

from modelica_like.flatten.model import FlatModel, Origin, evaluate
from modelica_like.structure.alias import PREFERENCES, Aliases


@dataclass(slots=True)
class Level:
    """One derivative of a chain: `order` times differentiated.

    Attributes:
        name: the shortest name of its variables.
        preference: as a state (0: avoid … 3: always).
    """

    chain: int
    order: int
    name: str
    preference: int
    nominal: float
    guess: float


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
    _stacked: Any = None

    def column(self, levels: list[int]) -> Any:
        """Return the column of symbols of some levels."""
        if not levels:
            return ca.SX(0, 1)
        if self._stacked is None or self._stacked.numel() != len(self.symbols):
            self._stacked = ca.vertcat(*self.symbols)
        # A vector of one entry, indexed by a list, gives a row.
        return ca.vec(self._stacked[levels])

    @property
    def everything(self) -> Any:
        """The column of all symbols."""
        return self.column(list(range(len(self.symbols))))

    def generic(self, expressions: Any) -> ca.DM:
        """Return numbers at a point that is not special; parameters have their values, modes their starts."""
        model = self.model
        function = ca.Function("generic", [self.everything, model.p, model.d, model.time], [expressions])
        # No two values are equal: the ends of a rod must not coincide.
        point = [0.3 + 0.61803398875 * (k % 7 + 1) + 0.7548776662 * k % 1 / 10 for k in range(len(self.symbols))]
        starts = [one.start if isinstance(one.start, int | float) else 0.0 for one in model.discretes]
        starts += [0.0] * (model.d.numel() - len(starts))
        return function(point, [one.value for one in model.parameters], starts, 0.0)

    def add_level(self, chain: int) -> int:
        """Extend a chain by one derivative."""
        below = self.levels[self.chains[chain][-1]]
        number = len(self.levels)
        self.levels.append(Level(chain, below.order + 1, f"der({below.name})", 1, below.nominal, 0.0))
        self.symbols.append(ca.SX.sym(self.levels[-1].name))
        self.chains[chain].append(number)
        return number

    def derivative(self, level: int) -> int | None:
        """Return the next level of the chain, if there is one."""
        one = self.levels[level]
        chain = self.chains[one.chain]
        return chain[one.order + 1] if one.order + 1 < len(chain) else None


def build_system(model: FlatModel, aliases: Aliases) -> System:
    """Replace every node by its class, and collect the equations that remain."""
    levels, chains, place = _chains(model, aliases)
    node_level = _node_levels(aliases, place)
    _name_levels(model, levels, node_level)
    node_level = _turn_chains(model, levels, node_level)
    _name_levels(model, levels, node_level)
    symbols = [ca.SX.sym(level.name) for level in levels]
    node_values = _node_values(model, aliases, node_level, symbols)
    system = System(model, levels, chains, symbols, None, [], node_level, node_values)
    system.inputs = [place[aliases.root[node]][0] for node in model.inputs]
    _collect_residuals(system, aliases)
    return system


def _chains(model: FlatModel, aliases: Aliases) -> tuple[list[Level], list[list[int]], dict[int, tuple[int, float]]]:
    """Number the classes along their derivatives; `place` gives each class (level, factor)."""
    roots = dict.fromkeys(root for root in aliases.root if root not in aliases.known)
    below = {target for root, (target, _) in aliases.derivative.items() if root in roots}
    levels: list[Level] = []
    chains: list[list[int]] = []
    place: dict[int, tuple[int, float]] = {}
    for base in roots:
        if base in below:
            continue
        numbers: list[int] = []
        root, factor = base, 1.0
        while True:
            # The level's symbol is the exact derivative of the level above: root = symbol / factor.
            place[root] = (len(levels), 1.0 / factor)
            numbers.append(len(levels))
            levels.append(Level(len(chains), len(numbers) - 1, "", 0, 1.0, 0.0))
            if root not in aliases.derivative:
                break
            root, times = aliases.derivative[root]
            factor = factor * times
        chains.append(numbers)
    return levels, chains, place


def _node_levels(aliases: Aliases, place: dict[int, tuple[int, float]]) -> list[tuple[int, float] | None]:
    """Level and factor of every node, None where its value is known."""
    pairs = ((place.get(root), factor) for root, factor in zip(aliases.root, aliases.factor, strict=True))
    return [found and (found[0], factor * found[1]) for found, factor in pairs]


def _turn_chains(
    model: FlatModel, levels: list[Level], node_level: list[tuple[int, float] | None]
) -> list[tuple[int, float] | None]:
    """Give the variable after which a chain is named the factor one, so that a state equals its variable, with sign."""
    scale: dict[int, float] = {}
    for node, placed in enumerate(node_level):
        if placed is not None and placed[1] != 1.0:
            level = levels[placed[0]]
            if level.order == 0 and level.name == model.node_name(node):
                scale[level.chain] = placed[1]
    if not scale:
        return node_level
    return [pair and (pair[0], pair[1] / scale.get(levels[pair[0]].chain, 1.0)) for pair in node_level]


def _name_levels(model: FlatModel, levels: list[Level], node_level: list[tuple[int, float] | None]) -> None:
    best: dict[int, tuple[Any, ...]] = {}
    for node, placed in enumerate(node_level):
        if placed is None:
            continue
        level, factor = placed
        variable, order = model.nodes[node]
        one = model.variables[variable]
        preference = PREFERENCES.index(one.state)
        rank = (order, one.kind in ("potential", "flow"), factor != 1.0, -preference, one.path.count("."), node)
        if order == 0:
            levels[level].preference = max(levels[level].preference, preference)
            # The name says nothing about the guess: any of them that has one knows more than zero.
            levels[level].guess = levels[level].guess or one.guess / factor
        if level not in best or rank < best[level]:
            best[level] = rank
            levels[level].name = model.node_name(node)
            levels[level].nominal = one.nominal
            if order == 0 and one.guess:
                levels[level].guess = one.guess / factor


def _node_values(
    model: FlatModel, aliases: Aliases, node_level: list[tuple[int, float] | None], symbols: list[Any]
) -> Any:
    vector = ca.vertcat(ca.SX(0, 1), *symbols)
    placed = [pair or (0, 0.0) for pair in node_level]
    if symbols:
        # A vector of one entry, indexed by a list, gives a row.
        values = ca.vec(vector[[level for level, _ in placed]]) * ca.SX(ca.DM([factor for _, factor in placed]))
        values = ca.densify(values)
    else:
        values = ca.SX.zeros(len(placed))
    for node, pair in enumerate(node_level):
        if pair is None:
            values[node] = aliases.factor[node] * aliases.known[aliases.root[node]]
    return values


def _collect_residuals(system: System, aliases: Aliases) -> None:
    model = system.model
    columns = evaluate(model, "residual", system.node_values)
    first = dict(zip(columns, accumulate((one.numel() for one in columns.values()), initial=0), strict=False))
    sums: list[Any] = []
    # Positions in all columns, then the sums; together this is cheaper than one by one.
    places = [first[instance] + row for instance, row in model.general]
    system.origins += [model.origin(instance, row) for instance, row in model.general]
    count = sum(one.numel() for one in columns.values())
    for number in aliases.remaining:
        equation = model.linear[number]
        system.linear_rows.append(_levels_of(system, equation.terms))
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
    system.residual = ca.vec(stacked[places]) if places else ca.SX(0, 1)


def _levels_of(system: System, terms: tuple[tuple[int, Any], ...]) -> list[int]:
    """Levels of the unknown nodes in an equation, each once."""
    placed = (system.node_level[node] for node, _ in terms)
    return list(dict.fromkeys(pair[0] for pair in placed if pair is not None))
