"""Starts from rest: what springs couple to a moving part turns with it; what nothing holds stands still."""

from math import pi

import pytest

from components import (
    Clutch,
    ConstantSpeed,
    Damper,
    DualMassFlywheel,
    ElasticCoupling,
    ElastoGap,
    Fixed,
    IdealGear,
    IdealRollingWheel,
    Inertia,
    Mass,
    Spring,
    SpringDamper,
    TimingBelt,
    TranslationalSpring,
    TranslationalSpringDamper,
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


SPRING, SOFT, STAGES = Spring(c=50), SpringDamper(c=80, d=0.1), ElasticCoupling(stages=((0, 10), (0.1, 90)), d=0.2)
GEAR, WHEEL, ROPE = IdealGear(ratio=4.0), IdealRollingWheel(radius=0.3), TranslationalSpring(c=900)
BELT = TimingBelt(r_a=0.1, r_b=0.25, c=1e4, d=5)


@pytest.mark.parametrize(
    ("between", "ratio"),
    [
        ([SPRING], 1.0),
        ([SOFT, SOFT], 1.0),
        ([SPRING, SOFT], 1.0),
        ([SPRING, SPRING], 1.0),
        ([STAGES, STAGES], 1.0),
        ([SPRING, STAGES, SOFT, SPRING], 1.0),
        ([SOFT, GEAR, SOFT], 0.25),
        ([SPRING, GEAR, SPRING], 0.25),
        ([SOFT, GEAR, STAGES, GEAR, SPRING], 1 / 16),
        ([BELT], 0.4),
        ([SOFT, BELT, SPRING], 0.4),
    ],
)
def test_springs_need_no_inertia_in_between(between: list[Component], ratio: float):
    """Nor a damper: whatever is given at one end, the other one turns along."""
    end = f"p{len(between) + 1}.w"
    assert starts(Inertia(J=1.0, w=100.0), *between, Inertia(J=2.0))[end] == pytest.approx(100.0 * ratio, rel=1e-12)
    values = starts(Inertia(J=1.0), *between, Inertia(J=2.0, w=6.0))
    assert values["p0.w"] == pytest.approx(6.0 / ratio, rel=1e-12)
    values = starts(Inertia(J=1.0), *between, Inertia(J=2.0))
    assert (values["p0.w"], values[end]) == (0.0, 0.0)
    values = starts(Inertia(J=1.0, w=7.0), *between, Inertia(J=2.0, w=6.0))
    assert (values["p0.w"], values[end]) == (7.0, 6.0)
    values = starts(ConstantSpeed(w_fixed=8.0), *between, Inertia(J=2.0))
    assert values[end] == pytest.approx(8.0 * ratio, rel=1e-12)
    assert starts(Fixed(), *between, Inertia(J=2.0), Damper(d=1.0), Inertia(J=1.0, w=5.0))[end] == 0.0


@pytest.mark.parametrize("rope", [[ROPE], [TranslationalSpringDamper(c=900, d=2.0), ROPE], []])
@pytest.mark.parametrize("shaft", [[SPRING], [SOFT], []])
def test_what_rolls_moves_with_a_shaft(shaft: list[Component], rope: list[Component]):
    row = [Inertia(J=1.0, w=20.0), *shaft, WHEEL, *rope, Mass(m=3.0)]
    assert starts(*row)[f"p{len(row) - 1}.v"] == pytest.approx(6.0, rel=1e-12)


def test_springs_between_masses():
    for between in ([ROPE], [ROPE, ROPE], [ROPE, TranslationalSpringDamper(c=900, d=2.0)]):
        assert starts(Mass(m=1.0, v=3.0), *between, Mass(m=2.0))[f"p{len(between) + 1}.v"] == pytest.approx(3.0)


@pytest.mark.parametrize("spring", [SPRING, SOFT])
def test_a_spring_in_series_with_a_damper_couples_nothing(spring: Component):
    for between in ([spring, Damper(d=0.5)], [Damper(d=0.5), spring]):
        values = starts(Inertia(J=0.1, w=85.0), *between, Inertia(J=0.1))
        assert (values["p0.w"], values["p3.w"]) == (85.0, 0.0)


def test_two_ways_of_springs_between_the_same_parts():
    """One of them says it all, and the other one nothing else."""
    parts = {"a": Inertia(J=1.0, w=9.0), "b": Inertia(J=1.0), "c": Inertia(J=1.0)}
    parts |= {f"{name}{k}": SpringDamper(c=10.0 * k, d=1.0) for name in "fg" for k in (1, 2)}
    parts |= {"gear": IdealGear(ratio=3.0)}
    series = {"first": ["a", "f1", "f2", "b"], "second": ["a", "g1", "g2", "b"], "last": ["b", "gear", "c"]}
    run = simulate(Assembly("ways", parts=parts, series=series), "1 ms", start="rest")
    assert [run[name][0] for name in ("b.w", "c.w")] == pytest.approx([9.0, 3.0], rel=1e-12)


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
