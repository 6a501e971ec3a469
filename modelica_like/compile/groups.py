"""What a compiled model consists of: equations, events, held motions and starts; rows of its tables."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import casadi as ca

from modelica_like.compile.buffers import Vector
from modelica_like.errors import Source
from modelica_like.flatten.model import Origin
from modelica_like.flatten.template import TransitionForm
from modelica_like.structure.holds import Circuit, HeldMotion
from modelica_like.structure.ideal import IdealNetwork

Blocks = tuple[tuple[tuple[str, ...], tuple[Origin, ...]], ...]
"""Names of the unknowns of blocks, and the origins of their equations."""
_Group = TypeVar("_Group", "Equations", "EventTables", "Held", "Starts")


@dataclass(frozen=True)
class Reset:
    """A value that changes at an event: entry of x (`state`), of d (`discrete`), or of the reset nodes (`value`).

    With a factor of zero a node keeps its value where another one gets a new value, if it gets none itself.
    """

    kind: str
    index: int
    factor: float
    value: int
    target: int


@dataclass(frozen=True)
class CompiledUpdate:
    """What gets the value of a row of `EventTables.updates`, and whether it also does so when start values are found.

    `source` is the place of its equation or `when`.
    """

    reset: Reset
    at_start: bool
    source: Source


CompiledTransition = TransitionForm[int, Reset]
"""A transition as numbers."""


@dataclass(frozen=True)
class StartEntry:
    """A start value: node, state (if it is one), strength, position in the start values."""

    node: int
    state: tuple[int, float] | None
    strength: str


@dataclass(frozen=True, eq=False)
class Equations:
    """What holds at every moment.

    Attributes:
        ode: derivatives of x.
        alg: residuals for z.
        alg_jacobian: their derivatives by z.
        variables: all flat variables, in the order of `flat_variables`.
        derived: parameters that follow from others, of p only.
        determinants: relative determinants; zero where a block is singular.
        singular: the blocks of `determinants`.
        implicit_blocks: the blocks of `alg`.
        differentiated: equations that were differentiated.
        nominals: orders of magnitude of x.
    """

    ode: ca.Function
    alg: ca.Function
    alg_jacobian: ca.Function
    variables: ca.Function
    derived: ca.Function
    determinants: ca.Function
    singular: Blocks
    implicit_blocks: Blocks
    differentiated: tuple[Origin, ...]
    nominals: Vector


@dataclass(frozen=True, eq=False)
class EventTables:
    """What may happen at an instant.

    Attributes:
        guards: one per state event, positive where it can fire.
        guard_rates: their time derivatives along the solution.
        guards_soon: guards one time resolution later.
        moments: times of the time events.
        transitions: what fires by a guard or at a moment.
        resets: new values at events.
        reset_nodes: variables with a reset that are neither states nor discrete.
        updates: what discrete variables, and variables in a `when`, become in one iteration of an event; as many as
            `update_rows`.
        delays: value and time of each delay, one after the other.
        delay_parts: places of the numbers of each delay in d: terms of its series, beginning, 2 over the length.
    """

    guards: ca.Function
    guard_rates: ca.Function
    guards_soon: ca.Function
    moments: ca.Function
    transitions: tuple[CompiledTransition, ...]
    resets: ca.Function
    reset_nodes: tuple[int, ...]
    updates: ca.Function
    update_rows: tuple[CompiledUpdate, ...]
    delays: ca.Function
    delay_parts: tuple[tuple[int, ...], ...]


@dataclass(frozen=True, eq=False)
class Held:
    """What modes hold, and what ideal elements set to zero.

    Attributes:
        motions: that modes hold.
        terms: gain (zero where nothing is held), capacities forward and backward, and restitution of every held
            motion, one row each, row by row.
        circuits: held motions that depend on each other.
        ideal: the ideal elements, if there are any.
    """

    motions: tuple[HeldMotion, ...]
    terms: ca.Function
    circuits: tuple[Circuit, ...]
    ideal: IdealNetwork | None


@dataclass(frozen=True, eq=False)
class Starts:
    """What is known at the start.

    Attributes:
        conditions: one per choice of a start mode.
        modes: entry of d, number and place of each of these choices.
        entries: start values of variables.
        values: as many as `entries`.
        discretes: start of d: modes and discrete values, then the entries of held motions and ideal elements.
        guesses: of x.
        z_guesses: of z.
    """

    conditions: ca.Function
    modes: tuple[tuple[int, int, Source], ...]
    entries: tuple[StartEntry, ...]
    values: ca.Function
    discretes: ca.Function
    guesses: Vector
    z_guesses: Vector


def functions_of(*groups: Equations | EventTables | Held | Starts) -> dict[str, ca.Function]:
    """Return the functions in groups by their names, such as `start_values`."""
    values = (value for group in groups for value in vars(group).values())
    return {value.name(): value for value in values if isinstance(value, ca.Function)}


def with_functions(group: _Group, functions: dict[str, ca.Function], **tables: Any) -> _Group:
    """Return a group in which functions stand for those of the same names.

    Args:
        group: is not changed.
        functions: by name; those of other groups do not count.
        tables: other fields to change.
    """
    given = {item.name: getattr(group, item.name) for item in fields(group)}
    names = {name: value.name() for name, value in given.items() if isinstance(value, ca.Function)}
    return replace(group, **{name: functions[key] for name, key in names.items() if key in functions}, **tables)
