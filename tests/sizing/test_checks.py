"""Design checks are found through the entry points of the libraries."""

import re
import sys
from collections.abc import Callable, Iterator
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


BELT = {"pull": 25.0, "velocity": 2.0, "teeth_in_mesh": 4, "width": 0.01, "tooth_height": 1.27e-3}
WHEEL = {"radius": 0.05, "density": 7850.0, "torque": 1.0, "speed": 100.0}
STEEL = sizing.ShaftMaterial(430e6, 275e6, 215e6, 125e6)
IMPOSSIBLE: dict[str, Callable[[], object]] = {
    "small_teeth are more than large_teeth: swap them.": lambda: sizing.belt_geometry(30, 10, 5.08e-3, 0.33),
    "Pulleys and belt need teeth and a pitch.": lambda: sizing.belt_geometry(0, 30, 5.08e-3, 0.33),
    "A belt needs a friction and a wrap angle above zero.": lambda: sizing.belt_forces(25.0, 2.8, 0.0, 2.0),
    "Section and density of a belt are not below zero.": lambda: sizing.belt_forces(25.0, 2.8, 0.5, 2.0, -1.0, 1.0),
    "A timing belt needs teeth in mesh, a width": lambda: sizing.timing_belt_load(**{**BELT, "width": -0.01}),
    "Diameter and strength of a shaft are positive.": lambda: sizing.shaft_stress(1.0, 1.0, -0.01, 275e6),
    "A stepped shaft needs sections, each of which ends behind the one before.": lambda: sizing.stepped_shaft(
        [sizing.Load(0.05, 100.0)], [0.0, 0.1], [sizing.Section(end, 0.01) for end in (0.06, 0.04, 0.1)], 275e6
    ),
    "The diameter of a shaft is positive.": lambda: sizing.shaft_fatigue(1.0, 1.0, 0.0, STEEL),
    "The share `alternating` of the torque is from 0 to 1.": lambda: sizing.shaft_fatigue(
        1.0, 1.0, 0.01, STEEL, alternating=50.0
    ),
    "Dimensions, density, torque, speed and time of a flywheel are positive.": lambda: sizing.flywheel(-0.05, **WHEEL),
    "Mass, span, side and modulus of a shaft that sags are positive.": lambda: sizing.deflection(5.0, 0.175, 0.0),
    "A load spectrum has at least one step": lambda: sizing.gear_life(
        sizing.gear_strength(sizing.GearPair(20, 60, 3e-3, 0.03), 100.0, sizing.GearMaterial(1500e6, 500e6)), []
    ),
}


@pytest.mark.parametrize("told", IMPOSSIBLE)
def test_what_cannot_be_is_refused(told: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(told)}"):
        IMPOSSIBLE[told]()


def test_no_stepped_shaft_without_sections() -> None:
    with pytest.raises(ValueError, match="A stepped shaft needs sections"):
        sizing.stepped_shaft([sizing.Load(0.05, 100.0)], [0.0, 0.1], [], 275e6)
