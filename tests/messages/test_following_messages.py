"""Errors of starts where states follow the motion: they name variables of the user.

Lines of this file are written as {marker}, the line that ends in `# marker`.
"""

from collections.abc import Callable
from typing import Any

import pytest

from modelica_like import simulate
from modelica_like.errors import ContradictingStart, MissingStart, ModelicaLikeError, SingularAtStart
from modelica_like.language import Component, Equations, Parameter, Variable, der, param, var


class Pendulum(Component):
    L: Parameter = param("m", "length of the rod", default=1.5)
    g: Parameter = param("m/s2", "gravity", default=9.81)
    x: Variable = var("m", "to the right")
    y: Variable = var("m", "upwards")
    vx: Variable = var("m/s", "to the right")
    vy: Variable = var("m/s", "upwards")
    pull: Variable = var("1/s2", "force of the rod over length and mass")

    def equations(self) -> Equations:
        yield der(self.x) == self.vx
        yield der(self.y) == self.vy
        yield der(self.vx) == -self.pull * self.x
        yield der(self.vy) == -self.pull * self.y - self.g
        yield self.x**2 + self.y**2 == self.L**2  # rod


IN_ROD = "  in test_following_messages.py:{rod} `yield self.x**2 + self.y**2 == self.L**2`\n"
KINDS = 'Or start from rest (start = "rest") or in the steady state (start = "steady").'


@pytest.mark.parametrize(
    ("starts", "kind", "text"),
    [
        (
            {}, MissingStart,
            "Initialization (not the model) lacks 2 equations: give x or y, a rate of x or y start values.\n" + KINDS,
        ),
        (
            {"x": 0.0}, MissingStart,
            "Initialization (not the model) lacks one equation: give a rate of x or y a start value.\n" + KINDS,
        ),
        (
            {"x": 0.0, "vx": 1.0}, SingularAtStart,
            "The Jacobian is singular at t = 0 s in block 1 (y, x).\n" + IN_ROD
            + "Its equations do not determine all of its unknowns there.\n"
            "At the start, give guesses of x and y near the motion, and start values to what moves there. On the way, "
            "the mechanism can go on in two ways from here.",
        ),
        (
            {"x": 0.0, "y": -1.6, "vx": 1.0}, ContradictingStart,
            "y = -1.6 cannot be met: y would be -1.5.\n" + IN_ROD
            + "Remove one of the start values, or make one a guess.",
        ),
    ],
)  # fmt: skip
def test_a_start_names_variables_of_the_user(
    starts: dict[str, float], kind: type[ModelicaLikeError], text: str, check_message: Callable[..., Any]
) -> None:
    check_message(kind, lambda: simulate(Pendulum(**starts), 1.0), text)
