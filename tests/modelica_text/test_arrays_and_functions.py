"""Arrays and functions of Modelica text, by the rules of the language (chapters 10 and 12), worked out by hand."""

from pathlib import Path

import pytest

from modelica_like import load, simulate
from modelica_like.errors import ModelicaTextError

MATRICES = "parameter Real A[2,2] = [1, 2; 3, 4]; parameter Real B[2,2] = [5, 6; 7, 8]; parameter Real v[2] = {1, 2};"
FORMULAS = {
    "sum(A .* B)": 70, "sum(A*B)": 134, "sum(A^2)": 54, "sum(A^0)": 2, "sum(A .^ 2)": 30, "sum(v .* v)": 5, "v*v": 5,
    "sum(v .+ 1)": 5, "sum(1 ./ v)": 1.5, "sum(v/2)": 1.5, "max(A)": 4, "min([A, B])": 1, "sum([v, v]*{1, 10})": 33,
    "sum([A, A])": 20, "sum([A; A]*{1, 0})": 8, "sum([A, v])": 13, "size([A; A], 1)*10 + size([A, A], 2)": 44,
    "sum(if time > 0.5 then {1, 2} else {3, 4})": 3, "-2^2": -4, "3 .* 4": 12, "time .* 2": 2, "A[1, :]*v": 5,
    "2*3 .+ 1": 7, "sum(transpose(A) - A)": 0,
}  # fmt: skip
FUNCTIONS = {
    "a loop": ("Real k; algorithm y := u; k := 0; while k < 3 loop y := y/2; k := k + 1; end while;", "f(8)", 1),
    "an iterator with the name of a variable": (
        "Integer i; algorithm y := 0; i := 10; for i in 1:3 loop y := y + i; end for; y := y + i*u;", "f(time)", 16,
    ),
    "element by element": ("Real k; algorithm y := if u > 1 then 10 else u;", "sum(f({0.5, 2}))", 10.5),
    "an assertion that holds": ('Real k; algorithm assert(u < 3, "too large"); y := u;', "f(2)", 2),
}  # fmt: skip
INHERITED = {
    "function f = g;": ("f(time)", 2),
    "function f = g(u = 3);": ("f()", 6),
    "function f extends g; algorithm y := y + 1; end f;": ("f(time)", 3),
}
ENDS = {
    "connect(r.flange_b, s[{2, 3, 1}].flange_a);": (0, 1, 0),
    "connect(r[1:2].flange_b, s[2:3].flange_a);": (0, 1, 0),
    "connect(r[3:-1:1].flange_b, s.flange_a);": (0, 0, 1),
    "connect(r[:].flange_b, s[:].flange_a);": (1, 0, 0),
    "connect(r[1:2].flange_b, p.flange_a); connect(p.flange_b, s[1:2].flange_a);": (1, 0, 0),
}


def at_one(folder: Path, formula: str, before: str = "") -> float:
    """Return y after one second."""
    text = (
        f"{before}\nmodel M\n  {MATRICES}\n  Real y;\n  Real x(start = 0, fixed = true);\nequation\n  y = {formula};\n"
    )
    (folder / "m.mo").write_text(f"{text}  der(x) = y;\nend M;\n", encoding="utf-8")
    return float(simulate(load(folder / "m.mo"), 1.0).final["y"])


@pytest.mark.parametrize("formula", FORMULAS)
def test_formulas_of_arrays(formula: str, tmp_path: Path) -> None:
    assert at_one(tmp_path, formula) == pytest.approx(FORMULAS[formula], rel=1e-12)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_algorithms(name: str, tmp_path: Path) -> None:
    body, call, value = FUNCTIONS[name]
    function = f"function f input Real u; output Real y; protected {body} end f;"
    assert at_one(tmp_path, call, function) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("function", INHERITED)
def test_inherited_algorithms(function: str, tmp_path: Path) -> None:
    call, value = INHERITED[function]
    base = "function g input Real u = 1; output Real y; algorithm y := 2*u; end g;"
    assert at_one(tmp_path, call, f"{base}\n{function}") == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("connections", ENDS)
def test_ends_that_subscripts_choose(connections: str, tmp_path: Path) -> None:
    """Only the first of three inertias turns: so does that one only which is joined to it."""
    springs = "Spring p[2](each c = 1e3);" if "p." in connections else ""
    (tmp_path / "s.mo").write_text(f"""model S
  import Modelica.Mechanics.Rotational.Components.*;
  Inertia r[3](J = {{1, 2, 4}}, each phi(fixed = true), w(each fixed = true, start = {{1, 0, 0}}));
  Inertia s[3](each J = 1);
  {springs}
equation
  {connections}
end S;
""", encoding="utf-8")  # fmt: skip
    run = simulate(load(tmp_path / "s.mo"), 1e-3)
    moved = [float(run.final[f"s[{k}].w"]) > 1e-6 for k in (1, 2, 3)]
    assert moved == [bool(one) for one in ENDS[connections]]


def test_states_of_an_array_jump(tmp_path: Path) -> None:
    (tmp_path / "a.mo").write_text("""model A
  Real y[2](each start = 0, each fixed = true);
equation
  der(y) = {1, 1};
  when time > 0.5 then
    reinit(y, {5, 6});
  end when;
end A;
""", encoding="utf-8")  # fmt: skip
    final = simulate(load(tmp_path / "a.mo"), 1.0).final
    assert [float(final[f"y[{k}]"]) for k in (1, 2)] == pytest.approx([5.5, 6.5], rel=1e-9)


REFUSED = {
    "sum(v + 1)": "An array and a number: .+ is element by element",
    "sum(1/v)": "An array and a number: ./ is element by element",
    "sum(v^2)": "Only a square matrix has powers, from 0 to 100: .^ is element by element",
    "sum([A; v])": "The rows of a matrix have different lengths",
    "sum([A, {1, 2, 3}])": "The parts of a matrix that stand side by side have different numbers of rows",
    "size({{1, 2}, {3}}, 1)": "size(…) needs an array whose rows are of one length",
    "size(A, 3)": "size(…) has no dimension 3: the array has 2",
    "sum(if time > 0.5 then {1, 2} else {3, 4, 5})": "The values of an 'if' have different sizes",
    "mod(time, 0)": "mod by 0 has no value",
    "sin(time, foo = 3)": "sin(…) has no argument 'foo'",
    "(x > 1)*2": "A condition is no number: write `if … then 1 else 0`",
    "abs(x > 1)": "abs needs numbers, and a condition is none",
    "if x > 1 and 1 then 1 else 2": "'and' joins conditions, and a number is none",
    "if 1 then 1 else 2": "The condition of this 'if' is a number",
    "x > 1": "y is a Real, and a truth value is none",
    "v[x]": "A subscript must be a number that constants and parameters determine",
}


@pytest.mark.parametrize("formula", REFUSED)
def test_what_is_refused(formula: str, tmp_path: Path) -> None:
    with pytest.raises(ModelicaTextError) as caught:
        at_one(tmp_path, formula)
    assert str(caught.value) == f"{REFUSED[formula]}.\n  in m.mo:7 `y = {formula};`"


@pytest.mark.parametrize(
    ("declaration", "equation", "what"),
    [
        ("Boolean b;", "b = 3;", "b is a Boolean, and 3 is none."),
        ("Integer n;", "n = 2.5;", "n is an Integer, and 2.5 is none."),
    ],
)
def test_types_that_do_not_fit(declaration: str, equation: str, what: str, tmp_path: Path) -> None:
    (tmp_path / "a.mo").write_text(f"model A\n  {declaration}\nequation\n  {equation}\nend A;\n", encoding="utf-8")
    with pytest.raises(ModelicaTextError) as caught:
        load(tmp_path / "a.mo")
    assert caught.value.what == what


WRONG = {
    "y := u; while y > 1 loop y := y/2; end while;": (
        "f(8 + time)", "A 'while' whose end only a run knows: that is not supported here.",
    ),
    "z[0] := u; y := z[1];": ("f(time)", "The index 0 is not one of 1 to 3."),
    "z[5] := u; y := z[1];": ("f(time)", "The index 5 is not one of 1 to 3."),
    "u[1] := 2; y := u;": ("f(time)", "u is an input and cannot be assigned."),
    "y[1] := 2;": ("f(time)", "What is no array has no subscript."),
    "z[2:3] := {1, 2, 3}; y := z[2];": ("f(time)", "z is given 3 elements for 2."),
    "z := {1, 2}; y := z[1];": ("f(true)", "u of f is a Real, and true is none."),
    "y := n;": ("f(1, n = 2.5)", "n of f is an Integer, and 2.5 is none."),
    "y := w[1];": ("f(1, w = {1, 2})", "w of f has 3 elements, not 2."),
    "y := w[2];": ("f(1, w = 1)", "w of f is an array."),
    "y := u;": ("f(1, u = 2)", "f is given u twice."),
    'assert(\nu < 0.5,\n"too large"); y := u;': ("f(2)", "f refuses its arguments: too large."),
    'assert(u < 0.5, "too large"); y := u;': ("f(2)", "f refuses its arguments: too large."),
    "if u > 1 then z := {1, 2, 3}; else z := zeros(2); end if; y := z[1];": (
        "f(time)", "The values of an 'if' have different sizes.",
    ),
}  # fmt: skip


@pytest.mark.parametrize("algorithm", WRONG)
def test_functions_that_are_refused(algorithm: str, tmp_path: Path) -> None:
    call, what = WRONG[algorithm]
    inputs = "input Real u; input Integer n = 1; input Real w[3] = zeros(3);"
    function = f"function f {inputs} output Real y; protected Real z[3]; algorithm {algorithm} end f;"
    with pytest.raises(ModelicaTextError) as caught:
        at_one(tmp_path, call, function)
    assert caught.value.what == what


def test_ends_that_are_refused(tmp_path: Path) -> None:
    for subscript, what in {"4": "1 to 3", "1.5": "1 to 3"}.items():
        (tmp_path / "s.mo").write_text(f"""model S
  Modelica.Mechanics.Rotational.Components.Inertia r[3](each J = 1);
equation
  connect(r[{subscript}].flange_b, r[1].flange_a);
end S;
""", encoding="utf-8")  # fmt: skip
        with pytest.raises(ModelicaTextError) as caught:
            load(tmp_path / "s.mo")
        assert caught.value.what == f"A subscript of this end is not one of {what}."


ANNOTATED = """
package Laws
  function law "torque of a spring over its angle"
    extends Modelica.Icons.Function;
    input Real phi;
    input Real k = 4;
    output Real tau;
  algorithm
    tau := if phi > 0 then k*phi^3 else -k*phi^3;
    annotation(derivative = law_der, inverse(phi = law_inverse(tau, k)), smoothOrder = 2, Inline = true);
  end law;
  function law_der
    input Real phi;
    input Real k = 4;
    input Real phi_der;
    input Real k_der = 0;
    output Real tau_der;
  algorithm
    tau_der := 3*k*phi^2*phi_der;
    annotation(derivative(order = 2) = law_der2, smoothOrder = 1);
  end law_der;
  function law_der2
    input Real phi;
    input Real k = 4;
    input Real phi_der;
    input Real k_der = 0;
    input Real phi_der2;
    input Real k_der2 = 0;
    output Real tau_der2;
  algorithm
    tau_der2 := 6*k*phi*phi_der^2 + 3*k*phi^2*phi_der2;
  end law_der2;
  function law_inverse
    input Real tau;
    input Real k = 4;
    output Real phi;
  algorithm
    phi := (tau/k)^(1/3);
  end law_inverse;
  model A
    Real s(start = 1, fixed = true), v, a, q(start = 0.5);
    Real Q;
  equation
    s = law(1 + time/2) - 3;
    der(s) = v;
    der(v) = a;
    2*(1 + time) = law(q);
    Q = law_der(1 + time/2, 4, 1/2);
  end A;
end Laws;
"""


def test_annotations_of_functions_change_no_value(tmp_path: Path) -> None:
    # What is inlined is differentiated as it is written, and solved for any argument.
    (tmp_path / "a.mo").write_text(ANNOTATED)
    result = simulate(load(tmp_path / "a.mo"), 1.0, rtol=1e-10, atol=1e-12)
    t = result.time
    assert result["s"] == pytest.approx(4 * (1 + t / 2) ** 3 - 3)
    assert result["v"] == pytest.approx(6 * (1 + t / 2) ** 2)
    assert result["a"] == pytest.approx(6 * (1 + t / 2))
    assert result["Q"] == pytest.approx(6 * (1 + t / 2) ** 2)
    assert result["q"] == pytest.approx(((1 + t) / 2) ** (1 / 3))
