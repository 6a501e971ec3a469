"""Edges of smooth functions: where a pulse, or a step, has its top and its flanks, however narrow it is.

A function of a state, such as exp(-((x - x0)/w)²), 1/(1 + ((x - x0)/w)²) or tanh((x - x0)/w), has no kink, but within a
few w it does what a kink does. An integrator whose step goes over it sees nothing. So its places are edges:

- The top of a pulse, at which the argument has no slope. It is a change of sign that no step is long enough to hide.
  The argument of an exponential may also turn because its states do: where nothing else bends, the top is at the zero
  of its rate.
- Its flanks: where an exponential begins to count, and elsewhere the points of inflection. Between flank and top is a
  good part of the pulse, which a few looks show. Both come to light when the top is located.
- The middle of a step (tanh), or of a bend (a root of squares), if there is another one elsewhere: two, one after the
  other, are a pulse. One alone has other values or slopes behind it, which every integrator sees; not so its square,
  therefore its tails are edges, too.

All come from the expression graph; slopes are taken by one moving symbol at a time, with the others held. Powers
without a bend in a symbol (1/x) have no edge.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import casadi as ca

_COUNTS_FROM = 36.0
"""exp(-36) is rounding beside exp(0)."""
_STEPS = frozenset({ca.OP_TANH, ca.OP_ATAN, ca.OP_ERF})
_EXPONENTIALS = frozenset({ca.OP_EXP, ca.OP_EXPM1})
_POWERS = frozenset({ca.OP_POW, ca.OP_CONSTPOW})
_RECIPROCALS = frozenset({ca.OP_DIV, ca.OP_INV})
_TINY = 1e-300
_ROOTS = frozenset({ca.OP_SQRT, ca.OP_HYPOT})
NARROW = _STEPS | _ROOTS | _EXPONENTIALS | _POWERS | _RECIPROCALS
"""Operations that may make a narrow pulse or step."""
_TAILS = -18.0, -3.0, 3.0, 18.0
"""tanh(3)² is one but for a hundredth, tanh(18)² but for rounding."""
_STEEP = 3.0
"""Powers from 0 to this one are no narrower than their base."""


class Narrow:
    """Finds the edges of smooth functions in the equations of a model.

    Args:
        arguments: symbols t, x, z, p, u, d.
        rates: of the states, column (nx).
    """

    def __init__(self, arguments: dict[str, Any], rates: Any) -> None:
        self._rates: dict[int, Any] = {arguments["t"].element_hash(): ca.SX(1)}
        for state, rate in zip(_split(arguments["x"]), _split(rates), strict=True):
            self._rates[state.element_hash()] = rate
        self._implicit = {one.element_hash() for one in _split(arguments["z"])}
        self._moves = self._rates.keys() | self._implicit

    def edges(self, operations: Iterable[tuple[int, list[Any]]]) -> Iterator[Any]:
        """Yield edges of operations of `NARROW`, each given by its code and operands."""
        steps = list[Any]()
        for code, operands in operations:
            base, last = operands[0], operands[-1]
            if code in _STEPS:
                steps.append(base)
            elif code in _ROOTS:
                square = base if code == ca.OP_SQRT else base**2 + last**2
                steps += [_distance(slope, slope, bend, ca.fabs(square)) for slope, bend in self._bends(square)]
            elif code in _EXPONENTIALS:
                yield from self._of_exponential(base, base)
            elif code in _RECIPROCALS:
                yield from self._of_power(last, -1.0)
            elif self._moving(last):
                yield from self._of_exponential(last, last * ca.log(base))
            elif not (last.is_constant() and 0 <= float(last) <= _STEEP):
                yield from self._of_power(base, last)
        yield from self._of_steps(steps)

    def _of_exponential(self, turns: Any, exponent: Any) -> Iterator[Any]:
        moving, size = self._moving(turns), 1 + ca.fabs(turns)
        slopes = [_slopes(turns, symbol) for symbol in moving]
        tops = [_distance(slope, slope, bend, size) for slope, bend in self._bends(turns)]
        names = [symbol.element_hash() for symbol in moving]
        if not tops and self._implicit.isdisjoint(names):  # their rates are not known
            rate = sum(slope * self._rates[name] for name, (slope, _) in zip(names, slopes, strict=True))
            tops = [rate] if self._moving(rate) else []
        yield from [*tops, (exponent + _COUNTS_FROM) / (ca.fabs(exponent) + _COUNTS_FROM)] if tops else []

    def _of_power(self, base: Any, exponent: Any) -> Iterator[Any]:
        for slope, bend in self._bends(base):
            steep, bent = (exponent - 1) * slope**2, base * bend
            yield _distance(slope, slope, bend, ca.fabs(base))
            yield (steep + bent) / (ca.fabs(steep) + ca.fabs(bent) + _TINY)

    def _of_steps(self, arguments: list[Any]) -> Iterator[Any]:
        """Yield middles and tails of steps that are not all where their symbols are zero."""
        moving = [self._moving(argument) for argument in arguments]
        aside = set[int]()
        for argument, symbols in zip(arguments, moving, strict=True):
            if not ca.substitute(argument, ca.vertcat(*symbols), ca.SX.zeros(len(symbols))).is_zero():
                aside.update(symbol.element_hash() for symbol in symbols)
        for argument, symbols in zip(arguments, moving, strict=True):
            if any(symbol.element_hash() in aside for symbol in symbols):
                yield from (argument, *(argument - tail for tail in _TAILS))

    def _bends(self, expression: Any) -> Iterator[tuple[Any, Any]]:
        """Yield first and second derivatives by each moving symbol in which an expression is not linear."""
        for slope, bend in (_slopes(expression, symbol) for symbol in self._moving(expression)):
            if not bend.is_zero():
                yield slope, bend

    def _moving(self, expression: Any) -> list[Any]:
        return [one for one in ca.symvar(expression) if one.element_hash() in self._moves]


def _slopes(expression: Any, symbol: Any) -> tuple[Any, Any]:
    """Return the first and second derivative by a symbol."""
    slope = ca.jacobian(expression, symbol)
    return slope, ca.jacobian(slope, symbol)


def _distance(top: Any, slope: Any, bend: Any, size: Any) -> Any:
    """Return what has the sign and the zeros of `top`, but grows like the distance from there.

    Edges are located by straight lines, as precisely as what they change by: not if they grow like a fifth power.
    """
    return top / (ca.fabs(bend) + slope**2 / (size + _TINY) + _TINY)


def _split(column: Any) -> list[Any]:
    return ca.vertsplit(column) if column.numel() else []
