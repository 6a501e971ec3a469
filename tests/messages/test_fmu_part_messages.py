"""Every message about FMUs as parts of netlists, as its reader sees it."""

import zipfile
from pathlib import Path

import pytest

from modelica_like.errors import ModelicaLikeError
from modelica_like.fmi.cosimulation.fmu_parts import system_of_netlist
from modelica_like.netlist import loads

DESCRIPTION = """<fmiModelDescription fmiVersion="2.0" modelName="motor" guid="0">
{kind}
<UnitDefinitions><Unit name="N.m"><BaseUnit kg="1" m="2" s="-2"/></Unit></UnitDefinitions>
<ModelVariables>
<ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
<ScalarVariable name="tau" valueReference="1" causality="output"><Real/></ScalarVariable>
<ScalarVariable name="w" valueReference="2" causality="output"><Real/></ScalarVariable>
<ScalarVariable name="load" valueReference="4" causality="input"><Real start="0" unit="N.m"/></ScalarVariable>
<ScalarVariable name="k" valueReference="3" causality="parameter" variability="fixed"><Real start="1"/></ScalarVariable>
</ModelVariables>
<ModelStructure/>
</fmiModelDescription>"""
KINDS = {"motor": '<CoSimulation modelIdentifier="m"/>', "exchange": '<ModelExchange modelIdentifier="m"/>'}
MOTOR = 'motor = { is = "FMU", file = "motor.fmu" }'
OTHERS = """
J = { is = "Inertia", J = 1 }
end = { is = "TorqueToAngleAdaptor" }
k = { is = "Constant", k = 1 }
"""
JOIN = "Join one output with the inputs that take it."


def line(text: str, number: int) -> str:
    return f"  in bench.toml:{number} `{text}`"


def wired(wire: str, parts: str = MOTOR) -> str:
    return f"[parts]\n{parts}{OTHERS}[connect]\n{wire}"


CASES = {
    "no FMU": (
        '[parts]\nJ = { is = "Inertia", J = 1 }',
        "bench has no FMU among its parts, so there is nothing to co-simulate.\n"
        "Simulate it, or cut it into FMUs with `modelica-like split`.",
    ),
    "missing file": (
        '[parts]\nmotor = { is = "FMU", file = "mtor.fmu" }',
        "motor: there is no file 'mtor.fmu'; did you mean 'motor.fmu'?\n"
        + line('motor = { is = "FMU", file = "mtor.fmu" }', 2) + "\nPaths are relative to the netlist.",
    ),
    "no file": (
        '[parts]\nmotor = { is = "FMU" }',
        "motor names no file.\n" + line('motor = { is = "FMU" }', 2)
        + '\nWrite { is = "FMU", file = "motor.fmu" }.',
    ),
    "a begin": (
        wired('a = ["k.y", "motor.u"]\n[simulate]\nfrom = "1 s"'),
        "A netlist with FMUs is a co-simulation, which begins at 0 s: it cannot have `from`.\n"
        + line('from = "1 s"', 9),
    ),
    "no archive": (
        '[parts]\nmotor = { is = "FMU", file = "text.fmu" }',
        "text.fmu is not an FMU: it is not a valid zip archive.\n"
        + line('motor = { is = "FMU", file = "text.fmu" }', 2) + "\nFile is not a zip file.",
    ),
    "Model Exchange only": (
        '[parts]\nmotor = { is = "FMU", file = "exchange.fmu" }',
        "motor: exchange.fmu has no Co-Simulation part, only Model Exchange.\n"
        + line('motor = { is = "FMU", file = "exchange.fmu" }', 2)
        + "\nIts equations need a solver, which this FMU does not contain.\n"
        "Export it again for Co-Simulation.",
    ),
    "array": (
        '[parts]\nmotor = { is = "FMU", file = "motor.fmu", count = 2 }',
        "motor: an array cannot contain FMUs.\n"
        + line('motor = { is = "FMU", file = "motor.fmu", count = 2 }', 2) + "\nDeclare each FMU as a part.",
    ),
    "unknown parameter": (
        '[parts]\nmotor = { is = "FMU", file = "motor.fmu", kk = 1 }',
        "motor has no variable 'kk'; did you mean 'k'?\n"
        + line('motor = { is = "FMU", file = "motor.fmu", kk = 1 }', 2),
    ),
    "no number": (
        '[parts]\nmotor = { is = "FMU", file = "motor.fmu", k = [1] }',
        'motor.k must be a number or a text with a unit, such as "10 N.m".\n'
        + line('motor = { is = "FMU", file = "motor.fmu", k = [1] }', 2),
    ),
    "series": (
        f'[parts]\n{MOTOR}{OTHERS}[series]\nmain = ["motor", "J"]',
        "motor cannot be in [series].\n" + line('main = ["motor", "J"]', 7)
        + "\nAn FMU has only signals: connect its inputs and outputs in [connect].",
    ),
    "free end": (
        f'free = ["motor.shaft"]\n[parts]\n{MOTOR}{OTHERS}',
        "motor cannot be in [free].\n" + line('free = ["motor.shaft"]', 1)
        + "\nAn FMU has only signals: connect its inputs and outputs in [connect].",
    ),
    "start value": (
        f'[parts]\n{MOTOR}{OTHERS}[start]\n"motor.w" = 1',
        "motor.w belongs to an FMU.\n" + line('"motor.w" = 1', 7)
        + "\nGive the value where motor is declared.",
    ),
    "unknown variable": (
        wired('x = ["motor.ta", "end.tau"]'),
        "motor has no variable 'ta'; did you mean 'tau'?\n" + line('x = ["motor.ta", "end.tau"]', 7),
    ),
    "parameter": (
        wired('x = ["k.y", "motor.k"]'),
        "motor.k is a parameter of an FMU, not a signal.\n" + line('x = ["k.y", "motor.k"]', 7),
    ),
    "flange": (
        wired('x = ["motor.tau", "J.flange_a"]'),
        "J.flange_a is a Flange, and an FMU has only signals.\n" + line('x = ["motor.tau", "J.flange_a"]', 7)
        + "\nA shaft, slide or wire carries torque and motion in both directions; an FMU computes one from the other."
        "\nPut an adaptor on it, such as TorqueToAngleAdaptor, and connect its signals.",
    ),
    "unknown signal": (
        wired('x = ["motor.tau", "end.taw"]'),
        "end has no signal 'taw'; did you mean 'tau'?\n" + line('x = ["motor.tau", "end.taw"]', 7),
    ),
    "no other part": (
        f'[parts]\n{MOTOR}\n[connect]\nx = ["motor.tau", "moter.u"]',
        "bench has no part 'moter'; did you mean 'motor'?\n" + line('x = ["motor.tau", "moter.u"]', 4),
    ),
    "two outputs": (
        wired('x = ["motor.tau", "motor.w", "end.tau"]'),
        "x: multiple outputs drive it: motor.tau, motor.w.\n" + line('x = ["motor.tau", "motor.w", "end.tau"]', 7)
        + f"\n{JOIN}",
    ),
    "no output": (
        wired('x = ["motor.u", "end.tau"]'),
        "x: no output drives it: motor.u, end.tau.\n" + line('x = ["motor.u", "end.tau"]', 7) + f"\n{JOIN}",
    ),
    "driven twice": (
        f'[parts]\n{MOTOR}\n[connect]\nx = ["motor.tau", "motor.u"]\ny = ["motor.w", "motor.u"]',
        "motor.u is given twice, by x and y.\n"
        + line('x = ["motor.tau", "motor.u"]', 4) + "\n" + line('y = ["motor.w", "motor.u"]', 5) + "\nRemove one.",
    ),
    "different quantities": (
        f'[parts]\n{MOTOR}\nk = {{ is = "Constant", k = "1 rad/s" }}\n[connect]\nx = ["k.y", "motor.load"]',
        "motor.load and k.y are different quantities: their units are N.m and rad/s.\n"
        + line('x = ["k.y", "motor.load"]', 5) + "\nConnect an input with an output of the same quantity.",
    ),
    "given twice among the others": (
        wired('x = ["k.y", "end.tau"]\ny = ["motor.tau", "end.tau"]'),
        "end.tau is given twice, by x and y.\n"
        + line('x = ["k.y", "end.tau"]', 7) + "\n" + line('y = ["motor.tau", "end.tau"]', 8) + "\nRemove one.",
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """FMUs that have nothing but a description, and a text."""
    home = tmp_path_factory.mktemp("parts")
    for name, kind in KINDS.items():
        with zipfile.ZipFile(home / f"{name}.fmu", "w") as archive:
            archive.writestr("modelDescription.xml", DESCRIPTION.format(kind=kind))
    (home / "text.fmu").write_text("no archive")
    return home


@pytest.mark.parametrize("case", CASES)
def test_a_netlist_whose_fmus_cannot_be_joined(case: str, folder: Path) -> None:
    text, sentence = CASES[case]
    path = folder / "bench.toml"
    path.write_text(text)
    with pytest.raises(ModelicaLikeError) as told:
        system_of_netlist(path, folder)
    assert str(told.value) == sentence


def test_an_fmu_among_equations() -> None:
    with pytest.raises(ModelicaLikeError) as told:
        loads(f"[parts]\n{MOTOR}", "bench.toml")
    assert str(told.value) == (
        "motor is an FMU, which cannot be part of a system of equations.\n" + line(MOTOR, 2)
        + "\nAn FMU computes its outputs in its own steps, and its equations are not known.\n"
        "Run the netlist as a co-simulation: cosim(…) or `modelica-like cosim`."
    )  # fmt: skip
