"""Drives on the standard library's classes: written as Modelica text, read back, and as netlists with units."""

from pathlib import Path

import numpy as np
import pytest
from calls import called

from modelica_like import load, simulate
from modelica_like.errors import ModelicaTextError
from modelica_like.language.inside import declarations
from modelica_like.netlist import library_types, loads
from modelica_like.netlist.modelica.library import known_classes
from modelica_like.netlist.modelica.netlist_form import netlist_text
from modelica_like.netlist.modelica.read import read_modelica
from modelica_like.netlist.modelica.write import modelica_text

EXAMPLES = Path(__file__).parents[2] / "examples"
DRIVES = Path(__file__).with_name("drives.mo")
WRITTEN = [
    *(f"msl/rotational/{name}" for name in (
        "Backlash", "CoupledClutches", "EddyCurrentBrake", "First", "Friction", "GenerationOfFMUs", "LossyGearDemo3",
        "OneWayClutch", "RollingWheel", "SimpleGearShift",
    )),
    *(f"msl/translational/{name}" for name in ("Accelerate", "Brake", "ElastoGap", "HeatLosses", "Sensors", "Vehicle")),
    "machine_table_geared", "dc_machines/shunt", "elements/absorbers",
    "msl/dcmachines/DCPM_CurrentControlled", "dc_machines/series_runaway",
]  # fmt: skip


def same(one, other, tolerance: float = 1e-9, without: tuple[str, ...] = ()) -> None:
    names = [name for name in one.names if name not in without]
    assert set(names) <= set(other.names)
    assert one.time == pytest.approx(other.time, abs=1e-9)
    for name in names:
        size = max(np.abs(one[name]).max(), 1e-6)
        assert np.abs(one[name] - other[name]).max() < tolerance * size, name


@pytest.mark.parametrize("name", WRITTEN)
def test_a_drive_written_and_read_back_moves_the_same(name: str, tmp_path: Path) -> None:
    drive = load(EXAMPLES / f"{name}.toml")
    (tmp_path / "drive.mo").write_text(modelica_text(drive))
    start = drive.simulate.get("start", "given")
    read = simulate(load(tmp_path / "drive.mo"), start=start, points=50)
    # Adaptors are written out, and what drives no input of theirs is a parameter there.
    inputs = tuple(f"angleToTorque{end}.{name}" for end in ("2a", "2b", "3a", "3b") for name in ("w", "a"))
    same(simulate(drive, points=50), read, without=inputs)


def netlist(name: str) -> tuple[str, list[str]]:
    model, notes = read_modelica(DRIVES, name)
    return netlist_text(model, DRIVES.parent, notes), notes


@pytest.mark.parametrize("name", ["TwoMasses", "Modified"])
def test_a_text_becomes_a_netlist_with_units(name: str) -> None:
    text, notes = netlist(name)
    assert notes[0] == "a, power: left out, because a netlist has no equations."
    assert notes[1].startswith("J = 0.1 * ratio**2.0 is the number 0.")
    assert len(notes) == 2
    same(simulate(loads(text, str(DRIVES.parent / "x.toml")), 1.5), simulate(load(f"{DRIVES}:{name}"), 1.5))


def test_the_netlist_says_what_the_text_says() -> None:
    text, _ = netlist("TwoMasses")
    for line in (
        'tau = "10 N.m"',
        "ratio = 3",
        'J = "0.9 kg.m2"',
        'step = { is = "Step", height = "tau", start_time = "0.1 s" }',
        'motor = { is = "Inertia", J = "J" }',
        'damper = { is = "Damper", d = "3 N.m.s/rad" }',
        '"motor.w" = "rpm"',
        'until = "1.5 s"',
        '"load[2].w" = "1 rad/s"',
    ):
        assert line in text, line
    assert "brake" not in text


def test_modifications_reach_all_levels() -> None:
    drive = load(f"{DRIVES}:Modified")
    assert drive.value("ratio").number == 1
    assert drive.damper.value("d").number == 5
    assert [one.value("J").number for one in drive.load] == [2, 2]
    assert [one.value("d").number for one in drive.shaft] == [0.5, 0.25]
    assert drive.display == {"motor.w": "rpm"}


def test_two_masses_obey_the_law_of_momentum() -> None:
    run = simulate(load(f"{DRIVES}:TwoMasses"), rtol=1e-10, atol=1e-12)
    momentum = 0.9 * run["motor.w"] + run["load[1].w"] + run["load[2].w"]
    torque = run["torque.tau"] - 3 * run["load[2].w"]
    change = np.concatenate([[0], np.cumsum(np.diff(run.time) * (torque[1:] + torque[:-1]) / 2)])
    assert momentum == pytest.approx(2.9 + change, abs=2e-3)
    assert 0.9 * run["a"] == pytest.approx(run["motor.flange_a.tau"] + run["motor.flange_b.tau"])
    assert run["power"] == pytest.approx(run["torque.flange.tau"] * run["motor.w"])


def test_every_class_of_the_table_has_its_component_with_its_names() -> None:
    for known in known_classes().values():
        kind = library_types()[known.component]
        names = {*declarations(kind).fields, *declarations(kind).structural, *declarations(kind).connectors}
        assert {*known.set, *known.fix} <= names, known.path
        own = {here for here in known.names if here in names}
        assert len({known.names[here] for here in own}) == len(own), known.path
        for here in own:
            assert known.here(known.there(here)) == here, known.path


def test_tables_that_hold_are_written_with_a_row_more(tmp_path: Path) -> None:
    drive = loads("""
    [parts]
    rotor = { is = "Inertia", J = 1 }
    bearing = { is = "BearingFriction", tau_pos = [[0, 1], [2, 3]] }
    [series]
    shaft = ["rotor", "bearing"]
    [start]
    "rotor.phi" = 0
    "rotor.w" = 10
    [simulate]
    until = "2 s"
    """)
    text = modelica_text(drive)
    assert "tau_pos = [0, 1; 2, 3; 4, 3]" in text
    (tmp_path / "drive.mo").write_text(text)
    # The row more is beyond the range, so the text does not say when that is left.
    same(simulate(drive), simulate(load(tmp_path / "drive.mo")), without=("bearing.range",))


def test_a_clutch_with_a_capacity_is_one_with_a_force() -> None:
    drive = loads("""
    [parts]
    a = { is = "Inertia", J = 1 }
    k = { is = "Clutch", capacity = "80 N.m", peak = 1.2 }
    b = { is = "Inertia", J = 1 }
    [series]
    shaft = ["a", "k", "b"]
    """)
    clutch = "Components.Clutch k(fn_max = 80, cgeo = 1, mu_pos = [0, 1], peak = 1.2, f_normalized = 1)"
    assert clutch in modelica_text(drive)


@pytest.mark.parametrize(
    ("part", "message"),
    [
        ('{ is = "Mass", m = 1, angle = "90 deg" }', "hook.angle = 90 deg has no counterpart in Modelica.Mechanics."),
        (
            '{ is = "Freewheel" }',
            "hook is a Freewheel, for which the Modelica Standard Library has no class, and it has",
        ),
    ],
)
def test_what_has_no_counterpart_is_refused(part: str, message: str) -> None:
    with pytest.raises(ModelicaTextError) as caught:
        modelica_text(loads(f"[parts]\nhook = {part}\n"))
    assert str(caught.value).startswith(message)
    assert "netlist.toml:2" in str(caught.value)


def test_equations_of_its_own_do_not_fit_into_a_netlist() -> None:
    with pytest.raises(ModelicaTextError, match="Thermostat has equations of its own"):
        netlist("Thermostat")


def test_the_commands(tmp_path: Path) -> None:
    made = tmp_path / "drive.toml"
    calls = [
        ["from-modelica", str(DRIVES), "--class", "TwoMasses", "-o", str(made)],
        ["check", str(made)],
        ["to-modelica", str(made)],
        ["check", str(tmp_path / "drive.mo")],
    ]
    for words in calls:
        result = called(words)
        assert result.exit_code == 0, result.stdout + result.stderr
    assert "model Drive" in (tmp_path / "drive.mo").read_text()


MACHINES = Path(__file__).with_name("machines.mo")


def test_a_machine_with_a_record_of_its_data_is_the_netlist() -> None:
    drive = load(f"{MACHINES}:Start")
    assert drive.dcpm.value("P_friction").number is None  # a formula: the record can be tuned
    run, reference = simulate(drive), simulate(load(EXAMPLES / "msl" / "dcmachines" / "DCPM_Start.toml"))
    for name in ("dcpm.ia", "dcpm.w", "dcpm.tau_electrical"):
        size = np.abs(reference[name]).max()
        assert np.interp(reference.time, run.time, run[name]) == pytest.approx(reference[name], abs=1e-6 * size), name


def test_a_parameter_chooses_the_kind_of_controller() -> None:
    drive = load(f"{MACHINES}:Controlled")
    assert type(drive.control).__name__ == "PI"
    assert drive.control.value("y_min").formula is None
    assert drive.control.value("y_min").number == -12
    assert simulate(drive).final["inertia.w"] == pytest.approx(10, abs=0.1)
