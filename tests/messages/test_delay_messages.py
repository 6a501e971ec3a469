"""Errors of delays.

Lines of this file are written as {marker}, the line that ends in `# marker`.
"""

from collections.abc import Callable
from typing import Any, cast

import pytest

from modelica_like import build, export_fmu, linearize, sensitivities, simulate
from modelica_like.errors import (
    ExportError,
    InitializationError,
    LanguageError,
    ModelicaLikeError,
    NoGradient,
    StepFailed,
    StructureError,
    UnitMismatch,
    ValueOutOfRange,
)
from modelica_like.language import (
    Component,
    Equations,
    Expr,
    Parameter,
    Variable,
    delay,
    der,
    param,
    sin,
    tanh,
    var,
    where,
)


class Lagging(Component):
    x: Variable = var("1", "moves", default=0)
    y: Variable = var("1", "delayed")
    T: Parameter = param("s", "delay", default=0.1)
    L: Parameter = param("m", "length", default=1.0)

    def late(self) -> Expr:
        return delay(self.x, self.T)

    def equations(self) -> Equations:
        yield self.T * der(self.x) == 1 - self.x
        yield self.y == self.late()  # basis


class Moving(Lagging):
    def late(self) -> Expr:
        return delay(self.x, self.T * self.x)  # moving


class Text(Lagging):
    def late(self) -> Expr:
        return delay(self.x, cast(Any, "0.1 s"))  # text


class Never(Lagging):
    def late(self) -> Expr:
        return delay(self.x, 0 * self.T)  # never


class Length(Lagging):
    def late(self) -> Expr:
        return delay(self.x, self.L)


class Branches(Lagging):
    def late(self) -> Expr:
        return delay(self.x, where(self.T > 2 * self.T, 1.0, self.T))


class Unit(Lagging):
    def late(self) -> Expr:
        return delay(self.T, self.T)


class Swinging(Lagging):
    def late(self) -> Expr:
        return delay(sin(1e6 * self.x), 10 * self.T)


class Own(Lagging):
    def late(self) -> Expr:
        return tanh(delay(self.y, self.T))


HERE = "test_delay_messages.py"
CASES: dict[type[Component], tuple[type[ModelicaLikeError], str]] = {
    Moving: (
        LanguageError,
        "delay(x, (T*x)): the delay changes during a run.\n"
        f"  in {HERE}:{{moving}} `delay(self.x, self.T * self.x)`\n"
        "Use a parameter. A delay that changes is not supported.",
    ),
    Text: (
        LanguageError,
        "The time of a delay is an expression of parameters, not the text '0.1 s'.\n"
        f'  in {HERE}:{{text}} `delay(self.x, cast(Any, "0.1 s"))`\n'
        "Declare a parameter in s, and name it.",
    ),
    Never: (
        LanguageError,
        "delay(x, 0): the delay must be positive.\n"
        f"  in {HERE}:{{never}} `delay(self.x, 0 * self.T)`\n"
        "Write the value itself where nothing is delayed.",
    ),
    Length: (
        UnitMismatch,
        f"Length, delay expects s; the expression is m.\n  in {HERE}:{{basis}} `yield self.y == self.late()`",
    ),
    Branches: (
        UnitMismatch,
        "Branches, delay expects s; the branches of choose(…) or where(…) differ in unit.\n"
        f"  in {HERE}:{{basis}} `yield self.y == self.late()`",
    ),
    Unit: (
        UnitMismatch,
        f"Unit, {HERE}:{{basis}} `yield self.y == self.late()`: left 1, right s.",
    ),
    Own: (
        StructureError,
        "Before the start, a delayed value is the one at the start, which depends on itself here.\n"
        f"  in {HERE}:{{basis}} `yield self.y == self.late()`\n"
        "Delay a state, or what follows from the delayed value linearly.",
    ),
}


@pytest.mark.parametrize("kind", CASES, ids=lambda kind: kind.__name__)
def test_messages_of_delays(
    kind: type[Component], check_message: Callable[[type[ModelicaLikeError], Callable[[], object], str], None]
) -> None:
    check_message(CASES[kind][0], lambda: simulate(build(kind()), 1.0), CASES[kind][1])


REFUSED: dict[str, tuple[type[ModelicaLikeError], Callable[[], object], str]] = {
    "negative": (
        ValueOutOfRange,
        lambda: simulate(Lagging(T=-0.1), 1.0),
        "The time of delay[1] is -0.1 s: it must be positive.",
    ),
    "negative natively": (
        ValueOutOfRange,
        lambda: simulate(Lagging(T=-0.1), 1.0, solver="native"),
        "The time of delay[1] is -0.1 s: it must be positive.",
    ),
    "long": (
        StepFailed,
        lambda: simulate(Swinging(), 3.0, solver="native"),
        "Delays reach back over more than 16384 points of the past.\nShorten them, or ask for less precise results.",
    ),
    "fixed steps": (
        ExportError,
        lambda: export_fmu(Lagging(), "lagging.fmu", fixed_step="1 ms"),
        "Lagging cannot take fixed steps: it has a delay(…), which needs the past of a run.\n"
        "Approximate the delay there, by a lag or a Padé approximation.",
    ),
    "native gradient": (
        NoGradient,
        lambda: build(Lagging()).native(outputs=["y"], by=["T"]).gradient(),
        "There are no derivatives with respect to anything after t = 0 s: a value is delayed.",
    ),
    "gradient": (
        NoGradient,
        lambda: sensitivities(Lagging(), ["y"], ["T"], until=1.0),
        "No gradient of Lagging: it has a delay(…), which needs the past of a run.\n"
        "Approximate the delay there, by a lag or a Padé approximation.",
    ),
    "linear": (
        LanguageError,
        lambda: linearize(Lagging()),
        "Lagging cannot be linearized: it has a delay(…), which needs the past of a run.\n"
        "Approximate the delay there, by a lag or a Padé approximation.",
    ),
    "steady": (
        InitializationError,
        lambda: simulate(Lagging(), 1.0, start="steady"),
        "Lagging cannot start in the steady state: it has a delay(…), which needs the past of a run.\n"
        "Approximate the delay there, by a lag or a Padé approximation.",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_needs_no_past_is_refused(
    case: str, check_message: Callable[[type[ModelicaLikeError], Callable[[], object], str], None]
) -> None:
    check_message(*REFUSED[case])
