"""Trains of gears, bearings and shafts in any order: steady turns and gradients, against long runs and differences."""

import numpy as np
import pytest

from components import BearingFriction, ConstantTorque, IdealGear, Inertia, LossyGear, SpeedDependentLoad, SpringDamper
from modelica_like import Assembly, Options, build, sensitivities, simulate, steady
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


@pytest.mark.slow
@pytest.mark.parametrize("number", [101, 105, 107, *range(108, 130)])
def test_a_gradient_passes_where_several_parts_that_hold_a_shaft_give_way(number: int) -> None:
    """How they split what they hold changes with the load, because a gear bears more under load: no matter."""
    drive, step, asked = train(number), 1e-4, ("J0.w", "J1.w")
    names = [f"{name}.{field}" for name, field in (
        ("J1", "J"), ("motor", "tau_constant"), ("shaft1", "c"), ("lossy1", "ratio"), ("gear1", "ratio"), ("load", "a"),
    ) if name in drive.parts]  # fmt: skip
    found = sensitivities(drive, asked, names, until=0.5, start="rest", options=Options(rtol=1e-9))
    values, model = [one.value for one in found.parameters], build(drive, free=names)

    def end(name: str, value: float) -> list[float]:
        run = simulate(model, 0.5, start="rest", parameters={name: value}, rtol=1e-11)
        return [run.final[path] for path in asked]

    moved = [
        [end(name, value * (1 + sign * step)) for sign in (1, -1)] for name, value in zip(names, values, strict=True)
    ]
    differences = np.array([np.subtract(*pair) for pair in moved]).T / (2 * step)
    assert found.derivatives * values == pytest.approx(differences, abs=3e-5 * np.abs(differences).max())
