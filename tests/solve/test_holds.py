"""What modes hold, and how elements that hold motions share reactions."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fakes import fake_model

from components import Clutch, ConstantTorque, Fixed, Inertia
from modelica_like import Assembly
from modelica_like.compile.compiled import Circuit
from modelica_like.solve.initialize import holds as module
from modelica_like.solve.initialize.holds import capacities, holding, sharing, terms
from modelica_like.solve.initialize.point import Point


class Fake:
    """Stands for the functions of a model, whose values at a point are given; tells how often they are called."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, **values: Any) -> None:
        self.calls: list[str] = []
        self.model: Any = fake_model(**{name: name for name in values})

        def call(model: Any, function: str, point: Any) -> Any:
            assert model is self.model
            self.calls.append(function)
            return np.array(values[function](point), float)

        monkeypatch.setattr(module, "call", call)


def at(*d: float) -> Point:
    return Point(2.0, np.zeros(0), np.zeros(0), np.array(d, float))


def held(k: int) -> Any:
    """Motion k: mode k, which holds it with number 1."""
    return SimpleNamespace(component=f"c{k}", mode=k, number=1)


def test_held_is_what_its_mode_holds_with_a_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [[1, 5, 6, 0.1], [0, 7, 8, 0.2], [-0.5, 9, 10, 0.3]]
    fake = Fake(monkeypatch, terms=lambda _: np.ravel(rows))
    fake.model.held.motions = [held(0), held(1), held(2)]
    assert terms(fake.model, at()).tolist() == rows
    assert capacities(fake.model, at()).tolist() == [one[1:3] for one in rows]
    assert holding(fake.model, at(1, 1, 1)) == [0, 2]
    assert holding(fake.model, at(2, 1, 1)) == [2]
    fake.calls.clear()
    assert holding(fake.model, at(2, 0, 2)) == []
    assert not fake.calls


def test_who_shares_is_told() -> None:
    model: Any = fake_model(motions=[held(k) for k in range(4)], circuits=(Circuit((3, 1, 2), 1), Circuit((0,), 13)))
    model.held.motions[2].component = "c3"
    d = np.zeros(15)
    d[4:13] = np.ravel([[0, 0, 0], [-0.5, 1.0, 0.0], [1.0, 0.0, -1.0]])
    assert sharing(model, at(*d)) == [("c3", "c1"), ("c3",)]


@pytest.mark.parametrize("torque", [0.5, 1.5, 1.97, -1.97])
@pytest.mark.parametrize("unit", [1.0, 1e-3])
def test_reactions_are_the_least_ones_that_all_can_bear(start: Any, torque: float, unit: float) -> None:
    """Brakes a and b bear 1 N.m each, the clutch between them 10: b gets what the clutch passes on.

    a²/1 + c²/10 + b²/1 is least at c = b = T/2.1; of 1.97 N.m that leaves a more than it bears, so b takes more.
    """
    parts = {"push": ConstantTorque(tau_constant=torque * unit), "first": Inertia(J=1.0), "last": Inertia(J=1.0)}
    parts |= {"a": Clutch(capacity=unit), "c": Clutch(capacity=10 * unit), "b": Clutch(capacity=unit), "g": Fixed()}
    joints = {
        "one": ["push.flange", "first.flange_a", "a.flange_a"], "two": ["first.flange_b", "c.flange_a"],
        "three": ["c.flange_b", "last.flange_a", "b.flange_a"], "ground": ["a.flange_b", "b.flange_b", "g.flange"],
    }  # fmt: skip
    found = start(Assembly("two_brakes", parts=parts, connect=joints), "steady")
    assert {found[f"{name}.mode"] for name in "abc"} == {"stuck"}
    shares = [abs(found[f"{name}.tau"] / (torque * unit)) for name in "acb"]
    assert (shares[0] + shares[1], shares[1] - shares[2]) == pytest.approx((1.0, 0.0), abs=1e-12)
    if abs(torque) < 1.97:
        assert shares[1] == pytest.approx(1 / 2.1, rel=1e-9)
    else:
        assert max(shares) * 1.97 <= 0.99
