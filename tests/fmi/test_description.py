"""modelDescription.xml: valid for every example, and true: names, units, start values, dependencies."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy
import lxml.etree as etree
import numpy as np
import pytest
from fmpy.validation import validate_fmu

from components import AngleToTorqueAdaptor, Clutch, Fixed, Inertia, SpringDamper, Torque
from modelica_like import build
from modelica_like.compile import CompiledDae
from modelica_like.fmi.check import description_problems
from modelica_like.fmi.dependencies import Dependencies, solved_rows
from modelica_like.fmi.description import About, identifier, model_description
from modelica_like.fmi.interface import Interface, fmi_name, interface
from modelica_like.fmi.sources import LOG_CATEGORIES
from modelica_like.language import Assembly
from modelica_like.native.start import initialize
from modelica_like.solve.initialize import call

EXAMPLES = Path(__file__).parents[2] / "examples"
NETLISTS = sorted(
    p.relative_to(EXAMPLES).as_posix() for p in EXAMPLES.rglob("*.toml") if not {"sizing", "cosim"} & set(p.parts)
)
MSL = "msl/rotational"


def described(model: CompiledDae, version: Any, faces: Interface | None = None) -> str:
    about = About(
        version, frozenset({"me", "cs"}), "{t}", "a & <b>", 1.5, 1e-6, 0.01, ("model.c",), dict(LOG_CATEGORIES), "tests"
    )  # fmt: skip
    return model_description(model, faces or interface(model), about)


def read(model: CompiledDae, version: str, folder: Path) -> Any:
    (folder / "modelDescription.xml").write_text(described(model, version), encoding="utf-8")
    return fmpy.read_model_description(folder, validate=True, validate_variable_names=True)


@pytest.mark.parametrize("netlist", NETLISTS)
def test_valid_for_every_example(netlist: str, tmp_path: Path) -> None:
    model = build(EXAMPLES / netlist)
    faces = interface(model)
    for version in ("2.0", "3.0"):
        (tmp_path / "modelDescription.xml").write_text(described(model, version, faces), encoding="utf-8")
        assert description_problems(tmp_path) == []


@pytest.mark.parametrize("netlist", ["machine_tool_startup.toml", f"{MSL}/Backlash.toml", f"{MSL}/First.toml"])
def test_the_slow_check_of_names_agrees(netlist: str, tmp_path: Path) -> None:
    (tmp_path / "modelDescription.xml").write_text(described(build(EXAMPLES / netlist), "3.0"), encoding="utf-8")
    assert validate_fmu(str(tmp_path)) == []


@pytest.mark.parametrize("name", ["a b", "der(a", "a..b", "der(der(a))", "1a", "a[0", "ä", "der(a,b)", ""])
def test_illegal_names_are_told(name: str, tmp_path: Path) -> None:
    text = described(build(EXAMPLES / "two_mass.toml"), "3.0").replace('name="J1.J"', f'name="{name}"')
    (tmp_path / "modelDescription.xml").write_text(text, encoding="utf-8")
    assert description_problems(tmp_path) == [f"The variable name '{name}' is not legal."]


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_names_are_those_of_python(version: str, tmp_path: Path) -> None:
    model = build(EXAMPLES / MSL / "CoupledClutches.toml")
    names = {one.name for one in read(model, version, tmp_path).modelVariables}
    ours = [one.path for one in (*model.flat_variables, *model.flat_parameters, *model.flat_derived)]
    assert names >= {*ours, *(one.path for one in model.flat_discretes), *(f"der({name})" for name in model.states)}


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_units_mean_what_they_say(version: str, tmp_path: Path) -> None:
    description = read(build(EXAMPLES / "dc_bench.toml"), version, tmp_path)
    units = {unit.name: unit for unit in description.unitDefinitions}
    shown = {
        unit.name: (float(unit.factor or 1), float(unit.offset or 0)) for u in units.values() for unit in u.displayUnits
    }
    assert shown["rpm"][0] * 100.0 == pytest.approx(954.929658551372)  # 100 rad/s
    assert shown["deg"][0] * np.pi == pytest.approx(180.0)
    base = units["V"].baseUnit
    assert [int(getattr(base, name) or 0) for name in ("kg", "m", "s", "A", "rad")] == [1, 2, -3, -1, 0]
    speeds = [one for one in description.modelVariables if one.unit == "rad/s"]
    assert speeds
    assert all(one.displayUnit == "rpm" for one in speeds)


def test_one_variable_per_line() -> None:
    model = build(EXAMPLES / MSL / "First.toml")
    for version, tag in (("2.0", "<ScalarVariable "), ("3.0", "<Float64 ")):
        lines = [line for line in described(model, version).splitlines() if tag in line]
        assert len(lines) == sum(version == "2.0" or one.type == "Float64" for one in interface(model).variables)


def test_text_is_escaped() -> None:
    top = etree.fromstring(described(build(EXAMPLES / "two_mass.toml"), "3.0").encode())
    assert top.get("description") == "a & <b>"


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_modes_are_discrete_outputs_with_names(version: str, tmp_path: Path) -> None:
    description = read(build(EXAMPLES / MSL / "CoupledClutches.toml"), version, tmp_path)
    mode = next(one for one in description.modelVariables if one.name == "clutch1.mode")
    assert (mode.causality, mode.variability) == ("output", "discrete")
    assert mode.type == "Enumeration"
    assert tuple(item.name for item in mode.declaredType.items) == Clutch.mode.names
    assert [int(item.value) for item in mode.declaredType.items] == list(range(len(Clutch.mode.names)))


def test_start_values_belong_to_the_names_they_were_given_for() -> None:
    faces = interface(build(EXAMPLES / MSL / "CoupledClutches.toml"))
    given = {one.name: one.start for one in faces.variables if one.initial == "exact"}
    assert given == {"J1.w": 10.0, "J1.phi": 0.0} | {f"J{k}.{v}": 0.0 for k in (2, 3, 4) for v in ("phi", "w")}


def test_bounds_nominals_and_descriptions_are_kept() -> None:
    faces = interface(build(EXAMPLES / MSL / "EddyCurrentBrake.toml"))
    assert (faces.by_name["inertia.J"].min, faces.by_name["inertia.J"].description) == (0.0, "moment of inertia")
    assert (faces.by_name["heatCapacitor.T"].nominal, str(faces.by_name["heatCapacitor.T"].unit)) == (300.0, "K")


def test_every_state_has_its_derivative() -> None:
    model = build(EXAMPLES / MSL / "First.toml")
    faces = interface(model)
    assert [faces.variables[k].derivative_of for k in faces.derivatives] == list(faces.states)
    # The speed behind `spring.phi_rel` has no name of its own: it is a derivative and a state.
    assert [faces.variables[k].name for k in faces.states] == list(map(fmi_name, model.states))


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("der(a.b)", "der(a.b)"),
        ("der(der(a.b[1]))", "der(a.b[1],2)"),
        ("a.der", "a.der"),
        ("der(der(der(x)))", "der(x,3)"),
    ],
)
def test_structured_names(name: str, expected: str) -> None:
    assert fmi_name(name) == expected


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("CoupledClutches", "CoupledClutches"),
        ("my drive-train", "my_drive_train"),
        ("3 masses", "model_3_masses"),
        ("öl", "l"),
        ("ä", "model"),
        ("drive " * 50, "drive_" * 10 + "dri"),
    ],
)
def test_identifiers(name: str, expected: str) -> None:
    assert identifier(name) == expected


# -- dependencies ------------------------------------------------------------------------------------------------------


def test_dependencies_through_blocks() -> None:
    # x2 = p0; x2, x0: p1; x0, x1: p2
    p0, p1, p2 = ("p", 0), ("p", 1), ("p", 2)
    assert solved_rows([{2}, {2, 0}, {0, 1}], [{p0}, {p1}, {p2}], 3) == [{p0, p1}, {p0, p1, p2}, {p0}]


@pytest.mark.parametrize("netlist", ["dc_bench.toml", f"{MSL}/First.toml", "msl/dcmachines/DCPM_Start.toml"])
def test_what_changes_at_the_start_is_listed(netlist: str) -> None:
    """Every parameter that moves a state or derivative at the start is among its dependencies."""
    model = build(EXAMPLES / netlist)
    faces = interface(model)
    dependencies = Dependencies(model, faces)
    unknowns = [faces.variables[k] for k in (*faces.states, *faces.derivatives)]
    listed = [set(dependencies.initial(one)) for one in unknowns]
    before = _start(model)
    found = 0
    for k, one in enumerate(model.flat_parameters):
        p = model.p.copy()
        p[k] += 1e-3 * max(abs(p[k]), 1e-3)
        changed = np.abs(_start(replace(model, p=p, _cache={})) - before) > 1e-9 * (1 + np.abs(before))
        reference = faces.by_name[one.path].reference
        missing = [
            u.name
            for u, known, moved in zip(unknowns, listed, changed, strict=True)
            if moved and reference not in known
        ]
        assert not missing, one.path
        found += int(changed.sum())
    assert found > 0


def _start(model: CompiledDae) -> Any:
    point = initialize(model, 0.0, model.settings.get("start", "given"))
    return np.concatenate([point.x, call(model, model.equations.ode, point)])


def test_a_chain_depends_on_its_neighbours_only() -> None:
    parts: dict[str, Any] = {"wall": Fixed()}
    for k in range(1, 9):
        parts[f"spring{k}"] = SpringDamper(c=10.0, d=1.0)
        parts[f"J{k}"] = Inertia(J=1.0, phi=0.0, w=0.0)
    model = build(Assembly("chain", parts=parts, series={"all": list(parts)}))
    faces = interface(model)
    dependencies = Dependencies(model, faces)
    while_running = [len(dependencies.continuous(faces.variables[k])) for k in faces.derivatives]
    assert max(while_running) == 6  # three springs: each a twist and its rate
    # A relative angle at the start follows from the two angles beside it.
    at_start = [dependencies.initial(faces.variables[k]) for k in faces.states]
    assert max(map(len, at_start)) <= 3


def test_outputs_know_their_inputs() -> None:
    parts = {
        "end": AngleToTorqueAdaptor(),
        "spring": SpringDamper(c=10.0, d=1.0),
        "wall": Fixed(),
        "motor": Torque(),
        "J": Inertia(J=1.0, phi=0.0, w=0.0),
    }
    drive = Assembly(
        "two",
        parts=parts,
        connect={
            "a": ["end.flange", "spring.flange_a"],
            "b": ["spring.flange_b", "wall.flange"],
            "c": ["motor.flange", "J.flange_a"],
        },
    )
    from modelica_like.fmi.export import compiled_open

    model, _, _ = compiled_open(drive, (), "flow", ())
    faces = interface(model)
    names = [faces.variables[k].name for k in Dependencies(model, faces).continuous(faces.by_name["end.tau"])]
    assert names == ["end.phi", "end.w"]
