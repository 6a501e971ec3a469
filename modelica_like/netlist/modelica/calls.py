"""What calls of Modelica mean here: functions of numbers, operators that only a run evaluates, what is refused."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any


class Unfit(ValueError):
    """Operands or arguments do not fit, in words."""


JUMPING = {"sign", "floor", "integer", "ceil", "mod", "div", "rem"}
"""Functions of numbers whose values jump."""
ELEMENTARY = JUMPING | {
    "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log", "log10", "sqrt", "abs",
    "min", "max",
}  # fmt: skip
"""Functions of numbers."""
KEPT = {
    "der", "pre", "noEvent", "smooth", "initial", "sample", "edge", "change", "terminal", "delay",
    "Clock", "previous", "hold",
}  # fmt: skip
OF_BEFORE = ("pre", "edge", "change")
"""Those that need what a variable was before an event."""
ARGUMENTS = {
    **dict.fromkeys(("der", "pre", "noEvent", "edge", "change", "previous", "hold", "Integer", "cardinality"), (1, 1)),
    **dict.fromkeys(("initial", "terminal", "getInstanceName"), (0, 0)),
    **dict.fromkeys(("sample", "Clock", "size"), (1, 2)), "smooth": (2, 2), "reinit": (2, 2), "delay": (2, 3),
    "homotopy": (2, 2), "assert": (2, 3), "terminate": (1, 1), "Streams.error": (1, 1),
}  # fmt: skip
"""Least and largest number of arguments."""
_NAMED = {
    "homotopy": ("actual", "simplified"), "assert": ("condition", "message", "level"), "terminate": ("message",),
    "Streams.error": ("string",),
}  # fmt: skip
"""Names of the arguments, where Modelica has some."""
STATEMENTS = ("assert", "reinit", "terminate")
REFUSED = {
    "spatialDistribution": "spatialDistribution (of a constant velocity it is delay(u, T))",
    "inStream": "a stream connector", "actualStream": "a stream connector",
    "subSample": "a clock that follows another",
    "superSample": "a clock that follows another", "shiftSample": "a clock that follows another",
    "backSample": "a clock that follows another",
    "transition": "a state machine", "initialState": "a state machine",
}  # fmt: skip


def positional(name: str, given: tuple[Any, ...], named: Iterable[tuple[str, Any]]) -> list[Any]:
    """Return the arguments of a built-in function, in the order of their places.

    Raises:
        Unfit: one is missing, has a name that there is not, or two values.
    """
    names, values = _NAMED.get(name, ()), dict(enumerate(given))
    for key, value in named:
        if key not in names:
            raise Unfit(f"{name}(…) has no argument '{key}'")
        if names.index(key) in values:
            raise Unfit(f"{name}(…) is given {key} twice")
        values[names.index(key)] = value
    least, most = ARGUMENTS.get(name, (0, len(values)))
    if not least <= len(values) <= most or max(values, default=-1) >= len(values):
        wanted = f"{least} to {most}" if most > least else str(least)
        raise Unfit(f"{name}(…) has {wanted} argument{'s' if most != 1 else ''}, not {len(values)}")
    return [values[k] for k in range(len(values))]
