"""Parameters whose values are in what was read: arrays and loops of functions that depend on them."""

from collections.abc import Callable
from pathlib import Path

import pytest

from modelica_like import build, load, simulate
from modelica_like.errors import LanguageError

DOUBLED = (
    "function f input Real u; output Real y; "
    "algorithm y := 1; while y < u loop y := 2*y; end while; end f;"
)  # fmt: skip
ARRAY = "parameter Real v[2] = {a, 3*a};"
CASES = {
    "a loop": (f"{DOUBLED} parameter Real a = 5; parameter Real b = f(a); Real y = b;", 8.0),
    "a loop in a law": (f"{DOUBLED} parameter Real a = 5; Real y = f(a)*time;", 8.0),
    "a loop at the start": (
        f"{DOUBLED} parameter Real a = 5; parameter Real b(fixed = false); Real y = b; initial equation b = f(a);", 8.0,
    ),
    "an array": (f"parameter Real a = 5; {ARRAY} Real y = v[2];", 15.0),
    "what an array is made of": (f"parameter Real b = 5; parameter Real a = b; {ARRAY} Real y = v[2];", 15.0),
}  # fmt: skip


def written(folder: Path, declarations: str) -> Path:
    begin, initial, end = declarations.partition("initial equation")
    (folder / "m.mo").write_text(
        f"model M {begin} Real x(start = 0, fixed = true); {initial}{end} equation der(x) = y; end M;\n",
        encoding="utf-8",
    )
    return folder / "m.mo"


@pytest.mark.parametrize("case", CASES)
def test_what_depends_on_a_number_is_computed_and_the_number_stays(case: str, tmp_path: Path) -> None:
    text, value = CASES[case]
    built = build(load(written(tmp_path, text)))
    assert simulate(built, 1.0).final["y"] == pytest.approx(value, rel=1e-12)
    name = "b" if "parameter Real b = 5" in text else "a"
    with pytest.raises(LanguageError, match=f"{name} cannot change after compilation"):
        built.with_parameters({name: 20.0})


def test_limits_and_units_do_not_keep_a_parameter(tmp_path: Path) -> None:
    text = "parameter Real a = 5; parameter Real b(max = 10*a, nominal = a) = 2; Real y(nominal = a) = a*b;"
    built = build(load(written(tmp_path, text)))
    assert simulate(built.with_parameters({"a": 7.0}), 1.0).final["y"] == pytest.approx(14.0, rel=1e-12)


def netlist(folder: Path, value: float) -> Path:
    written(folder, f"parameter Real a = 5; {ARRAY} Real y = v[2];")
    (folder / "n.toml").write_text(f'[parts]\nm = {{ is = "./m.mo:M", a = {value:g} }}\n', encoding="utf-8")
    return folder / "n.toml"


def test_the_same_value_may_be_given_again(tmp_path: Path) -> None:
    assert simulate(load(netlist(tmp_path, 5)), 1.0).final["m.y"] == pytest.approx(15.0, rel=1e-12)


@pytest.mark.parametrize(
    "change", [lambda m: setattr(m, "a", 6.0), lambda m: m.give("a", 6.0), lambda m: m.set("a", 6)]
)
def test_another_value_is_refused_and_the_old_one_kept(change: Callable[..., None], tmp_path: Path) -> None:
    model = load(written(tmp_path, f"parameter Real a = 5; {ARRAY} Real y = v[2];"))
    with pytest.raises(LanguageError, match="cannot change afterwards"):
        change(model)
    assert simulate(model, 1.0).final["y"] == pytest.approx(15.0, rel=1e-12)
