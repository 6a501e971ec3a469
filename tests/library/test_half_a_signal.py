"""What a signal switches stays as it is while the signal is exactly a half: on above, off below."""

from collections.abc import Callable

import pytest

from components import (
    ClutchActuator,
    ConstantVoltage,
    DogClutch,
    Fixed,
    Ground,
    IdealSwitch,
    IdealThyristor,
    Inertia,
    Resistor,
    Step,
    Switch,
)
from modelica_like import Assembly, Component, simulate


def circuit(switch: Component) -> tuple[dict[str, Component], dict[str, list[str]]]:
    """The switch between 24 V and 5 Ω."""
    parts = {"U": ConstantVoltage(V=24.0), "switch": switch, "R": Resistor(R=5.0), "earth": Ground()}
    return parts, {"+": ["U.p", "switch.p"], "-": ["switch.n", "R.p"], "0": ["R.n", "U.n", "earth.p"]}


def shaft(switch: Component) -> tuple[dict[str, Component], dict[str, list[str]]]:
    """The clutch between a wall and a wheel at rest."""
    parts = {"wall": Fixed(), "switch": switch, "wheel": Inertia(J=1.0, phi=0.0, w=0.0)}
    return parts, {"a": ["wall.flange", "switch.flange_a"], "b": ["switch.flange_b", "wheel.flange_a"]}


def alone(switch: Component) -> tuple[dict[str, Component], dict[str, list[str]]]:
    return {"switch": switch}, {}


@pytest.mark.parametrize(
    ("kind", "within", "entry", "mode", "off", "on"),
    [
        (ClutchActuator, alone, "on", "coil", "off", "on"),
        (DogClutch, shaft, "engage", "dogs", "out", "in"),
        (Switch, circuit, "closed", "contacts", "open", "closed"),
        (IdealSwitch, circuit, "closed", "state", "off", "on"),
        (IdealThyristor, circuit, "fire", "state", "off", "on"),
    ],
)
@pytest.mark.parametrize("before", [0.0, 0.5, 1.0])
def test_at_a_half_nothing_switches(
    kind: Callable[..., Component], within: Callable[..., tuple[dict[str, Component], dict[str, list[str]]]],
    entry: str, mode: str, off: str, on: str, before: float,
) -> None:  # fmt: skip
    switch = kind(t12=0.1, t2=0.1) if kind is ClutchActuator else kind()
    parts, wires = within(switch)
    parts["step"] = Step(offset=before, height=0.5 - before, start_time=0.5)
    run = simulate(Assembly("d", parts=parts, connect={**wires, "e": ["step.y", f"switch.{entry}"]}), 1.0)
    assert run.final["step.y"] == 0.5
    told = {one.path: one.names for one in run.model.flat_discretes}[f"switch.{mode}"]
    assert told[int(run.final[f"switch.{mode}"])] == (on if before == 1.0 else off)
