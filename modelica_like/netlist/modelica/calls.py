"""What calls of Modelica mean here: functions of numbers, operators that only a run evaluates, what is refused."""

from __future__ import annotations

JUMPING = {"sign", "floor", "integer", "ceil", "mod", "div", "rem"}
"""Functions of numbers whose values jump."""
ELEMENTARY = JUMPING | {
    "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log", "log10", "sqrt", "abs",
    "min", "max",
}  # fmt: skip
"""Functions of numbers."""
KEPT = {
    "der", "pre", "noEvent", "smooth", "initial", "sample", "edge", "change", "reinit", "terminal", "delay",
    "Clock", "previous", "hold",
}  # fmt: skip
ARGUMENTS = {
    **dict.fromkeys(("der", "pre", "noEvent", "edge", "change", "previous", "hold"), (1, 1)),
    **dict.fromkeys(("initial", "terminal"), (0, 0)),
    **dict.fromkeys(("sample", "Clock", "size"), (1, 2)), "smooth": (2, 2), "reinit": (2, 2), "delay": (2, 3),
    "homotopy": (2, 2),
}  # fmt: skip
"""Least and largest number of arguments."""
REFUSED = {
    "spatialDistribution": "spatialDistribution (of a constant velocity it is delay(u, T))",
    "inStream": "a stream connector", "actualStream": "a stream connector",
    "subSample": "a clock that follows another",
    "superSample": "a clock that follows another", "shiftSample": "a clock that follows another",
    "backSample": "a clock that follows another",
    "transition": "a state machine", "initialState": "a state machine",
}  # fmt: skip


def wrong_count(name: str, count: int) -> str:
    """Return that a built-in function does not have so many arguments, in words; empty if it does."""
    least, most = ARGUMENTS.get(name, (0, count))
    if least <= count <= most:
        return ""
    wanted = f"{least} to {most}" if most > least else str(least)
    return f"{name}(…) has {wanted} argument{'s' if most != 1 else ''}, not {count}."
