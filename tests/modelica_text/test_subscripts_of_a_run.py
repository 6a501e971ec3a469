"""Subscripts that only a run knows, and assertions in branches that only a run decides."""

from pathlib import Path

import pytest

from modelica_like import load, simulate
from modelica_like.errors import ModelicaLikeError

PLACE = "Integer k = integer(4*time) + 1;"  # 1, 2, 3, 4 for a quarter of a second each
VALUES = "parameter Real v[4] = {1, 10, 100, 1000};"
AREAS = {
    "a vector": (f"{PLACE} {VALUES} Real y = v[k];", 1111 / 4),
    "of variables": (f"{PLACE} Real v[4] = {{time, 0, 2*time, 0}}; Real y = v[k];", (1 / 16 + 2 * (9 - 4) / 16) / 2),
    "backwards": (f"{PLACE} {VALUES} Real y = v[end + 1 - k];", 1111 / 4),
    "a matrix": (f"{PLACE} parameter Real A[4, 2] = [1, 2; 3, 4; 5, 6; 7, 8]; Real y = A[k, 2];", 20 / 4),
    "a row": (f"{PLACE} parameter Real A[4, 2] = [1, 2; 3, 4; 5, 6; 7, 8]; Real y = A[k, :]*{{1, 1}};", 36 / 4),
    "two": ("Integer k = integer(2*time) + 1; parameter Real A[2, 2] = [1, 2; 3, 4]; Real y = A[k, 3 - k];", 5 / 2),
    "a choice that is never made": (f"{PLACE} {VALUES} Real y = if k > 1 then v[k - 1] else 0;", 111 / 4),
    "a condition": (f"{PLACE} Boolean b[4] = {{true, false, time < 2, true}}; Real y = if b[k] then 1 else 0;", 3 / 4),
    "a function": (
        f"function f input Real a[:]; input Integer i; output Real y; algorithm y := a[i] + 1; end f; {PLACE} {VALUES} "
        "Real y = f(v, k);", 1115 / 4,
    ),
}  # fmt: skip
BUFFER = """
model M
  Real buffer[3](each start = 0, each fixed = true);
  Integer k(start = 0, fixed = true);
algorithm
  when sample(0.25, 0.25) then
    k := pre(k) + 1;
    {0}
  end when;
end M;
"""


def written(folder: Path, text: str) -> Path:
    (folder / "m.mo").write_text(text, encoding="utf-8")
    return folder / "m.mo"


def model(declarations: str) -> str:
    return f"model M {declarations} Real x(start = 0, fixed = true); equation der(x) = y; end M;\n"


@pytest.mark.parametrize("case", AREAS)
def test_areas(case: str, tmp_path: Path) -> None:
    declarations, area = AREAS[case]
    run = simulate(load(written(tmp_path, model(declarations))), 0.999999999)
    assert run.final["x"] == pytest.approx(area, rel=2e-8, abs=2e-6)  # the last nanosecond is left out


def test_a_buffer(tmp_path: Path) -> None:
    run = simulate(load(written(tmp_path, BUFFER.format("if k <= 3 then buffer[k] := 2*time; end if;"))), 1.1)
    assert [run.final[f"buffer[{k}]"] for k in (1, 2, 3)] == pytest.approx([0.5, 1.0, 1.5], rel=1e-12)
    assert run.final["k"] == 4


OUTSIDE = {
    "above": (model(f"{PLACE} Real v[2] = {{1, 2}}; Real y = v[k];"), "has a subscript that is none of 1 to 2", 0.5),
    "below": (model(f"{PLACE} {VALUES} Real y = v[3 - k];"), "has a subscript that is none of 1 to 4", 0.5),
    "a place": (BUFFER.format("buffer[k] := 1;"), "has a subscript that is none of 1 to 3", 1.0),
    "an assertion": (BUFFER.format('buffer[k] := time; if k > 2 then assert(false, "full"); end if;'), "full", 0.75),
}  # fmt: skip


@pytest.mark.parametrize("case", OUTSIDE)
def test_outside_of_an_array_a_run_ends(case: str, tmp_path: Path) -> None:
    text, words, until = OUTSIDE[case]
    component = load(written(tmp_path, text))
    assert simulate(component, until - 1e-6).time[-1] == pytest.approx(until - 1e-6)
    with pytest.raises(ModelicaLikeError, match=words):
        simulate(component, 1.1)


def test_whole_numbers_of_signals_in_discrete_equations(tmp_path: Path) -> None:
    text = (
        "connector In = input Integer; connector Out = output Integer; "
        "block S Out y = if time > 0.5 then 3 else 1; end S; block T In u; Integer k = 2*u; Real v = k; end T;\n"
        "model M S s; T t; Integer n = s.y + 1; Real y = n + t.v; Real x(start = 0, fixed = true); "
        "equation connect(s.y, t.u); der(x) = y; end M;\n"
    )
    run = simulate(load(written(tmp_path, text)), 1.0)
    assert (run.final["n"], run.final["t.k"]) == (4, 6)
    assert run.final["x"] == pytest.approx(0.5 * (2 + 2) + 0.5 * (4 + 6), rel=1e-9)


def test_an_assertion_of_a_function_in_a_branch_that_is_not_taken(tmp_path: Path) -> None:
    function = (
        "function f input Real u; output Real y; algorithm y := u; "
        'if u < 0 then assert(false, "negative"); end if; end f;\n'
    )
    run = simulate(load(written(tmp_path, function + model("Real y = f(time);"))), 1.0)
    assert run.final["x"] == pytest.approx(0.5, rel=1e-7)


def test_a_condition_is_kept_where_the_subscript_has_no_element(tmp_path: Path) -> None:
    """The standard library's MathBoolean.MultiSwitch: true from 0.2 s to 0.5 s by u[1], which is kept until 0.7 s."""
    text = (
        "block S input Boolean u[2]; output Boolean y; Integer first; initial equation pre(y) = false; "
        "equation first = if u[1] then 1 else if u[2] then 2 else 0; "
        "y = if first == 0 then pre(y) else first == 1 or not u[first]; end S;\n"
        "model M S s(u = {time > 0.2 and time < 0.5, time > 0.7}); Real x(start = 0, fixed = true); "
        "equation der(x) = if s.y then 1 else 0; end M;\n"
    )
    run = simulate(load(written(tmp_path, text)), 1.0)
    assert run.final["x"] == pytest.approx(0.5, rel=1e-9)
