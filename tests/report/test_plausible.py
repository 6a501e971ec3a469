"""Notes about what looks like a slip: told for drives that have it, and for no others."""

import math
from pathlib import Path

import pytest
from calls import called

from components import (
    PI,
    Battery,
    Brake,
    Clutch,
    Constant,
    ConstantForce,
    ConstantSpeed,
    ConstantTorque,
    Fixed,
    Gearbox,
    IdealGear,
    Inertia,
    Mass,
    PermanentMagnetDCMachine,
    Ramp,
    Sine,
    Spring,
    TimingBelt,
    Torque,
    WormGear,
)
from modelica_like import load, simulate
from modelica_like.language import Assembly, Component, Equations, Variable, var
from modelica_like.show.report.plausible import drive_notes, run_notes

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_an_inertia_in_the_wrong_unit_is_noticed() -> None:
    parts = {"motor": Inertia(J="8.5 kg.m2"), "shaft": Spring(c=1e4), "load": Inertia(J="3 kg.cm2")}
    wires = {"a": ["motor.flange_b", "shaft.flange_a"], "b": ["shaft.flange_b", "load.flange_a"]}
    assert drive_notes(Assembly("drive", parts=parts, connect=wires)) == [
        "motor.J is 2.8e+04 times load.J: is the inertia of one of them in the wrong unit (kg.cm2 for kg.m2)?"
    ]
    parts["motor"] = Inertia(J="2.9 kg.m2")
    assert drive_notes(Assembly("drive", parts=parts, connect=wires)) == []


def test_only_neighbours_are_compared() -> None:
    parts = {name: Inertia(J=J) for name, J in (("a", 1.0), ("b", 1e-3), ("c", 1e-6))}
    wires = {"x": ["a.flange_b", "b.flange_a"], "y": ["b.flange_b", "c.flange_a"]}
    assert drive_notes(Assembly("drive", parts=parts, connect=wires)) == []


def test_a_signal_that_nothing_reads_is_noticed() -> None:
    parts = {"motor": ConstantTorque(tau_constant=1), "J": Inertia(J=1), "law": Ramp(height=1, duration=1)}
    wires = {"a": ["motor.flange", "J.flange_a"]}
    assert drive_notes(Assembly("drive", parts=parts, connect=wires)) == [
        "Nothing reads law.y: connect it, or leave law out."
    ]


def clutched(force: float | None, kind: type = Clutch) -> Assembly:
    parts = {"motor": ConstantTorque(tau_constant=1), "J": Inertia(J=1), "it": kind(capacity=10.0)}
    wires = {"a": ["motor.flange", "J.flange_a"], "b": ["J.flange_b", "it.flange_a"]}
    if kind is Clutch:
        parts["wall"] = Fixed()
        wires["c"] = ["it.flange_b", "wall.flange"]
    if force is not None:
        parts["force"] = Constant(k=force)
        wires["u"] = ["force.y", "it.f_normalized"]
    return Assembly("drive", parts=parts, connect=wires)


@pytest.mark.parametrize(("force", "kind", "expected"), [
    (0.0, Clutch, ["it never engages: its input is 0 during the whole run."]),
    (1.0, Clutch, []),
    (None, Brake, ["it holds during the whole run: nothing drives it.f_normalized, which is 1 by default."]),
    (1.0, Brake, []),
])  # fmt: skip
def test_clutches_and_brakes_that_do_nothing_are_noticed(force: float | None, kind: type, expected: list[str]) -> None:
    drive = clutched(force, kind)
    assert run_notes(drive, simulate(drive, 1.0, start="rest")) == expected


@pytest.mark.parametrize(("frequency", "notes"), [(5.0, 1), (5.3, 1), (7.0, 0)])
def test_an_excitation_near_an_eigenfrequency_is_noticed(frequency: float, notes: int) -> None:
    # f = sqrt(c/J)/2pi = 5 Hz
    c = (2 * 3.141592653589793 * 5.0) ** 2
    parts = {
        "law": Sine(amplitude=1, f=frequency), "motor": Torque(), "J": Inertia(J=1), "shaft": Spring(c=c),
        "wall": Fixed(),
    }  # fmt: skip
    wires = {
        "u": ["law.y", "motor.tau"], "a": ["motor.flange", "J.flange_a"], "b": ["J.flange_b", "shaft.flange_a"],
        "c": ["shaft.flange_b", "wall.flange"],
    }  # fmt: skip
    drive = Assembly("drive", parts=parts, connect=wires)
    found = run_notes(drive, simulate(drive, 0.1, start="rest"))
    assert len(found) == notes
    assert [one.partition(" is ")[2] for one in found] == [
        "near the natural frequency 5 Hz, whose damping is 0: expect resonance."
    ] * notes


def hoist(force: float) -> Assembly:
    parts = {"pull": ConstantForce(f_constant=force), "load": Mass(m=10.0, angle="90 deg", s=0.0, v=0.0)}
    return Assembly("drive", parts=parts, connect={"a": ["pull.flange", "load.flange_a"]})


def test_a_weight_that_drives_is_noticed() -> None:
    # a = 80/10 - g, and after one second s = a/2
    fallen = 10 * 9.80665 * (9.80665 - 8.0) / 2
    found = run_notes(hoist(80.0), simulate(hoist(80.0), 1.0))
    assert found == [
        f"The weight of load (98.07 N) falls and brings in {fallen:.4g} J, all sources together 0 J: gravity drives. "
        f"If it should be lifted, look at the signs."
    ]
    assert run_notes(hoist(120.0), simulate(hoist(120.0), 1.0)) == [], "it is lifted"


def test_a_load_that_pushes_is_noticed() -> None:
    drive = load(EXAMPLES / "machine_table_direct.toml")
    assert run_notes(drive, simulate(drive)) == []
    drive.set("load_torque", "-15 N.m")
    drive.set("clutch_torque", "80 N.m")
    assert run_notes(drive, simulate(drive)) == [
        "motor and load bring energy into one chain of shafts, and nothing takes it out: is the sign of one of them "
        "wrong?"
    ]


class Grinder(Inertia):
    """A wheel that bursts at 100 rad/s."""

    rim: Variable = var("rad/s", "speed of the rim", max=100.0)

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.rim == self.w


@pytest.mark.parametrize(("ratio", "notes"), [(1.0, 0), (0.25, 1)])
def test_a_gear_that_makes_a_load_too_fast_is_noticed(ratio: float, notes: int) -> None:
    parts = {"motor": ConstantSpeed(w_fixed=50.0), "gear": IdealGear(ratio=ratio), "wheel": Grinder(J=1.0)}
    drive = Assembly("drive", parts=parts, series={"drive": [*parts]})
    found = run_notes(drive, simulate(drive, 1.0, start="rest"))
    told = "wheel.rim exceeds its declared bound 100 rad/s: it is 200 rad/s at 0 s."
    assert found == [told] * notes


def test_a_bound_exceeded_between_the_results_is_noticed() -> None:
    """-6 rad cos(20/s t) has 120 rad/s at a quarter of its period; the wheel is at rest at all three results."""
    parts = {"wall": Fixed(), "spring": Spring(c=2e3), "wheel": Grinder(J=5.0, phi=-6.0, w=0.0)}
    drive = Assembly("drive", parts=parts, series={"drive": [*parts]})
    run = simulate(drive, math.pi / 10, points=2)
    (note,) = run_notes(drive, run)
    assert note.startswith("wheel.rim exceeds its declared bound 100 rad/s: it is 120 rad/s at 0.0785")
    run.dense = None
    assert run_notes(drive, run) == []


def test_commands_tell_them_and_go_on() -> None:
    told = called(["simulate", str(EXAMPLES / "ravigneaux.toml")])
    assert told.exit_code == 0
    assert "clutch_large, clutch_carrier and brake_carrier never engage: their inputs are 0" in told.stderr
    told = called(["check", str(EXAMPLES / "components" / "position_cascade.toml")])
    assert "Nothing reads total.y" in told.stderr


def test_a_value_without_effect_is_noticed() -> None:
    """What another value replaces, what a choice leaves out; zeros and defaults are none."""
    cells = {"ocv": ((0.0, 3.0), (1.0, 4.0)), "Q": "1 A.h"}
    cases: list[tuple[Component, list[str]]] = [
        (Battery(**cells, R_1=0.5, C_1=10.0), []),
        (PI(k=1.0, Ti=1.0, y_max=1.0, y_min=-1.0), []),
        (Clutch(capacity=10.0, fn_max=5.0), ["fn_max"]),
        (Gearbox(ratio=2.0, c=1e4, d=1.0, has_backlash=False, b=0.1), ["b"]),
        (Gearbox(ratio=2.0, c=1e4, d=1.0, b=0.1), []),
        (TimingBelt(r_a=0.1, r_b=0.1, c=1e5, d=10.0, wrap_angle=2.5), ["wrap_angle"]),
        (WormGear(z_1=2, z_2=40, gamma=0.3, mu=0.05), []),  # z_2/z_1 is the ratio, by default
        (WormGear(z_2=40, ratio=40, gamma=0.3, mu=0.05), ["z_2"]),
        (PermanentMagnetDCMachine(k=0.1, quasi_static=True, La=0.0), []),
        (PermanentMagnetDCMachine(k=0.1, quasi_static=True, La=0.1), ["La"]),
    ]
    for part, names in cases:
        drive = Assembly("drive", parts={"part": part})
        told = [note for note in drive_notes(drive) if "no effect" in note]
        assert told == [f"part.{name} has no effect: with what else is given nothing reads it." for name in names]
    inner = Assembly("inner", parts={"part": Clutch(capacity=10.0, fn_max=5.0)})
    (told,) = (note for note in drive_notes(Assembly("drive", parts={"inner": inner})) if "no effect" in note)
    assert told.startswith("inner.part.fn_max has no effect")
