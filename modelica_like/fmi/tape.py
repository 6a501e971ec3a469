"""Functions of the model as tapes: lists of elementary operations that C code runs, differentiates and transposes.

An operation writes one new value, nothing is overwritten, so that derivatives in both directions follow from the same
list. Compile time and size grow with the number of operations only.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate, chain, groupby
from typing import Any

import casadi as ca

from modelica_like.errors import LanguageError
from modelica_like.language.elements import numbers_of

ARGUMENTS = ("t", "x", "z", "p", "u", "d", "y")
"""Arguments of tapes: time, states, implicit unknowns, parameters, inputs, modes, and variables of the start system."""

OPERATIONS = (
    "ADD", "SUB", "MUL", "DIV", "NEG", "EXP", "LOG", "POW", "CONSTPOW", "SQRT", "SQ", "TWICE", "SIN", "COS", "TAN",
    "ASIN", "ACOS", "ATAN", "LT", "LE", "EQ", "NE", "NOT", "AND", "OR", "FLOOR", "CEIL", "FMOD", "REMAINDER", "FABS",
    "SIGN", "COPYSIGN", "IF_ELSE_ZERO", "ERF", "FMIN", "FMAX", "INV", "SINH", "COSH", "TANH", "ASINH", "ACOSH",
    "ATANH", "ATAN2", "HYPOT", "LOG1P", "EXPM1", "ELEMENT",
)  # fmt: skip
"""The operations of `tape.c`, in the order of its enumeration."""

_COPIES = (ca.OP_ASSIGN, ca.OP_LIFT)
_NAMES = {getattr(ca, f"OP_{name}"): name for name in OPERATIONS if name != "ELEMENT"}


Constant = float | tuple[float, ...]
"""A number, or a list of numbers behind its length."""


@dataclass(frozen=True)
class Tape:
    """A function as operations on slots.

    Slots are [t, x, z, p, u, d, y, constants, results]; operation k writes result k. Equal operations follow each other
    as far as their operands allow, so that C dispatches once per group of them.

    Attributes:
        name: name of the function.
        operations: (operation, slot of the left operand, slot of the right operand).
        outputs: slots of the results of the function.
    """

    name: str
    operations: tuple[tuple[str, int, int], ...]
    outputs: tuple[int, ...]

    @property
    def runs(self) -> tuple[tuple[str, int], ...]:
        """Groups of equal operations: operation and count."""
        return tuple((name, len(list(group))) for name, group in groupby(name for name, _, _ in self.operations))

    def __repr__(self) -> str:
        return f"<Tape {self.name}: {len(self.operations)} operations, {len(self.outputs)} outputs>"


@dataclass(frozen=True)
class Slots:
    """Slots of arguments and constants.

    Attributes:
        sizes: number of values of every argument.
        constants: all constants of all tapes; a list of numbers has its length and then its numbers.
    """

    sizes: dict[str, int]
    constants: tuple[float, ...]


def write_tapes(functions: dict[str, Any], sizes: dict[str, int]) -> tuple[Slots, tuple[Tape, ...]]:
    """Write CasADi functions, each with one dense or sparse result, as tapes.

    Args:
        functions: functions of scalar expressions (SX) by name; their arguments are among `ARGUMENTS`.
        sizes: number of values of every argument.

    Raises:
        LanguageError: a function uses an operation that has no counterpart in C.
    """
    first: dict[str, int] = dict(
        zip(ARGUMENTS, accumulate((sizes[name] for name in ARGUMENTS), initial=0), strict=False)
    )
    base = sum(sizes.values())
    constants: dict[Constant, int] = {0.0: -1}
    read = [_read(name, function, first, base, constants) for name, function in functions.items()]
    values = [constant if isinstance(constant, tuple) else (constant,) for constant in constants]
    firsts = accumulate(map(len, values), initial=base)
    places = dict(zip(constants.values(), firsts, strict=False))
    slots = Slots(sizes, tuple(chain.from_iterable(values)))
    return slots, tuple(_sorted(tape, places, base, base + len(slots.constants)) for tape in read)


def _read(name: str, function: Any, first: dict[str, int], base: int, constants: dict[Constant, int]) -> Tape:
    """Read a function unchanged: results follow the arguments, and constants have numbers below zero."""
    starts = [first[argument] for argument in function.name_in()]
    held: dict[int, int] = {}
    value_of: dict[int, float] = {}
    operations: list[tuple[str, int, int]] = []
    outputs = [constants[0.0]] * function.nnz_out(0)
    instruction, constant = function.instruction_id, function.instruction_constant
    reads, writes = function.instruction_input, function.instruction_output
    for k in range(function.n_instructions()):
        code = instruction(k)
        if code == ca.OP_CONST:
            value_of[writes(k)[0]] = constant(k)
            held[writes(k)[0]] = constants.setdefault(constant(k), -1 - len(constants))
        elif code == ca.OP_OUTPUT:
            outputs[writes(k)[1]] = held[reads(k)[0]]
        elif code == ca.OP_INPUT:
            argument, element = reads(k)
            held[writes(k)[0]] = starts[argument] + element
        elif code == ca.OP_CALL:
            index, number, count = reads(k)
            numbers = numbers_of(value_of[number], value_of[count], function)
            operations.append(
                ("ELEMENT", held[index], constants.setdefault((len(numbers), *numbers), -1 - len(constants)))
            )
            held[writes(k)[0]] = base + len(operations) - 1
        elif code in _COPIES:
            held[writes(k)[0]] = held[reads(k)[0]]
        elif code in _NAMES:
            operands = reads(k)
            operations.append((_NAMES[code], held[operands[0]], held[operands[-1]]))
            held[writes(k)[0]] = base + len(operations) - 1
        else:
            raise LanguageError(
                f"The function {name} of the model uses an operation that FMUs do not have (CasADi number {code}).",
                advice="Write it with elementary functions.",
            )
    return Tape(name, tuple(operations), tuple(outputs))


def _sorted(tape: Tape, places: dict[int, int], base: int, results: int) -> Tape:
    """Reorder operations into long groups of equal ones: always the kind of which most are ready.

    Args:
        tape: as `_read` returns it.
        places: slots of the constants.
        base: slot of the first constant.
        results: slot of the first result.
    """
    users: list[list[int]] = [[] for _ in tape.operations]
    missing: list[int] = []
    ready: dict[str, list[int]] = {}
    for k, (name, *operands) in enumerate(tape.operations):
        sources = {slot - base for slot in operands if slot >= base}
        for source in sources:
            users[source].append(k)
        missing.append(len(sources))
        if not sources:
            ready.setdefault(name, []).append(k)
    order: list[int] = []
    while any(ready.values()):
        chosen = ready[max(ready, key=lambda name: len(ready[name]))]
        for k in chosen:  # grows while it is read: operations that become ready can join
            order.append(k)
            for user in users[k]:
                missing[user] -= 1
                if not missing[user]:
                    ready.setdefault(tape.operations[user][0], []).append(user)
        chosen.clear()
    place = places | {base + k: results + position for position, k in enumerate(order)}
    moved = tuple(
        (name, place.get(left, left), place.get(right, right))
        for name, left, right in (tape.operations[k] for k in order)
    )
    return Tape(tape.name, moved, tuple(place.get(slot, slot) for slot in tape.outputs))
