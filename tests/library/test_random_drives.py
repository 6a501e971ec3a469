"""Chains of clutches with random parameters: whatever happens, the books close and nothing slips while it sticks."""

import numpy as np
import pytest

from components import Clutch, Inertia, Pulse, Sine, SpeedDependentLoad, Step, Torque
from modelica_like import Assembly, Component, simulate

# The first four once chattered or failed: surfaces let go and pressed together again by a normal force through zero.
SEEDS = [17, 47, 81, 112, 1, 2, 3]


def random_drive(seed: int) -> Assembly:
    r = np.random.default_rng(seed)
    parts: dict[str, Component] = {
        "sine": Sine(amplitude=r.uniform(0, 30), f=r.uniform(0.5, 8)),
        "torque": Torque(),
        "J1": Inertia(J=r.uniform(0.2, 2), phi=0.0, w=r.uniform(-10, 10)),
    }
    shaft, wires = ["torque", "J1"], {"drive": ("sine.y", "torque.tau")}
    for k in (2, 3, 4):
        kind = r.integers(3)
        signals = [
            Step(start_time=r.uniform(0, 1)),
            Pulse(period=r.uniform(0.05, 0.5), width=r.uniform(0.2, 0.8)),
            Sine(amplitude=1.0, f=r.uniform(0.2, 3)),
        ]
        parts[f"s{k}"] = signals[kind] if kind != 2 else Sine(amplitude=1.0, f=r.uniform(0.2, 3), phase=r.uniform(0, 6))
        parts[f"c{k}"] = Clutch(
            fn_max=r.uniform(5, 60),
            peak=float(r.choice([1.0, 1.1, 1.5])),
            mu_pos=((0, 0.5), (r.uniform(1, 5), r.uniform(0.2, 0.5)), (10, 0.45)),
        )
        parts[f"J{k}"] = Inertia(J=r.uniform(0.2, 2), phi=0.0, w=float(r.choice([0.0, r.uniform(-10, 10)])))
        shaft += [f"c{k}", f"J{k}"]
        wires[f"press{k}"] = (f"s{k}.y", f"c{k}.f_normalized")
    if r.random() < 0.5:
        parts["load"] = SpeedDependentLoad(a=r.uniform(0, 5), b=r.uniform(0, 1), p=float(r.choice([2 / 3, 1, 2])))
        shaft.append("load")
    return Assembly("drive", parts=parts, series={"shaft": shaft}, connect=wires)


@pytest.mark.parametrize("seed", SEEDS)
def test_random_clutches(seed: int) -> None:
    run = simulate(random_drive(seed), 1.0, points=100)
    stuck = run.model.flat_discretes[run.model.discrete_position["c2.mode"]].names.index("stuck")
    for k in (2, 3, 4):
        assert np.min(run[f"c{k}.loss_power"]) >= -1e-6
        slip = run[f"c{k}.w_rel"][run[f"c{k}.mode"] == stuck]
        assert np.all(np.abs(slip) < 1e-10)
    assert run.energy().power_closure < 1e-8
