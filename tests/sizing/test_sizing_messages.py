"""What can be wrong in a sizing file: one block of sentences with file and line, exit code 2."""

import subprocess
import sys
from pathlib import Path

import pytest

from modelica_like.analyse.sizing import size
from modelica_like.errors import ModelicaLikeError

GOOD = """[parameters]
force = "150 N"
[checks.bearing]
is = "bearing_life"
radial_load = "force"
speed = "1333 rpm"
dynamic_rating = "2600 N"
static_rating = "1060 N"
limits = { life = { min = "10000 h" } }
"""
SHAFT = """[checks.shaft]
is = "shaft_statics"
bearings = ["0 mm", "100 mm"]
loads = [{ at = "50 mm", y = "100 N" }]
"""


def changed(old: str, new: str, text: str = GOOD) -> str:
    assert old in text
    return text.replace(old, new)


BAD = {
    "unknown check": (changed("bearing_life", "bearing_live"), 3,
                      "There is no design check 'bearing_live'; did you mean 'bearing_life'?"),
    "unknown argument": (changed("speed =", "sped ="), 3, "has no argument 'sped'; did you mean 'speed'?"),
    "missing argument": (changed('speed = "1333 rpm"\n', ""), 3, "checks.bearing needs speed."),
    "wrong unit": (changed("2600 N", "2600 N.m"), 7, "checks.bearing.dynamic_rating expects N; '2600 N.m' is N.m."),
    "unknown unit": (changed("2600 N", "2600 Nn"), 7, "Unknown unit 'Nn'"),
    "no type": (changed('is = "bearing_life"\n', ""), 3, "checks.bearing has no type."),
    "no quantity": (changed('"2600 N"', '"2600 N 3"'), 7, "'N 3' is not a unit."),
    "true": (changed('"2600 N"', "true"), 7, "checks.bearing.dynamic_rating expects N; True is not a number."),
    "unknown name": (changed('"force"', '"forse"'), 5, "There is no parameter or check 'forse'; did you mean 'force'?"),
    "formula of another unit": (changed('"force"', '"force*force"'), 5,
                                "checks.bearing.radial_load = 'force*force' is N2; N is expected."),
    "sum of two units": (changed('"force"', '"force + 1"'), 5, "'force + 1.0' mixes N and 1."),
    "unknown line": (changed("life = {", "live = {"), 9, "the result has no line 'live'; did you mean 'life'?"),
    "limit of no kind": (changed("min =", "least ="), 9, "checks.bearing.limits.life must have min or max."),
    "limit of another unit": (changed("10000 h", "10000 m"), 9, "limits.life expects s; '10000 m' is m."),
    "circle": (changed('"150 N"', '"bearing.equivalent_load"'), 3,
               "Values depend on each other in a circle: checks.bearing needs force needs checks.bearing."),
    "beyond numbers": (changed('"1333 rpm"', '"1333 rpm"\nexponent = 1000'), 3,
                       "checks.bearing cannot be computed: it divides by zero or leaves the range of numbers."),
    "unknown entry": (GOOD + "[check.x]\n", 10, "A sizing file has no entry 'check'; did you mean 'checks'?"),
    "no checks": ('[parameters]\nforce = "1 N"\n', 0, "'bad.toml' has no checks."),
    "not TOML": (GOOD + "x\n", 10, "'bad.toml' is not TOML:"),
    "twice": (GOOD + '[checks.bearing]\nis = "x"\n', 3, "'bearing' in [checks] is declared twice."),
    "compare unknown": (GOOD + '[compare]\nall = ["bearings"]\n', 11,
                        "compare.all: there is no check 'bearings'; did you mean 'bearing'?"),
    "indeterminate": (changed('"100 mm"]', '"100 mm", "200 mm"]', SHAFT), 1, "with 2 bearings, not with 3."),
    "no list": (changed('["0 mm", "100 mm"]', '"0 mm"', SHAFT), 3, "checks.shaft.bearings must be a list."),
    "no table": (changed('[{ at = "50 mm", y = "100 N" }]', '["50 mm"]', SHAFT), 4,
                 "checks.shaft.loads[0] must be a table: { at = … }."),
    "check of another kind": (
        GOOD + '[checks.fit]\nis = "fit_speed_line"\nlargest_torque = "1 N.m"\nlines = "bearing"\n', 13,
        "checks.fit.lines must be a table: { voltage = …, no_load_speed = …,"),
    "wrong unit inside": (changed("100 N", "100 mm", SHAFT), 4, "checks.shaft.loads[0].y expects N; '100 mm' is m."),
    "no netlist": (changed('"force"', '{ from = "none.toml", peak = "x.tau" }'), 5, "The netlist"),
    "no variable asked": (changed('"force"', '{ from = "none.toml" }'), 5,
                          "checks.bearing.radial_load must be a value, or name a netlist and one variable of it."),
    "unknown way to read": (changed('"force"', '{ from = "none.toml", peek = "x.tau" }'), 5,
                            "A load of a simulation has no 'peek'; did you mean 'peak'?"),
}  # fmt: skip


@pytest.mark.parametrize(("text", "line", "message"), BAD.values(), ids=BAD)
def test_bad_file(text: str, line: int, message: str, tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text(text)
    with pytest.raises(ModelicaLikeError) as caught:
        size(tmp_path / "bad.toml")
    told = str(caught.value)
    assert message in told
    assert (f"in bad.toml:{line} " if line else "in bad.toml") in told


def test_command(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text(BAD["wrong unit"][0])
    command = [sys.executable, "-m", "modelica_like", "size", "bad.toml"]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=60)
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr.splitlines()[:2] == [
        "checks.bearing.dynamic_rating expects N; '2600 N.m' is N.m.",
        '  in bad.toml:7 `dynamic_rating = "2600 N.m"`',
    ]
    missing = subprocess.run([*command[:-1], "none.toml"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (missing.returncode, missing.stderr) == (2, "The sizing file 'none.toml' does not exist.\n")


def test_variable_of_another_unit(tmp_path: Path) -> None:
    example = Path(__file__).resolve().parents[2] / "examples" / "machine_table_direct.toml"
    (tmp_path / "drive.toml").write_text(example.read_text())
    (tmp_path / "bad.toml").write_text(changed('"force"', '{ from = "drive.toml", peak = "clutch.tau" }'))
    with pytest.raises(ModelicaLikeError, match=r"checks\.bearing\.radial_load is N\.m; N is expected"):
        size(tmp_path / "bad.toml")
    (tmp_path / "bad.toml").write_text(changed('"force"', '{ from = "drive.toml", peak = "clutch.tao" }'))
    with pytest.raises(ModelicaLikeError, match=r"has no variable 'clutch\.tao'; did you mean 'clutch\.tau'"):
        size(tmp_path / "bad.toml")
