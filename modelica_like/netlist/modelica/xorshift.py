"""Random numbers of the standard library: the xorshift generators of Vigna (2014), in exact arithmetic of doubles.

A state is whole numbers of 32 bits with a sign, the lower half of each word first. A word of 64 bits is a list of its
bits, the lowest first: shifts are slices, and a run needs no operations on whole numbers for them.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca

from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.tree import Expr

_HALF, _WORD, _LIMB = 32, 64, 16
_RANGE = 2.0**_HALF
_WORDS = 16
"""Of the state of xorshift1024*."""
Bits = list[Any]


def _bits(low: Any, high: Any) -> Bits:
    result: Bits = []
    for half in (low, high):
        above = [ca.floor(half * 2.0**-k) for k in range(_HALF + 1)]
        result += [above[k] - 2 * above[k + 1] for k in range(_HALF)]
    return result


def _left(word: Bits, by: int) -> Bits:
    return [0.0] * by + word[: _WORD - by]


def _right(word: Bits, by: int) -> Bits:
    return word[by:] + [0.0] * by


def _xor(*words: Bits) -> Bits:
    return [functools.reduce(_differ, bits) for bits in zip(*words, strict=True)]


def _differ(a: Any, b: Any) -> Any:
    """Return whether two bits differ; one that a shift has brought in is a number."""
    return b if isinstance(a, float) else a if isinstance(b, float) else (a - b) ** 2


def _number(bits: Bits) -> Any:
    return sum((bit * 2.0**k for k, bit in enumerate(bits) if not isinstance(bit, float)), ca.SX(0))


def _carried(numbers: list[Any], width: int) -> list[Any]:
    """Return digits of so many bits, the lowest first, of larger ones; what the last one carries is lost."""
    carry, result = ca.SX(0), list[Any]()
    for number in numbers:
        whole = number + carry
        carry = ca.floor(whole * 2.0**-width)
        result.append(whole - carry * 2.0**width)
    return result


def _product(word: Bits, factor: int) -> list[Any]:
    """Return the halves of a word times a constant: limbs of 16 bits, whose products are below 2^34."""
    limbs = [_number(word[k : k + _LIMB]) for k in range(0, _WORD, _LIMB)]
    others = [factor >> k & 0xFFFF for k in range(0, _WORD, _LIMB)]
    sums = [sum(limbs[i] * others[k - i] for i in range(k + 1)) for k in range(len(limbs))]
    a, b, c, d = _carried(sums, _LIMB)
    return [a + b * 2.0**_LIMB, c + d * 2.0**_LIMB]


def _signed(half: Any) -> Any:
    return half - _RANGE * ca.floor(half * (2 / _RANGE))


def _uniform(low: Any, high: Any) -> Any:
    """Return the number above 0 and up to 1 of a word: as a whole number with a sign, rounded once, over 2^64 + 1/2."""
    return (_signed(high) * _RANGE + low) * 2.0**-_WORD + 0.5


def _xorshift64star(state: list[Any]) -> list[Any]:
    x = _bits(*state)
    x = _xor(x, _right(x, 12))
    x = _xor(x, _left(x, 25))
    x = _xor(x, _right(x, 27))
    low, high = _product(x, 2685821657736338717)
    return [_uniform(low, high), low, high]


def _xorshift128plus(state: list[Any]) -> list[Any]:
    a, b = _bits(*state[:2]), _bits(*state[2:])
    a = _xor(a, _left(a, 23))
    mixed = _xor(a, b, _right(a, 17), _right(b, 26))
    sums = [_number(mixed[:_HALF]) + state[2], _number(mixed[_HALF:]) + state[3]]
    low, high = _carried(sums, _HALF)
    return [_uniform(low, high), *state[2:], low, high]


def _xorshift1024star(state: list[Any]) -> list[Any]:
    place = state[-1] - _WORDS * ca.floor(state[-1] / _WORDS)
    after = place + 1 - _WORDS * ca.floor((place + 1) / _WORDS)

    def chosen(at: Any) -> Bits:
        halves = [sum((state[2 * k + half] * (at == k) for k in range(_WORDS)), ca.SX(0)) for half in (0, 1)]
        return _bits(*halves)

    a, b = chosen(place), chosen(after)
    b = _xor(b, _left(b, 31))
    word = _xor(b, _right(b, 11), a, _right(a, 30))
    halves = [_number(word[:_HALF]), _number(word[_HALF:])]
    new = [ca.if_else(after == k // 2, halves[k % 2], state[k]) for k in range(2 * _WORDS)]
    return [_uniform(*_product(word, 1181783497276652981)), *new, after]


_GENERATORS: dict[str, tuple[int, Callable[[list[Any]], list[Any]]]] = {
    "xorshift64star": (2, _xorshift64star),
    "xorshift128plus": (4, _xorshift128plus),
    "xorshift1024star": (2 * _WORDS + 1, _xorshift1024star),
}
NAMES = tuple(_GENERATORS)


@functools.cache
def _function(name: str) -> ca.Function:
    """Return the function of a generator: of a state, a random number and the next state."""
    size, make = _GENERATORS[name]
    state = ca.SX.sym("state", size)
    halves = [state[k] - _RANGE * ca.floor(state[k] / _RANGE) for k in range(2 * (size // 2))]
    number, *new = make([*halves, *(state[k] for k in range(len(halves), size))])
    new = [_signed(half) for half in new[: len(halves)]] + new[len(halves) :]
    return ca.Function(name, [state], [ca.vertcat(number, *new)])


@dataclass(frozen=True)
class Drawn:
    """One result of a generator as a function of its state: the random number, or a part of the next state from 1."""

    generator: str
    result: int

    @property
    def whole(self) -> bool:
        """Whether the result is a whole number."""
        return self.result > 0

    def __call__(self, *state: Any) -> Any:
        """Return the result, in symbols."""
        return _function(self.generator)(ca.vertcat(*state))[self.result]


def draw(name: str, state: Expr, line: int) -> Expr:
    """Return a random number and the next state.

    Args:
        name: of the generator.
        state: its state, an array of as many whole numbers as it has.
        line: of the call.

    Raises:
        Unfit: the state has another size.
    """
    size, parts = _GENERATORS[name][0], fold.elements(state)
    if len(parts) != size:
        raise fold.Unfit(f"The state of {name} has {size} whole numbers, not {len(parts)}")
    number, *new = (fold.native(Drawn(name, k), tuple(parts), line) for k in range(size + 1))
    return Expr("tuple", (number, Expr("array", tuple(new), line)), line)
