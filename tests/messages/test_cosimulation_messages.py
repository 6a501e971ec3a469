"""Every message of splitting and of co-simulation, as its reader sees it."""

import json
import zipfile
from pathlib import Path
from typing import Any

import pytest

from modelica_like.errors import ModelicaLikeError
from modelica_like.fmi.cosimulation.cut import cut_netlist
from modelica_like.fmi.cosimulation.files import load_system
from modelica_like.fmi.cosimulation.run import cosim, tell_error
from modelica_like.fmi.cosimulation.split import split
from modelica_like.fmi.cosimulation.system import Link, Port, Settings, System, Unit, check_system
from modelica_like.language import Assembly
from modelica_like.netlist import loads

J = '{ is = "Inertia", J = 1 }'
SHAFT = '{ is = "SpringDamper", c = 1, d = 1 }'
PARTS = {"J1": J, "shaft": SHAFT, "J2": J}
STARTS = '[start]\n"J1.phi" = 0\n"J1.w" = 0\n"shaft.phi_rel" = 0\n"shaft.w_rel" = 0'
CHAIN = '[series]\nmain = ["J1", "shaft", "J2"]'
PLACES = (
    "A name is a part (it is cut behind it), one of its ends (shaft.flange_a), or an entry of [connect].\n"
    "It can be cut at J1, shaft, J2, as in --at J1."
)
WHERE_TO_CUT = "Cut where a spring or damper on one side meets an inertia on the other."


def netlist(parts: dict[str, str], wires: str = CHAIN, before: str = "") -> Assembly:
    declared = "\n".join(f"{name} = {entry}" for name, entry in parts.items())
    return loads(f'name = "drive"\n{before}\n[parts]\n{declared}\n{wires}', "drive.toml")


DRIVE = netlist(PARTS)
TWO_WAYS = netlist({**PARTS, "other": SHAFT}, f'{CHAIN}\nmore = ["J1", "other", "J2"]')
NODE = netlist(
    {**PARTS, "d": SHAFT},
    '[connect]\nx = ["J1.flange_b", "shaft.flange_a", "d.flange_a"]\ny = ["shaft.flange_b", "J2.flange_a"]',
)
DIRECT = netlist({"J": '{ is = "Inertia", J = 1, count = 2 }'}, '[connect]\na = ["J[1].flange_b", "J[2].flange_a"]')
ENGAGED = netlist(
    {"force": '{ is = "Constant", k = 1 }', "clutch": '{ is = "Clutch", fn_max = 1 }', "J1": J, "J2": J},
    '[connect]\nengage = ["force.y", "clutch.f_normalized"]\n[series]\nmain = ["J1", "clutch", "J2"]',
)
METER = netlist(
    {"meter": '{ is = "VoltageSensor" }', "source": '{ is = "ConstantVoltage", V = 1 }'},
    '[connect]\na = ["meter.p", "source.p"]\nb = ["meter.n", "source.n"]',
)

CUTS: dict[str, tuple[Assembly, list[str], str]] = {
    "nothing": (DRIVE, [], "drive: it is not said where to cut.\nIt can be cut at J1, shaft, J2, as in --at J1."),
    "nothing, with signals": (
        ENGAGED, [], "drive: it is not said where to cut.\nIt can be cut at clutch, J1, J2, as in --at clutch.",
    ),
    "unknown": (DRIVE, ["shft"], f"drive has no shaft 'shft'; did you mean 'shaft'?\n{PLACES}"),
    "free end": (DRIVE, ["J2.flange_b"], f"drive has no shaft 'J2.flange_b'; did you mean 'J2.flange_a'?\n{PLACES}"),
    "series": (
        DRIVE, ["main"],
        "main is a whole series: J1, shaft, J2.\n"
        '  in drive.toml:8 `main = ["J1", "shaft", "J2"]`\nName the part behind which to cut.',
    ),
    "inside": (
        DRIVE, ["J1.flange_b.phi"],
        "J1.flange_b.phi is inside J1; only connections of the netlist itself can be cut.\n"
        "Split J1's own netlist, or cut at one of its ends.",
    ),
    "node": (
        NODE, ["x"],
        "x joins 3 ends: J1.flange_b, shaft.flange_a, d.flange_a.\n"
        '  in drive.toml:9 `x = ["J1.flange_b", "shaft.flange_a", "d.flange_a"]`\nName the end to cut off.',
    ),
    "unclear": (METER, ["meter"], "It is not clear where to cut meter.\nName an end: meter.p, meter.n."),
    "another way": (
        TWO_WAYS, ["shaft"],
        "drive does not separate between shaft.flange_b and J2.flange_a.\n"
        '  in drive.toml:9 `main = ["J1", "shaft", "J2"]`\n'
        "shaft and J2 are also joined by shaft – other – J2.\nCut there as well: --at can be given several times.",
    ),
    "default": (
        ENGAGED, ["engage"],
        "clutch.f_normalized has a default value, so it does not become an input of an FMU.\n"
        "Cut at a shaft, or at a signal whose inputs have no default.",
    ),
    "array": (
        DIRECT, ["J[1]"],
        "J[1].flange_b is inside the array J, which cannot be cut.\n"
        '  in drive.toml:6 `a = ["J[1].flange_b", "J[2].flange_a"]`',
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CUTS)
def test_a_place_that_cannot_be_cut(case: str) -> None:
    drive, at, sentence = CUTS[case]
    with pytest.raises(ModelicaLikeError) as told:
        cut_netlist(drive, at)
    assert str(told.value) == sentence


SPLITS: dict[str, tuple[Assembly, list[str], dict[str, Any], str]] = {
    "rigid": (
        netlist({"J1": J, "J2": J}, '[series]\nmain = ["J1", "J2"]'), ["J1"], {},
        "J1: neither side of the cut can take the motion while the other takes the load.\n"
        '  in drive.toml:7 `main = ["J1", "J2"]`\n'
        "J1.flange_b is rigid: its tau would depend on the acceleration; "
        f"J2.flange_a is rigid: its tau would depend on the acceleration.\n{WHERE_TO_CUT}",
    ),
    "without inertia": (
        netlist({"J1": J, "a": SHAFT, "b": SHAFT, "J2": J}, '[series]\nmain = ["J1", "a", "b", "J2"]'), ["a"], {},
        "a: neither side of the cut can take the motion while the other takes the load.\n"
        '  in drive.toml:9 `main = ["J1", "a", "b", "J2"]`\n'
        "b.flange_a stores no energy: its phi would depend directly on tau; "
        f"a.flange_b stores no energy: its phi would depend directly on tau.\n{WHERE_TO_CUT}",
    ),
    "exclusive": (
        netlist({"J1": J, "gear": '{ is = "IdealGear", ratio = 2 }', "J2": J}, '[series]\nmain = ["J1", "gear", "J2"]'),
        ["J1", "gear"], {}, "The cuts exclude each other.\nCut at fewer shafts, or at others.",
    ),
    "formula": (
        netlist({**PARTS, "shaft": SHAFT.replace("c = 1", 'c = "2*J2.J"')}, f"{CHAIN}\n{STARTS}"), ["shaft"], {},
        "A formula needs J2.J, which the cut puts into another FMU.\nIt is in one of J1, shaft.\n"
        "Give both parts a parameter of the netlist: [parameters].",
    ),
    "few names": (DRIVE, ["shaft"], {"names": ["a"]}, "There are 2 FMUs, but 1 name.\nThey are: J1, shaft; J2."),
    "no name": (
        DRIVE, ["shaft"], {"names": ["a", "b.c"]}, "'b.c' is not a name for an FMU: use letters, digits and _.",
    ),
    "one name": (DRIVE, ["shaft"], {"names": ["a", "a"]}, "Two FMUs cannot have the same name: a, a."),
    "master": (
        DRIVE, ["shaft"], {"master": "jakobi"},
        "There is no master 'jakobi'; did you mean 'jacobi'?\nThere are jacobi and gauss-seidel.",
    ),
    "step": (
        DRIVE, ["shaft"], {"step": "1 m"},
        "step expects s; '1 m' is m.\nGive seconds or a time, e.g. step=\"2 s\".",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", SPLITS)
def test_a_drive_that_cannot_be_split(case: str, tmp_path: Path) -> None:
    drive, at, options, sentence = SPLITS[case]
    with pytest.raises(ModelicaLikeError) as told:
        split(drive, at, tmp_path / "new", **options)
    assert str(told.value) == sentence
    assert not (tmp_path / "new").exists()


def test_too_many_cuts(tmp_path: Path) -> None:
    parts = {f"{kind}{k}": {"J": J, "s": SHAFT}[kind] for k in range(10) for kind in "Js"}
    drive = netlist(parts, f"[series]\nmain = {list(parts)}\n")
    with pytest.raises(ModelicaLikeError) as told:
        split(drive, [f"s{k}" for k in range(9)], tmp_path)
    assert str(told.value) == "9 cuts at once are too many; 8 are possible."


GOOD = '[fmus]\na = "a.fmu"\nb = { file = "b.fmu" }\n[connect]\ntau = ["a.tau", "b.tau"]\nw = ["b.w", "a.w"]\n'
FILES: dict[str, tuple[str, str]] = {
    "no TOML": ("x = ", "'bench.toml' is not TOML: invalid value.\n  in bench.toml:1 `x =`"),
    "entry": (
        "parts = 1\nfmus = {}",
        "A system has no entry 'parts'. It has name, own_names, fmus, connect, bonds, simulate.\n"
        "  in bench.toml:1 `parts = 1`",
    ),
    "empty": ("[fmus]", "bench has no FMU.\nDeclare them in [fmus]."),
    "section": ("fmus = 3", "fmus must be a table: [fmus].\n  in bench.toml:1 `fmus = 3`"),
    "fmu": (
        "fmus.a = 3",
        'fmus.a must be a table: { file = "a.fmu" }, optionally with `parameters`.\n'
        "  in bench.toml:1 `fmus.a = 3`",
    ),
    "fmu's name": (
        'fmus."b c" = "x.fmu"',
        "fmus.b c: the name of an FMU must be a word: letters, digits and _.\n"
        "  in bench.toml:1 `fmus.\"b c\" = \"x.fmu\"`",
    ),
    "parameters": (
        'fmus.a = { file = "a.fmu", parameters = { m = "2 kg" } }',
        "fmus.a.parameters must be a table of numbers, in the FMU's units.\n"
        '  in bench.toml:1 `fmus.a = { file = "a.fmu", parameters = { m = "2 kg" } }`',
    ),
    "connection": (
        GOOD + 'e = ["a.phi"]',
        "connect.e must be a list of an output and the inputs that take it.\n  in bench.toml:7 `e = [\"a.phi\"]`\n"
        'Write the FMU and its variable: ["motor.flange.tau", "load.tau"].',
    ),
    "bond": (
        GOOD + '[bonds]\nshaft = "tau"',
        "bonds.shaft must be a list of two connections, whose product is a power.\n"
        '  in bench.toml:8 `shaft = "tau"`\n'
        "First that of the torque, force or current, then that of the speed, velocity or potential.",
    ),
    "option": (
        GOOD + "[simulate]\nuntl = 1",
        "[simulate] has no 'untl'; did you mean 'until'? It has until, step, master, inputs, tolerance.\n"
        "  in bench.toml:8 `untl = 1`",
    ),
    "options": ("simulate = 3\n" + GOOD, "simulate must be a table: [simulate].\n  in bench.toml:1 `simulate = 3`"),
    "master": (
        GOOD + '[simulate]\nmaster = "jakobi"',
        "simulate.master = 'jakobi' must be jacobi or gauss-seidel.\n  in bench.toml:8 `master = \"jakobi\"`",
    ),
    "negative": (
        GOOD + '[simulate]\nstep = "-1 s"',
        "simulate.step = -1 s must be positive.\n  in bench.toml:8 `step = \"-1 s\"`",
    ),
    "unit": (
        GOOD + '[simulate]\nstep = "1 m"', "simulate.step expects s; '1 m' is m.\n  in bench.toml:8 `step = \"1 m\"`",
    ),
    "tolerance": (
        GOOD + "[simulate]\ntolerance = 3",
        "simulate.tolerance = 3 must be a number from 1e-12 to 0.1.\n  in bench.toml:8 `tolerance = 3`",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", FILES)
def test_a_system_file_with_a_mistake(case: str, tmp_path: Path) -> None:
    text, sentence = FILES[case]
    file = tmp_path / "bench.toml"
    file.write_text(text)
    with pytest.raises(ModelicaLikeError) as told:
        load_system(file, tmp_path)
    assert str(told.value) == sentence


def test_a_system_file_that_connects_different_quantities(tmp_path: Path) -> None:
    units = (
        '<Unit name="N.m"><BaseUnit kg="1" m="2" s="-2"/></Unit><Unit name="rad/s"><BaseUnit s="-1" rad="1"/></Unit>'
    )
    variables = (
        '<ScalarVariable name="w" valueReference="1" causality="output"><Real unit="rad/s"/></ScalarVariable>'
        '<ScalarVariable name="tau" valueReference="2" causality="input"><Real unit="N.m" start="0"/></ScalarVariable>'
    )
    with zipfile.ZipFile(tmp_path / "a.fmu", "w") as archive:
        archive.writestr(
            "modelDescription.xml",
            '<fmiModelDescription fmiVersion="2.0" modelName="m" guid="1"><CoSimulation modelIdentifier="m"/>'
            f"<UnitDefinitions>{units}</UnitDefinitions><ModelVariables>{variables}</ModelVariables>"
            "<ModelStructure/></fmiModelDescription>",
        )
    file = tmp_path / "bench.toml"
    file.write_text('fmus.a = "a.fmu"\nfmus.b = "a.fmu"\n[connect]\nx = ["a.w", "b.tau"]\n')
    with pytest.raises(ModelicaLikeError) as told:
        load_system(file, tmp_path)
    assert str(told.value) == (
        "b.tau and a.w are different quantities: their units are N.m and rad/s.\n"
        '  in bench.toml:4 `x = ["a.w", "b.tau"]`\n'
        "Connect an input with an output of the same quantity."
    )


TAU = Link("tau", Port("a", "tau"), (Port("b", "tau"),))
UNITS = (Unit("a", Path("a.fmu")), Unit("b", Path("b.fmu")))
SYSTEMS: dict[str, tuple[System, str]] = {
    "unknown FMU": (
        System("bench", UNITS, (Link("tau", Port("aa", "tau"), (Port("b", "tau"),)),)),
        "bench has no FMU 'aa'; did you mean 'a'?",
    ),
    "driven twice": (
        System("bench", UNITS, (TAU, Link("more", Port("a", "w"), (Port("b", "tau"),)))),
        "bench: b.tau is driven twice, by tau and more.",
    ),
}


@pytest.mark.parametrize("case", SYSTEMS)
def test_a_system_that_cannot_be(case: str) -> None:
    system, sentence = SYSTEMS[case]
    with pytest.raises(ModelicaLikeError) as told:
        check_system(system)
    assert str(told.value) == sentence


BENCH = System("bench", UNITS, (TAU,), settings=Settings(until=1.0))
OPTIONS: dict[str, tuple[dict[str, Any], str]] = {
    "end": ({"until": "-1 s"}, "The end time must be positive, not -1 s."),
    "step": ({"step": 0.0}, "The step must be positive, not 0 s."),
    "tolerance": ({"tolerance": 1.0}, "tolerance = 1 must be a number from 1e-12 to 0.1."),
    "timeout": ({"timeout": 0.0}, "bench: the time limit must be positive, not 0 s."),
    "inputs": ({"inputs": "cubic"}, "There is no way to give inputs 'cubic'.\nThere are hold and linear."),
    "parameter": ({"parameters": {"c.m": 1.0}}, "bench has no FMU 'c'."),
}


@pytest.mark.parametrize("case", OPTIONS)
def test_a_run_that_makes_no_sense(case: str) -> None:
    options, sentence = OPTIONS[case]
    with pytest.raises(ModelicaLikeError) as told:
        cosim(BENCH, **options)
    assert str(told.value) == sentence


def test_no_end_time() -> None:
    with pytest.raises(ModelicaLikeError) as told:
        cosim(System("bench", UNITS, (TAU,)))
    assert str(told.value) == (
        "bench: there is no end time.\nGive `until`, or put it under [simulate] in the system's file."
    )


FAILURES: dict[str, tuple[dict[str, Any], str]] = {
    "unknown": (
        {"kind": "unknown", "unit": "a", "name": "tua", "known": ["tau"]},
        "a (a.fmu) has no variable 'tua'; did you mean 'tau'?",
    ),
    "no output": (
        {"kind": "no output", "name": "*.v", "known": ["a.w"]}, "bench has no variable '*.v'.",
    ),
    "no input": (
        {"kind": "no input", "unit": "b", "name": "w", "causality": "output", "known": ["tau"]},
        "b (b.fmu): 'w' is not an input but an output. It has tau.",
    ),
    "no input at all": (
        {"kind": "no input", "unit": "b", "name": "w", "causality": "output", "known": []},
        "b (b.fmu): 'w' is not an input but an output. It has none.",
    ),
    "FMI 1.0": (
        {"kind": "too old", "unit": "a"},
        "a (a.fmu) is an FMU of FMI 1.0.\nCo-simulation supports FMI 2.0 and 3.0.",
    ),
    "model exchange": (
        {"kind": "no co-simulation", "unit": "a"},
        "a (a.fmu) has no Co-Simulation part.\nExport it as a Co-Simulation FMU.",
    ),
    "no rollback": (
        {"kind": "no rollback", "unit": "a"},
        "a (a.fmu) cannot restore a saved state, or cannot take steps of any length, so the step cannot vary.\n"
        "It needs both canGetAndSetFMUState and canHandleVariableCommunicationStepSize.\n"
        "Run with a fixed step, without tolerance.",
    ),
    "loop": (
        {"kind": "not settled", "unit": "a", "name": "tau", "time": 0.25},
        "a (a.fmu): tau does not settle at t = 0.25 s when inputs follow outputs.\n"
        "bench has an algebraic loop: the output depends directly on inputs that depend directly on this output.\n"
        "Cut where a mass, a spring or a controller with a state is between the FMUs.",
    ),
    "no number": (
        {"kind": "not finite", "unit": "a", "name": "tau", "time": 0.25},
        "a (a.fmu): tau is not finite at t = 0.25 s.\n"
        "If the values before it grow without bounds, choose a shorter step.",
    ),
    "unstable": (
        {"kind": "unstable", "bond": "shaft", "time": 0.25, "size": 0.03},
        "bench: at t = 0.25 s the energy that the coupling shaft makes grows without bounds.\n"
        "The values that the FMUs exchange swing against each other: the step of 0.03 s is too long.\n"
        "Choose a shorter step, or give a tolerance.",
    ),
    "step": (
        {"kind": "step", "time": 0.25},
        "bench: after t = 0.25 s no step is short enough for the tolerance of the coupling.\n"
        "Give a larger tolerance, or a fixed step.",
    ),
    "failed": (
        {"kind": "failed", "unit": "a", "text": "fmi2DoStep failed.", "messages": ["giving up"]},
        "a (a.fmu) failed: fmi2DoStep failed.\nIt reported: giving up\n"
        "If the exchanged values grow without bounds, choose a shorter step.",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", FAILURES)
def test_what_stops_a_run(case: str, tmp_path: Path) -> None:
    left, sentence = FAILURES[case]
    (tmp_path / "error.json").write_text(json.dumps(left))
    with pytest.raises(ModelicaLikeError) as told:
        tell_error(BENCH, tmp_path)
    assert str(told.value) == sentence
