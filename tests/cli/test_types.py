"""The commands about component types: describe, schema, library."""

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from calls import called

from modelica_like.analyse.sizing.json_schema import schema as sizing_schema
from modelica_like.errors import UnitError
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Parameter,
    Variable,
    clock,
    der,
    discrete,
    param,
    var,
    when,
)
from modelica_like.language.inside import declarations
from modelica_like.language.units import parse_unit, to_si
from modelica_like.netlist import library_types, load, schema
from modelica_like.netlist.json_units import Quantities
from modelica_like.show.report.component_pages.source import Source
from modelica_like.show.report.statements import statements


@pytest.fixture(scope="module")
def netlists() -> jsonschema.Draft7Validator:
    """Validator of netlists by the schema, which is made once."""
    return jsonschema.Draft7Validator(json.loads(json.dumps(schema())))


def test_library_lists_every_type_with_a_sentence() -> None:
    result = called(["library"])
    assert result.exit_code == 0
    lines = {line.split()[0]: line for line in result.stdout.splitlines()[2:]}
    assert lines.keys() == library_types().keys()
    assert all(len(line.split()) > 3 for line in lines.values())
    assert "Rigid rotating mass." in lines["Inertia"]


@pytest.mark.parametrize("name", sorted(library_types()))
def test_every_type_can_be_described(name: str) -> None:
    result = called(["describe", name])
    assert result.exit_code == 0
    for field in declarations(library_types()[name]).fields.values():
        assert field.name in result.stdout
        assert field.unit_text in result.stdout
    assert "iter(" not in result.stdout
    assert "--" not in result.stdout


def test_a_description_has_declarations_equations_and_events() -> None:
    text = " ".join(called(["describe", "Clutch"]).stdout.split())
    for expected in ("capacity N.m 0 …", "phi [rad], tau [N.m]", "der(phi_rel) == w_rel", "mode.go("):
        assert expected in text
    assert "self." not in text


def test_equations_of_several_lines_are_told_in_one() -> None:
    text = called(["describe", "PermanentMagnetDCMachine"]).stdout
    lines = [line.strip() for line in text.splitlines()]
    assert "v == resistance(Ra) * ia + brush_voltage(ia) + v_core + series_voltage()" in lines


@pytest.mark.parametrize("name", sorted(library_types()))
def test_nothing_in_equations_is_left_undefined(name: str) -> None:
    """Methods of the class that occur in a line are defined below it, and no line is Python about classes."""
    source = Source(library_types()[name])
    lines = [line.strip() for some in statements(source.kind).values() for line in some]
    defined = {re.split(r"[(:= ]", line)[0] for line in lines}
    fields = {
        *declarations(source.kind).fields,
        *declarations(source.kind).modes,
        *declarations(source.kind).structural,
    }
    for line in lines:
        words = set(re.findall(r"(?<![\w.'])[A-Za-z_]\w*\b(?!=[^=])", line))
        methods = {word for word in words if source.method(word) or source.method(f"_{word}")} - fields
        assert methods <= defined, line
        assert not re.search(r"(?<![\w'])_\w|\._\w", line), line
        assert not re.search(r"\bself\.|\bsuper\(|\byield\b", line)


def test_private_names_have_no_underscore_and_meet_no_other() -> None:
    text = called(["describe", "Clutch"]).stdout
    assert re.search(r"^ +soon\(\) = slip \+ creep_time \* der\(slip\) *$", text, re.MULTILINE)
    assert re.search(r"^ +FAINT = 1e-10 *$", text, re.MULTILINE)
    for kind in library_types().values():
        source = Source(kind)
        public = {
            *declarations(kind).fields,
            *declarations(kind).modes,
            *declarations(kind).structural,
            *declarations(kind).connectors,
        }
        private = {name for base in kind.__mro__ for name in vars(base) if re.match("_[a-z]", name)}
        assert [name for name in private if source.method(name) and name.lstrip("_") in public] == []
        assert [name for name in private if source.method(name) and source.method(name.lstrip("_"))] == []


def test_conditions_parts_and_codes_are_told() -> None:
    def lines(name: str) -> list[str]:
        return [line.rstrip() for line in called(["describe", name]).stdout.splitlines()]

    clutch = lines("Clutch")
    assert "    heat_port.Q_flow == -heat()" in clutch
    assert clutch[clutch.index("    heat_port.Q_flow == -heat()") - 1] == "  if heat_port.used:"
    assert {"  dissipation() = friction * slip", "  slip = w_rel", "  friction = tau"} <= set(clutch)
    assert "free (0), stuck (1), start_forward (2)" in "\n".join(clutch)
    servo = library_types()["ServoMotor"]
    begin = lines("ServoMotor").index("parts")
    told = {
        line.split()[0]: line.split()[1] for line in lines("ServoMotor")[begin + 2 :][: len(declarations(servo).parts)]
    }
    assert told == {name: type(part).__name__ for name, part in declarations(servo).parts.items()}


def test_a_netlist_is_described_with_the_parts_of_its_assemblies() -> None:
    file = Path(__file__).parents[2] / "examples" / "lepelletier.toml"
    tables = json.loads(called(["describe", str(file), "--json"]).stdout)["tables"]
    drive = load(file)
    assert [(row["name"], row["type"]) for row in tables["parts"]] == [
        (part.path, type(part).__name__) for part in drive.walk() if part is not drive
    ]
    (clutch,) = (row for row in tables["parts"] if row["name"] == "box.clutch_a")
    assert clutch["values"] == "capacity = 500 N.m"
    assert "clutch_a: selector.a = box.pressure_a" in tables["connections"]
    startup = called(["describe", str(file.with_name("machine_tool_startup.toml"))]).stdout
    assert re.search(r"^h1 +10 N.m.s/rad *$", startup, re.MULTILINE)


class Heater(Component):
    warm: Variable = var("K", "temperature")
    limit: Parameter = param("K", "limit")
    period: Parameter = param("s", "time between two instants", default=1.0)
    held: Discrete = discrete("K", "temperature at the last instant")

    def equations(self) -> Equations:
        yield der(self.warm) * self.tau() == self.limit - self.warm

    def tau(self) -> float:
        return 3.0

    def initial_equations(self) -> Equations:
        yield self.warm == self.limit / 2

    def events(self) -> Events:
        yield when(clock(self.period), {self.held: self.warm})


def test_equations_of_the_start_and_at_instants_are_told() -> None:
    assert statements(Heater) == {
        "equations": ["der(warm) * tau() == limit - warm"],
        "initial equations": ["warm == limit / 2"],
        "events": ["when(clock(period), {held: warm})"],
        "where": ["tau() = 3.0"],
    }


@pytest.mark.parametrize("words", [["worm"], ["gear", "--group", "gears"], ["FRICTION", "clutch"]])
def test_the_library_is_filtered(words: list[str]) -> None:
    found = {line.split()[0] for line in called(["library", *words]).stdout.splitlines()[2:]}
    asked = [one.lower() for one in words if one not in ("--group", "gears")]
    for name, kind in library_types().items():
        wanted = all(one in f"{name} {kind.__module__.partition('.')[2]} {kind.__doc__}".lower() for one in asked)
        assert (name in found) is (wanted and ("--group" not in words or "gears" in kind.__module__.split(".")))
    assert found


def test_a_group_or_a_word_that_is_not_there_is_told() -> None:
    assert "There is no group 'gear'; did you mean 'gears'?" in called(["library", "--group", "gear"]).stderr
    assert "No component type has 'gearz' in its name or text." in called(["library", "gearz"]).stderr


def test_the_schema_is_a_schema() -> None:
    result = called(["schema"])
    assert result.exit_code == 0
    known = json.loads(result.stdout)
    jsonschema.Draft7Validator.check_schema(known)
    assert known == json.loads(json.dumps(schema()))
    assert known["definitions"]["Inertia"]["properties"]["J"]["anyOf"][0] == {"type": "number", "minimum": 0}


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
        ({"is": "FMU", "file": "drive.fmu", "J.J": 2}, True),
        ({"is": "Inertia", "J": "15 kg"}, False),
        ({"is": "Inertia", "J": "15 kg.m"}, False),
        ({"is": "Inertia", "J": "15 Nm"}, False),
        ({"is": "Inertia", "J": "2*motor.J + 15 kg.cm2"}, True),
        ({"is": "Inertia", "J": "3 lb.ft2", "w": "1500 rpm"}, True),
        ({"is": "Inertia", "J": 1, "w": "50 Hz"}, False),
        ({"is": "Clutch", "mu_pos": [["50 rpm", 0.1], ["1 N.m", 0.2]]}, False),
        ({"is": "Clutch", "mode": "stuk"}, False),
        ({"is": "Clutch", "extrapolate": "error", "smooth": True}, True),
        ({"is": "Clutch", "extrapolate": "quadratic"}, False),
        ({"is": "Clutch", "smooth": 1}, False),
    ],
)
def test_the_schema_knows_right_from_wrong(
    netlists: jsonschema.Draft7Validator, part: dict[str, Any], is_right: bool
) -> None:
    assert netlists.is_valid({"parts": {"a": part}}) is is_right


def test_a_quantity_passes_the_schema_if_and_only_if_a_netlist_takes_it() -> None:
    """For the units of all declarations, against the units of all declarations."""
    known = schema()["definitions"]
    units = sorted(
        {field.unit_text for kind in library_types().values() for field in declarations(kind).fields.values()}
        - {"*", "1"}
    )
    told = 0
    for unit in units:
        name = next(iter(Quantities(units).text(parse_unit(unit)).values()))
        validator = jsonschema.Draft7Validator({"definitions": known, "$ref": name})
        for other in units:
            try:
                to_si(f"2.5e-3 {other}", parse_unit(unit), "x")
            except UnitError:
                told += 1
                assert not validator.is_valid(f"2.5e-3 {other}"), (unit, other)
            else:
                assert validator.is_valid(f"2.5e-3 {other}"), (unit, other)
    assert told > 1000


def test_every_entry_is_explained() -> None:
    known = schema()
    assert all("description" in one for one in known["properties"].values())
    assert all(
        "examples" in known["properties"][name] for name in ("parameters", "parts", "series", "connect", "start")
    )
    for name, kind in library_types().items():
        properties = known["definitions"][name]["properties"]
        for field in declarations(kind).fields.values():
            if field.name in properties:
                unit = "" if field.unit_text == "1" else f" [{field.unit_text}]"
                assert properties[field.name]["description"] == field.description + unit


def test_a_schema_is_written_to_a_file(tmp_path: Path) -> None:
    for of, generate in (("netlist", schema), ("sizing", sizing_schema)):
        file = tmp_path / f"{of}.json"
        result = called(["schema", of, "-o", str(file)])
        assert f"#:schema ./{of}.json" in result.stdout
        assert json.loads(file.read_text(encoding="utf-8")) == json.loads(json.dumps(generate()))


@pytest.mark.parametrize("folder", ["sizing", "cosim"])
def test_sizing_files_and_netlists_with_fmus_fit_their_schemas(folder: str) -> None:
    validator = jsonschema.Draft7Validator(sizing_schema() if folder == "sizing" else schema())
    files = sorted((Path(__file__).parents[2] / "examples" / folder).glob("*.toml"))
    assert files
    for file in files:
        validator.validate(tomllib.loads(file.read_text(encoding="utf-8")))


def test_a_sizing_file_with_a_wrong_unit_does_not_fit() -> None:
    validator = jsonschema.Draft7Validator(sizing_schema())
    heat = {"is": "clutch_heat", "work": "200 J", "heat_capacity": "90 J/K", "frequency": "300 1/h"}
    assert validator.is_valid({"checks": {"heat": heat}})
    assert not validator.is_valid({"checks": {"heat": heat | {"heat_capacity": "90 kg"}}})
    assert not validator.is_valid({"checks": {"heat": heat | {"capacity": 3}}})


def test_unknown_types_are_told_on_stderr() -> None:
    result = called(["describe", "Cluch"])
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr.startswith("There is no component type 'Cluch'; did you mean 'Clutch'?\n")


def test_debug_shows_where_an_error_was_raised() -> None:
    result = called(["describe", "Cluch", "--debug"])
    assert type(result.exception).__name__ == "UnknownName"
