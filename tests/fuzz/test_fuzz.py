"""No input ends in anything but a sentence; what the fuzzer has found stays found."""

import contextlib
import zipfile
from collections.abc import Callable
from pathlib import Path
from time import process_time

import pytest
from fuzzer import attempt

from components import Inertia
from modelica_like import simulate
from modelica_like.analyse.sizing import size
from modelica_like.analyse.sweeps.ranges import read_range
from modelica_like.errors import FmuRefused, ModelicaLikeError
from modelica_like.fmi.cosimulation.described import described
from modelica_like.fmi.cosimulation.files import load_system
from modelica_like.fmi.cosimulation.ssp import write_ssp
from modelica_like.fmi.cosimulation.system import System, Unit
from modelica_like.netlist import loads
from modelica_like.netlist.write import dumps

BATCHES = 24
INPUTS = 3000


@pytest.mark.parametrize("batch", [0, 1, *(pytest.param(n, marks=pytest.mark.slow) for n in range(2, BATCHES))])
def test_mutated_inputs_are_told(batch: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    size = INPUTS // BATCHES
    crashes = [crash for number in range(batch * size, (batch + 1) * size) if (crash := attempt(number))]
    assert crashes == []
    assert list(tmp_path.iterdir()) == []


WHEEL = '[parts]\nk = { is = "Inertia", J = 1, phi = 0, w = 0 }\n'
FOUND: dict[str, tuple[Callable[[], object], str]] = {
    "a replaced part whose type is a number": (
        lambda: loads('[parts]\nk = { is = "Inertia", J = { is = 1 } }\n'),
        "parts.k.J has no type.",
    ),
    "a mode that is a time of day": (
        lambda: loads('[parts]\nk = { is = "ElastoBacklash", flanks = 07:32:00 }\n'),
        "ElastoBacklash.flanks has no mode '07:32:00'. It has pressed, meeting, leaving.",
    ),
    "a mode that is a list": (
        lambda: loads('[parts]\nk = { is = "P", y_max = 1, limit = [["0 rad/s", 0.1]] }\n'),
        "Controller.limit has no mode '[['0 rad/s', 0.1]]'. It has",
    ),
    "a formula that is a number": (
        lambda: loads('[parts]\nk = { is = "TimeFormula", formula = -0.0 }\n'),
        "TimeFormula.formula = -0.0 must be a text.",
    ),
    "a run shorter than times": (
        lambda: simulate(loads(WHEEL), 5e-324),
        "A run of 4.94066e-324 s is too short: its times cannot be distinguished.",
    ),
    "a run longer than solvers count": (
        lambda: simulate(loads(WHEEL), 1e150),
        "A run of 1e+150 s is too long: solvers square such times, which are no numbers.",
    ),
}


@pytest.mark.parametrize("name", FOUND)
def test_found_by_the_fuzzer(name: str) -> None:
    act, told = FOUND[name]
    with pytest.raises(ModelicaLikeError) as caught:
        act()
    assert caught.value.what.startswith(told)


LIFE = """[checks.k]
is = "bearing_life"
radial_load = "150 N"
speed = "1333 rpm"
dynamic_rating = "2600 N"
static_rating = "1060 N"
"""
RING = """[checks.k]
is = "ravigneaux_gear"
input_speed = "1000 rpm"
input_torque = "100 N.m"
teeth = { small_sun = 21, large_sun = 39, short_planet = 13, long_planet = 10, ring = 3 }
"""


def test_a_limit_next_to_nothing_is_missed_without_a_warning(tmp_path: Path) -> None:
    (tmp_path / "small.toml").write_text(LIFE + "limits = { life = { max = 5e-324 } }\n")
    assert size(tmp_path / "small.toml").exceeded == 1


SIZINGS = {
    "a published list": (
        LIFE + 'published = { life = ["1 h"] }\n',
        "checks.k.published.life needs a line with a number",
    ),
    "a limit that is a list": (LIFE + "limits = { life = { min = [[0, 1]] } }\n", "checks.k.limits.life needs a line"),
    "a list of lists": (LIFE.replace('"150 N"', '["1 N", ["2 N"]]'), "checks.k.radial_load must be a list of numbers"),
    "a ring inside of its planets": (RING, "checks.k cannot be computed: A ring of 3 teeth cannot hold planets of"),
    "teeth without the ring": (RING.replace(", ring = 3", ""), "checks.k.teeth needs ring."),
    "a list without numbers": (LIFE.replace('"150 N"', "[]"), "checks.k.radial_load must be a list of numbers"),
    "a number without end": (
        LIFE.replace('"150 N"', '"a*1 N"') + "[parameters]\na = " + "9" * 401 + "\n",
        "parameters.a is too large for a number",
    ),
    "an array in published": (LIFE + "published = [1, 2]\n", "checks.k.published must be a table by line"),
}


@pytest.mark.parametrize("name", SIZINGS)
def test_sizing_files_found_by_the_fuzzer(name: str, tmp_path: Path) -> None:
    text, told = SIZINGS[name]
    (tmp_path / "bad.toml").write_text(text)
    with pytest.raises(ModelicaLikeError) as caught:
        size(tmp_path / "bad.toml")
    assert caught.value.what.startswith(told)


MANY = 100_000
LONG = {
    "a sum": "+".join(MANY // 2 * ["1"]), "names": "a." * (MANY // 2) + "b", "brackets": "(" * MANY + "1" + ")" * MANY,
    "spaces in a unit": "1 N.m" + " " * MANY + "x", "spaces behind": "1 kg.m2" + " " * MANY + "\t",
    "units": "1 " + "kg." * MANY + "kg", "digits": "1" * MANY, "an exponent": "1 m^" + "9" * MANY, "dots": "1." * MANY,
}  # fmt: skip


@pytest.mark.parametrize("name", LONG)
def test_long_texts_take_no_time(name: str) -> None:
    """Spaces within a unit took time with the square of their number: 41 s for these."""
    begin = process_time()
    with contextlib.suppress(ModelicaLikeError):
        Inertia(J=LONG[name])
    assert process_time() - begin < 1.0


def test_ranges_are_refused_before_anything_is_built() -> None:
    with pytest.raises(ModelicaLikeError) as caught:
        read_range("J2.J=0:1:99999999999")
    assert caught.value.what == "J2.J: a sweep has at most 10000000 runs."


SYSTEM = """name = "two"
[fmus]
a = {{ file = "a.fmu", parameters = {{ J = {} }} }}
"""
LARGE = "1" + 400 * "0"


@pytest.mark.parametrize(("given", "told"), [(LARGE, "is too large for a number"), ("nan", "must be a finite")])
def test_values_of_fmus_are_finite_numbers(given: str, told: str, tmp_path: Path) -> None:
    (tmp_path / "two.toml").write_text(SYSTEM.format(given))
    with pytest.raises(ModelicaLikeError) as caught:
        load_system(tmp_path / "two.toml", tmp_path)
    assert caught.value.what.startswith(f"fmus.a.J {told}")


def test_an_ssp_in_an_encoding_that_is_another_one(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "bad.ssp", "w") as archive:
        archive.writestr("SystemStructure.ssd", b'<?xml version="1.0" encoding="utf-8"?><a b="\xff"/>')
    (tmp_path / "work").mkdir()
    with pytest.raises(ModelicaLikeError, match=r"^SystemStructure\.ssd in bad\.ssp is not XML: "):
        load_system(tmp_path / "bad.ssp", tmp_path / "work")


def test_an_ssp_has_no_names_that_xml_does_not_know(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.fmu", "w") as archive:
        archive.writestr(
            "modelDescription.xml",
            '<fmiModelDescription fmiVersion="2.0" modelName="a" guid="1"><CoSimulation modelIdentifier="a"/>'
            "<ModelVariables/><ModelStructure/></fmiModelDescription>",
        )
    with pytest.raises(ModelicaLikeError, match=r"^The name 'two.' has characters that XML does not allow\.$"):
        write_ssp(System("two\0", (Unit("a", tmp_path / "a.fmu"),), ()), tmp_path / "two.ssp")


def test_a_null_character_in_the_name_of_an_fmu(tmp_path: Path) -> None:
    (tmp_path / "two.toml").write_text('[fmus]\na = "a\\u0000.fmu"\n')
    with pytest.raises(ModelicaLikeError, match=r"^fmus\.a must be a table: "):
        load_system(tmp_path / "two.toml", tmp_path)


DEEP = {"1,500 folders": "a/" * 1500 + "b", "a name of 300 letters": "a" * 300, "700 letters": "a/" * 350}


@pytest.mark.parametrize("name", DEEP)
def test_names_that_no_file_system_takes(name: str, tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "deep.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", "<fmiModelDescription/>")
        archive.writestr(DEEP[name], "")
    with pytest.raises(FmuRefused, match="has a longer name than file systems allow"):
        described(tmp_path / "deep.fmu")


@pytest.mark.parametrize("name", [".", "modelDescription.xml/a"])
def test_a_file_with_the_name_of_a_folder(name: str, tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "odd.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", "<fmiModelDescription/>")
        archive.writestr(name, "")
    with pytest.raises(FmuRefused, match=r"^odd\.fmu is refused: a file in it has the name of a folder\.$"):
        described(tmp_path / "odd.fmu")


@pytest.mark.parametrize("name", ["description", "simulate", "origin"])
def test_a_part_may_be_called_like_an_entry_of_the_file(name: str) -> None:
    """It was written as the description of the netlist."""
    drive = loads(f'description = "two"\n[parts]\n{name} = {{ is = "Fixed" }}\n[simulate]\nuntil = 1\n')
    again = loads(dumps(drive))
    assert list(again.parts) == [name]
    assert dumps(again) == dumps(drive)
    assert 'description = "two"' in dumps(again)


@pytest.mark.parametrize("offset", [(8, 2), (16, 4), (42, 4)])
def test_archives_whose_directory_leads_nowhere_are_told(offset: tuple[int, int], tmp_path: Path) -> None:
    """The end of the directory or a member points before the beginning of the file: an OSError without a file."""
    path, (place, size) = tmp_path / "bad.fmu", offset
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("a.txt", "modelicaDescription.xml", "b.txt"):
            archive.writestr(name, "x" * 999)
    data = bytearray(path.read_bytes())
    at = data.rfind(b"PK\1\2" if place == 42 else b"PK\5\6") + place
    data[at : at + size] = b"\xff" * size
    path.write_bytes(data)
    with pytest.raises(FmuRefused, match=r"bad\.fmu is not an FMU"):
        described(path)
