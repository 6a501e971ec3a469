"""What is wrong with a formula of a netlist is told with its line."""

import pytest

from modelica_like import build
from modelica_like.errors import ModelicaLikeError
from modelica_like.netlist import loads

HEAD = """name = "bench"
[parameters]
a = {a}
b = "a"
[parts]
disc = {{ is = "Inertia", J = {J} }}
push = {{ is = "Torque" }}
[start]
"disc.w" = {w}
"disc.phi" = 0
"""
RIGHT = {"a": '"2 kg.m2"', "J": '"b"', "w": "0"}
DISC = '  in bench.toml:6 `disc = { is = "Inertia", J = "%s" }`'
PUSH = '  in bench.toml:7 `push = { is = "Torque" }`'


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"J": '"2*c"'}, f"disc.J: bench has no parameter 'c'. It has a, b.\n{DISC % '2*c'}"),
        (
            {"a": '"b"'},
            'Parameters depend on each other in a circle: a → b → a.\n  in bench.toml:3 `a = "b"`\n'
            "Give one of them a number.",
        ),
        ({"w": '"b"'}, f"disc.w = b expects rad/s; the expression is kg.m2.\n{DISC % 'b'}"),
        (
            {},
            "push.flange is free, so push (Torque) carries no torque.\n"
            f'{PUSH}\nConnect it, or list it: free = ["push.flange"].\n\n'
            f"push.tau is an input without a value.\n{PUSH}\nConnect it or give it a value.",
        ),
    ],
    ids=["unknown name", "circle", "wrong unit of a start value", "free flange and missing input"],
)
def test_a_formula_has_its_line(wrong: dict[str, str], message: str) -> None:
    with pytest.raises(ModelicaLikeError) as caught:
        build(loads(HEAD.format(**{**RIGHT, **wrong}), file="bench.toml"))
    assert sorted(str(caught.value).split("\n\n")) == sorted(message.split("\n\n"))
