"""Design checks are found through the entry points of the libraries."""

import sys
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from components import sizing
from modelica_like.analyse.sizing import checks, size
from modelica_like.analyse.sizing.checks import GROUP, design_checks, find_check
from modelica_like.errors import NetlistError, UnknownName

LEVER = '''
from modelica_like.language.quantities import Force, Length, Torque
from modelica_like.language.results import Result, line

__all__ = ["Lever", "half", "lever"]

class Lever(Result):
    torque: Torque = line("torque", at_most="limit")
    limit: Torque = line("limit")

def half(force: Force) -> Force:
    return force / 2

def lever(force: Force, arm: Length, limit: Torque) -> Lever:
    """Compare the torque of a lever with a limit."""
    return Lever(force * arm, limit)
'''


@pytest.fixture
def library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    folder = tmp_path / "levers_for_tests"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    monkeypatch.syspath_prepend(tmp_path)
    names = {"own": "components", "levers": "levers_for_tests", "plain": "json.decoder"}
    entries = [EntryPoint(name, value, GROUP) for name, value in names.items()]
    monkeypatch.setattr(checks, "entry_points", lambda group: entries)
    design_checks.cache_clear()
    yield folder
    design_checks.cache_clear()
    for name in [name for name in sys.modules if name.startswith("levers_for_tests")]:
        del sys.modules[name]


def test_own_checks() -> None:
    assert find_check("bearing_life") is sizing.bearing_life
    assert "wrap_angle" not in design_checks()


def test_library_with_checks(library: Path, tmp_path: Path) -> None:
    (library / "sizing.py").write_text(LEVER)
    assert "lever" in design_checks()
    assert "half" not in design_checks()
    file = tmp_path / "lever.toml"
    file.write_text('[checks.a]\nis = "lever"\nforce = "100 N"\narm = "20 cm"\nlimit = "15 N.m"\n')
    assert size(file).exceeded == 1


def test_library_without_checks(library: Path) -> None:
    assert "lever" not in design_checks()
    with pytest.raises(UnknownName, match="There is no design check 'lever'"):
        find_check("lever")


def test_broken_library(library: Path) -> None:
    (library / "sizing.py").write_text("import nothing_of_this_name")
    with pytest.raises(NetlistError, match="The design checks of the library 'levers' cannot be imported"):
        design_checks()


def test_two_checks_of_one_name(library: Path) -> None:
    (library / "sizing.py").write_text(
        LEVER.replace("def lever(", "def bearing_life(").replace('"lever"', '"bearing_life"')
    )
    with pytest.raises(NetlistError, match="Two libraries have a design check 'bearing_life'"):
        design_checks()


def test_checks_of_a_file_by_name(tmp_path: Path) -> None:
    file = tmp_path / "speed.toml"
    file.write_text('[checks.a]\nis = "speed_limit"\nspeed = "4550 rpm"\nratio = 3\nlimit = "1500 rpm"\n')
    made = size(file)
    assert (made.name, made.exceeded) == ("speed", 1)
    with pytest.raises(UnknownName, match="speed has no check 'b'"):
        made["b"]
