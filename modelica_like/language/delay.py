"""Transport delay: a value as it was some time before."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import casadi as ca

from modelica_like.errors import LanguageError
from modelica_like.language.discrete import Marker, is_fixed, marker
from modelica_like.language.expr import TIME, Expr, Scalar, symbols_in
from modelica_like.language.places import caller

TERMS = 16
"""Terms of the Chebyshev series that a delayed value is during a piece of a run."""


class Part(Marker):
    """A number of a delayed value: terms of its series, then the beginning of its piece in s, and 2 over its length.

    Attributes:
        whole: the marker of the delay: `of` is the value, `offset` the delay in s.
    """

    whole: Marker

    def __init__(self, whole: Marker, of: Expr) -> None:
        super().__init__("delay", of)
        self.whole = whole


def parts(delay: Marker) -> Sequence[Part]:
    """Return the numbers of a delay, always the same ones."""
    if not delay.numbers:
        delay.numbers = [Part(delay, unit) for unit in (*[delay.of] * TERMS, TIME, 1 / TIME)]
    return delay.numbers


def delay(value: Expr, time: Scalar) -> Expr:
    """Return a value as it was some time before: y(t) = value(t - time); before the start it is that at the start.

    A run takes it from its own past, as a polynomial for a piece of at most `time`. Jumps and kinks of the value come
    again exactly `time` later. The value now does not depend on it, so it breaks algebraic loops. It has no
    derivatives by parameters.

    Args:
        value: any expression.
        time: the delay in s: a parameter or an expression of parameters; positive.

    Raises:
        LanguageError: the delay is not positive, a text, or no parameter.
    """
    if isinstance(time, str):
        what = f"The time of a delay is an expression of parameters, not the text '{time}'."
        raise LanguageError(what, where=caller(), advice="Declare a parameter in s, and name it.")
    size: Any = ca.SX(cast(Any, time))
    if any(symbol.owner is None or not is_fixed(symbol) for symbol in symbols_in(size)):
        what = f"delay({value}, {size}): the delay changes during a run."
        raise LanguageError(what, where=caller(), advice="Use a parameter. A delay that changes is not supported.")
    if size.is_constant() and not 0 < float(size) < float("inf"):
        what = f"delay({value}, {size}): the delay must be positive."
        raise LanguageError(what, where=caller(), advice="Write the value itself where nothing is delayed.")
    *terms, begin, rate = (cast(Any, part) for part in parts(marker("delay", ca.SX(cast(Any, value)), time)))
    place = (cast(Any, TIME) - begin) * rate - 1
    last = before = ca.SX(0)
    for term in reversed(terms[1:]):
        last, before = term + 2 * place * last - before, last
    return terms[0] + place * last - before
