"""Mathematical functions of expressions."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Sequence
from math import inf
from typing import Any, cast

import casadi as ca

from modelica_like.errors import LanguageError
from modelica_like.language.discrete import CONTINUOUS, Marker, if_, marker, moves, silent
from modelica_like.language.expr import (
    TIME,
    Expr,
    Scalar,
    Symbol,
    flag_name,
    is_expression,
    operands,
    symbol_of,
    symbols_in,
)

RANDOM_NUMBERS = 2147483647.0


def _sx(value: Scalar) -> Any:
    return ca.SX(cast(Any, value))


def der(expression: Expr) -> Expr:
    """Return the time derivative (by the chain rule).

    Args:
        expression: a variable, or an expression of variables.
    """
    if isinstance(expression, Symbol) and expression is not TIME and not expression.owner.is_constant(expression.name):
        return expression.derivative()
    total: Any = 0.0
    for symbol in symbols_in(expression):
        if isinstance(symbol, Marker):
            continue  # constant between events
        rate: Any = 1.0 if symbol is TIME else _rate(symbol)
        total = total + ca.jacobian(_sx(expression), symbol) * rate
    return total


def random(before: Expr) -> Expr:
    """Return the pseudo-random number between 0 and 1 that follows another one.

    It belongs in a `when`, as in {self.u: random(pre(self.u))}. Numbers are k / (2^31 - 1) with k from the generator
    48271 k mod (2^31 - 1) of S. K. Park, K. W. Miller and P. K. Stockmeyer, `minstd_rand` of C++, which is exact in
    floating point: they are the same in every run and every FMU.

    Args:
        before: the number before. The start value of its variable, from 0 to below 1, is the seed.
    """
    product = 48271.0 * ca.fmax(ca.floor(_sx(before) * RANDOM_NUMBERS + 0.5), 1.0)
    return cast(Expr, (product - RANDOM_NUMBERS * ca.floor(product / RANDOM_NUMBERS)) / RANDOM_NUMBERS)


def prescribed(motion: Expr) -> Expr:
    """Return 1 if the model prescribes a motion, whatever torque or force it takes, and 0 if these determine it.

    This follows from the structure of the whole model and never changes during a run.

    Args:
        motion: a speed of the component, whose derivative is in the same equation.

    Raises:
        LanguageError: it is not a variable.
    """
    if not isinstance(motion, Symbol) or motion is TIME or motion.order:
        raise LanguageError(f"prescribed({motion}): only a variable can be prescribed.")
    return symbol_of(motion.owner, flag_name(motion.name))


def above_zero(function: Callable[[Any], Any], x: Any) -> Any:
    """Return a root of an expression; that of what is cut off at zero, sqrt(max(0, h)), has no slope below.

    The slope of the root is infinite at zero and that of the rest is zero: their product is not a number.
    """
    sides = operands(x) if is_expression(x) and x.is_op(ca.OP_FMAX) else []
    inner = next((one for one, other in zip(sides, reversed(sides), strict=True) if other.is_zero()), None)
    return function(x) if inner is None else where(inner > 0, function(inner), 0, events=False)


def power(base: Any, exponent: Any) -> Any:
    """Return a power; below one it is a root."""
    number = float(exponent) if _sx(exponent).is_constant() else 1.0
    return above_zero(lambda x: x**exponent, base) if 0 < number < 1 else base**exponent


def _rate(symbol: Symbol) -> Expr | float:
    constant = symbol.owner.is_constant(symbol.name)
    return 0.0 if constant else symbol.derivative()


def _elementary(function: Callable[[Any], Any], doc: str) -> Callable[[Scalar], Expr]:
    """Return a function of an expression or a number."""

    def of(x: Scalar) -> Expr:
        return above_zero(function, _sx(x)) if function is ca.sqrt else function(_sx(x))

    of.__name__, of.__doc__ = function.__name__, f"{doc}\n\nArgs:\n    x: an expression or a number.\n"
    return of


sin = _elementary(ca.sin, "Sine of an angle in rad.")
cos = _elementary(ca.cos, "Cosine of an angle in rad.")
tan = _elementary(ca.tan, "Tangent of an angle in rad.")
exp = _elementary(ca.exp, "Exponential function.")
log = _elementary(ca.log, "Natural logarithm.")
sqrt = _elementary(ca.sqrt, "Square root.")
tanh = _elementary(ca.tanh, "Hyperbolic tangent.")


def absolute(x: Scalar, *, events: bool = False) -> Expr:
    """Return the absolute value.

    Args:
        x: an expression or a number.
        events: whether the instants are located at which its branch changes; the integrator begins anew there.
    """
    return if_(_sx(x) < 0, -_sx(x), x) if events else ca.fabs(_sx(x))


def sign(x: Scalar, *, events: bool | None = None) -> Expr:
    """Return the sign: -1, 0 or 1.

    Args:
        x: an expression or a number.
        events: as of `where`.
    """
    if events is None:
        return ca.sign(_sx(x))
    return where(_sx(x) > 0, 1, 0, events=events) - where(_sx(x) < 0, 1, 0, events=events)


def floor(x: Scalar, *, events: bool | None = None) -> Expr:
    """Return the largest whole number that is not above a value.

    Args:
        x: an expression or a number.
        events: as of `where`.
    """
    if events and moves(_sx(x)):
        return marker("floor", _sx(x))
    return -ca.ceil(-_sx(x)) if events is False else ca.floor(_sx(x))


def mod(x: Scalar, y: Scalar, *, events: bool | None = None) -> Expr:
    """Return what is left of a value after subtracting a whole multiple of another one: `x - y * floor(x / y)`.

    Args:
        x: an expression or a number.
        y: another one.
        events: as of `where`.
    """
    return _sx(x) - _sx(y) * floor(_sx(x) / _sx(y), events=events)


def atan2(y: Scalar, x: Scalar) -> Expr:
    """Return the angle of a point in rad.

    Args:
        y: its ordinate.
        x: its abscissa.
    """
    return ca.atan2(_sx(y), _sx(x))


def minimum(x: Scalar, y: Scalar, *, events: bool = False) -> Expr:
    """Return the smaller of two values.

    Args:
        x: an expression or a number.
        y: another one.
        events: as of `absolute`.
    """
    return if_(_sx(x) < _sx(y), x, y) if events else ca.fmin(_sx(x), _sx(y))


def maximum(x: Scalar, y: Scalar, *, events: bool = False) -> Expr:
    """Return the larger of two values.

    Args:
        x: an expression or a number.
        y: another one.
        events: as of `absolute`.
    """
    return if_(_sx(x) > _sx(y), x, y) if events else ca.fmax(_sx(x), _sx(y))


def where(condition: Expr | bool, then: Scalar, otherwise: Scalar, *, events: bool | None = None) -> Expr:
    """Choose by a condition; the branch not taken may be undefined.

    Args:
        condition: a relation, or several joined with `all_of` and the like.
        then: value if it is true.
        otherwise: value if it is false.
        events: None: in an equation, a relation makes an event if the equation jumps there; it makes none where the
            branches meet, nor in what changes at events only. True: always (this is `if_`). False: never; then what
            jumps is integrated as it is written.

    Raises:
        LanguageError: events are asked for, and it is no condition.
    """
    if events:
        return if_(condition, then, otherwise)
    return ca.if_else(condition if events is None else silent(condition), _sx(then), _sx(otherwise))


def all_of(*conditions: Expr) -> Expr:
    """Return a condition that is true where all conditions are.

    Args:
        conditions: relations, or combinations of them.
    """
    return functools.reduce(ca.logic_and, conditions)


def any_of(*conditions: Expr) -> Expr:
    """Return a condition that is true where at least one condition is.

    Args:
        conditions: relations, or combinations of them.
    """
    return functools.reduce(ca.logic_or, conditions)


def negate(condition: Expr) -> Expr:
    """Return the opposite of a condition.

    Args:
        condition: a relation, or a combination of several.
    """
    return ca.logic_not(condition)


BEYOND = ("hold", "linear", "error")
"""Extrapolation of a table."""


def interpolate(
    x: Scalar, xs: Sequence[float], ys: Sequence[float], smooth: bool = False, extrapolate: str = "linear",
    limits: tuple[float, float] = (-inf, inf),
) -> Expr:  # fmt: skip
    """Interpolate in a table.

    Args:
        x: abscissa of the value.
        xs: abscissae, strictly increasing, at least one.
        ys: values at the abscissae.
        smooth: False: piecewise linear. True: continuous slope (cubic Hermite with Fritsch-Carlson slopes, no
            overshoot).
        extrapolate: beyond the ends `hold`: the last value; `linear`: the last slope; `error`: also the last value,
            while an event of the component ends the run.
        limits: smallest and largest value, which no slope goes on beyond.

    Raises:
        LanguageError: lengths differ, `xs` does not increase, or `extrapolate` is unknown.
    """
    numeric = not any(is_expression(x) for x in xs)
    if extrapolate not in BEYOND:
        raise LanguageError(f"A table has extrapolate = '{extrapolate}', which is not {', '.join(BEYOND)}.")
    if len(xs) != len(ys) or not xs or (numeric and any(b <= a for a, b in itertools.pairwise(xs))):
        raise LanguageError(
            f"A table has the abscissae {list(xs)} and the values {list(ys)}.",
            advice="Give both the same length, and let the abscissae increase strictly.",
        )
    if len(xs) == 1:
        return _sx(ys[0])
    slopes = _monotone_slopes(xs, ys) if smooth and len(xs) > 2 else None
    x = _sx(x) if extrapolate == "linear" else ca.fmin(ca.fmax(_sx(x), xs[0]), xs[-1])
    pieces = [_piece(x, xs, ys, slopes, k) for k in range(len(xs) - 1)]
    result: Any = pieces[0]
    for start, piece in zip(xs[1:-1], pieces[1:], strict=True):
        result = ca.if_else(silent(x < start, CONTINUOUS), result, piece)
    if slopes is not None and extrapolate == "linear":
        result = ca.if_else(silent(x < xs[0], CONTINUOUS), ys[0] + slopes[0] * (x - xs[0]), result)
        result = ca.if_else(silent(x > xs[-1], CONTINUOUS), ys[-1] + slopes[-1] * (x - xs[-1]), result)
    if extrapolate == "linear":
        result = ca.fmax(result, limits[0]) if limits[0] > -inf else result
        result = ca.fmin(result, limits[1]) if limits[1] < inf else result
    return result


def _piece(x: Any, xs: Sequence[float], ys: Sequence[float], slopes: list[Any] | None, k: int) -> Any:
    width = xs[k + 1] - xs[k]
    rise = ys[k + 1] - ys[k]
    if slopes is None:
        return ys[k] + (x - xs[k]) * (rise / width)
    s = (x - xs[k]) / width
    a, b = slopes[k] * width, slopes[k + 1] * width
    return ys[k] + s * (a + s * (3 * rise - 2 * a - b + s * (a + b - 2 * rise)))


def _monotone_slopes(xs: Sequence[float], ys: Sequence[float]) -> list[Any]:
    """Slopes after Fritsch and Butland (1984): the weighted harmonic mean of the neighbouring secants."""
    widths = [b - a for a, b in itertools.pairwise(xs)]
    secants = [(d - c) / h for c, d, h in zip(ys, ys[1:], widths, strict=False)]
    slopes: list[Any] = [secants[0]]
    for (h0, h1), (s0, s1) in zip(itertools.pairwise(widths), itertools.pairwise(secants), strict=True):
        weight0, weight1 = 2 * h1 + h0, h1 + 2 * h0
        mean = _ratio(weight0 + weight1, _ratio(weight0, s0) + _ratio(weight1, s1))
        slopes.append(where(s0 * s1 > 0, mean, 0.0) if is_expression(mean) else mean if s0 * s1 > 0 else 0.0)
    return [*slopes, secants[-1]]


def _ratio(over: Any, under: Any) -> Any:
    return over / under if is_expression(under) or under else 0.0
