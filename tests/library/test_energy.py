"""Every component keeps its books: power in + source = rate of stored energy + losses."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import components
from components import (
    AngleSensor,
    BallScrew,
    BearingFriction,
    Brake,
    Clutch,
    CoilForce,
    Constant,
    ConstantForce,
    ConstantSpeed,
    ConstantTorque,
    Damper,
    Differential,
    ElastoBacklash,
    ElastoBacklash2,
    Fixed,
    Force,
    ForceSensor,
    IdealGear,
    IdealPlanetary,
    Inertia,
    MachineTable,
    Mass,
    MultiPlateClutch,
    MultiSensor,
    PositionSensor,
    PowerSensor,
    Product,
    Pulse,
    Ramp,
    RelativeAngleSensor,
    RelativeSpeedSensor,
    Sine,
    Speed,
    SpeedDependentLoad,
    SpeedSensor,
    Spring,
    SpringDamper,
    Step,
    Table,
    TimeFormula,
    Torque,
    TorqueSensor,
    TorqueStep,
    TranslationalDamper,
    TranslationalFixed,
    TranslationalSpeed,
    TranslationalSpring,
    TranslationalSpringDamper,
    Trapezoid,
)
from modelica_like import Assembly, Component, Solution, load, simulate
from modelica_like.errors import UnknownName
from modelica_like.language.inside import declarations, inside

CLOSES = 1e-8
EXAMPLES = Path(__file__).parents[2] / "examples"


def through(part: Component) -> Assembly:
    """The part between a motor with slip and a flywheel on a damper."""
    parts = {
        "motor": ConstantSpeed(w_fixed=8.0), "slip": Damper(d=4.0), "J1": Inertia(J=0.2, phi=0.0, w=0.0), "part": part,
        "J2": Inertia(J=0.5, phi=0.1, w=2.0), "oil": Damper(d=0.4), "wall": Fixed(),
    }  # fmt: skip
    return Assembly("drive", parts=parts, series={"shaft": list(parts)})


def rigid(part: Component) -> Assembly:
    """The same where the part joins both masses rigidly."""
    drive = slide(part) if isinstance(part, ForceSensor) else through(part)
    second = drive.parts["m2" if isinstance(part, ForceSensor) else "J2"]
    inside(second).starts.clear()
    return drive


def at_end(part: Component) -> Assembly:
    """The part at the end of an oscillating shaft."""
    parts = {"wall": Fixed(), "spring": SpringDamper(c=60.0, d=0.2), "J": Inertia(J=0.5, phi=0.4, w=3.0), "part": part}
    return Assembly("drive", parts=parts, series={"shaft": list(parts)})


def slide(part: Component) -> Assembly:
    """The part between two masses."""
    parts = {
        "push": ConstantForce(f_constant=5.0), "m1": Mass(m=0.2, s=0.0, v=0.0), "part": part,
        "m2": Mass(m=0.5, s=0.1, v=2.0), "oil": TranslationalDamper(d=0.4), "wall": TranslationalFixed(),
    }  # fmt: skip
    return Assembly("drive", parts=parts, series={"shaft": list(parts)})


def slide_end(part: Component) -> Assembly:
    parts = {
        "wall": TranslationalFixed(),
        "spring": TranslationalSpringDamper(c=60.0, d=0.2),
        "m": Mass(m=0.5, s=0.4, v=3.0),
        "part": part,
    }
    return Assembly("drive", parts=parts, series={"shaft": list(parts)})


def signal(part: Component) -> Assembly:
    """The part drives a torque."""
    parts = {"part": part, "torque": Torque(), "J": Inertia(J=0.5, phi=0.0, w=1.0)}
    return Assembly("drive", parts=parts, series={"shaft": ["torque", "J"]}, connect={"c": ("part.y", "torque.tau")})


def driven(part: Component, entry: str, wave: Component) -> Assembly:
    drive = slide_end(part) if isinstance(part, Force) else at_end(part)
    parts = {**drive.parts, "wave": wave}
    return Assembly("drive", parts=parts, series=drive.chains, connect={"c": ("wave.y", f"part.{entry}")})


def prescribed(part: Component, spring: Component, wall: Component, mass: Component, entry: str, unit: str) -> Assembly:
    """The part moves one end of an oscillator."""
    parts = {
        "part": part,
        "spring": spring,
        "mass": mass,
        "spring2": type(spring)(c=50.0),
        "wall": wall,
        "wave": Sine(amplitude=f"2 {unit}", f=1.5),
    }
    return Assembly(
        "drive",
        parts=parts,
        series={"s": ["part", "spring", "mass", "spring2", "wall"]},
        connect={"c": ("wave.y", f"part.{entry}")},
    )


def measured(part: Component) -> Assembly:
    drive = at_end(Damper(d=0.1))
    parts = {**drive.parts, "wall2": Fixed(), "sensor": part}
    ends = (
        {"a": ("sensor.flange_a", "wall.flange"), "b": ("sensor.flange_b", "J.flange_b")}
        if "flange_a" in part.connectors
        else {"a": ("sensor.flange", "J.flange_b")}
    )
    return Assembly("drive", parts=parts, series={"s": ["wall", "spring", "J", "part", "wall2"]}, connect=ends)


def planetary() -> Assembly:
    parts = {
        "part": IdealPlanetary(ratio=2.5),
        "sun": Inertia(J=0.1, phi=0.0, w=4.0),
        "ring": Inertia(J=0.6, phi=0.0, w=-1.0),
        "carrier": Inertia(J=0.3),
        "oil": Damper(d=0.4),
        "wall": Fixed(),
        "torque": ConstantTorque(tau_constant=2.0),
    }
    connect = {
        "s": ("part.sun", "sun.flange_a", "torque.flange"),
        "r": ("part.ring", "ring.flange_a"),
        "c": ("part.carrier", "carrier.flange_a", "oil.flange_a"),
        "w": ("oil.flange_b", "wall.flange"),
    }
    return Assembly("drive", parts=parts, connect=connect)


def differential() -> Assembly:
    parts = {
        "engine": ConstantTorque(tau_constant=2.0),
        "part": Differential(ratio=3.0),
        "left": Inertia(J=0.3, phi=0.0, w=1.0),
        "right": Inertia(J=0.5, phi=0.0, w=-1.0),
    }
    connect = {
        "d": ("engine.flange", "part.flange"),
        "l": ("part.left", "left.flange_a"),
        "r": ("part.right", "right.flange_a"),
    }
    return Assembly("drive", parts=parts, connect=connect)


def screw() -> Assembly:
    parts = {
        "motor": ConstantTorque(tau_constant=2.0),
        "part": BallScrew(lead=0.02),
        "table": MachineTable(m=20.0, f_friction=30.0, f_load=20.0, s=0.0, v=0.0),
    }
    return Assembly("drive", parts=parts, series={"s": list(parts)})


def product() -> Assembly:
    parts = {
        "part": Product(),
        "a": Sine(amplitude="3 N.m", f=2.0),
        "b": Step(start_time=0.2),
        "torque": Torque(),
        "J": Inertia(J=0.5, phi=0.0, w=1.0),
    }
    connect = {"1": ("a.y", "part.u1"), "2": ("b.y", "part.u2"), "3": ("part.y", "torque.tau")}
    return Assembly("drive", parts=parts, series={"s": ["torque", "J"]}, connect=connect)


PLATES = {
    "mu_min": 0.04,
    "w_min": 3.0,
    "curvature": 1e-3,
    "slope": 1e-3,
    "mu_static": 0.133,
    "fn_max": 90.0,
    "cgeo": 0.5,
}
MU = ((0.0, 0.5), (2.0, 0.3), (9.0, 0.4))

DRIVES: dict[type[Component], Callable[[], Assembly]] = {
    AngleSensor: lambda: measured(AngleSensor()),
    BallScrew: screw,
    BearingFriction: lambda: at_end(BearingFriction(tau_pos=((0, 0.4), (3, 1.0)))),
    Brake: lambda: at_end(Brake(fn_max=2.0, mu_pos=MU, peak=1.2, tau_drag=0.1)),
    Clutch: lambda: through(Clutch(fn_max=2.0, mu_pos=MU, peak=1.2, smooth=True)),
    CoilForce: lambda: signal(CoilForce(amplitude="2 N.m", T=0.1)),
    Constant: lambda: signal(Constant(k="2 N.m")),
    ConstantForce: lambda: slide_end(ConstantForce(f_constant=-2.0)),
    ConstantSpeed: lambda: through(Spring(c=30.0)),
    ConstantTorque: lambda: at_end(ConstantTorque(tau_constant=-2.0)),
    Damper: lambda: through(Damper(d=2.0)),
    Differential: differential,
    ElastoBacklash: lambda: through(ElastoBacklash(c=300.0, d=3.0, b=0.2)),
    ElastoBacklash2: lambda: through(ElastoBacklash2(c=300.0, d=3.0, b=0.2)),
    Fixed: lambda: through(Spring(c=30.0)),
    Force: lambda: driven(Force(), "f", Sine(amplitude="2 N", f=2.0)),
    ForceSensor: lambda: rigid(ForceSensor()),
    IdealGear: lambda: rigid(IdealGear(ratio=-3.0)),
    IdealPlanetary: planetary,
    Inertia: lambda: through(Spring(c=30.0)),
    MachineTable: screw,
    Mass: lambda: slide(TranslationalSpring(c=40.0)),
    MultiPlateClutch: lambda: through(MultiPlateClutch(**PLATES)),
    MultiSensor: lambda: rigid(MultiSensor()),
    PositionSensor: lambda: slide_end(PositionSensor()),
    PowerSensor: lambda: rigid(PowerSensor()),
    Product: product,
    Pulse: lambda: signal(Pulse(amplitude="2 N.m", period=0.1, width=0.3)),
    Ramp: lambda: signal(Ramp(height="2 N.m", duration=0.3)),
    RelativeAngleSensor: lambda: measured(RelativeAngleSensor()),
    RelativeSpeedSensor: lambda: measured(RelativeSpeedSensor()),
    Sine: lambda: signal(Sine(amplitude="2 N.m", f=3.0)),
    Speed: lambda: prescribed(Speed(), Spring(c=40.0, phi_rel=0.0), Fixed(), Inertia(J=0.2, w=0.0), "w_ref", "rad/s"),
    SpeedDependentLoad: lambda: at_end(SpeedDependentLoad(a=0.5, b=0.2, p=2 / 3)),
    SpeedSensor: lambda: measured(SpeedSensor()),
    Spring: lambda: through(Spring(c=30.0, phi_rel0=0.1)),
    SpringDamper: lambda: through(SpringDamper(c=30.0, d=0.5, phi_rel0=-0.1)),
    Step: lambda: signal(Step(height="2 N.m", start_time=0.2)),
    Table: lambda: signal(Table(table=((0, 0), (0.3, 2), (0.6, -1)), scale="1 N.m")),
    TimeFormula: lambda: signal(TimeFormula(formula="exp(-time)", scale="1 N.m")),
    Torque: lambda: driven(Torque(), "tau", Sine(amplitude="2 N.m", f=2.0)),
    TorqueSensor: lambda: rigid(TorqueSensor()),
    TorqueStep: lambda: at_end(TorqueStep(step_torque=2.0, start_time=0.3)),
    TranslationalDamper: lambda: slide(TranslationalDamper(d=0.7)),
    TranslationalFixed: lambda: slide(TranslationalSpring(c=40.0)),
    TranslationalSpeed: lambda: prescribed(
        TranslationalSpeed(s=0.0),
        TranslationalSpring(c=40.0, s_rel=0.0),
        TranslationalFixed(),
        Mass(m=0.2, v=0.0),
        "v_ref",
        "m/s",
    ),
    TranslationalSpring: lambda: slide(TranslationalSpring(c=40.0, s_rel0=0.1)),
    TranslationalSpringDamper: lambda: slide(TranslationalSpringDamper(c=40.0, d=0.5)),
    Trapezoid: lambda: signal(Trapezoid(amplitude="2 N.m", period=0.3, rising=0.05, width=0.1, falling=0.05)),
}


def _types(part: Component) -> set[type[Component]]:
    return {type(part)}.union(*(_types(inner) for inner in part.parts.values()))


def test_every_component_is_in_some_energy_balance() -> None:
    """Here, or in a netlist of the examples; of all of these the balance is tested, component by component."""
    exported = [getattr(components, name) for name in components.__all__]
    kinds = {kind for kind in exported if issubclass(kind, Component) and not declarations(kind).partial}
    powered = {kind for kind in kinds if declarations(kind).connectors}
    assert len(powered) > 120
    netlists = [path for path in EXAMPLES.rglob("*.toml") if not {"sizing", "cosim"} & set(path.parts)]
    missing = powered - set(DRIVES) - set().union(*(_types(load(path)) for path in netlists))
    assert not missing, "give these a small drive above, or a netlist in examples"


_runs: dict[type[Component], Solution] = {}


def run(kind: type[Component]) -> Solution:
    if kind not in _runs:
        _runs[kind] = simulate(DRIVES[kind](), 1.0, rtol=1e-9, atol=1e-11, points=200)
    return _runs[kind]


@pytest.mark.parametrize("kind", DRIVES, ids=lambda kind: kind.__name__)
def test_energy_closes(kind: type[Component]) -> None:
    balance = run(kind).energy()
    assert balance.throughput > 0.1
    for row in balance:
        assert abs(row.residual) <= CLOSES * balance.throughput, row
    assert balance.power_closure <= CLOSES
    assert sum(row.inflow for row in balance) == pytest.approx(0.0, abs=CLOSES * balance.throughput)


@pytest.mark.parametrize("kind", DRIVES, ids=lambda kind: kind.__name__)
def test_losses_are_never_negative(kind: type[Component]) -> None:
    result = run(kind)
    for path in result.model.components:
        assert np.min(result[f"{path}.loss_power"]) >= -1e-8, path


def test_the_balance_would_notice_a_wrong_sign() -> None:
    class WrongSpring(Spring):
        """Spring whose stored energy has the wrong sign."""

        def stored_energy(self) -> Any:
            return -super().stored_energy()

    result = simulate(through(WrongSpring(c=30.0)), 1.0)
    assert result.energy().power_closure > 1e-5


def test_a_component_that_is_not_there() -> None:
    with pytest.raises(UnknownName, match=r"no component 'sip'; did you mean 'slip'\?"):
        simulate(through(Spring(c=30.0)), 0.1).energy()["sip"]
