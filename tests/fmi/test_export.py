"""Exported FMUs as an importer gets them: files, terminals, parameters and start values, recompiled sources."""

import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import lxml.etree as etree
import numpy as np
import pytest
from fmpy.validation import validate_fmu

import components
from components import (
    AngleToTorqueAdaptor,
    CurrentToVoltageAdaptor,
    Fixed,
    ForceToPositionAdaptor,
    Ground,
    HeatFlowToTemperatureAdaptor,
    Inertia,
    Mass,
    PositionToForceAdaptor,
    Resistor,
    SpringDamper,
    TemperatureToHeatFlowAdaptor,
    ThermalMass,
    VoltageToCurrentAdaptor,
)
from modelica_like import build, export_fmu, load, schematic, simulate
from modelica_like.errors import UnknownName
from modelica_like.fmi import export
from modelica_like.fmi.build import PLATFORMS, native_platform
from modelica_like.fmi.check import problems
from modelica_like.fmi.export import Export
from modelica_like.fmi.run import run_fmu
from modelica_like.fmi.terminals import with_open_ends
from modelica_like.language import Assembly

EXAMPLES = Path(__file__).parents[2] / "examples"
VERSIONS = ["2.0", "3.0"]


def flywheel() -> Assembly:
    """J der(w) = tau, with tau from outside."""
    drive = Assembly("flywheel", parts={"J": Inertia(J="2 kg.m2", phi=0.0, w="3 rad/s")}, description="one inertia")
    drive.expose("shaft", "J.flange_b")
    drive.simulate["until"] = "2 s"
    return drive


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Export]:
    folder = tmp_path_factory.mktemp("export")
    done: dict[str, Export] = {}

    def get(version: str) -> Export:
        if version not in done:
            done[version] = export_fmu(flywheel(), folder / f"flywheel{version}.fmu", version)
        return done[version]

    return get


def member(path: Path, name: str) -> bytes:
    with zipfile.ZipFile(path) as archive:
        return archive.read(name)


# -- what it does ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("kind", ["me", "cs"])
def test_parameters_starts_and_inputs_count(exported: Callable[[str], Export], version: str, kind: Any) -> None:
    given = {"J.J": 5.0, "J.w": 7.0}
    run = run_fmu(exported(version).path, {"shaft_end.tau": 4.0}, given, kind=kind, step=0.1, tolerance=1e-9)
    np.testing.assert_allclose(run["J.w"], 7.0 + 4.0 / 5.0 * run.time, rtol=1e-7)
    np.testing.assert_allclose(run["shaft_end.phi"], 7.0 * run.time + 0.4 * run.time**2, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(run["shaft_end.a"], 0.8, rtol=1e-9)


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("kind", ["me", "cs"])
@pytest.mark.parametrize("step", [0.4, 0.01])
def test_ramps_and_jumps_of_inputs_are_met(
    exported: Callable[[str], Export], version: str, kind: Any, step: float
) -> None:
    """J der(w) = 4 t until 1 s, then -2, whatever the steps are."""
    torque = [(0.0, 0.0), (1.0, 4.0), (1.0, -2.0), (2.0, -2.0)]
    run = run_fmu(exported(version).path, {"shaft_end.tau": torque}, kind=kind, step=step, tolerance=1e-9)
    t, late = run.time, run.time - 1.0
    before = t < 1.0
    np.testing.assert_allclose(run["J.w"], np.where(before, 3 + t**2, 4 - late), rtol=1e-6)
    angle = np.where(before, 3 * t + t**3 / 3, 10 / 3 + 4 * late - late**2 / 2)
    np.testing.assert_allclose(run["J.phi"], angle, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(run["shaft_end.tau"][before], 4 * t[before], rtol=1e-12, atol=1e-12)


def test_start_values_that_are_equations_count(tmp_path: Path) -> None:
    """The speed of an inertia behind a gear and a spring is no state; the states follow from it."""
    netlist = EXAMPLES / "msl/rotational/First.toml"
    export_fmu(netlist, tmp_path / "first.fmu", "3.0", check=False)
    run = run_fmu(
        tmp_path / "first.fmu", parameters={"inertia3.w": 2.0, "Jload": 1.0}, stop=0.5, step=0.1, tolerance=1e-9
    )
    drive = load(netlist)
    drive.set("inertia3.w", 2.0)
    drive.set("Jload", 1.0)
    truth = simulate(drive, 0.5, points=5, rtol=1e-10, atol=1e-12)
    for name in ("inertia3.w", "inertia2.phi", "spring.tau"):
        np.testing.assert_allclose(run[name], truth[name], rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("version", VERSIONS)
def test_validated_and_told(exported: Callable[[str], Export], version: str) -> None:
    done = exported(version)
    assert validate_fmu(str(done.path)) == []
    assert problems(done.path) == []
    pattern = rf"\S+\.fmu: FMI {version}, Model Exchange and Co-Simulation, \d+ kB, {native_platform()}, \d+\.\d s"
    assert re.fullmatch(pattern, str(done))
    assert done.size == done.path.stat().st_size < 330_000


@pytest.mark.parametrize("version", VERSIONS)
def test_capabilities(exported: Callable[[str], Export], version: str) -> None:
    description: Any = fmpy.read_model_description(str(exported(version).path))
    sides = (description.modelExchange, description.coSimulation)
    assert all(str(one.canGetAndSetFMUstate) in ("True", "true") for one in sides)
    assert {one.modelIdentifier for one in sides} == {"flywheel"}
    assert float(description.defaultExperiment.stopTime) == 2.0


@pytest.mark.parametrize("version", [pytest.param("2.0", marks=pytest.mark.slow), "3.0"])
def test_sources_make_the_same_fmu(exported: Callable[[str], Export], version: str, tmp_path: Path) -> None:
    path = tmp_path / "copy.fmu"
    shutil.copy(exported(version).path, path)
    before = run_fmu(path, {"shaft_end.tau": 4.0}, step=0.1)
    subprocess.run([sys.executable, "-m", "fmpy", "compile", str(path)], check=True, capture_output=True, timeout=120)
    native = PLATFORMS[native_platform()]
    home = native.fmi2 if version == "2.0" else native.name
    libraries = [member(one, f"binaries/{home}/flywheel{native.suffix}") for one in (path, exported(version).path)]
    assert libraries[0] != libraries[1]  # it was compiled again
    after = run_fmu(path, {"shaft_end.tau": 4.0}, step=0.1)
    np.testing.assert_allclose(after["J.w"], before["J.w"], rtol=1e-12)


# -- what it holds -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
def test_same_model_same_bytes(version: str, tmp_path: Path) -> None:
    paths = [tmp_path / f"{k}.fmu" for k in range(3)]
    for path in paths[:2]:
        export_fmu(flywheel(), path, version, platforms=())
    other = flywheel()
    other.set("J.J", 3.0)
    export_fmu(other, paths[2], version, platforms=())
    first, second, third = (path.read_bytes() for path in paths)
    assert first == second
    tokens = [fmpy.read_model_description(str(path)).guid for path in paths]
    assert tokens[0] == tokens[1] != tokens[2]
    assert third != first


def test_token_is_the_same_in_description_and_code(exported: Callable[[str], Export]) -> None:
    path = exported("3.0").path
    token = fmpy.read_model_description(str(path)).guid
    assert token.encode() in member(path, "resources/model.bin")
    words = re.findall(r"0x(\w+)u", member(path, "sources/model_data.c").decode())
    assert b"".join(int(word, 16).to_bytes(8, "little") for word in words) == member(path, "resources/model.bin")


def test_a_single_component(tmp_path: Path) -> None:
    export_fmu(Inertia(J=2.0, phi=0.0, w=1.0), tmp_path / "inertia.fmu", "2.0")
    run = run_fmu(tmp_path / "inertia.fmu", stop=0.5, inputs={"inertia_flange_a.tau": 3.0, "inertia_flange_b.tau": 1.0})
    assert run.final["inertia.w"] == pytest.approx(1.0 + 4.0 / 2.0 * 0.5, rel=1e-9)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_licences_of_the_sources_are_in_the_fmu(exported: Callable[[str], Export], version: str) -> None:
    text = member(exported(version).path, "documentation/licenses/license.txt").decode()
    assert (EXAMPLES.parent / "LICENSE").read_text(encoding="utf-8") in text
    assert 'Modelica Association Project "FMI"' in text
    assert "Redistributions in binary form must reproduce" in text


def test_page_lists_variables_and_equations(exported: Callable[[str], Export]) -> None:
    page = member(exported("3.0").path, "documentation/index.html").decode()
    assert all(
        text in page for text in ("<h1>flywheel</h1>", "<code>shaft_end.tau</code>", "yield self.J * der(self.w)")
    )


def test_kinds_can_be_chosen(tmp_path: Path) -> None:
    for kind in ("me", "cs"):
        export_fmu(flywheel(), tmp_path / "one.fmu", "3.0", {kind}, ())
        description: Any = fmpy.read_model_description(str(tmp_path / "one.fmu"))
        assert (description.modelExchange is not None, description.coSimulation is not None) == (
            kind == "me",
            kind == "cs",
        )


def test_further_outputs(tmp_path: Path) -> None:
    export_fmu(flywheel(), tmp_path / "one.fmu", platforms=(), outputs=["J.w"])
    description: Any = fmpy.read_model_description(str(tmp_path / "one.fmu"))
    assert "J.w" in {one.variable.name for one in description.outputs}


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize(
    ("modes", "kind", "causality"), [("local", "Enumeration", "local"), ("integer", "Integer", "output")]
)
def test_modes_for_importers_that_know_no_enumerations(
    version: str, modes: str, kind: str, causality: str, tmp_path: Path
) -> None:
    path = export_fmu(
        EXAMPLES / "machine_table_direct.toml", tmp_path / "m.fmu", version, modes=modes, check=False
    ).path
    assert validate_fmu(str(path)) == []
    description: Any = fmpy.read_model_description(str(path))
    (mode,) = (one for one in description.modelVariables if one.name == "clutch.mode")
    assert (mode.type.replace("Int64", "Integer"), mode.causality) == (kind, causality)
    assert ("clutch.mode" in {one.variable.name for one in description.outputs}) == (causality == "output")
    run = run_fmu(path, outputs=["clutch.mode"])
    truth = simulate(EXAMPLES / "machine_table_direct.toml")
    assert [e.time for e in run.events] == pytest.approx([e.time for e in truth.events if e.mode == "clutch.mode"])
    assert run.final["clutch.mode"] == truth.final["clutch.mode"]


def test_another_way_of_modes_is_told(tmp_path: Path) -> None:
    with pytest.raises(UnknownName, match="There are output, local, integer"):
        export_fmu(flywheel(), tmp_path / "x.fmu", platforms=(), modes="real")


def test_a_compiled_model_can_be_exported(tmp_path: Path) -> None:
    model = build(EXAMPLES / "two_mass.toml")
    assert export_fmu(model, tmp_path / "two_mass.fmu", "3.0", platforms=()).platforms == ()


# -- terminals ---------------------------------------------------------------------------------------------------------


def test_terminal_of_an_exposed_flange(exported: Callable[[str], Export]) -> None:
    path = exported("3.0").path
    top = etree.fromstring(member(path, "terminalsAndIcons/terminalsAndIcons.xml"))
    (terminal,) = top.iter("Terminal")
    assert terminal.get("name") == "shaft_end"
    assert terminal.get("terminalKind") == "org.modelica.mechanics.rotational.flange"
    members = {one.get("memberName"): one.get("variableName") for one in terminal.iter("TerminalMemberVariable")}
    assert members == {name: f"shaft_end.{name}" for name in ("phi", "w", "a", "tau")}
    assert member(path, "terminalsAndIcons/rotational.png").startswith(b"\x89PNG")


def test_the_icon_is_the_schematic(tmp_path: Path) -> None:
    drive = load(EXAMPLES / "machine_table_direct.toml")
    paths = {version: export_fmu(drive, tmp_path / f"{version}.fmu", version, check=False).path for version in VERSIONS}
    picture = member(paths["2.0"], "model.png")
    svg = member(paths["3.0"], "terminalsAndIcons/icon.svg")
    assert svg.decode() == schematic(drive, depth=0)
    assert member(paths["3.0"], "terminalsAndIcons/icon.png") == picture
    top = etree.fromstring(member(paths["3.0"], "terminalsAndIcons/terminalsAndIcons.xml"))
    (icon,) = top.iter("Icon")
    wide, high = (float(icon.get(f"{way}2")) - float(icon.get(f"{way}1")) for way in "xy")
    size = etree.fromstring(svg)
    assert high / wide == pytest.approx(float(size.get("height")) / float(size.get("width")), rel=2e-3), "whole pixels"
    export_fmu(drive, tmp_path / "again.fmu", check=False)
    assert (tmp_path / "again.fmu").read_bytes() == paths["2.0"].read_bytes()


def test_what_cannot_be_drawn_has_the_general_icon(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drive = load(EXAMPLES / "two_mass.toml")
    general = (Path(export.__file__).parent / "pictures/icon.png").read_bytes()
    export_fmu(build(drive), tmp_path / "compiled.fmu", platforms=())
    assert member(tmp_path / "compiled.fmu", "model.png") == general
    monkeypatch.setattr("modelica_like.show.draw.find_spec", lambda _: None)
    export_fmu(drive, tmp_path / "no_extra.fmu", platforms=())
    assert member(tmp_path / "no_extra.fmu", "model.png") == general


ENDS = [
    (Inertia(J=2.0, phi=0.0, w=0.0), "flange_b", "flow", {"phi", "w", "a", "tau"}, "rotational"),
    (Inertia(J=2.0), "flange_b", "potential", {"phi", "w", "a", "tau"}, "rotational"),
    (Mass(m=2.0, s=0.0, v=0.0), "flange_b", "flow", {"s", "v", "a", "f"}, "translational"),
    (Mass(m=2.0), "flange_b", "potential", {"s", "v", "a", "f"}, "translational"),
    (ThermalMass(C=3.0, T=300.0), "port", "flow", {"T", "Q_flow"}, "thermal"),
]


@pytest.mark.parametrize(("part", "end", "takes", "members", "family"), ENDS)
def test_every_kind_of_end(part: Any, end: str, takes: Any, members: set[str], family: str, tmp_path: Path) -> None:
    drive = Assembly("drive", parts={"part": part})
    export_fmu(drive, tmp_path / "d.fmu", "3.0", platforms=(), ends=[f"part.{end}"], takes=takes)
    top = etree.fromstring(member(tmp_path / "d.fmu", "terminalsAndIcons/terminalsAndIcons.xml"))
    (terminal,) = top.iter("Terminal")
    assert terminal.get("name") == f"part_{end}"
    assert {one.get("memberName") for one in terminal.iter("TerminalMemberVariable")} == members
    assert family in terminal.get("terminalKind")


def test_a_moved_inertia_answers_with_its_torque(tmp_path: Path) -> None:
    drive = Assembly("inverse", parts={"J": Inertia(J=2.0)})
    export_fmu(drive, tmp_path / "i.fmu", ends=["J.flange_a"], takes="potential", check=False)
    moved = {"J_flange_a.phi": 1.0, "J_flange_a.w": 0.5, "J_flange_a.a": 3.0}
    run = run_fmu(tmp_path / "i.fmu", moved, stop=1.0, step=0.5, kind="cs")
    np.testing.assert_allclose(run["J_flange_a.tau"], -6.0)
    np.testing.assert_allclose(run["J.w"], 0.5)


def test_a_moved_spring_and_damper_answer_with_their_torque() -> None:
    parts = {"end": AngleToTorqueAdaptor(), "shaft": SpringDamper(c=100.0, d=3.0), "wall": Fixed()}
    wires = {"a": ["end.flange", "shaft.flange_a"], "b": ["shaft.flange_b", "wall.flange"]}
    assert answer(Assembly("d", parts=parts, connect=wires), "end.tau", [0.1, 2.0, 5.0]) == pytest.approx(-16.0)


def test_circuits_and_heat_can_be_cut_too() -> None:
    parts = {"end": VoltageToCurrentAdaptor(), "r": Resistor(R=4.0), "zero": Ground()}
    circuit = Assembly("c", parts=parts, connect={"a": ["end.pin", "r.p"], "b": ["r.n", "zero.p"]})
    assert answer(circuit, "end.i", [8.0]) == pytest.approx(-2.0)
    parts["end"] = CurrentToVoltageAdaptor()
    circuit = Assembly("c", parts=parts, connect={"a": ["end.pin", "r.p"], "b": ["r.n", "zero.p"]})
    assert answer(circuit, "end.v", [8.0]) == pytest.approx(32.0)


def answer(drive: Assembly, name: str, inputs: list[float]) -> float:
    """Value of a variable of a drive without states."""
    from modelica_like.compile import compile
    from modelica_like.flatten import flatten
    from modelica_like.structure import reduce

    model = compile(reduce(flatten(drive, open_inputs=True)))
    assert not model.states
    return float(model.equations.variables(0.0, [], [], model.p, inputs, []).full().ravel()[model.position[name]])


def test_opening_leaves_the_drive_alone() -> None:
    drive = flywheel()
    opened = with_open_ends(drive)
    assert list(opened.parts) == ["J", "shaft_end"]
    assert list(drive.parts) == ["J"]
    assert opened.label == drive.label


def test_every_adaptor_is_a_library_type() -> None:
    kinds = {getattr(components, name) for name in components.__all__ if name.endswith("Adaptor")}
    assert kinds >= {
        ForceToPositionAdaptor,
        PositionToForceAdaptor,
        HeatFlowToTemperatureAdaptor,
        TemperatureToHeatFlowAdaptor,
    }
    assert all(kind.terminal is not None for kind in kinds)
