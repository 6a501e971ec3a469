"""From flat equations to an index-1 system: states x with derivatives, and implicit unknowns z."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from modelica_like.errors import StructureError
from modelica_like.flatten.flatten import flatten_again
from modelica_like.flatten.model import FlatModel, Origin
from modelica_like.language.elements import inserted
from modelica_like.structure.alias import Aliases, find_aliases
from modelica_like.structure.blocks import Block, BlockSolver, Solved
from modelica_like.structure.decided import decide, needs_decision
from modelica_like.structure.diagnose import check_solvable
from modelica_like.structure.following import (
    Choice,
    Following,
    Group,
    follow,
    moving_chains,
    prefer,
    singular_groups,
    write_choice,
)
from modelica_like.structure.holds import (
    Circuit,
    HeldMotion,
    add_approaches,
    find_circuits,
    held_rates,
    let_yield,
    share_reactions,
)
from modelica_like.structure.ideal import IdealNetwork, complete, find_ideals
from modelica_like.structure.index import Pantelides, prefer_relative_states
from modelica_like.structure.locks import contradictions, find_locks, left_open
from modelica_like.structure.motion import Motion
from modelica_like.structure.prescribed import Flags
from modelica_like.structure.states import select_states
from modelica_like.structure.system import System, build_system


@dataclass(frozen=True, eq=False, repr=False)
class ReducedDae:
    """Index-1 system: der(x) = ode(x, z, p, d, t), 0 = alg(x, z, p, d, t).

    Attributes:
        states: names of x.
        implicit: names of z.
        x: state symbols.
        z: implicit symbols.
        ode: derivatives of x.
        alg: residuals for z.
        inputs: symbols of the model's inputs.
        values: expression of every node of the flat model in x, z, inputs, p, d and t.
        node_states: for every node (position in x, factor) if it is a state up to a factor, else None.
        blocks: blocks of the triangular form, with the names of their unknowns and the origins of their equations.
        determinants: (names, origins, expression); a block is singular if the expression is zero. Without names it is
            an equation that was reduced for other parameters.
        implicit_blocks: (names, origins) of the blocks that stay implicit.
        level_values: expression of every level in x, z, inputs, p, d and t.
        explicit: (level, expression) of the explicit unknowns, each in states, z and earlier ones.
        index: structural index of the equations before the reduction.
        differentiated: origins of the differentiated equations.
        holds: motions that modes hold.
        circuits: held motions that depend on each other.
        choices: of states that follow the motion.
        ideal: the ideal elements, if there are any.
    """

    flat: FlatModel
    states: tuple[str, ...]
    implicit: tuple[str, ...]
    x: Any
    z: Any
    u: Any
    ode: Any
    alg: Any
    values: Any
    node_states: tuple[tuple[int, float] | None, ...]
    guesses: tuple[float, ...]
    nominals: tuple[float, ...]
    z_guesses: tuple[float, ...]
    blocks: tuple[Block, ...]
    determinants: tuple[tuple[tuple[str, ...], tuple[Origin, ...], Any], ...]
    index: int
    differentiated: tuple[Origin, ...]
    system: System
    implicit_blocks: tuple[tuple[tuple[str, ...], tuple[Origin, ...]], ...]
    level_values: Any
    explicit: tuple[tuple[int, Any], ...]
    holds: tuple[HeldMotion, ...] = ()
    circuits: tuple[Circuit, ...] = ()
    choices: tuple[Choice, ...] = ()
    ideal: IdealNetwork | None = None

    def rate(self, variable: int) -> Any:
        """Return the time derivative of a flat variable, in x, z, inputs, p, d and t."""
        placed = self.system.node_level[variable]
        if placed is None:
            return ca.SX(0)
        level, factor = placed
        above = self.system.derivative(level)
        if above is not None:
            return self.level_values[above] * factor
        return self.total_derivative(self.values[variable])

    def total_derivative(self, expressions: Any) -> Any:
        """Return the time derivative of expressions in x, z, p, d and t along the solution (inputs held)."""
        return Motion(self.flat.time, self.x, self.z, self.ode, self.alg).rate(expressions)

    def __repr__(self) -> str:
        return f"<{self}>"

    def __str__(self) -> str:
        kinds = [block.kind for block in self.blocks]
        largest = max((len(block.unknowns) for block in self.blocks), default=0)
        return (
            f"ReducedDae {self.flat.name}: {len(self.states)} states ({', '.join(self.states)}), "
            f"{len(self.implicit)} implicit, index {self.index}, {len(kinds)} blocks (largest {largest})"
        )

    @property
    def notices(self) -> tuple[str, ...]:
        """Notices for the reader: a high index and the chosen states."""
        if not self.differentiated:
            return ()
        places, count = list(dict.fromkeys(o.path or o.kind for o in self.differentiated)), len(self.differentiated)
        named = f"{' and '.join(places[:4])}{' …' if len(places) > 4 else ''} couple{'s' if len(places) == 1 else ''}"
        text = f"{count} constraint{'s' if count > 1 else ''} differentiated; states kept: {', '.join(self.states)}."
        index = f"Index {self.index}: {named} motions. {text}"
        return index, *(
            f"No fixed choice of states fits {choice.told} everywhere: {self.flat.discretes[choice.mode].path} makes "
            "it anew at events."
            for choice in self.choices
        )


_NONE: dict[str, tuple[int, ...]] = {}


def reduce(flat: FlatModel) -> ReducedDae:
    """Reduce flat equations to an index-1 system.

    Raises:
        Underdetermined, Overdetermined: the equations cannot determine the unknowns.
    """
    return _reduce(flat, decided=False)


def _reduce(flat: FlatModel, *, decided: bool, speeds: Mapping[str, tuple[int, ...]] = _NONE) -> ReducedDae:
    """Reduce flat equations, with the branches of present parameters where others would not determine the unknowns.

    With `speeds`, of components that lock what others lock, too, these have been made to yield.
    """
    chosen = _choose(flat, find_aliases(flat), (), decided=decided)
    if groups := singular_groups(chosen.system, chosen.counts, chosen.states):
        chosen = _choose(flat, find_aliases(flat), groups, decided=decided)
    system, counts, states, holds, flags = chosen.system, chosen.counts, chosen.states, chosen.holds, chosen.flags
    residual, origins = _differentiate(system, counts)
    determined = {*states, *system.inputs}
    unknowns = [n for n in range(len(system.levels)) if n not in determined]
    if flags.settle(residual, unknowns):
        residual, origins = _differentiate(system, counts)
    if not decided and needs_decision(system, residual, unknowns):
        return _reduce(flat, decided=True, speeds=speeds)
    derivatives = {system.derivative(state) for state in states}
    rates = [k for k, unknown in enumerate(unknowns) if unknown in derivatives]
    ideals = find_ideals(flat)
    locks = find_locks(flat)
    kept = [*(ideal.row for ideal in ideals), *(lock.row for lock in locks if lock.creeps)]
    solver = BlockSolver(residual, system.column(unknowns), system.volatile, rates, kept)
    solved = solver.run()
    if not speeds and (speeds := left_open(locks, solver, flat.d)):
        return _reduce(flatten_again(flat, speeds), decided=decided, speeds=speeds)
    order = [(system.symbols[unknowns[k]], expression) for k, expression in solved.order]
    circuits = find_circuits(system, holds, order, states)
    moving = moving_chains(system, counts) if holds else set[int]()
    changed = let_yield(system, holds, moving, order, states, residual) if moving else residual
    changed = share_reactions(system, holds, circuits, changed) if circuits else changed
    if changed is not residual:
        residual = changed
        solved = BlockSolver(residual, system.column(unknowns), system.volatile, rates, kept).run()
    degrees = len(counts) - sum(len(choice.chains) for choice in chosen.following)
    reduced = _assemble(system, counts[:degrees], states, unknowns, origins, solved)
    held = tuple(_placed(holds, reduced, states))
    ode = held_rates(reduced.flat, reduced.ode, reduced.values, held, circuits)
    choices = tuple(write_choice(choice, system, states, reduced.level_values) for choice in chosen.following)
    kept_so = tuple(((), (system.origins[row],), check) for row, check in chosen.checks)
    open_still = contradictions(reduced.flat, locks, speeds, reduced.values)
    determinants = (*reduced.determinants, *kept_so, *open_still)
    reduced = replace(
        reduced, ode=ode, holds=held, circuits=tuple(circuits), choices=choices, determinants=determinants
    )
    return complete(reduced, ideals, solved.rows) if ideals else reduced


def _placed(holds: Iterable[HeldMotion], reduced: ReducedDae, states: list[int]) -> Iterator[HeldMotion]:
    """Yield holds with the states of their motions and those of the positions whose rates these are."""
    system, rates = reduced.system, {reduced.system.derivative(level): k for k, level in enumerate(states)}
    for hold in holds:
        placed = system.node_level[hold.motion]
        position = rates.get(placed[0], -1) if placed is not None else -1
        yield replace(hold, state=reduced.node_states[hold.motion], position=position)


@dataclass
class _Chosen:
    """The equations with chosen states."""

    system: System
    counts: list[int]
    states: list[int]
    holds: tuple[HeldMotion, ...]
    flags: Flags
    following: tuple[Following, ...]
    checks: list[tuple[int, Any]]


def _choose(flat: FlatModel, aliases: Aliases, groups: tuple[Group, ...], *, decided: bool) -> _Chosen:
    """Choose states; those of `groups` follow the motion."""
    system = build_system(flat, aliases)
    checks = decide(system) if decided else []
    following = follow(system, groups)
    holds = add_approaches(system)
    flags = Flags(system)
    # A motion prescribed by an input has no known derivative.
    for level in system.inputs:
        rate = system.derivative(level)
        if rate is not None and rate not in system.inputs:
            raise StructureError(
                f"{system.levels[rate].name} is the derivative of the input {system.levels[level].name}, "
                "which is not known.",
                advice="Give the derivative as a separate input, or filter the input before it prescribes a motion.",
            )
    prefer_relative_states(system)
    contradictions = [flat.linear[k].origin for group in aliases.contradictions for k in group]
    incidence: list[list[int]] = [[] for _ in range(system.residual.numel())]
    for row, column in zip(*ca.jacobian_sparsity(system.residual, system.everything).get_triplet(), strict=True):
        incidence[row].append(column)
    check_solvable(system, incidence, contradictions)
    counts = Pantelides(system, incidence).counts
    prefer(system, groups, following)
    states = select_states(system, counts, _top_slopes(system, counts), incidence)
    return _Chosen(system, counts, states, holds, flags, following, checks)


def _top_slopes(system: System, counts: list[int]) -> list[dict[int, float]]:
    """Derivative of each fully differentiated equation by the highest level of each chain, at a generic point."""
    slopes: list[dict[int, float]] = [{} for _ in counts]
    rows = [k for k, count in enumerate(counts) if count]
    # d e^(c) / d v^(d) equals d e / d v^(d - c), so the original equations are enough.
    values = system.generic(ca.jacobian(system.residual[rows], system.everything))
    for place, column, value in zip(*values.sparsity().get_triplet(), values.nonzeros(), strict=True):
        level = system.levels[column]
        row = rows[place]
        if level.order + counts[row] == len(system.chains[level.chain]) - 1:
            slopes[row][level.chain] = float(value)
    return slopes


def _differentiate(system: System, counts: list[int]) -> tuple[Any, list[Origin]]:
    """Append the derivatives of the equations that must be differentiated."""
    residuals = [system.residual]
    origins = list(system.origins)
    rows = list(range(len(counts)))
    current = system.residual
    above = {n: rate for n in range(len(system.levels)) if (rate := system.derivative(n)) is not None}
    times = 1
    while keep := [k for k, row in enumerate(rows) if counts[row] >= times]:
        current, rows = current[keep], [rows[k] for k in keep]
        _check_inputs(system, current, rows)
        by_time = ca.jtimes(current, system.model.time, ca.SX(1))
        current = ca.jtimes(current, system.column(above), system.column(above.values())) + by_time
        residuals.append(current)
        origins += [system.origins[row] for row in rows]
        times += 1
    return ca.vertcat(*residuals), origins


def _check_inputs(system: System, equations: Any, rows: list[int]) -> None:
    unknown_rates = [level for level in system.inputs if system.derivative(level) is None]
    for place, depends in enumerate(ca.which_depends(equations, system.column(unknown_rates), 1, True)):
        if depends:
            origin = system.origins[rows[place]]
            names = ", ".join(system.levels[n].name for n in unknown_rates)
            raise StructureError(
                f"{origin.path or origin.kind}: the derivative of an input ({names}) would be needed.",
                where=origin.source,
                advice="Give the derivative as a separate input, or filter the input before it prescribes a motion.",
            )


def _assemble(
    system: System, counts: list[int], states: list[int], unknowns: list[int], origins: list[Origin], solved: Solved
) -> ReducedDae:
    """Assemble the reduced system.

    Args:
        system: the equations over levels.
        counts: number of differentiations of each, without those of states that follow the motion.
        states: levels that are states.
        unknowns: solved levels; positions in `solved` are positions in this list.
        origins: of all equations, differentiated ones included; positions in blocks are positions in this list.
        solved: the blocks.
    """
    model, levels = system.model, system.levels
    level_values, alg, determinants = _written_out(system, unknowns, solved)
    place = ca.Function("nodes", [system.everything, model.p], [system.node_values])
    z_levels = [unknowns[k] for k in solved.z]
    rates = [level_values[n] for s in states if (n := system.derivative(s)) is not None]
    blocks = [
        (tuple(levels[unknowns[k]].name for k in block.unknowns), tuple(origins[k] for k in block.equations))
        for block in solved.blocks
    ]
    numbers = [number for number, _ in solved.determinants]
    position = {level: k for k, level in enumerate(states)}
    return ReducedDae(
        flat=model,
        states=tuple(levels[s].name for s in states),
        implicit=tuple(levels[n].name for n in z_levels),
        x=system.column(states),
        z=system.column(z_levels),
        u=system.column(system.inputs),
        ode=ca.vertcat(*rates) if rates else ca.SX(0, 1),
        alg=ca.vertcat(*alg) if alg else ca.SX(0, 1),
        values=place(level_values, model.p),
        node_states=tuple(
            (position[p[0]], p[1]) if p is not None and p[0] in position else None for p in system.node_level
        ),
        guesses=tuple(levels[s].guess for s in states),
        nominals=tuple(levels[s].nominal for s in states),
        z_guesses=tuple(levels[n].guess for n in z_levels),
        blocks=tuple(solved.blocks),
        determinants=tuple((*blocks[number], d) for number, d in zip(numbers, determinants, strict=True)),
        index=max(counts, default=0) + 1,
        differentiated=tuple(system.origins[k] for k, count in enumerate(counts) if count),
        system=system,
        implicit_blocks=tuple(pair for pair, b in zip(blocks, solved.blocks, strict=True) if b.kind == "implicit"),
        level_values=level_values,
        explicit=tuple((unknowns[k], expression) for k, expression in solved.order),
    )


def _written_out(system: System, unknowns: list[int], solved: Solved) -> tuple[Any, list[Any], list[Any]]:
    """Values of all levels, residuals of z and determinants, in states, z and inputs instead of explicit unknowns."""
    results: list[Any] = [system.everything, *solved.alg, *(expression for _, expression in solved.determinants)]
    if solved.order:
        symbols, expressions = [system.symbols[unknowns[k]] for k, _ in solved.order], [e for _, e in solved.order]
        results = inserted(symbols, expressions, results)
    end = 1 + len(solved.alg)
    return results[0], results[1:end], results[end:]
