"""Operations on every example: built from an empty sheet, renamed, grouped."""

import random
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from some import some

from modelica_like import simulate
from modelica_like.edit import Document, apply
from modelica_like.errors import ModelicaLikeError
from modelica_like.flatten import flatten
from modelica_like.language import Assembly
from modelica_like.netlist import dumps, load, loads

EXAMPLES = Path(__file__).parents[2] / "examples"
NETLISTS = sorted(path for path in EXAMPLES.rglob("*.toml") if not {"sizing", "cosim"} & set(path.parts))
every = pytest.mark.parametrize("path", some(NETLISTS, lambda path: path.stem))
DOCUMENTS = [path.stem for path in NETLISTS if "Document 00" in path.read_text(encoding="utf-8")]
"""Drives of the published documents."""
RUN = ["two_mass", "dc_bench_speed_control", "launch"]
"""Drives whose runs are compared: one with springs, one with signals, one with formulas and modes."""


def flat(table: dict[str, Any], before: str = "") -> dict[str, Any]:
    """Return start values and units by path."""
    paths: dict[str, Any] = {}
    for name, value in table.items():
        paths |= flat(value, f"{before}{name}.") if isinstance(value, dict) else {before + name: value}
    return paths


def build(document: Document, data: dict[str, Any]) -> None:
    """Do the operations that lead from an empty sheet to a netlist."""
    for name in ("name", "description", "sizing"):
        if name in data:
            document.set(name, data[name], section="")
    for name, value in data.get("parameters", {}).items():
        document.set(name, value)
    for name, table in data["parts"].items():
        if isinstance(table, dict):
            document.add(name, table["is"], values={key: value for key, value in table.items() if key != "is"})
        else:
            document.set(name, table, section="parts")
    for name, names in data.get("series", {}).items():
        document.set(name, names, section="series")
    for name, (first, second, *others) in data.get("connect", {}).items():
        document.connect(first, second, name=name)
        for end in others:
            document.connect(first, end)
    for section in ("start", "guess", "display", "simulate", "expose"):
        for path, value in flat(data.get(section, {})).items():
            document.set(path, value, section=section)
    for section in ("optimize", "tolerances"):
        for key, value in data.get(section, {}).items():
            document.set(key, value, section=section)
    if "free" in data:
        document.set("free", data["free"], section="")


@pytest.mark.parametrize("path", some(NETLISTS, lambda path: path.stem, DOCUMENTS))
def test_an_example_is_built_from_an_empty_sheet(path: Path) -> None:
    document = Document.new(path.with_name("built.toml"))
    build(document, tomllib.loads(path.read_text(encoding="utf-8")))
    again = loads(document.text, str(path.with_name("built.toml")))
    expected = load(path)
    text = dumps(expected, folder=path.parent)
    assert dumps(again, folder=path.parent) == text.replace(f'name = "{path.stem}"', f'name = "{again.label}"', 1)


@every
def test_parts_of_an_example_are_renamed_there_and_back(path: Path) -> None:
    text = path.read_bytes().decode()
    data, before = tomllib.loads(text), flatten(load(path))
    names = [*data["parts"], *data.get("parameters", {})]
    for name in random.Random(1).sample(names, min(4, len(names))):
        renamed = apply(text, {"op": "rename", "old": name, "new": "other_name"}, file=path).text
        after = flatten(loads(renamed, str(path)))
        assert {follow(variable.path, name) for variable in before.variables} == {v.path for v in after.variables}
        assert len(after.linear) == len(before.linear)
        assert apply(renamed, {"op": "rename", "old": "other_name", "new": name}, file=path).text == text


def follow(path: str, name: str) -> str:
    """Return the path of a variable after a part was renamed."""
    first, dot, rest = path.partition(".")
    part, bracket, place = first.partition("[")
    return f"other_name{bracket}{place}{dot}{rest}" if part == name and dot else path


def grouped(path: Path, seed: int) -> tuple[list[str], Document]:
    """Return a document with a group of some of its parts."""
    chooser, document = random.Random(seed), Document(path)
    parts = list(tomllib.loads(document.text)["parts"])
    first = chooser.randrange(len(parts))
    number = chooser.randint(1, 4)
    names = chooser.sample(parts, min(number, len(parts))) if seed % 2 else parts[first : first + number]
    return names, document.group(names, "assembly_of_parts")


@every
def test_an_example_with_grouped_parts_is_the_same_drive(path: Path) -> None:
    before = flatten(load(path))
    for seed in range(4):
        names, document = grouped(path, seed)
        assert document.problems() == []
        after = flatten(assembled(document))
        prefixes = tuple(f"{name}{end}" for name in names for end in ".[")
        inner = {f"assembly_of_parts.{v.path}" if v.path.startswith(prefixes) else v.path for v in before.variables}
        assert inner <= {variable.path for variable in after.variables}
        assert document.undo().text == path.read_bytes().decode()


def assembled(document: Document) -> Assembly:
    """Return the drive of a document whose new netlists are written only while it is read."""
    state = document.state
    try:
        for file, text in state.files.items():
            file.write_text(text, encoding="utf-8")
        return loads(state.text, str(document.path))
    finally:
        for file in state.files:
            file.unlink(missing_ok=True)


@pytest.mark.parametrize("stem", RUN)
def test_the_run_of_a_drive_with_grouped_parts_is_the_same(stem: str) -> None:
    path = EXAMPLES / f"{stem}.toml"
    names, document = grouped(path, 3)
    before, after = simulate(load(path)), simulate(assembled(document))
    assert len(after.events) == len(before.events)
    for variable in before.model.flat_variables:
        first = variable.path.partition(".")[0].partition("[")[0]
        here = f"assembly_of_parts.{variable.path}" if first in names else variable.path
        # The equations are the same in another order: only rounding differs, within the tolerance of the run.
        scale = 1e-6 * float(np.max(np.abs(before[variable.path]))) + 1e-9
        assert abs(after[here][-1] - before[variable.path][-1]) <= scale


def test_a_group_has_ports_and_parameters(tmp_path: Path) -> None:
    text = """\
[parameters]
J = "2 kg.m2"
unused = 1
[parts]
motor = { is = "ConstantTorque", tau_constant = "5 N.m" }
a = { is = "Inertia", J = "J" } # kept
s = { is = "SpringDamper", c = 100, d = "motor.tau_constant*1 s" }
b = { is = "Inertia", J = "a.J" }
[series]
drive = ["motor", "a", "s", "b"]
[start]
"a.w" = "3 rad/s"
"""
    (tmp_path / "drive.toml").write_text(text)
    document = Document(tmp_path / "drive.toml").group(["a", "s"], "line").save()
    assert (
        (tmp_path / "line.toml").read_text()
        == """\
name = "line"

[parameters]
J = "2 kg.m2"

[parts]
a = { is = "Inertia", J = "J" } # kept
s = { is = "SpringDamper", c = 100 }

[series]
drive = ["a", "s"]

[expose]
flange_a = "a.flange_a"
flange_b = "s.flange_b"
"""
    )
    assert document.text == text.replace('a = { is = "Inertia", J = "J" } # kept\n', (
        'line = { is = "./line.toml", J = "J", s.d = "motor.tau_constant*1 s" }\n'
    )).replace('s = { is = "SpringDamper", c = 100, d = "motor.tau_constant*1 s" }\n', "").replace(
        '"a.J"', '"line.a.J"').replace('"a", "s"', '"line"').replace('"a.w"', '"line.a.w"')  # fmt: skip
    with pytest.raises(ModelicaLikeError, match=r"'line.toml' exists already"):
        document.group(["b"], "line_2", file="line.toml")
