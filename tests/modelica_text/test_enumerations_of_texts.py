"""Variables of enumerations: numbers of their literals, 1 for the first."""

from pathlib import Path

import pytest

from modelica_like import load, simulate
from modelica_like.simulation import Solver

E = "type E = enumeration(a, b, c);"
CASES: dict[str, tuple[str, dict[str, float]]] = {
    "of a parameter": ("parameter E e = E.b; Integer j = Integer(e), k = Integer(E.c);", {"j": 2, "k": 3}),
    "an order": ("parameter E e = E.b; Boolean f = e < E.c, g = E.b > E.c;", {"f": 1, "g": 0}),
    "with a when": (
        "E e(start = E.a, fixed = true); Boolean was = pre(e) == E.c; Real x(start = 0, fixed = true); equation "
        "der(x) = if was then 1 else 0; when time > 0.5 then e = E.c; elsewhen time > 0.75 then e = E.b; end when;",
        {"e": 2, "was": 0, "x": 0.25},
    ),
    "with an equation": (
        "E s = if time > 0.25 then E.b else E.c; Integer z = Integer(s); Boolean f = s == E.b; "
        "Real q = if s >= E.c then 1 else 0;",
        {"s": 2, "z": 2, "f": 1, "q": 0},
    ),
    "from one to the next": (
        "E e(start = E.a, fixed = true); Real x(start = 0, fixed = true); equation "
        "der(x) = if e == E.a then 1 elseif e == E.b then 2 else 3; "
        "when time > 0.5 then e = E.b; elsewhen time > 0.7 then e = if pre(e) == E.b then E.c else E.a; end when;",
        {"e": 3, "x": 0.5 + 2 * 0.2 + 3 * 0.3},
    ),
    "before the start": (
        "E e; Boolean b; initial equation pre(e) = E.c; equation b = pre(e) == E.c; "
        "when time > 2 then e = E.a; end when;",
        {"e": 3, "b": 1},
    ),
    "without a start": ("E e; equation when time > 2 then e = E.c; end when;", {"e": 1}),
}


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("case", CASES)
def test_variables_of_enumerations(case: str, solver: Solver, tmp_path: Path) -> None:
    text, wanted = CASES[case]
    (tmp_path / "m.mo").write_text(f"model M\n{E}\n{text}\nend M;\n")
    result = simulate(load(tmp_path / "m.mo"), 1.0, solver=solver)
    assert {name: result.final[name] for name in wanted} == pytest.approx(wanted, abs=1e-7)
