"""Systems as SSP: what is written is what is read, others understand it, and foreign ones are understood."""

import json
import subprocess
import sys
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import lxml.etree as etree
import numpy as np
import pytest
from calls import called
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd

from modelica_like.fmi.cosimulation.described import DescribedFmu, FmuVariable, UnitDefinition
from modelica_like.fmi.cosimulation.run import cosim
from modelica_like.fmi.cosimulation.split import Split
from modelica_like.fmi.cosimulation.ssp import load_ssp, write_ssp
from modelica_like.fmi.cosimulation.ssp_document import NAMES, ssd
from modelica_like.fmi.cosimulation.system import Link, Port, Settings, System, Unit

M, J1, J2, C, D = 5.0, 0.02, 0.08, 400.0, 0.2
NETLIST = Path(__file__).parents[2] / "examples" / "two_mass.toml"
VERSIONS = pytest.mark.parametrize("version", ["1.0", "2.0"])
END = 0.1
ECOS = """
import json, sys
from modelica_like.fmi.importers import load_tbb
load_tbb()
import ecospy
speeds = []
with ecospy.EcosSimulation(ssp_path=sys.argv[1], step_size=float(sys.argv[2])) as simulation:
    assert simulation.init(parameter_set="initialValues")
    for _ in range(int(sys.argv[3])):
        simulation.step(1)
        speeds.append(simulation.get_real("wheel::J2.w"))
    simulation.terminate()
print(json.dumps(speeds))
"""


# -- what is written -----------------------------------------------------------------------------------------------


def without_files(system: System) -> System:
    return replace(system, units=tuple(replace(unit, file=Path(unit.name)) for unit in system.units))


@pytest.fixture
def system(oscillator: Split) -> System:
    """The oscillator with all settings, a parameter and two connections of one output."""
    first, second = oscillator.system.units
    motor = replace(first, parameters={**first.parameters, "shaft.d": 0.5})
    settings = Settings(until=0.05, step=1e-3, master="gauss-seidel", inputs="hold", tolerance=1e-4)
    return replace(oscillator.system, units=(motor, second), settings=settings)


@VERSIONS
def test_what_is_written_is_read(system: System, version: str, tmp_path: Path) -> None:
    (tmp_path / "work").mkdir()
    read = load_ssp(write_ssp(system, tmp_path / "system.ssp", version), tmp_path / "work")
    assert without_files(read) == without_files(system)
    for before, after in zip(system.units, read.units, strict=True):
        assert after.file.read_bytes() == before.file.read_bytes()


def test_an_ssp_runs_as_its_system(oscillator: Split, tmp_path: Path) -> None:
    path = write_ssp(oscillator.system, tmp_path / "system.ssp")
    packed, plain = (cosim(one, 0.02, step=1e-4) for one in (path, oscillator.path))
    assert np.array_equal(packed["J2.w"], plain["J2.w"])
    assert packed.couplings == plain.couplings


def test_the_same_system_gives_the_same_bytes(system: System, tmp_path: Path) -> None:
    first, second = (write_ssp(system, tmp_path / f"{name}.ssp").read_bytes() for name in "ab")
    assert first == second


def test_an_fmu_that_is_used_twice_is_packed_once(oscillator: Split, tmp_path: Path) -> None:
    wheel = oscillator.system.units[1].file
    twins = System("twins", (Unit("left", wheel), Unit("right", wheel, {"J2.J": 0.1})), ())
    with zipfile.ZipFile(write_ssp(twins, tmp_path / "twins.ssp")) as archive:
        assert archive.namelist() == ["SystemStructure.ssd", "resources/left.fmu"]


def test_split_writes_an_ssp_on_the_command_line(tmp_path: Path) -> None:
    path = tmp_path / "parts.ssp"
    options = ["--at", "shaft", "--name", "motor", "--name", "wheel", "--ssp", "2.0", "--no-check"]
    result = called(["split", str(NETLIST), *options, "-o", str(path)])
    assert result.exit_code == 0, result.stdout + result.stderr
    assert result.stdout.startswith(f"{path}: motor.fmu, wheel.fmu\n")
    with zipfile.ZipFile(path) as archive:
        assert etree.fromstring(archive.read("SystemStructure.ssd")).get("version") == "2.0"
        assert archive.namelist()[1:] == ["resources/motor.fmu", "resources/wheel.fmu"]


def test_the_description_is_valid(system: System, tmp_path: Path) -> None:
    """FMPy checks with the schemas of the standard, 1.0."""
    path = write_ssp(system, tmp_path / "system.ssp")
    described = read_ssd(str(path), validate=True)
    motor, wheel = described.system.elements
    assert [(one.name, one.kind) for one in wheel.connectors] == [
        ("J2_flange_a.tau", "input"), ("J2_flange_a.phi", "output"), ("J2_flange_a.w", "output"),
    ]  # fmt: skip
    (values,) = motor.parameterBindings[0].parameterValues
    assert {one.name: (float(one.value), one.unit) for one in values.parameters} == {
        "shaft_flange_b.a": (0.0, "rad/s2"), "shaft.d": (0.5, "N.m.s/rad"),
    }  # fmt: skip
    (torque,) = [unit for unit in described.units if unit.name == "N.m"]
    assert (torque.kg, torque.m, torque.s, torque.rad) == (1, 2, -2, 0)


def test_types_of_both_versions() -> None:
    """SSP 1.0 knows Real and Integer only; 2.0 has the types of FMI 3.0 in the same namespaces."""
    kinds = ("Float64", "Float32", "Int32", "UInt8", "Boolean", "Enumeration")
    variables = {kind: FmuVariable(kind, kind, "output", "rpm" if kind == "Float64" else "") for kind in kinds}
    rpm = UnitDefinition("rpm", (("s", -1), ("rad", 1)), factor=np.pi / 30)
    fmu = DescribedFmu("3.0", cosimulation=True, variables=variables, units={"rpm": rpm})
    values = {"Float64": 1.5, "Int32": 2.0, "Boolean": 1.0, "Enumeration": 3.0}
    links = tuple(Link(kind, Port("a", kind), (Port("b", kind),)) for kind in kinds)
    bench = System("bench", (Unit("a", Path("a.fmu"), values), Unit("b", Path("b.fmu"))), links)
    found: dict[str, str] = {}
    for version in ("1.0", "2.0"):
        top = etree.fromstring(ssd(bench, {"a": fmu, "b": fmu}, {"a": "a.fmu", "b": "b.fmu"}, version))
        assert top.get("version") == version
        assert top.find("ssd:Units/ssc:Unit/ssc:BaseUnit", NAMES).get("factor") == repr(np.pi / 30)
        component = top.find(".//ssd:Component[@name='a']", NAMES)
        ways = (".//ssd:Connector/*", ".//ssv:Parameter/*")
        typed = [one for way in ways for one in component.findall(way, NAMES)]
        found[version] = " ".join(f"{etree.QName(one).localname} {one.get('value', '')}".strip() for one in typed)
    assert found == {
        "1.0": "Real Real Integer Integer Boolean Real 1.5 Integer 2 Boolean true Integer 3",
        "2.0": "Float64 Float32 Int32 UInt8 Boolean Float64 1.5 Int32 2 Boolean true Integer 3",
    }


# -- whether others understand it ----------------------------------------------------------------------------------


def closed_form(time: float, J2: float = J2) -> float:
    """Speed of the second mass: a constant acceleration of the centre of mass, and a damped oscillation."""
    total, reduced = J1 + J2, J1 * J2 / (J1 + J2)
    decay = D / (2 * reduced)
    w = np.sqrt(C / reduced - decay**2)
    rate = -M * J2 / (total * C) * np.exp(-decay * time) * (w + decay**2 / w) * np.sin(w * time)
    return float(M / total * time + J1 / total * rate)


def in_ecos(path: Path, step: float) -> list[float]:
    command = [sys.executable, "-c", ECOS, str(path), str(step), str(round(END / step))]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def in_fmpy(path: Path, step: float) -> list[float]:
    table = simulate_ssp(str(path), stop_time=END - step / 2, step_size=step)
    return list(table["wheel.J2_flange_a.w"])


def test_others_run_it(oscillator: Split, tmp_path: Path) -> None:
    """FMPy and ecos do the same; both hand on what outputs were before the inputs of a step had reached them.

    Which is a master of first order: what two steps extrapolate to is what the closed form says, and what `cosim`
    comes to with slopes.
    """
    path = write_ssp(oscillator.system, tmp_path / "system.ssp")
    truth = closed_form(END)
    ends: list[float] = []
    for step in (1e-4, 5e-5):
        speeds = in_ecos(path, step)
        assert np.abs(np.array(in_fmpy(path, step)) - speeds).max() < 1e-9
        ends.append(speeds[-1])
    coarse, fine = (abs(end - truth) for end in ends)
    assert coarse / fine == pytest.approx(2.0, abs=0.1)
    assert 2 * ends[1] - ends[0] == pytest.approx(truth, rel=2e-3)
    assert cosim(path, END, step=1e-4)["J2.w"][-1] == pytest.approx(truth, rel=2e-3)


def test_ecos_applies_the_parameters(oscillator: Split, tmp_path: Path) -> None:
    motor, wheel = oscillator.system.units
    heavy = replace(oscillator.system, units=(motor, replace(wheel, parameters={"J2.J": 2 * J2})))
    ends = [in_ecos(write_ssp(heavy, tmp_path / "heavy.ssp"), step)[-1] for step in (1e-4, 5e-5)]
    assert 2 * ends[1] - ends[0] == pytest.approx(closed_form(END, 2 * J2), rel=2e-3)


# -- foreign packages ----------------------------------------------------------------------------------------------

HEAD = " ".join(f'xmlns:{name}="{space}"' for name, space in NAMES.items() if name != "ml")
RPM = (
    '<ssd:Units><ssc:Unit name="rpm"><ssc:BaseUnit s="-1" rad="1" factor="0.10471975511965977"/></ssc:Unit></ssd:Units>'
)

KILO = '<ssd:Units><ssc:Unit name="kN.m"><ssc:BaseUnit kg="1" m="2" s="-2" factor="1000"/></ssc:Unit></ssd:Units>'


def foreign(path: Path, system: str, files: Mapping[str, bytes], after: str = "") -> Path:
    """Write an SSP by hand: `system` is what stands in the outermost System, `after` what comes behind it."""
    text = f"""<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription {HEAD} version="1.0" name="bench">
<ssd:System name="root">{system}</ssd:System>{after}
</ssd:SystemStructureDescription>"""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("SystemStructure.ssd", text)
        for name, content in files.items():
            archive.writestr(name, content)
    return path


def loaded(path: Path) -> System:
    work = path.with_suffix("")
    work.mkdir()
    return load_ssp(path, work)


def bound(values: str, prefix: str = "") -> str:
    return f"""<ssd:ParameterBinding prefix="{prefix}"><ssd:ParameterValues>
<ssv:ParameterSet version="1.0" name="set"><ssv:Parameters>{values}</ssv:Parameters></ssv:ParameterSet>
</ssd:ParameterValues></ssd:ParameterBinding>"""


MOTOR = """<ssd:Component name="DC motor" source="resources/the%20motor.fmu"><ssd:Connectors>
<ssd:Connector name="shaft_flange_b.tau" kind="output"><ssc:Real unit="N.m"/></ssd:Connector>
<ssd:Connector name="shaft_flange_b.phi" kind="input"/><ssd:Connector name="shaft_flange_b.w" kind="input"/>
</ssd:Connectors></ssd:Component>"""
WHEEL = """<ssd:Component name="wheel" source="resources/wheel.fmu"><ssd:Connectors>
<ssd:Connector name="J2_flange_a.tau" kind="input"/><ssd:Connector name="J2_flange_a.phi" kind="output"/>
<ssd:Connector name="J2_flange_a.w" kind="output"/></ssd:Connectors></ssd:Component>"""
NESTED = f"""
<ssd:Connectors><ssd:Connector name="speed" kind="output"/></ssd:Connectors>
<ssd:Elements>{MOTOR}<ssd:System name="load">
<ssd:Connectors><ssd:Connector name="torque" kind="input"/><ssd:Connector name="angle" kind="output"/>
<ssd:Connector name="speed" kind="output"/></ssd:Connectors>
<ssd:Elements>{WHEEL}</ssd:Elements>
<ssd:Connections>
<ssd:Connection startConnector="torque" endElement="wheel" endConnector="J2_flange_a.tau"/>
<ssd:Connection startConnector="angle" endElement="wheel" endConnector="J2_flange_a.phi"/>
<ssd:Connection startElement="wheel" startConnector="J2_flange_a.w" endConnector="speed"/>
</ssd:Connections></ssd:System></ssd:Elements>
<ssd:Connections>
<ssd:Connection startElement="DC motor" startConnector="shaft_flange_b.tau" endElement="load" endConnector="torque"/>
<ssd:Connection startElement="load" startConnector="angle" endElement="DC motor" endConnector="shaft_flange_b.phi"/>
<ssd:Connection startElement="DC motor" startConnector="shaft_flange_b.w" endElement="load" endConnector="speed"/>
<ssd:Connection startElement="load" startConnector="speed" endConnector="speed"/>
</ssd:Connections>"""
"""Ends in both orders, a name with a blank, a source with an escape, outputs of the system itself."""


@pytest.fixture
def fmus(oscillator: Split) -> dict[str, bytes]:
    motor, wheel = (unit.file.read_bytes() for unit in oscillator.system.units)
    return {"resources/the motor.fmu": motor, "resources/wheel.fmu": wheel}


def test_systems_inside_are_taken_apart(fmus: dict[str, bytes], tmp_path: Path) -> None:
    after = '<ssd:DefaultExperiment startTime="0" stopTime="0.3"/>'
    system = loaded(foreign(tmp_path / "bench.ssp", NESTED, fmus, after))
    assert [unit.name for unit in system.units] == ["DC_motor", "load_wheel"]
    assert {str(link) for link in system.links} == {
        "DC_motor.shaft_flange_b.tau → load_wheel.J2_flange_a.tau",
        "load_wheel.J2_flange_a.phi → DC_motor.shaft_flange_b.phi",
        "load_wheel.J2_flange_a.w → DC_motor.shaft_flange_b.w",
    }
    assert (system.name, system.settings, system.own_names) == ("bench", Settings(until=0.3), False)
    (bond,) = system.bonds
    assert bond.name == "shaft_flange_b"


def test_a_foreign_package_runs(fmus: dict[str, bytes], oscillator: Split, tmp_path: Path) -> None:
    run = cosim(foreign(tmp_path / "bench.ssp", NESTED, fmus), 0.02, step=1e-4)
    assert np.array_equal(run["load_wheel.J2.w"], cosim(oscillator.system, 0.02, step=1e-4)["J2.w"])


def test_values_from_everywhere(fmus: dict[str, bytes], tmp_path: Path) -> None:
    """The later of two bindings counts, the outer of two elements; units are converted; unknown names are let go."""
    inner = bound('<ssv:Parameter name="J2.J"><ssv:Real value="1"/></ssv:Parameter>'
                  '<ssv:Parameter name="J2.w"><ssv:Real value="7"/></ssv:Parameter>'
                  '<ssv:Parameter name="nothing"><ssv:Real value="7"/></ssv:Parameter>'
                  '<ssv:Parameter name="J2_flange_a.tau"><ssv:Real value="3"/></ssv:Parameter>')  # fmt: skip
    outer = bound('<ssv:Parameter name="J2.J"><ssv:Real value="2"/></ssv:Parameter>', "wheel.")
    last = bound('<ssv:Parameter name="wheel.J2.w"><ssv:Real value="60" unit="rpm"/></ssv:Parameter>')
    wheel = WHEEL.replace("</ssd:Component>", f"<ssd:ParameterBindings>{inner}</ssd:ParameterBindings></ssd:Component>")
    text = f"<ssd:ParameterBindings>{outer}{last}</ssd:ParameterBindings><ssd:Elements>{wheel}</ssd:Elements>"
    (unit,) = loaded(foreign(tmp_path / "bench.ssp", text, fmus, RPM)).units
    assert unit.parameters == pytest.approx({"J2.J": 2.0, "J2.w": 2 * np.pi, "J2_flange_a.tau": 3.0}, rel=1e-12)


def test_values_of_a_file_with_units_of_its_own(fmus: dict[str, bytes], tmp_path: Path) -> None:
    values = f"""<ssv:ParameterSet {HEAD} version="1.0" name="set"><ssv:Parameters>
<ssv:Parameter name="J2.J"><ssv:Real value="80" unit="g.m2"/></ssv:Parameter></ssv:Parameters>
<ssv:Units><ssc:Unit name="g.m2"><ssc:BaseUnit kg="1" m="2" factor="0.001"/></ssc:Unit></ssv:Units>
</ssv:ParameterSet>"""
    wheel = WHEEL.replace(
        "</ssd:Component>",
        '<ssd:ParameterBindings><ssd:ParameterBinding source="values.ssv"/></ssd:ParameterBindings></ssd:Component>',
    )
    path = foreign(
        tmp_path / "bench.ssp", f"<ssd:Elements>{wheel}</ssd:Elements>", fmus | {"values.ssv": values.encode()}
    )
    (unit,) = loaded(path).units
    assert unit.parameters == pytest.approx({"J2.J": 0.08}, rel=1e-12)


def test_a_value_of_the_system_reaches_what_is_connected_to_it(fmus: dict[str, bytes], tmp_path: Path) -> None:
    """An input of the system that nothing drives is a constant, in its own unit; a parameter is passed on."""
    given = '<ssv:Parameter name="load"><ssv:Real value="3"/></ssv:Parameter>'
    given += '<ssv:Parameter name="inertia"><ssv:Real value="0.5"/></ssv:Parameter>'
    wheel = WHEEL.replace("<ssd:Connectors>", '<ssd:Connectors><ssd:Connector name="J2.J" kind="parameter"/>')
    text = f"""<ssd:Connectors><ssd:Connector name="load" kind="input"><ssc:Real unit="kN.m"/></ssd:Connector>
<ssd:Connector name="inertia" kind="parameter"/></ssd:Connectors>
<ssd:ParameterBindings>{bound(given)}</ssd:ParameterBindings><ssd:Elements>{wheel}</ssd:Elements>
<ssd:Connections><ssd:Connection startConnector="load" endElement="wheel" endConnector="J2_flange_a.tau"/>
<ssd:Connection startConnector="inertia" endElement="wheel" endConnector="J2.J"/></ssd:Connections>"""
    system = loaded(foreign(tmp_path / "bench.ssp", text, fmus, KILO))
    assert system.links == ()
    assert system.units[0].parameters == {"J2_flange_a.tau": 3000.0, "J2.J": 0.5}


def test_a_conversion_of_units_that_is_to_be_suppressed(fmus: dict[str, bytes], tmp_path: Path) -> None:
    wheel = WHEEL.replace('tau" kind="input"/>', 'tau" kind="input"><ssc:Real unit="kN.m"/></ssd:Connector>')
    text = f"""<ssd:Elements>{MOTOR}{wheel}</ssd:Elements><ssd:Connections><ssd:Connection suppressUnitConversion="true"
startElement="DC motor" startConnector="shaft_flange_b.tau" endElement="wheel" endConnector="J2_flange_a.tau"/>
</ssd:Connections>"""
    (link,) = loaded(foreign(tmp_path / "bench.ssp", text, fmus, KILO)).links
    assert link.name == "DC_motor_shaft_flange_b_tau"
