"""Starts from rest: what springs couple to a moving part turns with it; what nothing holds stands still."""

from math import pi

import pytest

from components import (
    Clutch,
    Damper,
    DualMassFlywheel,
    ElastoGap,
    Fixed,
    IdealGear,
    Inertia,
    Mass,
    SpringDamper,
)
from components.interfaces import CompliantWithRelativeStates
from modelica_like import simulate
from modelica_like.language import (
    Assembly,
    Component,
    Equations,
    Output,
    Parameter,
    Variable,
    param,
    signal_out,
    sin,
    var,
)

IDLE = 850 * pi / 30


def starts(*row: Component) -> dict[str, float]:
    """Values at the start from rest of parts p0, p1, … in a row."""
    parts = {f"p{k}": part for k, part in enumerate(row)}
    run = simulate(Assembly("row", parts=parts, series={"row": [*parts]}), "1 ms", start="rest")
    return {name: float(run[name][0]) for name in run.names}


def test_behind_springs_all_turn():
    values = starts(
        Inertia(J=0.1, w="850 rpm"), SpringDamper(c=800, d=0.1), Inertia(J=0.05), IdealGear(ratio=2.0),
        SpringDamper(c=500, d=0.1), Inertia(J=0.01),
    )  # fmt: skip
    assert [values[f"p{k}.w"] for k in (0, 2, 5)] == pytest.approx([IDLE, IDLE, IDLE / 2], rel=1e-12)


def test_both_sides_of_a_flywheel_turn():
    wheel = DualMassFlywheel(J_1=0.1, J_2=0.05, stages=((0, 800),), tau_h=8, c_h=4000)
    values = starts(Inertia(J=0.12, w="850 rpm"), wheel, Inertia(J=0.01))
    assert [values[f"{one}.w"] for one in ("p1.primary", "p1.secondary", "p2")] == pytest.approx([IDLE] * 3, rel=1e-12)


@pytest.mark.parametrize("separates", [Clutch(capacity=100.0, f_normalized=0.0), Damper(d=0.5)])
def test_behind_clutches_and_dampers_all_stands(separates: Component):
    values = starts(
        Inertia(J=0.1, w="850 rpm"), SpringDamper(c=800, d=0.1), Inertia(J=0.05), separates,
        Inertia(J=0.1), SpringDamper(c=500, d=0.1), Inertia(J=0.01),
    )  # fmt: skip
    assert values["p2.w"] == pytest.approx(IDLE, rel=1e-12)
    assert [values["p4.w"], values["p6.w"]] == [0.0, 0.0]


def test_springs_to_the_ground_hold():
    """The middle one is held by the ground; what is given turns all the same."""
    values = starts(Fixed(), SpringDamper(c=800, d=0.1), Inertia(J=0.1), Damper(d=1.0), Inertia(J=0.1, w=5.0))
    assert (values["p2.w"], values["p4.w"]) == (0.0, 5.0)
    values = starts(Fixed(), SpringDamper(c=800, d=0.1), Inertia(J=0.1, w=5.0), SpringDamper(c=8, d=0), Inertia(J=1))
    assert (values["p2.w"], values["p4.w"]) == (5.0, 5.0)


def test_an_open_gap_couples_nothing():
    """The second mass waits for the first."""
    values = starts(Mass(m=1.0, s=0.0, v=3.0), ElastoGap(c=1e4, d=1.0), Mass(m=1.0, s=0.5))
    assert (values["p0.v"], values["p2.v"]) == (3.0, 0.0)


class PlainSpring(CompliantWithRelativeStates):
    """A spring that declares no energy and hides its law behind another variable."""

    c: Parameter = param("N.m", "largest torque", default=100.0)
    d: Parameter = param("N.m.s/rad", "damping coefficient", default=0.1)
    pull: Variable = var("N.m", "elastic torque")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.pull == self.c * sin(self.phi_rel)
        yield self.tau == self.pull + self.d * self.w_rel


class ShownSlip(Damper):
    """A damper that shows an angle, by which nothing moves."""

    shown: Output = signal_out("1", "sine of the angle")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.shown == sin(self.phi_rel)


def test_structure_tells_springs_not_their_energy():
    values = starts(Inertia(J=0.1, w=9.0), PlainSpring(), Inertia(J=0.2), ShownSlip(d=0.1), Inertia(J=0.1))
    assert [values[f"p{k}.w"] for k in (0, 2, 4)] == pytest.approx([9.0, 9.0, 0.0], rel=1e-12)
