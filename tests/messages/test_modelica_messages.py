"""Every way in which a Modelica text is refused, and the sentence that tells it."""

from pathlib import Path

import pytest

from modelica_like import load
from modelica_like.errors import ModelicaLikeError, ModelicaTextError, UnknownName

R = "Modelica.Mechanics.Rotational.Components"


def model(declarations: str = "", equations: str = "", before: str = "") -> str:
    """Return a text: class A with declarations from line 3, and equations from line 5, after `before` in line 1."""
    return f"{before}\nmodel A\n{declarations}\nequation\n{equations}\nend A;\n"


MESSAGES: dict[str, tuple[str, str]] = {
    "no end": ("model A\n  Real x;\n", "model A of line 1 has no 'end A;'.\n  in a.mo:3"),
    "wrong end": ("model A\n  Real x;\nend B;\n", "model A of line 1 ends with 'end B'.\n  in a.mo:3 `end B;`"),
    "no semicolon": (model("Real x", "x = 1;"), "Expected ';' before 'equation'.\n  in a.mo:4 `equation`"),
    "no equation": (model("Real x;", "x + 1;"), "Expected '=' before ';'.\n  in a.mo:5 `x + 1;`"),
    "a strange sign": (model("Real x;", "x = 1 $ 2;"), "'$' has no meaning in Modelica.\n  in a.mo:5 `x = 1 $ 2;`"),
    "no expression": (model("Real x;", "x = * 2;"), "Expected an expression before '*'.\n  in a.mo:5 `x = * 2;`"),
    "empty": ("// nothing\n", "The file has no class.\n  in a.mo:1 `// nothing`"),
    "no model": ("function f\nend f;\n", "'a.mo' has no model. Its models: none.\n  in a.mo:1 `function f`"),
    "unknown class": (model("Inertiaa J;"), "There is no class 'Inertiaa'.\n  in a.mo:3 `Inertiaa J;`"),
    "a class that is not in the table": (
        model("Modelica.Mechanics.MultiBody.World world;"),
        "There is no class 'Modelica.Mechanics.MultiBody.World'.\n"
        "  in a.mo:3 `Modelica.Mechanics.MultiBody.World world;`\n"
        "No component here stands for this class of the standard library.",
    ),
    "unknown parameter": (
        model(f"{R}.Inertia a(JJ = 1);"),
        f"{R}.Inertia has no 'JJ' here; did you mean 'J'?\n  in a.mo:3 `{R}.Inertia a(JJ = 1);`",
    ),
    "unknown name": (
        model("Real speed;", "speed = 2*sped;"),
        "There is no 'sped'; did you mean 'speed'?\n  in a.mo:5 `speed = 2*sped;`",
    ),
    "unknown variable of a part": (
        model("B b; Real x;", "x = b.z;", "model B Real y = 1; end B;"),
        "b has no 'z'.\n  in a.mo:5 `x = b.z;`",
    ),
    "unknown end": (
        model(f"{R}.Inertia a;", "connect(a.flange_b, b.flange_a);"),
        "A has no 'b'.\n  in a.mo:5 `connect(a.flange_b, b.flange_a);`",
    ),
    "inner": (model("inner Real x;"), "'inner' before x: that is not supported here.\n  in a.mo:3 `inner Real x;`"),
    "stream": (
        model("C c;", before="connector C stream Real h; flow Real m; end C;"),
        "'stream' before h: that is not supported here.\n  in a.mo:1 `connector C stream Real h; flow Real m; end C;`",
    ),
    "external function": (
        model("Real x = f(1);", before='function f input Real u; output Real y; external "C"; end f;'),
        "External functions: that is not supported here.\n"
        '  in a.mo:1 `function f input Real u; output Real y; external "C"; end f;`',
    ),
    "overdetermined connectors": (
        model("Real x;", "Connections.branch(a.R, b.R);"),
        "Connections.branch(…) among equations: that is not supported here.\n"
        "  in a.mo:5 `Connections.branch(a.R, b.R);`",
    ),
    "state machine": (
        model("Real x;", "x = transition(a, b);"),
        "A state machine: that is not supported here.\n  in a.mo:5 `x = transition(a, b);`",
    ),
    "clock": (
        model("Real x;", "x = subSample(x, 2);"),
        "A clock that follows another: that is not supported here.\n  in a.mo:5 `x = subSample(x, 2);`",
    ),
    "algorithm": (
        "model A\n  Real x;\nalgorithm\n  x := 1;\nend A;\n",
        "An algorithm outside a function: that is not supported here.\n  in a.mo:3 `algorithm`",
    ),
    "a text as a number": (
        model("Real x;", 'x = 2*"two";'),
        'A text, an array or a choice stands where a number belongs.\n  in a.mo:5 `x = 2*"two";`',
    ),
    "two results": (
        model("Real x;", "(x, y) = f(1);"),
        "Functions with several results are not supported.\n  in a.mo:5 `(x, y) = f(1);`",
    ),
    "pre of what changes all the time": (
        model("Real x;", "x = pre(x) + 1;"),
        "pre(x): only what changes at events has a value before them.\n  in a.mo:5 `x = pre(x) + 1;`",
    ),
    "two whens": (
        model("discrete Real x;", "when time > 1 then x = 1; end when; when time > 2 then x = 2; end when;"),
        "Two whens determine x.\n  in a.mo:5 `when time > 1 then x = 1; end when; when time > 2 then x = 2; end when;`",
    ),
    "a when that never comes": (
        model("discrete Real x;", "when 1 > 2 then x = 1; end when;"),
        "The condition of this 'when' never changes.\n  in a.mo:5 `when 1 > 2 then x = 1; end when;`",
    ),
    "branches of different length": (
        model("Real x; Real y;", "if time > 1 then x = 1; y = 1; else x = 2; end if;"),
        "An 'if' whose branches have different numbers of equations: that is not supported here.\n"
        "  in a.mo:5 `if time > 1 then x = 1; y = 1; else x = 2; end if;`",
    ),
    "a changing connection": (
        model(f"{R}.Inertia a; {R}.Inertia b;", "if time > 1 then connect(a.flange_b, b.flange_a); end if;"),
        "A connection or an event in a branch that changes during a run: that is not supported here.\n"
        "  in a.mo:5 `if time > 1 then connect(a.flange_b, b.flange_a); end if;`",
    ),
    "a base with a component": (
        f"model A\n  extends {R}.Inertia;\nend A;\n",
        f"A extends {R}.Inertia, for which a component of its own stands here: that is not supported here.\n"
        f"  in a.mo:2 `extends {R}.Inertia;`\nWrite it as a part, and connect its ends.",
    ),
    "a base that is not there": (
        "model A\n  extends B;\nend A;\n",
        "There is no class 'B'.\n  in a.mo:2 `extends B;`",
    ),
    "a value that is not supported": (
        model(f"{R}.Clutch k(fn_max = 1, smoothness = Modelica.Blocks.Types.Smoothness.ContinuousDerivative);"),
        "Clutch.smoothness = ContinuousDerivative: that is not supported here.\n"
        f"  in a.mo:3 `{R}.Clutch k(fn_max = 1, smoothness = Modelica.Blocks.Types.Smoothness.ContinuousDerivative);`\n"
        "The component Clutch has smoothness = LinearSegments only.",
    ),
    "an index outside": (
        model("parameter Real k[2] = {1, 2}; Real x;", "x = k[3];"),
        "The index 3 is outside 1 to 2.\n  in a.mo:5 `x = k[3];`",
    ),
    "sizes that differ": (
        model("Real x[2];", "x = {1, 2, 3};"),
        "The sizes of both sides differ.\n  in a.mo:5 `x = {1, 2, 3};`",
    ),
    "a parameter without a value": (
        model("parameter Integer n; Real x[n];"),
        "n has no value.\n  in a.mo:3 `parameter Integer n; Real x[n];`\n  in a.mo:3 `parameter Integer n; Real x[n];`",
    ),
    "a parameter of itself": (
        model("parameter Integer n = m; parameter Integer m = n; Real x[n];"),
        "n depends on itself.\n  in a.mo:3 `parameter Integer n = m; parameter Integer m = n; Real x[n];`",
    ),
    "a class that extends itself": (
        "model A\n  extends A;\nend A;\n",
        "A extends itself.\n  in a.mo:1 `model A`",
    ),
    "a class that contains itself": (
        "model A\n  A a;\nend A;\n",
        "A contains itself.\n  in a.mo:2 `A a;`",
    ),
    "a broken assertion": (
        model("parameter Real k = 3;", 'assert(2 > 3, "k is too large");'),
        'An assertion is broken: k is too large.\n  in a.mo:5 `assert(2 > 3, "k is too large");`',
    ),
    "an unknown function": (
        model("Real x;", "x = bessel(2);"),
        "The function bessel: that is not supported here.\n"
        "  in a.mo:5 `x = bessel(2);`\nOwn functions with an algorithm are read.",
    ),
    "no value": (
        model("Real x;", "x = log(-1);"),
        "A formula of -1 has no value.\n  in a.mo:5 `x = log(-1);`",
    ),
}


NAMES = ("unknown parameter", "unknown name", "unknown variable of a part", "unknown end")


@pytest.mark.parametrize("case", MESSAGES)
def test_every_refusal_has_its_sentence(case: str, tmp_path: Path, check_message) -> None:
    text, message = MESSAGES[case]
    (tmp_path / "a.mo").write_text(text)
    kind = (ModelicaTextError, UnknownName)[case in NAMES]
    check_message(kind, lambda: load(tmp_path / "a.mo"), message)


def test_several_errors_are_told_together(tmp_path: Path) -> None:
    (tmp_path / "a.mo").write_text(model(f"{R}.Inertia a(JJ = 1); {R}.Spring b(cc = 1);"))
    with pytest.raises(ModelicaLikeError) as caught:
        load(tmp_path / "a.mo")
    assert "has no 'JJ'" in str(caught.value)
    assert "has no 'cc'" in str(caught.value)


def test_errors_of_the_drive_point_into_the_text(tmp_path: Path) -> None:
    from modelica_like import build

    (tmp_path / "a.mo").write_text(model("Real x; Real y;", "x = 1;\ny = x; y = 2;"))
    with pytest.raises(ModelicaLikeError) as caught:
        build(load(tmp_path / "a.mo"))
    assert str(caught.value) == (
        "A declares 3 equations for 2 unknowns (x, y).\n"
        "  in a.mo:6 `y = x; y = 2;`\n"
        "Each own variable, output and flow takes one: remove an equation, or declare the missing unknown."
    )
