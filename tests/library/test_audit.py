"""The audit of the energy balance notices wrong equations of components, at every instant.

What no balance can see is a law that is wrong but consistent: another stiffness in torque and energy, another ratio in
speeds and torques, less friction that also loses less. Such a component is a right one with other values, and only a
reference or a closed form tells.
"""

from collections.abc import Callable
from math import pi
from typing import Any

import numpy as np
import pytest

from components import (
    BallScrew,
    Capacitor,
    Clutch,
    ConstantForce,
    ConstantSpeed,
    ConstantTorque,
    ConstantVoltage,
    Damper,
    Fixed,
    Ground,
    IdealGear,
    IdealPlanetary,
    Inertia,
    LossyPlanetarySet,
    MachineTable,
    Mass,
    PermanentMagnetDCMachine,
    Resistor,
    Spring,
    SpringDamper,
    TimingBelt,
    TranslationalDamper,
    TranslationalFixed,
    UniversalJoint,
)
from modelica_like import Assembly, simulate
from modelica_like.language import Component, Equations, Parameter, absolute, der, param


def through(part: Component, flywheel: Component | None = None) -> Assembly:
    """The part between a motor with slip and a flywheel on a damper."""
    parts = {
        "motor": ConstantSpeed(w_fixed=8.0), "slip": Damper(d=4.0), "J1": Inertia(J=0.2, phi=0.0, w=0.0), "part": part,
        "J2": flywheel or Inertia(J=0.5), "oil": Damper(d=0.4), "wall": Fixed(),
    }  # fmt: skip
    return Assembly("drive", parts=parts, series={"shaft": list(parts)})


def elastic(part: Component) -> Assembly:
    return through(part, Inertia(J=0.5, phi=0.1, w=2.0))


def flywheel(kind: type[Inertia]) -> Assembly:
    return through(Spring(c=30.0), kind(J=0.5, phi=0.1, w=2.0))


def pushed(part: Component) -> Assembly:
    parts = {"push": ConstantForce(f_constant=5.0), "part": part, "oil": TranslationalDamper(d=0.4)}
    parts["wall"] = TranslationalFixed()
    return Assembly("drive", parts=parts, series={"slide": list(parts)})


def screw(part: Component, table: Component | None = None) -> Assembly:
    table = table or MachineTable(m=20.0, f_friction=30.0, f_load=20.0, s=0.0, v=0.0)
    parts = {"motor": ConstantTorque(tau_constant=2.0), "part": part, "table": table}
    return Assembly("drive", parts=parts, series={"s": list(parts)})


def planetary(part: Component) -> Assembly:
    parts = {
        "part": part, "sun": Inertia(J=0.1, phi=0.0, w=4.0), "ring": Inertia(J=0.6, phi=0.0, w=-1.0),
        "carrier": Inertia(J=0.3), "torque": ConstantTorque(tau_constant=2.0),
    }  # fmt: skip
    connect = {
        "s": ("part.sun", "sun.flange_a", "torque.flange"),
        "r": ("part.ring", "ring.flange_a"),
        "c": ("part.carrier", "carrier.flange_a"),
    }
    return Assembly("drive", parts=parts, connect=connect)


def machine(part: Component) -> Assembly:
    parts = {
        "battery": ConstantVoltage(V=24.0),
        "earth": Ground(),
        "part": part,
        "load": ConstantTorque(tau_constant=-1),
    }
    connect = {"plus": ("battery.p", "part.ap"), "minus": ("battery.n", "part.an", "earth.p")}
    return Assembly("drive", parts=parts, series={"s": ["part", "load"]}, connect=connect)


def circuit(part: Component) -> Assembly:
    parts = {"battery": ConstantVoltage(V=24.0), "earth": Ground(), "R": Resistor(R=5.0), "part": part}
    connect = {"minus": ("battery.n", "part.n", "earth.p"), "1": ("battery.p", "R.p"), "2": ("R.n", "part.p")}
    return Assembly("drive", parts=parts, connect=connect)


def dc(kind: type[PermanentMagnetDCMachine]) -> Assembly:
    return machine(kind(k=0.5, Ra=0.8, La=0.01, Jr=0.02, phi=0.0, w=0.0, i=0.0))


# -- mutants: what is wrong with them stands in their names ------------------------------------------------------------


class SpringOfTwiceTheEnergy(Spring):
    def stored_energy(self) -> Any:
        return 2 * super().stored_energy()


class SpringOfNegativeEnergy(Spring):
    def stored_energy(self) -> Any:
        return -super().stored_energy()


class SpringEnergyWithoutRestAngle(Spring):
    def stored_energy(self) -> Any:
        return 0.5 * self.c * self.phi_rel**2


class SpringTorqueHalved(Spring):
    def equations(self) -> Equations:
        yield from super(Spring, self).equations()
        yield self.tau == 0.5 * self.c * (self.phi_rel - self.phi_rel0)


class DamperLosesHalf(Damper):
    def dissipation(self) -> Any:
        return 0.5 * super().dissipation()


class DamperDrives(Damper):
    def equations(self) -> Equations:
        yield from super(Damper, self).equations()
        yield self.tau == -0.1 * self.d * self.w_rel


class SpringDamperWithoutLoss(SpringDamper):
    def dissipation(self) -> Any:
        return 0.0


class InertiaWithoutHalf(Inertia):
    def stored_energy(self) -> Any:
        return self.J * self.w**2


class InertiaFeelsOneSideBackward(Inertia):
    def equations(self) -> Equations:
        a, b = self.flange_a, self.flange_b
        yield a.phi == self.phi
        yield b.phi == self.phi
        yield der(self.phi) == self.w
        yield self.J * der(self.w) == a.tau - b.tau


class InertiaTwiceAsHeavy(Inertia):
    def equations(self) -> Equations:
        a, b = self.flange_a, self.flange_b
        yield a.phi == self.phi
        yield b.phi == self.phi
        yield der(self.phi) == self.w
        yield 2 * self.J * der(self.w) == a.tau + b.tau


class MassWithoutHalf(Mass):
    def stored_energy(self) -> Any:
        return self.m * self.v**2


class GearTorqueTheWrongWay(IdealGear):
    def equations(self) -> Equations:
        a, b = self.flange_a, self.flange_b
        yield a.phi == self.ratio * b.phi
        yield a.tau + self.ratio * b.tau == 0


class GearTorqueOfWrongSign(IdealGear):
    def equations(self) -> Equations:
        a, b = self.flange_a, self.flange_b
        yield a.phi == self.ratio * b.phi
        yield self.ratio * a.tau - b.tau == 0


class GearTorqueOffByAThousandth(IdealGear):
    def equations(self) -> Equations:
        a, b = self.flange_a, self.flange_b
        yield a.phi == self.ratio * b.phi
        yield 1.001 * self.ratio * a.tau + b.tau == 0


class JointWithoutTorqueTransformation(UniversalJoint):
    def equations(self) -> Equations:
        a, b = self.flange_a, self.flange_b
        yield b.phi == a.phi + self.lead(a.phi)
        yield a.tau + b.tau == 0


class ScrewForceWithoutTwoPi(BallScrew):
    def equations(self) -> Equations:
        yield 2 * pi * self.flange_t.s == self.lead * self.flange_r.phi
        yield self.flange_r.tau == -self.lead * self.flange_t.f


class TableGivesWhatItsLoadTakes(MachineTable):
    def source_power(self) -> Any:
        return self.f_load * self.v


class TableWithoutFrictionHeat(MachineTable):
    def dissipation(self) -> Any:
        return 0.0


class BeltOfOneStrand(TimingBelt):
    def stored_energy(self) -> Any:
        return 0.5 * self.c * self.x**2


class BeltLosesNothing(TimingBelt):
    def dissipation(self) -> Any:
        return 0.0


class ClutchLosesHalf(Clutch):
    def dissipation(self) -> Any:
        return 0.5 * super().dissipation()


class PlanetaryLosesTwice(LossyPlanetarySet):
    def dissipation(self) -> Any:
        return 2 * super().dissipation()


class PlanetaryCarrierWithoutTheRing(IdealPlanetary):
    def equations(self) -> Equations:
        sun, carrier, ring = self.sun, self.carrier, self.ring
        yield (1 + self.ratio) * carrier.phi == sun.phi + self.ratio * ring.phi
        yield ring.tau == self.ratio * sun.tau
        yield carrier.tau == -sun.tau


class MachineWithoutFieldEnergy(PermanentMagnetDCMachine):
    def stored_energy(self) -> Any:
        return 0.5 * self.Jr * self.w_rotor**2


class MachineWithoutRotorEnergy(PermanentMagnetDCMachine):
    def stored_energy(self) -> Any:
        return 0.5 * self.La * self.i**2


class MachineWithoutCopperLoss(PermanentMagnetDCMachine):
    def dissipation(self) -> Any:
        return super().dissipation() - self.Ra * self.ia**2


class CapacitorWithoutHalf(Capacitor):
    def stored_energy(self) -> Any:
        return self.C * self.v**2


BELT: dict[str, Any] = {"r_a": 0.1, "r_b": 0.1, "c": 2e3, "d": 20.0, "F_0": 1e4, "x": 0.0}
TABLE: dict[str, Any] = {"m": 20.0, "f_friction": 30.0, "f_load": 20.0, "s": 0.0, "v": 0.0}
SET: dict[str, Any] = {"i0": -2.5, "efficiency": 0.97}

MUTANTS: dict[type[Component], Callable[[], Assembly]] = {
    SpringOfTwiceTheEnergy: lambda: elastic(SpringOfTwiceTheEnergy(c=30.0)),
    SpringOfNegativeEnergy: lambda: elastic(SpringOfNegativeEnergy(c=30.0)),
    SpringEnergyWithoutRestAngle: lambda: elastic(SpringEnergyWithoutRestAngle(c=30.0, phi_rel0=0.2)),
    SpringTorqueHalved: lambda: elastic(SpringTorqueHalved(c=30.0)),
    DamperLosesHalf: lambda: elastic(DamperLosesHalf(d=2.0)),
    DamperDrives: lambda: elastic(DamperDrives(d=2.0)),
    SpringDamperWithoutLoss: lambda: elastic(SpringDamperWithoutLoss(c=30.0, d=0.5)),
    InertiaWithoutHalf: lambda: flywheel(InertiaWithoutHalf),
    InertiaFeelsOneSideBackward: lambda: flywheel(InertiaFeelsOneSideBackward),
    InertiaTwiceAsHeavy: lambda: flywheel(InertiaTwiceAsHeavy),
    MassWithoutHalf: lambda: pushed(MassWithoutHalf(m=0.5, s=0.0, v=0.0)),
    GearTorqueTheWrongWay: lambda: through(GearTorqueTheWrongWay(ratio=-3.0)),
    GearTorqueOfWrongSign: lambda: through(GearTorqueOfWrongSign(ratio=-3.0)),
    GearTorqueOffByAThousandth: lambda: through(GearTorqueOffByAThousandth(ratio=-3.0)),
    JointWithoutTorqueTransformation: lambda: through(JointWithoutTorqueTransformation(beta=0.5)),
    ScrewForceWithoutTwoPi: lambda: screw(ScrewForceWithoutTwoPi(lead=0.02)),
    TableGivesWhatItsLoadTakes: lambda: screw(BallScrew(lead=0.02), TableGivesWhatItsLoadTakes(**TABLE)),
    TableWithoutFrictionHeat: lambda: screw(BallScrew(lead=0.02), TableWithoutFrictionHeat(**TABLE)),
    BeltOfOneStrand: lambda: elastic(BeltOfOneStrand(**BELT)),
    BeltLosesNothing: lambda: elastic(BeltLosesNothing(**BELT)),
    ClutchLosesHalf: lambda: elastic(ClutchLosesHalf(capacity=1.0)),
    PlanetaryLosesTwice: lambda: planetary(PlanetaryLosesTwice(**SET)),
    PlanetaryCarrierWithoutTheRing: lambda: planetary(PlanetaryCarrierWithoutTheRing(ratio=2.5)),
    MachineWithoutFieldEnergy: lambda: dc(MachineWithoutFieldEnergy),
    MachineWithoutRotorEnergy: lambda: dc(MachineWithoutRotorEnergy),
    MachineWithoutCopperLoss: lambda: dc(MachineWithoutCopperLoss),
    CapacitorWithoutHalf: lambda: circuit(CapacitorWithoutHalf(C=0.1, v=0.0)),
}


WRONG = {Inertia: "J2", MachineTable: "table"}
"""Names of mutants that are not called `part`."""


@pytest.mark.parametrize("kind", MUTANTS, ids=lambda kind: kind.__name__)
def test_a_wrong_component_is_noticed(kind: type[Component]) -> None:
    balance = simulate(MUTANTS[kind](), 0.7).energy()
    name = next((name for base, name in WRONG.items() if issubclass(kind, base)), "part")
    wrong = {row.component: row.imbalance for row in balance if row.imbalance}
    assert set(wrong) == {name}
    assert wrong[name] > 1e-4
    assert balance.imbalance == wrong[name]
    assert any(notice.startswith(f"{name} does not balance") for notice in balance.notices)
    assert f"{name} does not balance" in str(balance)


def test_a_difference_that_cancels_over_a_turn_is_noticed_within_it() -> None:
    """The power that goes in beyond what comes out is that of two torques: it is the largest where the ratio is."""
    parts = {
        "motor": ConstantSpeed(w_fixed=10.0), "joint": JointWithoutTorqueTransformation(beta=0.5),
        "load": ConstantTorque(tau_constant=-5.0),
    }  # fmt: skip
    turn = 2 * pi / 10.0
    balance = simulate(Assembly("drive", parts=parts, series={"s": list(parts)}), turn).energy()
    joint = balance["joint"]
    assert balance.power_closure < 1e-8
    # In 5·10 W, out 5·10/cos(beta) W where the fork of flange_a stands in the plane of both shafts.
    fastest = 1 / np.cos(0.5)
    assert joint.imbalance == pytest.approx((fastest - 1) / (fastest + 1), rel=1e-9)
    assert min(abs(joint.imbalance_time - k * turn / 2) for k in range(3)) < 1e-9


# -- what no balance can see -------------------------------------------------------------------------------------------


class SpringTwiceAsStiff(Spring):
    def equations(self) -> Equations:
        yield from super(Spring, self).equations()
        yield self.tau == 2 * self.c * self.phi_rel

    def stored_energy(self) -> Any:
        return self.c * self.phi_rel**2


class GearTheOtherWayRound(IdealGear):
    def equations(self) -> Equations:
        yield self.flange_b.phi == self.ratio * self.flange_a.phi
        yield self.ratio * self.flange_b.tau + self.flange_a.tau == 0


class DamperOfTurbulence(Damper):
    w_full: Parameter = param("rad/s", "speed of the full torque", default=1.0)

    def equations(self) -> Equations:
        yield from super(Damper, self).equations()
        yield self.tau == self.d * self.w_rel * absolute(self.w_rel) / self.w_full

    def dissipation(self) -> Any:
        return self.tau * self.w_rel


CONSISTENT: dict[type[Component], Callable[[], Assembly]] = {
    SpringTwiceAsStiff: lambda: elastic(SpringTwiceAsStiff(c=30.0)),
    GearTheOtherWayRound: lambda: through(GearTheOtherWayRound(ratio=-3.0)),
    DamperOfTurbulence: lambda: elastic(DamperOfTurbulence(d=2.0)),
    Clutch: lambda: elastic(Clutch(capacity=1.0, phi_rel=0.1)),
}


@pytest.mark.parametrize("kind", CONSISTENT, ids=lambda kind: kind.__name__)
def test_a_consistent_law_balances_whether_it_is_right_or_not(kind: type[Component]) -> None:
    balance = simulate(CONSISTENT[kind](), 0.7).energy()
    assert balance.imbalance <= 1e-12
    assert balance.at_events <= 1e-12
    assert balance.notices == ()
    assert "balance" not in str(balance)
