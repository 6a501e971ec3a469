"""What is wrong with a formula of a netlist is told with its line."""

from pathlib import Path

import pytest

from modelica_like import build
from modelica_like.errors import ModelicaLikeError, UnitMismatch
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
        (
            {"a": '"2 kg.m2"', "w": '"b*1 s"'},
            f"disc.w = b * 1 s expects rad/s; the expression is kg.m2.s.\n{DISC % 'b'}",
        ),
        (
            {"a": '"2 kg.m2"', "w": '"exp(a)"'},
            f"disc.w = exp(a): 'exp(a)' takes a number; 'a' is in kg.m2.\n{DISC % 'b'}",
        ),
        (
            {"J": '"push.phi"'},
            f"disc.J: push.phi is no parameter: it changes over time, and a value does not.\n{DISC % 'push.phi'}\n"
            'If disc.J is an input, connect them: name = ["push.phi", "disc.J"] in [connect].',
        ),
        ({"w": '"b"'}, f"disc.w = b expects rad/s; the expression is kg.m2.\n{DISC % 'b'}"),
        (
            {},
            "push.flange is free, so push (Torque) carries no torque.\n"
            f'{PUSH}\nConnect it, or list it: free = ["push.flange"].\n\n'
            f"push.tau is an input without a value.\n{PUSH}\nConnect it or give it a value.",
        ),
    ],
    ids=[
        "unknown name",
        "circle",
        "numbers that cancel",
        "function of a quantity",
        "variable",
        "wrong unit of a start value",
        "free flange and missing input",
    ],
)
def test_a_formula_has_its_line(wrong: dict[str, str], message: str) -> None:
    with pytest.raises(ModelicaLikeError) as caught:
        build(loads(HEAD.format(**{**RIGHT, **wrong}), file="bench.toml"))
    assert sorted(str(caught.value).split("\n\n")) == sorted(message.split("\n\n"))


BOX = '[parameters]\ni = 3\n[parts]\na = { is = "Inertia", J = "i * 1 kg.m2" }\n'


@pytest.mark.parametrize(
    ("part", "start", "of", "place"),
    [
        ("", "c * 1 rad/s", "q.a.w", '7 `"q.a.w" = "c * 1 rad/s"`'),
        (', i = "c"', "0", "q.i", '5 `q = { is = "./box.toml", i = "c" }`'),
        (', a.J = "c"', "0", "q.a.J", '5 `q = { is = "./box.toml", a.J = "c" }`'),
    ],
)
def test_a_formula_for_a_value_inside_has_its_line(part: str, start: str, of: str, place: str, tmp_path: Path) -> None:
    (tmp_path / "box.toml").write_text(BOX)
    text = f'name = "bench"\n[parameters]\nn = 7\n[parts]\nq = {{ is = "./box.toml"{part} }}\n'
    text += f'[start]\n"q.a.w" = "{start}"\n'
    with pytest.raises(ModelicaLikeError) as caught:
        build(loads(text, file=str(tmp_path / "bench.toml")))
    assert str(caught.value) == f"{of}: bench has no parameter 'c'. It has n.\n  in bench.toml:{place}"


def test_units_that_a_block_leaves_open_are_told_by_its_values() -> None:
    text = '[parts]\nway = { is = "KinematicPTP2", q_end = "100 mm", qd_max = "2 rad/s", qdd_max = "5 rad/s2" }\n'
    with pytest.raises(UnitMismatch) as caught:
        build(loads(text, file="bench.toml"))
    told = str(caught.value).splitlines()
    assert told[0] == (
        "way (KinematicPTP2): its units do not fit together: q_end in mm, qd_max in rad/s, qdd_max in rad/s2."
    )
    assert told[1].startswith("  in bench.toml:2 `way = ")
    assert told[2].startswith("KinematicPTP2, point_to_point.py:")
