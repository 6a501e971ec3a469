"""Every kind of bad input, through the command: one block of sentences with file and line, exit code 2."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from calls import called

DRIVE = """
[parts]
motor = { is = "ConstantSpeed", w_fixed = "100 rpm", phi = 0 }
shaft = { is = "SpringDamper", c = 100, d = 1, phi_rel = 0 }
rotor = { is = "Inertia", J = "1 kg.m2", w = 0 }
[series]
drive = ["motor", "shaft", "rotor"]
[simulate]
until = "1 s"
"""


def changed(old: str, new: str) -> str:
    assert old in DRIVE
    return DRIVE.replace(old, new)


BAD = {
    "unknown type": (
        changed('"Inertia"', '"Inertja"'),
        5,
        "There is no component type 'Inertja'; did you mean 'Inertia'?",
    ),
    "unknown flange": (
        DRIVE + '[connect]\nw = ["rotor.flange_c", "shaft.flange_b"]\n',
        11,
        "has no connector 'flange_c'; did you mean 'flange_",
    ),
    "wrong unit": (changed('"1 kg.m2"', '"1 kg.m"'), 5, "Inertia.J expects kg.m2; '1 kg.m' is kg.m."),
    "duplicate name": (DRIVE + '[parts.rotor]\nis = "Inertia"\n', 5, "'rotor' in [parts] is declared twice."),
    "free flange": (changed('"motor", ', ""), 0, "motor.flange"),
    "two speed sources": (
        changed("[series]", 'second = { is = "ConstantSpeed", w_fixed = 1 }\n[series]')
        + '[connect]\nw = ["second.flange", "motor.flange"]\n',
        0,
        "motor",
    ),
    "missing start value": (changed(", w = 0", ""), 0, "rotor"),
    "cyclic sub-assembly": (
        DRIVE + '[parts.inner]\nis = "./bad.toml"\n',
        10,
        "A netlist contains itself: bad.toml contains bad.toml.",
    ),
    "parameter out of range": (
        changed('"1 kg.m2"', "-1"),
        5,
        "Inertia.J = -1 is out of range: it must be at least 0 kg.m2.",
    ),
    "nan": (changed('"1 kg.m2"', "nan"), 5, "Inertia.J must be a finite number, not nan."),
    "empty": ("", 0, "'bad.toml' is empty."),
    "not TOML": (changed('is = "Inertia"', "is Inertia"), 5, "'bad.toml' is not TOML:"),
    "brackets": ("[" * 10_000_000, 0, "'bad.toml' is larger than 2 MB, the limit for netlists."),
    "fewer brackets": ("x = " + "[" * 1_900_000, 0, "Brackets or keys are nested too deeply for a netlist."),
}


@pytest.mark.parametrize(("text", "line", "message"), BAD.values(), ids=BAD.keys())
def test_bad_input(text: str, line: int, message: str, tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text(text)
    command = [sys.executable, "-m", "modelica_like", "simulate", "bad.toml"]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=20)
    assert result.returncode == 2
    assert result.stdout == ""
    assert message in result.stderr
    assert "Traceback" not in result.stderr
    assert re.search(rf"in bad\.toml:{line} `" if line else r"in \w+\.(toml|py)", result.stderr)


RIGID = changed(', "shaft"', "").replace("shaft = {", "#")
NOT_BEGUN = {
    "start values that contradict a source": (RIGID, 2, """\
rotor.w = 0 cannot be met: rotor.w would be 10.472."""),
    "a part that refuses its parameters": ("""
[parts]
u = { is = "Constant", k = 1 }
block = { is = "PulseCounter", u_high = 1, u_low = 2 }
[connect]
u = ["u.y", "block.u"]
[simulate]
until = "1 s"
""", 1, "At 0 s block has u_high below u_low."),
}  # fmt: skip


@pytest.mark.parametrize("command", ["check", "simulate"])
@pytest.mark.parametrize(("text", "code", "message"), NOT_BEGUN.values(), ids=NOT_BEGUN.keys())
def test_check_finds_what_a_run_refuses_at_its_start(
    text: str, code: int, message: str, command: str, tmp_path: Path
) -> None:
    """`check` said "can be simulated" first."""
    (tmp_path / "bad.toml").write_text(text)
    result = called([command, str(tmp_path / "bad.toml")])
    assert result.exit_code == code
    assert "can be simulated" not in result.stdout
    assert result.stderr.startswith(message)


def test_a_parameter_of_a_sweep_given_twice(tmp_path: Path) -> None:
    drive = tmp_path / "drive.toml"
    drive.write_text(DRIVE)
    result = called(["sweep", str(drive), "--over", "rotor.J=1", "--over", "rotor.J=2", "--of", "rotor.w"])
    assert result.exit_code == 2
    assert "--over gives rotor.J twice." in result.stderr
