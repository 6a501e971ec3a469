"""The commands about component types: describe, schema, library."""

import json

import jsonschema
import pytest
from typer.testing import CliRunner

from modelica_like.cli import app
from modelica_like.netlist import library_types


@pytest.fixture
def run() -> CliRunner:
    return CliRunner()


def test_library_lists_every_type_with_a_sentence(run: CliRunner) -> None:
    result = run.invoke(app, ["library"])
    assert result.exit_code == 0
    lines = {line.split()[0]: line for line in result.stdout.splitlines()[2:]}
    assert lines.keys() == library_types().keys()
    assert all(len(line.split()) > 3 for line in lines.values())
    assert "Rigid rotating mass." in lines["Inertia"]


@pytest.mark.parametrize("name", sorted(library_types()))
def test_every_type_can_be_described(run: CliRunner, name: str) -> None:
    result = run.invoke(app, ["describe", name])
    assert result.exit_code == 0
    for field in library_types()[name]._class_fields.values():
        assert field.name in result.stdout
        assert field.unit_text in result.stdout


def test_a_description_has_declarations_equations_and_events(run: CliRunner) -> None:
    text = " ".join(run.invoke(app, ["describe", "Clutch"]).stdout.split())
    for expected in ("capacity N.m 0 …", "phi [rad], tau [N.m]", "der(phi_rel) == w_rel", "mode.go("):
        assert expected in text
    assert "self." not in text


def test_equations_of_several_lines_are_told_in_one(run: CliRunner) -> None:
    text = run.invoke(app, ["describe", "PermanentMagnetDCMachine"]).stdout
    lines = [line.strip() for line in text.splitlines()]
    assert "v == resistance(Ra) * ia + brush_voltage(ia) + v_core + series_voltage()" in lines


def test_the_schema_is_a_schema(run: CliRunner) -> None:
    result = run.invoke(app, ["schema"])
    assert result.exit_code == 0
    schema = json.loads(result.stdout)
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["$defs"]["Inertia"]["properties"]["J"]["anyOf"][0] == {"type": "number", "minimum": 0}


@pytest.mark.parametrize(
    ("part", "is_right"),
    [
        ({"is": "Inertia", "J": "1 kg.m2"}, True),
        ({"is": "Inertia", "J": 1, "w": 0, "count": 3}, True),
        ({"is": "Inertia", "J": -1}, False),
        ({"is": "Inertia", "K": 1}, False),
        ({"is": "Inertja"}, False),
        ({"J": 1}, False),
        ({"is": "parts:Coupling", "anything": 1}, True),
        ({"is": "./gearbox.toml", "shaft": {"J": 2}}, True),
    ],
)
def test_the_schema_knows_right_from_wrong(run: CliRunner, part: dict[str, object], is_right: bool) -> None:
    schema = json.loads(run.invoke(app, ["schema"]).stdout)
    validator = jsonschema.Draft202012Validator(schema)
    assert validator.is_valid({"parts": {"a": part}}) is is_right


def test_unknown_types_are_told_on_stderr(run: CliRunner) -> None:
    result = run.invoke(app, ["describe", "Cluch"])
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr.startswith("There is no component type 'Cluch'; did you mean 'Clutch'?\n")


def test_debug_shows_where_an_error_was_raised(run: CliRunner) -> None:
    result = run.invoke(app, ["describe", "Cluch", "--debug"])
    assert type(result.exception).__name__ == "UnknownName"
