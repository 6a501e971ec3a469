"""Mutated files: sizing files, systems of FMUs, SSPs and FMUs."""

from __future__ import annotations

import atexit
import contextlib
import io
import random
import shutil
import tempfile
import tomllib
import warnings
import zipfile
from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import lxml.etree as etree
from inputs import PIECES, STRANGE, document, mutated_text, mutated_tree
from rich.console import Console

from modelica_like.analyse.sizing import size
from modelica_like.errors import ModelicaLikeError
from modelica_like.fmi.cosimulation.described import described
from modelica_like.fmi.cosimulation.files import load_system
from modelica_like.fmi.cosimulation.run import cosim
from modelica_like.fmi.cosimulation.split import split
from modelica_like.fmi.cosimulation.ssp import write_ssp
from modelica_like.fmi.run import run_fmu
from modelica_like.runs.measured import read_csv
from modelica_like.show.report.sizing import sizing_report

Case = tuple[str, Callable[[], object]]
EXAMPLES = Path(__file__).parents[2] / "examples"
RUNS = 0.003
"""Share of FMUs and systems that are run, in a process of its own, which takes half a second."""
LOADED = """[checks.b]
is = "shaft_stress"
bending = "0 N.m"
diameter = "32 mm"
yield_strength = "275 N/mm2"
torque = { from = "drive.toml", peak = "shaft.tau", until = "1 ms", set = { "J1.J" = 1 } }
"""
TEXTS = [one for one in (*STRANGE, *PIECES) if isinstance(one, str) and one.isprintable()]
OLD = """<fmiModelDescription fmiVersion="1.0" modelName="m" modelIdentifier="m" guid="1" numberOfContinuousStates="0"
numberOfEventIndicators="0"><UnitDefinitions><BaseUnit unit="rad/s"><DisplayUnitDefinition displayUnit="rpm"
gain="9.5"/></BaseUnit></UnitDefinitions><TypeDefinitions><Type name="t"><RealType unit="rad/s"/></Type><Type name="e">
<EnumerationType><Item name="a"/><Item name="b"/></EnumerationType></Type></TypeDefinitions><DefaultExperiment
startTime="0" stopTime="1" tolerance="1e-4"/><ModelVariables><ScalarVariable name="w" valueReference="1"
causality="output"><Real declaredType="t" start="0"/></ScalarVariable><ScalarVariable name="e" valueReference="2"
variability="discrete"><Enumeration declaredType="e" start="1"/></ScalarVariable></ModelVariables><Implementation>
<CoSimulation_StandAlone><Capabilities canHandleVariableCommunicationStepSize="true"/></CoSimulation_StandAlone>
</Implementation></fmiModelDescription>"""
NEW = """<fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="1"><CoSimulation modelIdentifier="m"
hasEventMode="true"/><ScheduledExecution modelIdentifier="m"/><UnitDefinitions><Unit name="rpm"><BaseUnit s="-1"
rad="1" factor="0.1" offset="0"/><DisplayUnit name="x" factor="2" offset="1" inverse="true"/></Unit></UnitDefinitions>
<TypeDefinitions><Float64Type name="t" unit="rpm"/><EnumerationType name="e"><Item name="a" value="1"/>
</EnumerationType></TypeDefinitions><LogCategories><Category name="all"/></LogCategories>
<DefaultExperiment stopTime="1"/><ModelVariables>
<UInt64 name="n" valueReference="1" causality="structuralParameter" start="2"/><Float64 name="x" valueReference="2"
causality="output" start="1 2"><Dimension valueReference="1"/><Dimension start="1"/><Alias name="y"/></Float64>
<Float64 name="w" declaredType="t" valueReference="3" derivative="2"/><Boolean name="b" valueReference="4" start="true"
clocks="5"/><Clock name="c" valueReference="5" intervalVariability="constant" intervalDecimal="0.1"/><String name="s"
valueReference="6"><Start value="x"/></String><Binary name="d" valueReference="7" mimeType="a"><Start value="00"/>
</Binary><Enumeration name="e" declaredType="e" valueReference="8" start="1"/></ModelVariables><ModelStructure>
<Output valueReference="2" dependencies="1 3" dependenciesKind="fixed dependent"/><ContinuousStateDerivative
valueReference="3"/><InitialUnknown valueReference="2"/><EventIndicator valueReference="3"/></ModelStructure>
</fmiModelDescription>"""


@cache
def folder() -> Path:
    """Return the folder of this process, with a drive in two FMUs: motor.fmu, wheel.fmu, system.toml and system.ssp.

    What is not run has its descriptions only; the folder `whole` has the whole FMUs.
    """
    made = Path(tempfile.mkdtemp(prefix="modelica_like_fuzz_"))
    atexit.register(shutil.rmtree, made, ignore_errors=True)
    parts = split(EXAMPLES / "two_mass.toml", "shaft", made / "whole", names=("motor", "wheel"), check=False)
    parts.path.rename(made / "whole" / "system.toml")
    write_ssp(parts.system, made / "whole" / "system.ssp")
    for name in ("motor", "wheel"):
        contents = {
            n: one for n, one in members(made / "whole" / f"{name}.fmu").items() if not n.startswith("binaries")
        }
        _write(made / f"{name}.fmu", contents)
    units = tuple(replace(unit, file=made / unit.file.name) for unit in parts.system.units)
    write_ssp(replace(parts.system, units=units), made / "system.ssp")
    shutil.copy(made / "whole" / "system.toml", made)
    shutil.copy(EXAMPLES / "two_mass.toml", made / "drive.toml")
    (made / "here").mkdir()
    around = (EXAMPLES / "cosim" / "speed_control.toml").read_text(encoding="utf-8")
    around = around.replace("../../build/fmus/two_mass_fmi2.fmu", "wheel.fmu")
    around = around.replace("drive.motor.tau", "drive.J2_flange_a.tau").replace("drive.J1.w", "drive.J2.w")
    (made / "controller.toml").write_text(around, encoding="utf-8")
    return made


def _place(run: bool) -> Path:
    return folder() / "whole" if run else folder()


def _write(path: Path, contents: Mapping[str, bytes]) -> None:
    with warnings.catch_warnings(action="ignore"), zipfile.ZipFile(path, "w") as archive:
        for name, content in contents.items():
            archive.writestr(name, content)


def members(path: Path) -> dict[str, bytes]:
    """Return what an archive holds."""
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def packed(chance: random.Random, path: Path, contents: Mapping[str, bytes]) -> Path:
    """Write an archive; some are damaged, some have strange names inside."""
    names = {name: name for name in contents}
    if chance.random() < 0.05:
        names[chance.choice(list(names))] = chance.choice(
            [*filter(None, TEXTS), "a/" * 1500 + "b", "../x", "/etc/x", "CON", "a" * 300]
        )
    _write(path, {names[name]: content for name, content in contents.items()})
    written = bytearray(path.read_bytes())
    if chance.random() < 0.1:
        for _ in range(chance.randrange(1, 9)):
            written[chance.randrange(len(written))] = chance.randrange(256)
    path.write_bytes(written if chance.random() < 0.97 else written[: chance.randrange(len(written))])
    return path


def mutated_xml(chance: random.Random, text: bytes) -> bytes:
    """Change an XML text: elements, attributes, characters, bytes or the encoding."""
    if chance.random() < 0.15:
        return mutated_text(chance, text.decode()).encode(errors="surrogatepass")
    top = etree.fromstring(text)
    for _ in range(chance.choice((1, 1, 2, 3))):
        _change_element(chance, top)
    encoding = chance.choice(["utf-8"] * 17 + ["utf-16", "iso-8859-1", "utf-32"])
    return etree.tostring(top, encoding=encoding, xml_declaration=chance.random() < 0.9)


def _change_element(chance: random.Random, top: Any) -> None:
    places = [one for one in top.iter() if isinstance(one.tag, str)]
    one, other = chance.choice(places), chance.choice(places)
    above, keys = one.getparent(), list(one.attrib)
    change = chance.randrange(8)
    if change <= 3 and keys:
        one.set(chance.choice(keys), chance.choice(TEXTS))
    elif change == 4 and keys:
        del one.attrib[chance.choice(keys)]
    elif change == 5 and above is not None:
        above.remove(one)
    elif change == 6:
        other.append(deepcopy(one))
    elif other.attrib and keys:
        one.set(chance.choice(keys), chance.choice(list(other.attrib.values())))
    else:
        one.text, one.tag = chance.choice(TEXTS), chance.choice([one.tag, other.tag])


def _toml(chance: random.Random, text: str) -> str:
    if chance.random() < 0.3:
        return mutated_text(chance, text)
    tree = tomllib.loads(text)
    for _ in range(chance.choice((1, 1, 2, 3))):
        mutated_tree(chance, tree)
    return document(tree)


@cache
def sizings() -> list[str]:
    """Return every check of the examples that needs no simulation, and one that needs a short one."""
    found = []
    for path in sorted((EXAMPLES / "sizing").glob("*.toml")):
        tree = tomllib.loads(path.read_text(encoding="utf-8"))
        for name, check in tree["checks"].items():
            one = {"parameters": tree.get("parameters", {}), "checks": {name: check}}
            file = folder() / "sizing.toml"
            file.write_text(document(one))
            with contextlib.suppress(ModelicaLikeError):
                size(file)
                found.append(document(one))
    load = '[checks.b]\nis = "shaft_stress"\nbending = "0 N.m"\ndiameter = "32 mm"\nyield_strength = "275 N/mm2"\n'
    return [
        *found,
        f'{load}torque = {{ from = "drive.toml", peak = "shaft.tau", until = "1 ms", set = {{ "J1.J" = 1 }} }}\n',
    ]


def sizing(chance: random.Random) -> Case:
    """Work out a mutated sizing file, and report it."""
    text = _toml(chance, chance.choice(sizings()))
    file = folder() / "sizing.toml"

    def run() -> None:
        file.write_text(text, encoding="utf-8", errors="surrogatepass")
        Console(file=io.StringIO()).print(sizing_report(size(file)))

    return text, run


def system(chance: random.Random) -> Case:
    """Read a mutated system, or a netlist with an FMU; some are packed, a few run."""
    depth = chance.random()
    place = _place(depth < RUNS)
    name = chance.choice(["system.toml"] * 4 + ["controller.toml"]) if depth >= RUNS else "system.toml"
    text = _toml(chance, (place / name).read_text(encoding="utf-8"))

    def run() -> None:
        file = place / "mutated.toml"
        file.write_text(text, encoding="utf-8", errors="surrogatepass")
        _loaded(file, depth)

    return text, run


def _loaded(file: Path, depth: float) -> None:
    if depth < RUNS:
        cosim(file, 1e-4, step=5e-5, timeout=4.0)
        return
    with tempfile.TemporaryDirectory(dir=folder()) as work:
        read = load_system(file, Path(work))
        if depth < 0.5:
            write_ssp(read, folder() / "again.ssp")


def ssp(chance: random.Random) -> Case:
    """Read a mutated SSP; some are packed again, a few run."""
    depth = chance.random()
    contents = members(_place(depth < RUNS) / "system.ssp")
    contents["SystemStructure.ssd"] = mutated_xml(chance, contents["SystemStructure.ssd"])
    file = packed(chance, folder() / "mutated.ssp", contents)
    return contents["SystemStructure.ssd"].decode(errors="replace"), lambda: _loaded(file, depth)


def fmu(chance: random.Random) -> Case:
    """Read the description of a mutated FMU; a few are run."""
    name, depth = "modelDescription.xml", chance.random()
    contents = members(_place(depth < RUNS) / "motor.fmu")
    contents[name] = mutated_xml(chance, chance.choice([contents[name], OLD.encode(), NEW.encode()]))
    file = packed(chance, folder() / "mutated.fmu", contents)

    def run() -> None:
        described(file)
        if depth < RUNS:
            run_fmu(file, stop=1e-4, timeout=4.0)

    return contents[name].decode(errors="replace"), run


def table(chance: random.Random) -> Case:
    """Read a mutated table, in any encoding."""
    numbers = [["time", "motor.w [rpm]", "tau"], *([repr(chance.gauss(k, 1)) for k in range(3)] for _ in range(4))]
    mark = chance.choice(",;\t")
    text = "\n".join(mark.join(row) for row in numbers)
    text = text.replace(".", ",") if mark != "," and chance.random() < 0.5 else text
    for _ in range(chance.randrange(3)):
        text = mutated_text(chance, text) or " "
    data = bytearray(text.encode(chance.choice(("utf-8", "utf-8-sig", "utf-16", "cp1252")), "replace") or b" ")
    for _ in range(chance.choice((0, 0, 1, 4))):
        data[chance.randrange(len(data))] = chance.randrange(256)
    file = folder() / "mutated.csv"

    def run() -> None:
        file.write_bytes(data)
        read_csv(file)

    return repr(bytes(data)), run


def archive(chance: random.Random) -> Case:
    """Read an archive whose structure is damaged: headers, directory and end, member by member."""
    name = chance.choice(("motor.fmu", "system.ssp"))
    data = bytearray((folder() / name).read_bytes())
    places = [at for mark in (b"PK\3\4", b"PK\1\2", b"PK\5\6") for at in _places(data, mark)]
    for _ in range(chance.randrange(1, 4)):
        at = min(chance.choice(places) + chance.randrange(46), len(data) - 1)
        data[at] = chance.choice((0, 1, 255, chance.randrange(256)))
    match chance.randrange(8):
        case 0:
            data = data[: chance.randrange(len(data))]
        case 1:
            data = bytearray(chance.randbytes(chance.randrange(200))) + data
        case 2:
            data += chance.randbytes(chance.randrange(200))
        case 3:
            at = chance.choice(places)
            data[at:at] = data[at : at + chance.randrange(100)]
        case _:
            pass
    file = folder() / f"damaged{Path(name).suffix}"

    def run() -> None:
        file.write_bytes(data)
        if name == "motor.fmu":
            described(file)
        else:
            _loaded(file, 1.0)

    return repr(bytes(data[-300:])), run


def _places(data: bytearray, mark: bytes) -> list[int]:
    return [at for at in range(len(data)) if data.startswith(mark, at)]
