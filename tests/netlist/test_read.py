"""What a netlist means: the tree it becomes."""

import math
from math import exp
from pathlib import Path

import pytest

from components import Clutch, IdealGear, Inertia, Mass
from modelica_like import build, simulate
from modelica_like.errors import CyclicAssembly, NetlistError, UnknownName, WiringErrors
from modelica_like.flatten import flatten
from modelica_like.language import Assembly
from modelica_like.native.start import initialize
from modelica_like.netlist import dumps, load, loads
from modelica_like.show.draw.diagram import diagram

DRIVE = """
name = "drive"
description = "Two masses"

[parameters]
inertia = "2 kg.m2"

[parts]
motor = { is = "Inertia", J = "inertia / 2", w = "600 rpm" }
gear = { is = "IdealGear", ratio = 3 }
loads = { is = "Inertia", count = 2, J = 0.5 }

[series]
shaft = ["motor", "gear"]

[connect]
out = ["gear.flange_b", "loads[1].flange_a"]

[start]
"loads[2].w" = "10 rad/s"
motor.phi = "90 deg"

[guess]
"loads[1].w" = 1

[simulate]
until = "2 s"
rtol = 1e-8
"""


@pytest.fixture
def drive() -> Assembly:
    return loads(DRIVE)


def test_parts_have_types_and_values(drive: Assembly) -> None:
    assert list(drive.parts) == ["motor", "gear", "loads[1]", "loads[2]"]
    assert isinstance(drive.find("gear"), IdealGear)
    assert isinstance(drive.find("loads[2]"), Inertia)
    assert drive.find("gear").value("ratio").number == 3
    assert str(drive.find("motor").value("J").formula) == "inertia / 2.0"


def test_start_values_stand_in_the_part_or_in_start(drive: Assembly) -> None:
    assert math.isclose(drive.find("motor").start("w").number, 20 * math.pi)
    assert math.isclose(drive.find("motor").start("phi").number, math.pi / 2)
    assert drive.find("loads[2]").start("w").number == 10
    assert drive.find("loads[1]").start("w").fixed is False
    assert drive.find("loads[2]").start("phi") is None


def test_wires_options_and_places_are_kept(drive: Assembly) -> None:
    assert drive.wires == {"out": ("gear.flange_b", "loads[1].flange_a")}
    assert drive.chains == {"shaft": ("motor", "gear")}
    assert drive.simulate == {"until": "2 s", "rtol": 1e-8}
    assert drive.source_of("connect.out").line == 17
    assert len(list(drive.equations())) == 2


def test_a_file_is_the_same_as_its_text(tmp_path: Path, drive: Assembly) -> None:
    path = tmp_path / "drive.toml"
    path.write_text("\ufeff" + DRIVE.replace("\n", "\r\n"), encoding="utf-8")
    assert [repr(part) for part in load(path).walk()] == [repr(part) for part in drive.walk()]


def test_the_name_is_that_of_the_file_if_none_is_given(tmp_path: Path) -> None:
    (tmp_path / "shaft.toml").write_text('[parts]\na = { is = "Inertia", J = 1 }\n')
    assert load(tmp_path / "shaft.toml").label == "shaft"


def test_a_part_may_stand_in_a_table_of_its_own() -> None:
    assembly = loads(
        '[parts.motor]\nis = "Inertia"\nJ = "1 kg.m2"\n[[parts.row]]\nis = "Inertia"\n[[parts.row]]\nis = "Mass"\n'
    )
    assert [type(part) for part in assembly.parts.values()] == [Inertia, Inertia, Mass]
    assert list(assembly.parts) == ["motor", "row[1]", "row[2]"]


def test_a_mode_has_a_start() -> None:
    assembly = loads('[parts]\nk = { is = "Clutch", capacity = 10 }\n[start]\n"k.mode" = "free"\n')
    clutch = assembly.find("k")
    assert isinstance(clutch, Clutch)
    assert clutch.start_mode("mode") == "free"


def test_a_class_of_a_module_is_a_type() -> None:
    assert isinstance(loads('[parts]\na = { is = "components.inertias:Inertia", J = 1 }\n').find("a"), Inertia)


# --- netlists as parts ----------------------------------------------------------------------------------------------

GEARBOX = """
[parameters]
ratio = 4
[parts]
gear = { is = "IdealGear", ratio = "ratio" }
shaft = { is = "Inertia", J = "0.1 kg.m2" }
[series]
shafts = ["gear", "shaft"]
[expose]
input = "gear.flange_a"
output = "shaft.flange_b"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "gears").mkdir()
    (tmp_path / "gears" / "gearbox.toml").write_text(GEARBOX)
    return tmp_path


def test_a_netlist_is_a_part_with_parameters_and_inner_values(folder: Path) -> None:
    text = (
        '[parts]\nbox = { is = "./gears/gearbox.toml", ratio = 5, shaft.J = "0.2 kg.m2", "gear.ratio" = "2 * ratio" }\n'
    )
    (folder / "drive.toml").write_text(text + 'other = { is = "gears/gearbox.toml" }\n')
    drive = load(folder / "drive.toml")
    assert drive.find("box").value("ratio").number == 5
    assert drive.find("box.shaft").value("J").number == 0.2
    assert str(drive.find("box.gear").value("ratio").formula) == "2.0 * ratio"
    assert drive.find("other").value("ratio").number == 4
    assert drive.find("other.shaft").value("J").number == 0.1
    assert list(drive.find("box").connectors) == ["input", "output"]


def test_errors_inside_keep_their_own_place(folder: Path) -> None:
    (folder / "gears" / "gearbox.toml").write_text(GEARBOX.replace("0.1 kg.m2", "0.1 kg").replace("IdealGear", "Gear"))
    (folder / "drive.toml").write_text('[parts]\nbox = { is = "./gears/gearbox.toml" }\nx = { is = "Y" }\n')
    with pytest.raises(WiringErrors) as caught:
        load(folder / "drive.toml")
    places = [(Path(error.where[0].file).name, error.where[0].line) for error in caught.value.errors]
    assert places == [("gearbox.toml", 5), ("gearbox.toml", 6), ("drive.toml", 3)]


def test_a_circle_of_netlists_is_told_with_its_files(tmp_path: Path) -> None:
    for name, other in (("a", "b"), ("b", "c"), ("c", "a")):
        (tmp_path / f"{name}.toml").write_text(f'[parts]\nx = {{ is = "./{other}.toml" }}\n')
    with pytest.raises(CyclicAssembly) as caught:
        load(tmp_path / "a.toml")
    assert caught.value.what == "A netlist contains itself: a.toml contains b.toml contains c.toml contains a.toml."
    (tmp_path / "d.toml").write_text('[parts]\nx = { is = "./c.toml" }\n')
    with pytest.raises(
        CyclicAssembly, match=r"a.toml contains b.toml contains c.toml contains a.toml|c.toml contains a.toml"
    ):
        load(tmp_path / "d.toml")


def test_netlists_that_multiply_are_stopped(tmp_path: Path) -> None:
    (tmp_path / "n0.toml").write_text('[parts]\nx = { is = "Inertia", count = 100, J = 1 }\n')
    for level in range(1, 6):
        (tmp_path / f"n{level}.toml").write_text(f'[parts]\nx = {{ is = "./n{level - 1}.toml", count = 100 }}\n')
    with pytest.raises(NetlistError, match="has more than 200000 parts"):
        load(tmp_path / "n5.toml")


def test_names_are_suggested() -> None:
    with pytest.raises(UnknownName, match="did you mean 'motor'"):
        loads(DRIVE.replace("motor.phi", "motr.phi"))


def test_parts_may_be_called_like_methods(tmp_path: Path) -> None:
    """Names such as place or wires mean something in Python, not in a netlist."""
    (tmp_path / "drive.toml").write_text(
        '[parts]\nplace = { is = "Inertia", J = 1, phi = 0, w = 1 }\nexpose = { is = "Damper", d = 1, phi_rel = 0 }\n'
        'wires = { is = "Inertia", J = 1, w = 0 }\n[series]\ns = ["place", "expose", "wires"]\n'
    )
    run = simulate(tmp_path / "drive.toml", 20.0)
    assert run.final["wires.w"] == pytest.approx(0.5, rel=1e-6)


def test_a_circle_through_a_part_that_is_replaced(tmp_path: Path) -> None:
    """It ends the reading at once, though other values are read on after an error."""
    part = '{ is = "Lepelletier", nothing = 1, brake_c = { is = "./a.toml" } }'
    (tmp_path / "a.toml").write_text(f"[parts]\nx = {part}\n")
    with pytest.raises(CyclicAssembly, match=r"a\.toml contains a\.toml"):
        load(tmp_path / "a.toml")


def test_signals_leave_an_assembly(tmp_path: Path) -> None:
    """4 N.m·s·(e + ∫e) on 1 kg m²: e = (10 - 20 t)·exp(-2 t) rad/s."""
    (tmp_path / "control.toml").write_text(
        '[parts]\npi = { is = "PI", k = "2 N.m.s", Ti = "1 s" }\ntwice = { is = "Gain", k = 2 }\n'
        '[connect]\nw = ["pi.y", "twice.u"]\n[start]\n"pi.integral" = 0\n'
        '[expose]\nwanted = "pi.u_s"\nmeasured = "pi.u_m"\ntorque = "twice.y"\n'
    )
    (tmp_path / "drive.toml").write_text(
        '[parts]\ncontrol = { is = "./control.toml", wanted = "10 rad/s" }\ntorque = { is = "Torque" }\n'
        'rotor = { is = "Inertia", J = 1, phi = 0, w = 0 }\nspeed = { is = "SpeedSensor" }\n'
        '[series]\nshaft = ["torque", "rotor", "speed"]\n'
        '[connect]\ndrive = ["control.torque", "torque.tau"]\nmeasured = ["speed.w", "control.measured"]\n'
    )
    run = simulate(tmp_path / "drive.toml", 3.0, rtol=1e-9)
    assert run.final["rotor.w"] == pytest.approx(10 + 50 * exp(-6), rel=1e-7)
    assert run.final["control.torque"] == run.final["control.twice.y"]
    control = load(tmp_path / "control.toml")
    (tmp_path / "again.toml").write_text(dumps(control, folder=tmp_path))
    assert dict(load(tmp_path / "again.toml").exposed) == dict(control.exposed)
    assert {node.name for node in diagram(control, 0).nodes} >= {"wanted", "measured", "torque"}


def test_only_connectors_and_signals_leave_an_assembly(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text('[parts]\na = { is = "Inertia", J = 1 }\n[expose]\nx = "a.w"\n')
    with pytest.raises(UnknownName, match=r"has no connector 'a\.w'"):
        load(tmp_path / "bad.toml")


BOX = """
[parameters]
J = "2 kg.m2"
i = 3
J_out = "J * i**2"
[parts]
a = { is = "Inertia", J = "J" }
b = { is = "Inertia", J = "J_out" }
[series]
x = ["a", "b"]
[expose]
flange_a = "a.flange_a"
"""
BENCH = """
[parameters]
i = 7
[parts]
t = { is = "Torque", tau = 0 }
q = { is = "./box.toml", i = "i - 2", a.J = "i * 1 kg.m2", b = { J = "i * J" } }
[series]
x = ["t", "q"]
[start]
"q.a.w" = "i * 1 rad/s"
"q.b.phi" = "J_out * 1 rad / J"
"""


def test_names_are_those_of_the_file_where_a_formula_stands(tmp_path: Path) -> None:
    (tmp_path / "box.toml").write_text(BOX)
    drive = loads(BENCH, file=str(tmp_path / "bench.toml"))
    found = {parameter.path: parameter.value for parameter in flatten(drive).derived}
    # i is 7 in the bench and 5 in the box; only the box has J = 2 kg.m2 and J_out = 2*5**2 kg.m2.
    assert found["q.i"] == 5.0
    assert found["q.a.J"] == 7.0
    assert found["q.b.J"] == 7.0 * 2.0
    model = build(drive)
    assert dict(zip(model.states, initialize(model).x, strict=True)) == {"t.phi": 2 * 5**2 / 2, "q.a.w": 7.0}


def test_a_path_that_is_set_names_what_it_begins_at(tmp_path: Path) -> None:
    (tmp_path / "box.toml").write_text(BOX)
    drive = loads(BENCH, file=str(tmp_path / "bench.toml"))
    drive.set("q.a.J", "2 * i * 1 kg.m2")
    drive.find("q").set("b.J", "2 * i * 1 kg.m2")
    found = {parameter.path: parameter.value for parameter in flatten(drive).derived}
    assert (found["q.a.J"], found["q.b.J"]) == (2 * 7.0, 2 * 5.0)
