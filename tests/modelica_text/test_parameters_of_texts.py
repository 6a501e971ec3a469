"""Arrays follow the parameters they are made of; where numbers of these are in what was read, they cannot change."""

from collections.abc import Callable
from pathlib import Path

import pytest

from modelica_like import build, load, simulate
from modelica_like.errors import LanguageError

DOUBLED = (
    "function f input Real u; output Real y; "
    "algorithm y := 1; while y < u loop y := 2*y; end while; end f;"
)  # fmt: skip
ROTOR = "Modelica.Mechanics.Rotational.Components.Inertia rotor(J = a, phi(fixed = true), w(fixed = true));"
WHOLE = "parameter Integer n = integer(3*a); Real y = n;"
CASES = {
    "a loop": (f"{DOUBLED} parameter Real a = 5; parameter Real b = f(a); Real y = b;", 8.0),
    "a loop in a law": (f"{DOUBLED} parameter Real a = 5; Real y = f(a)*time;", 8.0),
    "a loop at the start": (
        f"{DOUBLED} parameter Real a = 5; parameter Real b(fixed = false); Real y = b; initial equation b = f(a);", 8.0,
    ),
    "whole numbers": (f"parameter Real a = 5; {WHOLE}", 15.0),
    "whole numbers of a part": (
        f"parameter Real a = 5; {ROTOR} parameter Integer n = integer(rotor.J);"
        "Real y = n;", 5.0,
    ),
    "a table": (
        "parameter Real a = 5; parameter Real v[2,2] = [0, 0; 1, 3*a]; Real y = t.y[1]; "
        "Modelica.Blocks.Tables.CombiTable1Ds t(table = v, u = time);", 15.0,
    ),
    "an array of a part": ("parameter Real a = 5; Q q(v = {a, 3*a}); Real y = q.w;", 15.0),
}  # fmt: skip


def written(folder: Path, declarations: str) -> Path:
    section = "initial equation" if "initial equation" in declarations else "equation"
    begin, section, end = declarations.partition(section)
    (folder / "m.mo").write_text(
        "model P parameter Real v[2]; end P; model Q parameter Real v[2]; Real w = v[2]; end Q; "
        "model R parameter Real a = 1; end R;\n"
        f"model M {begin} Real x(start = 0, fixed = true); {section} {end} equation der(x) = y; end M;\n",
        encoding="utf-8",
    )
    return folder / "m.mo"


@pytest.mark.parametrize("case", CASES)
def test_what_depends_on_a_number_is_computed_and_the_number_stays(case: str, tmp_path: Path) -> None:
    text, value = CASES[case]
    built = build(load(written(tmp_path, text)))
    assert simulate(built, 1.0).final["y"] == pytest.approx(value, rel=1e-12)
    with pytest.raises(LanguageError, match="a cannot change after compilation"):
        built.with_parameters({"a": 20.0})


FOLLOWING = {
    "an array": "parameter Real v[2] = {a, 3*a}; Real y = v[2];",
    "an array of open size": "parameter Real v[:] = {a, 3*a}; Real y = v[end];",
    "what an array is made of": "parameter Real b = a; parameter Real v[2] = {a, 3*b}; Real y = v[2];",
    "a loop": "parameter Real v[3] = {i*a for i in 1:3}; Real y = v[3];",
    "an array in a part": "P p(v = {a, 3*a}); Real y = p.v[2];",
    "a matrix": "parameter Real M[2,2] = [a, 0; a, a]; Real z[2] = M*{1, 2}, y = z[2];",
    "an array of a part's": f"{ROTOR} parameter Real v[2] = {{rotor.J, 3*rotor.J}}; Real y = v[2];",
    "an array of an array's": "R r[2,2](a = {{1, 2}, {a, 3}}); parameter Real v[2] = 3*r[:,1].a; Real y = v[2];",
    "modifiers of an array": "parameter Real v[2] = {a, 3*a}; R r[2](a = v); Real y = r[2].a;",
    "start values": "parameter Real v[2] = {a, 3*a}; Real z[2](start = v, each fixed = true), y = z[2]; equation "
    "der(z) = {0, 0};",
    "a function": "function f input Real v[:]; output Real y = sum(v); algorithm end f; "
    "parameter Real v[2] = {a, 2*a}; "
    "Real y = f(v);",
    "a delay": "parameter Real v[2] = {a, 1}; Real y = 3*a + 0*delay(time, v[1]);",
}


@pytest.mark.parametrize("case", FOLLOWING)
def test_what_depends_on_a_parameter_follows_it(case: str, tmp_path: Path) -> None:
    built = build(load(written(tmp_path, f"parameter Real a = 5; {FOLLOWING[case]}")))
    for a in (5.0, 7.0):
        assert simulate(built.with_parameters({"a": a}), 1.0).final["y"] == pytest.approx(3 * a, rel=1e-12)


def test_limits_and_units_do_not_keep_a_parameter(tmp_path: Path) -> None:
    text = "parameter Real a = 5; parameter Real b(max = 10*a, nominal = a) = 2; Real y(nominal = a) = a*b;"
    built = build(load(written(tmp_path, text)))
    assert simulate(built.with_parameters({"a": 7.0}), 1.0).final["y"] == pytest.approx(14.0, rel=1e-12)


def netlist(folder: Path, value: float) -> Path:
    written(folder, f"parameter Real a = 5; {WHOLE}")
    (folder / "n.toml").write_text(f'[parts]\nm = {{ is = "./m.mo:M", a = {value:g} }}\n', encoding="utf-8")
    return folder / "n.toml"


def test_the_same_value_may_be_given_again(tmp_path: Path) -> None:
    assert simulate(load(netlist(tmp_path, 5)), 1.0).final["m.y"] == pytest.approx(15.0, rel=1e-12)


@pytest.mark.parametrize(
    "change", [lambda m: setattr(m, "a", 6.0), lambda m: m.give("a", 6.0), lambda m: m.set("a", 6)]
)
def test_another_value_is_refused_and_the_old_one_kept(change: Callable[..., None], tmp_path: Path) -> None:
    model = load(written(tmp_path, f"parameter Real a = 5; {WHOLE}"))
    with pytest.raises(LanguageError, match="cannot change afterwards"):
        change(model)
    assert simulate(model, 1.0).final["y"] == pytest.approx(15.0, rel=1e-12)


def test_a_component_of_which_numbers_were_made_keeps_its_value(tmp_path: Path) -> None:
    text = f"{ROTOR.replace('J = a', 'J = 5')} parameter Boolean heavy = rotor.J > 4; Real y = if heavy then 1 else 2;"
    model = load(written(tmp_path, text))
    with pytest.raises(LanguageError, match=r"rotor\.J was read as a number"):
        model.set("rotor.J", 3.0)
    with pytest.raises(LanguageError, match=r"rotor\.J cannot change after compilation"):
        build(model).with_parameters({"rotor.J": 3.0})
    assert simulate(model, 1.0).final["y"] == 1.0
