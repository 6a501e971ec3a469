"""What is said about an SSP that cannot be written or read, word by word."""

import re
import stat
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from modelica_like.errors import ModelicaLikeError
from modelica_like.fmi.cosimulation.files import load_system
from modelica_like.fmi.cosimulation.ssp import write_ssp
from modelica_like.fmi.cosimulation.ssp_document import NAMES
from modelica_like.fmi.cosimulation.system import Link, Port, System, Unit

FMU = """<fmiModelDescription fmiVersion="2.0" modelName="m" guid="1"><CoSimulation modelIdentifier="m"/>
<UnitDefinitions><Unit name="rad/s"><BaseUnit s="-1" rad="1"/></Unit>
<Unit name="{unit}"><BaseUnit s="-1" rad="1" factor="{factor}"/></Unit></UnitDefinitions><ModelVariables>
<ScalarVariable name="w" valueReference="1" causality="output"><Real unit="{unit}"/></ScalarVariable>
<ScalarVariable name="u" valueReference="2" causality="input"><Real unit="rad/s" start="0"/></ScalarVariable>
<ScalarVariable name="J" valueReference="3" causality="parameter" variability="fixed"><Real start="1"/></ScalarVariable>
</ModelVariables><ModelStructure/></fmiModelDescription>"""
TORQUE = FMU.replace('<BaseUnit s="-1" rad="1" factor="{factor}"/>', '<BaseUnit kg="1" m="2" s="-2"/>')
IN_SYSTEM = "SystemStructure.ssd"
HEAD = " ".join(f'xmlns:{name}="{space}"' for name, space in NAMES.items())
TOP = f'<ssd:SystemStructureDescription {HEAD} version="1.0" name="bench">'
PORTS = (
    """<ssd:Connectors><ssd:Connector name="u" kind="input"/><ssd:Connector name="w" kind="output"/></ssd:Connectors>"""
)
A = f'<ssd:Component name="a" source="a.fmu">{PORTS}</ssd:Component>'
B = A.replace('name="a"', 'name="b"')


def fmu(path: Path, unit: str = "rad/s2", factor: float = 1.0, text: str = FMU) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text.format(unit=unit, factor=factor))
    return path


def wire(start: str, end: str, inner: str = "", more: str = "") -> str:
    return f"<{connection(start, end)}{more}>{inner}</ssd:Connection>".replace("<", "<ssd:", 1)


def connection(start: str, end: str) -> str:
    ends = {"start": start.partition("/"), "end": end.partition("/")}
    return "Connection " + " ".join(f'{key}Element="{one[0]}" {key}Connector="{one[2]}"' for key, one in ends.items())


def at(line: int, start: str, end: str, more: str = "") -> str:
    """Where a connection stands."""
    return f"  in {IN_SYSTEM}:{line} `<{connection(start, end)}{more}>`"


def elements(*inner: str) -> str:
    return f"<ssd:Elements>\n{''.join(inner)}</ssd:Elements>\n"


def wires(*inner: str) -> str:
    return f"<ssd:Connections>\n{''.join(inner)}</ssd:Connections>"


def bound(inner: str, more: str = "") -> str:
    """A component with a parameter binding."""
    text = f"<ssd:ParameterBindings><ssd:ParameterBinding {more}>{inner}</ssd:ParameterBinding></ssd:ParameterBindings>"
    return elements(A.replace("</ssd:Component>", f"\n{text}</ssd:Component>"))


def values(parameter: str) -> str:
    group = '<ssv:ParameterSet version="1.0" name="set"><ssv:Parameters>'
    return bound(f"<ssd:ParameterValues>{group}{parameter}</ssv:Parameters></ssv:ParameterSet></ssd:ParameterValues>")


def annotated(attributes: str) -> str:
    note = '<ssc:Annotation type="modelica_like.cosimulation">'
    return f"<ssd:Annotations>{note}<ml:Cosimulation {attributes}/></ssc:Annotation></ssd:Annotations>"


INNER = '<ssd:Connectors><ssd:Connector name="x" kind="input"/><ssd:Connector name="y" kind="inout"/></ssd:Connectors>'
CIRCLE = elements(f'<ssd:System name="s">{INNER}</ssd:System>{A}') + wires(
    wire("s/y", "s/x"), "\n", wire("s/x", "s/y"), "\n", wire("s/y", "a/u")
)
KILONEWTON_METRE = """<ssd:Units><ssc:Unit name="kN.m"><ssc:BaseUnit kg="1" m="2" s="-2" factor="1000"/></ssc:Unit>
</ssd:Units>"""
DIRECT = "Connect the components directly."
SELF = "Do the conversion in one of the FMUs."
SYSTEMS: dict[str, tuple[str, str, str]] = {
    "no name": (
        elements('<ssd:Component source="a.fmu"/>'), "",
        f'An element Component lacks its name.\n  in {IN_SYSTEM}:3 `<Component source="a.fmu">`',
    ),
    "two elements": (
        elements(A, A), "",
        f"root has two elements 'a'.\n  in {IN_SYSTEM}:3 `<Component name=\"a\" source=\"a.fmu\">`",
    ),
    "two connectors": (
        elements(A.replace('name="w"', 'name="u"')), "",
        f"a has two connectors 'u'.\n  in {IN_SYSTEM}:3 `<Connector name=\"u\" kind=\"output\">`",
    ),
    "two names": (
        elements(A.replace('name="a"', 'name="a b"'), A.replace('name="a"', 'name="a-b"')), "",
        f"Two FMUs would have the name a_b.\n  in {IN_SYSTEM}:3 `<Component name=\"a-b\" source=\"a.fmu\">`\n"
        "Rename one of them.",
    ),
    "no FMU": (
        elements(A.replace("a.fmu", "b.fmu")), "",
        f"bench.ssp has no file 'b.fmu'.\n  in {IN_SYSTEM}:3 `<Component name=\"a\" source=\"b.fmu\">`",
    ),
    "outside": (
        elements(A.replace("a.fmu", "../a.fmu")), "",
        f"'../a.fmu' does not lie in bench.ssp.\n  in {IN_SYSTEM}:3 `<Component name=\"a\" source=\"../a.fmu\">`\n"
        "Only files of the archive itself can be used, such as resources/motor.fmu.",
    ),
    "from the net": (
        elements(A.replace("a.fmu", "file:///a.fmu")), "",
        f"'file:///a.fmu' does not lie in bench.ssp.\n  in {IN_SYSTEM}:3 `<Component name=\"a\" source=\"file:///a.fmu\">`\n"
        "Only files of the archive itself can be used, such as resources/motor.fmu.",
    ),
    "package": (
        elements('<ssd:Component name="a" source="a.ssp" type="application/x-ssp-package"/>'), "",
        "a is not an FMU but has the type application/x-ssp-package, which is not supported.\n"
        f'  in {IN_SYSTEM}:3 `<Component name="a" source="a.ssp" type="application/x-ssp-package">`\n'
        "Put the FMUs of the inner SSP into the system itself.",
    ),
    "model exchange": (
        elements('<ssd:Component name="a" source="a.fmu" implementation="ModelExchange"/>'), "",
        "a asks for ModelExchange, but systems run as co-simulation.\n"
        f'  in {IN_SYSTEM}:3 `<Component name="a" source="a.fmu" implementation="ModelExchange">`',
    ),
    "dictionary": (
        elements('<ssd:SignalDictionaryReference name="bus" dictionary="can"/>'), "",
        "bus refers to a signal dictionary, which is not supported.\n"
        f"  in {IN_SYSTEM}:3 `<SignalDictionaryReference name=\"bus\" dictionary=\"can\">`\n{DIRECT}",
    ),
    "element": (
        elements(A) + wires(wire("a/w", "c/u")), "",
        f"root has no element 'c'.\n{at(5, 'a/w', 'c/u')}",
    ),
    "connector": (
        elements(A) + wires(wire("a/ww", "a/u")), "",
        f"a has no connector 'ww'; did you mean 'w'?\n{at(5, 'a/ww', 'a/u')}",
    ),
    "two outputs": (
        elements(A, B) + wires(wire("a/w", "b/w")), "",
        "A connection joins two connectors that provide a value: a.w and b.w.\n"
        f"{at(5, 'a/w', 'b/w')}",
    ),
    "two inputs": (
        elements(A, B) + wires(wire("a/u", "b/u")), "",
        "A connection joins two connectors that receive a value: a.u and b.u.\n"
        f"{at(5, 'a/u', 'b/u')}",
    ),
    "driven twice": (
        elements(A, B) + wires(wire("a/w", "b/u"), "\n", wire("b/w", "b/u")), "",
        "b.u is driven twice, by a.w and b.w.\n"
        f"{at(5, 'a/w', 'b/u')}\n{at(6, 'b/w', 'b/u')}",
    ),
    "circle": (
        CIRCLE, "",
        f"a.u is driven by a loop of connections.\n{at(7, 's/y', 'a/u')}",
    ),
    "transformation": (
        elements(A, B) + wires(wire("a/w", "b/u", '<ssc:LinearTransformation factor="2"/>')), "",
        "A connection with a LinearTransformation is not supported.\n"
        f"{at(5, 'a/w', 'b/u')}\n{SELF}",
    ),
    "array": (
        elements(A, B) + wires(wire("a/w", "b/u", more=' startIndices="1"')), "",
        "Connections to single elements of arrays are not supported.\n"
        + at(5, "a/w", "b/u", ' startIndices="1"'),
    ),
    "units": (
        elements(A, B.replace("a.fmu", "rpm.fmu")) + wires(wire("b/w", "a/u")), "",
        "a.u and b.w have different units, rad/s and rpm, and conversion is not supported.\n"
        f"{at(5, 'b/w', 'a/u')}\n{SELF}",
    ),
    "quantities": (
        elements(A, B.replace("a.fmu", "torque.fmu")) + wires(wire("b/w", "a/u")), "",
        "a.u and b.w are different quantities: their units are rad/s and N.m.\n"
        f"{at(5, 'b/w', 'a/u')}\nConnect an input with an output of the same quantity.",
    ),
    "a value of another quantity": (
        values('<ssv:Parameter name="u"><ssv:Real value="2" unit="kN.m"/></ssv:Parameter>'), KILONEWTON_METRE,
        "a.u is in rad/s; 2 kN.m is another quantity.\n"
        f'  in {IN_SYSTEM}:4 `<Parameter name="u">`\nGive it in rad/s, or in a unit of the same dimension.',
    ),
    "mapping": (
        bound("<ssd:ParameterMapping/>"), "",
        f"Mappings of parameters (ssm) are not supported.\n  in {IN_SYSTEM}:4 `<ParameterBinding>`\n"
        "Give the values under the names that they have in the system.",
    ),
    "kind of parameters": (
        bound("", 'type="text/csv"'), "",
        f"Parameters of type text/csv are not supported.\n  in {IN_SYSTEM}:4 `<ParameterBinding type=\"text/csv\">`",
    ),
    "parameters of a component": (
        bound("", 'source="x.ssv" sourceBase="component"'), "",
        "Parameters inside a component's file are not supported.\n"
        f'  in {IN_SYSTEM}:4 `<ParameterBinding source="x.ssv" sourceBase="component">`',
    ),
    "text": (
        values('<ssv:Parameter name="J"><ssv:String value="x"/></ssv:Parameter>'), "",
        f"Parameter 'J' is of type String; only numbers can be set.\n  in {IN_SYSTEM}:4 `<Parameter name=\"J\">`",
    ),
    "no value": (
        values('<ssv:Parameter name="J"/>'), "",
        f"Parameter 'J' has no value; only numbers can be set.\n  in {IN_SYSTEM}:4 `<Parameter name=\"J\">`",
    ),
    "no number": (
        values('<ssv:Parameter name="J"><ssv:Real value="x"/></ssv:Parameter>'), "",
        f"Real: value = 'x' is not a number.\n  in {IN_SYSTEM}:4 `<Real value=\"x\">`",
    ),
    "not finite": (
        values('<ssv:Parameter name="J"><ssv:Real value="INF"/></ssv:Parameter>'), "",
        f"Real: value = 'INF' is not finite.\n  in {IN_SYSTEM}:4 `<Real value=\"INF\">`",
    ),
    "start time": (
        elements(A), '<ssd:DefaultExperiment startTime="5"/>',
        f"bench.ssp starts at t = 5 s; co-simulations start at 0 s.\n"
        f"  in {IN_SYSTEM}:4 `<DefaultExperiment startTime=\"5\">`",
    ),
    "master": (
        elements(A), annotated('master="jakobi"'),
        "There is no master 'jakobi'; did you mean 'jacobi'?\nThere are jacobi and gauss-seidel.",
    ),
    "empty": ("", "", "bench has no FMU.\nDeclare them in [fmus]."),
}  # fmt: skip


def document(system: str, after: str = "") -> str:
    return f'{TOP}\n<ssd:System name="root">{system}</ssd:System>{after}</ssd:SystemStructureDescription>'


def told(write: Callable[[zipfile.ZipFile], None], tmp_path: Path) -> str:
    path, work = tmp_path / "bench.ssp", tmp_path / "work"
    with zipfile.ZipFile(path, "w") as archive:
        write(archive)
        archive.write(fmu(tmp_path / "a.fmu"), "a.fmu")
        archive.write(fmu(tmp_path / "rpm.fmu", "rpm", 0.10471975511965977), "rpm.fmu")
        archive.write(fmu(tmp_path / "torque.fmu", "N.m", text=TORQUE), "torque.fmu")
    work.mkdir()
    with pytest.raises(ModelicaLikeError) as error:
        load_system(path, work)
    return str(error.value)


@pytest.mark.parametrize("case", SYSTEMS)
def test_a_system_that_cannot_be_run(case: str, tmp_path: Path) -> None:
    system, after, sentence = SYSTEMS[case]
    assert told(lambda archive: archive.writestr(IN_SYSTEM, document(system, after)), tmp_path) == sentence


def test_a_parameter_file_that_is_no_xml(tmp_path: Path) -> None:
    text = document(bound("", 'source="x.ssv"'))

    def write(archive: zipfile.ZipFile) -> None:
        archive.writestr(IN_SYSTEM, text)
        archive.writestr("x.ssv", "<a>")

    assert told(write, tmp_path) == (
        "x.ssv in bench.ssp is not XML: Premature end of data in tag a line 1, line 1, column 4.\n  in x.ssv:1"
    )


DOCUMENTS = {
    "no XML": (
        "<a", f"{IN_SYSTEM} in bench.ssp is not XML: Couldn't find end of Start Tag a line 1, line 1, column 3.\n"
        f"  in {IN_SYSTEM}:1",
    ),
    "other XML": ("<a/>", f"{IN_SYSTEM} in bench.ssp describes no system structure.\n  in {IN_SYSTEM}:1 `<a>`"),
    "version": (
        f'{TOP.replace("1.0", "3.0")}</ssd:SystemStructureDescription>',
        f"bench.ssp has the SSP version 3.0; 1.0 and 2.0 are supported.\n"
        f'  in {IN_SYSTEM}:1 `<SystemStructureDescription version="3.0" name="bench">`',
    ),
    "no system": (
        f"{TOP}</ssd:SystemStructureDescription>",
        f'bench.ssp has no system.\n  in {IN_SYSTEM}:1 `<SystemStructureDescription version="1.0" name="bench">`',
    ),
    "document type": (
        "<!DOCTYPE a><a/>", f"bench.ssp is refused: its {IN_SYSTEM} declares a document type.\n"
        "A model description needs none; it can make a small file enormous, or read other files.",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", DOCUMENTS)
def test_a_file_that_describes_no_system(case: str, tmp_path: Path) -> None:
    text, sentence = DOCUMENTS[case]
    assert told(lambda archive: archive.writestr(IN_SYSTEM, text), tmp_path) == sentence


def link(archive: zipfile.ZipFile) -> None:
    info = zipfile.ZipInfo("resources/way_out")
    info.external_attr = (stat.S_IFLNK | 0o777) << 16
    archive.writestr(info, "/etc/passwd")


def bomb(archive: zipfile.ZipFile) -> None:
    info = zipfile.ZipInfo("resources/zeros")
    info.compress_type = zipfile.ZIP_DEFLATED
    archive.writestr(info, bytes(20 * 1024**2))
    archive.writestr(IN_SYSTEM, "")


UNSAFE: dict[str, tuple[Callable[[zipfile.ZipFile], None], str]] = {
    "no SSP": (lambda archive: archive.writestr("x", ""), f"bench.ssp is not an SSP: it has no {IN_SYSTEM}."),
    "outside": (
        lambda archive: archive.writestr("../outside", ""),
        "bench.ssp is refused: '../outside' leads out of the archive.",
    ),
    "link": (link, "bench.ssp is refused: 'resources/way_out' is a link."),
    "bomb": (
        bomb, "bench.ssp is refused: … kB would unpack to 20 MB.\n"
        "A file that shrinks to less than 1/200 is more likely a zip bomb than an SSP.",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", UNSAFE)
def test_an_archive_that_is_refused(case: str, tmp_path: Path) -> None:
    write, sentence = UNSAFE[case]
    assert re.sub(r"[\d.]+ kB", "… kB", told(write, tmp_path)) == sentence  # how far zeros shrink is zlib's matter
    assert not list((tmp_path / "work").iterdir())


def test_no_archive(tmp_path: Path) -> None:
    (tmp_path / "bench.ssp").write_text("x")
    with pytest.raises(ModelicaLikeError) as error:
        load_system(tmp_path / "bench.ssp", tmp_path)
    assert str(error.value) == "bench.ssp is not an SSP: it is not a valid zip archive.\nFile is not a zip file."


def test_an_fmu_without_a_readable_description(tmp_path: Path) -> None:
    bad = fmu(tmp_path / "bad.fmu", text='<fmiModelDescription fmiVersion="7.0"/>')
    with pytest.raises(ModelicaLikeError) as error:
        write_ssp(System("bench", (Unit("a", bad),), ()), tmp_path / "bench.ssp")
    assert str(error.value) == "The description of bad.fmu cannot be read: Unsupported FMI version: 7.0."


WRITTEN: dict[str, tuple[str, str, str]] = {
    "version": ("bench.ssp", "3.0", "SSP 3.0 is not supported.\nThere are 1.0 and 2.0."),
    "ending": ("bench.zip", "1.0", "An SSP is a file with the ending .ssp, not 'bench.zip'."),
    "folder": ("no/bench.ssp", "1.0", "There is no folder 'no' for bench.ssp.\nCreate it first."),
    "variable": ("bench.ssp", "1.0", "a (a.fmu) has no variable 'ww'; did you mean 'w'?"),
}


@pytest.mark.parametrize("case", WRITTEN)
def test_an_ssp_that_cannot_be_written(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name, version, sentence = WRITTEN[case]
    monkeypatch.chdir(tmp_path)
    unit = Unit("a", fmu(Path("a.fmu")))
    with pytest.raises(ModelicaLikeError) as error:
        write_ssp(System("bench", (unit,), (Link("w", Port("a", "ww"), (Port("a", "u"),)),)), name, version)
    assert str(error.value) == sentence
    assert not Path(name).exists()


def test_a_unit_with_two_meanings(tmp_path: Path) -> None:
    units = [Unit(name, fmu(tmp_path / f"{name}.fmu", "rpm", factor)) for name, factor in (("a", 1.0), ("b", 2.0))]
    links = tuple(Link(f"w{one}", Port(one, "w"), (Port(one, "u"),)) for one in "ab")
    with pytest.raises(ModelicaLikeError) as error:
        write_ssp(System("bench", tuple(units), links), tmp_path / "bench.ssp")
    assert str(error.value) == "Two FMUs define the unit 'rpm' differently, which an SSP cannot express."


def test_a_unit_without_a_definition_is_no_number(tmp_path: Path) -> None:
    """Nothing is known of it: it fits everything, also after it has been written and read."""
    text = FMU.replace('<BaseUnit s="-1" rad="1" factor="{factor}"/>', "")
    units = Unit("a", fmu(tmp_path / "a.fmu", "turns", text=text)), Unit("b", fmu(tmp_path / "b.fmu"))
    links = (Link("w", Port("a", "w"), (Port("b", "u"),)),)
    write_ssp(System("bench", units, links), tmp_path / "bench.ssp")
    (tmp_path / "work").mkdir()
    assert load_system(tmp_path / "bench.ssp", tmp_path / "work").links == links
