"""A drive that was read and changed is written with the comments, the order and the layout of its file."""

import copy
import os
import random
import re
from pathlib import Path

import pytest
from some import some

from components import Inertia, Spring
from modelica_like.errors import ModelicaLikeError
from modelica_like.language import Assembly, Parameter
from modelica_like.language.inside import inside
from modelica_like.netlist import dumps, load, loads, save
from modelica_like.netlist.write import sections
from modelica_like.upper import rewritten

EXAMPLES = Path(__file__).parents[2] / "examples"
NETLISTS = sorted(path for path in EXAMPLES.rglob("*.toml") if not {"sizing", "cosim"} & set(path.parts))
every = pytest.mark.parametrize("path", some(NETLISTS, lambda path: path.stem))
TEXT = """\
# A drive.
[parts]
rotor  = {is="Inertia", J='2 kg.cm2', w = 3}   # of the catalogue
wheel = { is = "Inertia", count = 2, J = 1 } # two

[parts.motor]
is = "ConstantTorque"
# measured
tau_constant = "5 N.m"

[series]
drive = [
  "motor",  # first
  "rotor", "wheel",
]

[simulate]
until = "1 s"
"""


def test_only_what_has_changed_is_written_anew(tmp_path: Path) -> None:
    file = tmp_path / "drive.toml"
    file.write_bytes(TEXT.replace("\n", "\r\n").encode())
    drive = load(file)
    drive.set("rotor.J", "3 kg.cm2")
    drive.set("rotor.w", 4)
    drive.set("rotor.phi", 0)
    drive.set("motor.tau_constant", 6)
    save(drive, file)
    expected = TEXT.replace("J='2 kg.cm2', w = 3", "J='3 kg.cm2', w = 4").replace('"5 N.m"', "6")
    expected = expected.replace("[simulate]", '[start]\n"rotor.phi" = 0\n\n[simulate]')
    assert file.read_bytes() == expected.replace("\n", "\r\n").encode()


def test_the_page_saves_so_too(tmp_path: Path) -> None:
    """What its **Save as** does: values of a copy in SI units, into another file."""
    (tmp_path / "drive.toml").write_text(TEXT)
    drive = copy.deepcopy(load(tmp_path / "drive.toml"))
    drive.set("rotor.J", 0.5)
    save(drive, tmp_path / "drive_explored.toml")
    expected = TEXT.replace("J='2 kg.cm2'", "J=0.5").replace("# A drive.\n", '# A drive.\nname = "drive"\n\n')
    assert (tmp_path / "drive_explored.toml").read_text() == expected


def test_parts_that_come_and_go_are_written(tmp_path: Path) -> None:
    drive = loads(TEXT, str(tmp_path / "drive.toml"))
    drive.spring = Spring(c=3)
    drive.rotor = Inertia(J=7)
    drive.set("wheel[2].J", 5)
    save(drive, tmp_path / "drive.toml")
    text = (tmp_path / "drive.toml").read_text()
    assert 'rotor  = {is="Inertia", J=7}   # of the catalogue\n' in text
    assert 'spring = { is = "Spring", c = 3 }\n' in text
    assert 'wheel = [\n    { is = "Inertia", J = 1 },\n    { is = "Inertia", J = 5 },\n] # two\n' in text
    assert sections(load(tmp_path / "drive.toml"), tmp_path) == sections(drive, tmp_path)


def test_files_are_named_from_another_folder(tmp_path: Path) -> None:
    (tmp_path / "box.toml").write_text('name = "box"\n[parts]\nm = { is = "Inertia", J = 1 }\n')
    (tmp_path / "drive.toml").write_text('# mine\nsizing = "s.toml"\n[parts]\nb = { is = "./box.toml" } # a box\n')
    drive = load(tmp_path / "drive.toml")
    (tmp_path / "sub").mkdir()
    save(drive, tmp_path / "sub" / "drive.toml")
    text = (tmp_path / "sub" / "drive.toml").read_text()
    assert text == '# mine\nsizing = "../s.toml"\n[parts]\nb = { is = "../box.toml" } # a box\n'
    assert sections(load(tmp_path / "sub" / "drive.toml"), tmp_path) == sections(drive, tmp_path)


def test_a_drive_from_python_is_written_in_the_plain_form() -> None:
    drive = Assembly("drive", parts={"a": Inertia(J=1)})
    assert inside(drive).text == ""
    assert dumps(drive) == 'name = "drive"\n\n[parts]\na = { is = "Inertia", J = 1 }\n'


@every
def test_an_example_that_was_not_changed_is_written_as_it_was(path: Path) -> None:
    text = path.read_bytes()
    copy = path.with_name(f"copy_{os.getpid()}.toml")
    try:
        save(load(path), copy)
        name = b"" if re.search(rb"^name = ", text, re.MULTILINE) else f'name = "{path.stem}"\n'.encode()
        assert copy.read_bytes().replace(name, b"", 1).strip() == text.strip()
    finally:
        copy.unlink()


@every
def test_changed_values_of_an_example_are_found_in_its_text(path: Path) -> None:
    drive, chooser, changed = load(path), random.Random(path.stem), 0
    given = [
        (part, name) for part in drive.walk() for name, field in part.fields.items() if isinstance(field, Parameter)
    ]
    for part, name in chooser.sample(given, min(3, len(given))):
        value = part.value(name)
        try:
            drive.set(f"{part.path}.{name}".lstrip("."), 1.01 * (value.number or 0.0) if value else 1.0)
        except ModelicaLikeError:
            continue  # out of its range
        changed += 1
    text = rewritten(drive, path)
    assert text is not None
    old, new = path.read_bytes().decode().splitlines(), text.splitlines()
    assert len([line for line in old if line not in new]) <= changed
    assert [line for line in old if line.startswith("#")] == [line for line in new if line.startswith("#")]
    assert dumps(loads(text, str(path)), folder=path.parent) == dumps(drive, folder=path.parent)
