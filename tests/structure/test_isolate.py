"""One equation is solved for one unknown by undoing its operations: the author's arithmetic stays, to the last bit."""

from typing import Any

import casadi as ca
import pytest

from modelica_like.structure.isolate import isolate, isolate_inverse

a, b, c, x = (ca.SX.sym(name) for name in "abcx")
VALUES = {"a": 0.7, "b": 0.3, "c": -1.9}


def value(expression: Any) -> float:
    return float(ca.evalf(ca.substitute(expression, ca.vertcat(a, b, c), ca.DM([VALUES[name] for name in "abc"]))))


@pytest.mark.parametrize(
    ("residual", "solved"),
    [
        (x + a, -a),
        (x - a * b, a * b),
        (a * b - x, a * b),
        (a - (b * x + c), (a - c) / b),
        (a - (b * x - c), (a + c) / b),
        (b * (c - x) - a, c - a / b),
        (x / b - a, a * b),
        (2 * x - a, a / 2),
        (-x - a, -a),
        (a + b * (c + x / (a + b)), ((0 - a) / b - c) * (a + b)),
    ],
    ids=str,
)
def test_operations_are_undone_in_their_order(residual: Any, solved: Any) -> None:
    found = isolate(residual, x)
    assert found is not None
    assert value(found) == pytest.approx(value(solved), rel=1e-15)


@pytest.mark.parametrize("residual", [x * x - a, x - a * x, ca.sin(x) - a, a / x - b, a - b, ca.fmax(x, a)], ids=str)
def test_other_equations_are_not_solved(residual: Any) -> None:
    assert isolate(residual, x) is None


@pytest.mark.parametrize(
    ("residual", "solved"), [(a - 1 / x, 1 / a), (c - b / x + a, b / (c + a)), (a / (x - b) + c, b - a / c)], ids=str
)
def test_a_denominator_is_solved_for(residual: Any, solved: Any) -> None:
    assert value(isolate_inverse(residual, x)) == pytest.approx(value(solved), rel=1e-15)


@pytest.mark.parametrize("residual", [x - a, a * (1 / x) - b * x, c * (b / x) - a, a / (b * x) - c], ids=str)
def test_other_equations_have_no_denominator_to_be_solved_for(residual: Any) -> None:
    assert isolate_inverse(residual, x) is None


def test_a_long_equation_is_not_searched() -> None:
    long = x
    for _ in range(100):
        long = long * a + b
    assert isolate(long, x) is None
