"""Trains of gears, bearings and shafts in any order turn steadily as they do in the end of a long run."""

import numpy as np
import pytest

from components import BearingFriction, ConstantTorque, IdealGear, Inertia, LossyGear, SpeedDependentLoad, SpringDamper
from modelica_like import Assembly, build, simulate, steady
from modelica_like.language import Component


def train(number: int) -> Assembly:
    """A motor, two to four groups of elements in random order with an inertia behind each, and a load."""
    chance = np.random.default_rng(number)
    parts: dict[str, Component] = {"motor": ConstantTorque(tau_constant=chance.uniform(20, 60)), "J0": Inertia(J=0.1)}
    for k in range(1, int(chance.integers(3, 6))):
        for kind in chance.permutation(["bearing", "shaft", "gear", "lossy"])[: chance.integers(1, 5)]:
            parts[f"{kind}{k}"] = {
                "bearing": BearingFriction(tau_pos=((0, 1.0), (50, chance.uniform(0.5, 2.0)))),
                "shaft": SpringDamper(c=10 ** chance.uniform(2, 4), d=10 ** chance.uniform(0, 1)),
                "gear": IdealGear(ratio=chance.choice([-1.5, 0.8, 2.0])),
                "lossy": LossyGear(ratio=chance.choice([1.5, 0.7]), loss_table=((0.0, 0.95, 0.9, 0.1, 0.1),)),
            }[kind]
        parts[f"J{k}"] = Inertia(J=10 ** chance.uniform(-2, 0))
    parts["load"] = SpeedDependentLoad(a=1.0, b=5.0, w_ref=10.0, p=1.0)
    return Assembly("train", parts=parts, series={"line": tuple(parts)})


@pytest.mark.parametrize("number", [*range(3), *(pytest.param(n, marks=pytest.mark.slow) for n in range(3, 60))])
def test_a_train_turns_as_it_does_in_the_end(number: int) -> None:
    model = build(train(number))
    found, end = steady(model), simulate(model, 4000.0, start="rest", rtol=1e-9).final
    for path in model.units:
        if path.endswith((".w", ".phi_rel", ".tau")):
            assert found[path] == pytest.approx(end[path], rel=1e-6, abs=1e-6), path
