"""Loops along an array whose end only a run knows."""

from pathlib import Path

import pytest

from modelica_like import load, simulate
from modelica_like.errors import ModelicaLikeError

ABOVE = (
    "function above input Real v[:]; input Real u; input Integer first; output Integer k; "
    "algorithm k := first; while k < size(v, 1) and u >= v[k] loop k := k + 1; end while; end above;\n"
)
LINEAR = (
    "function linear input Real t[:, 2]; input Real u; output Real y; protected Integer k; algorithm k := 2; "
    "while k < size(t, 1) and u >= t[k, 1] loop k := k + 1; end while; "
    "y := t[k - 1, 2] + (t[k, 2] - t[k - 1, 2])*(u - t[k - 1, 1])/(t[k, 1] - t[k - 1, 1]); end linear;\n"
)
LESS = (
    "function less input Real v[:]; input Real u; output Real w; "
    "algorithm w := u; while w > v[1] loop w := w - 1; end while; end less;\n"
)


def written(folder: Path, text: str) -> Path:
    (folder / "m.mo").write_text(text, encoding="utf-8")
    return folder / "m.mo"


def sampled(function: str, declarations: str, value: str) -> str:
    return f"{function}model M {declarations} equation when sample(0.1, 0.25) then k = {value}; end when; end M;\n"


@pytest.mark.parametrize("first", ["1", "pre(k)"])
@pytest.mark.parametrize(("until", "place"), [(0.2, 1), (0.4, 2), (0.7, 3), (0.95, 4)])
def test_a_place_in_a_vector(first: str, until: float, place: int, tmp_path: Path) -> None:
    declarations = "parameter Real v[4] = {0.25, 0.5, 0.75, 1}; Integer k(start = 1);"
    run = simulate(load(written(tmp_path, sampled(ABOVE, declarations, f"above(v, time, {first})"))), until)
    assert run.final["k"] == place


def test_interpolation(tmp_path: Path) -> None:
    """From 0 to 2 at 0.3 s, to -1 at 0.6 s, to 5 at 1 s, and on."""
    table = "parameter Real t[4, 2] = [0, 0; 0.3, 2; 0.6, -1; 1, 5];"
    variables = "Real y = linear(t, time); Real x(start = 0, fixed = true);"
    text = f"{LINEAR}model M {table} {variables} equation der(x) = y; end M;\n"
    component = load(written(tmp_path, text))
    for time, value in ((0.15, 1.0), (0.45, 0.5), (0.8, 2.0), (1.2, 8.0)):
        assert simulate(component, time).final["y"] == pytest.approx(value, rel=1e-12)
    area = 0.3 * 2 / 2 + 0.3 * (2 - 1) / 2 + 0.4 * (-1 + 5) / 2
    assert simulate(component, 1.0, rtol=1e-9, atol=1e-11).final["x"] == pytest.approx(area, rel=1e-6)  # no events


def test_a_loop_that_goes_on_ends_the_run(tmp_path: Path) -> None:
    """Two rounds suffice for 2 and not for 3: the vector has two elements."""
    declarations = "parameter Real v[2] = {0, 0}; discrete Real k;"
    component = load(written(tmp_path, sampled(LESS, declarations, "less(v, if time < 0.5 then 2 else 3)")))
    assert simulate(component, 0.4).final["k"] == 0.0
    with pytest.raises(ModelicaLikeError, match="has a 'while' that does not end after 2 rounds"):
        simulate(component, 1.0)
