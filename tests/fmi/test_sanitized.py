"""Wrong calls and many instances, with the C code under AddressSanitizer and UBSan."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from modelica_like import build
from modelica_like.fmi.interface import interface
from modelica_like.fmi.model_file import generate
from modelica_like.fmi.sources import source_files
from modelica_like.language import Component, Equations, Events, Mode, Parameter, Variable, delay, der, param, var

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "examples"
SANITIZE = ["-g", "-O1", "-std=c99", "-Wall", "-Wextra", "-Werror", "-fsanitize=address,undefined"]


class Echo(Component):
    """The past of a run is memory, too."""

    T: Parameter = param("s", "delay", default=1e-3)
    y: Variable = var("1", "value", default=1.0)
    mode = Mode("up", "down")

    def equations(self) -> Equations:
        yield self.T * der(self.y) == -delay(self.y, self.T)

    def events(self) -> Events:
        yield self.mode.go("up", "down", when=self.y < 0)
        yield self.mode.go("down", "up", when=self.y > 0.1)


def driver(drive: str | Component, version: str, folder: Path) -> Path:
    """The C code of a model and a program that misuses it, as one executable."""
    model = build(EXAMPLES / drive if isinstance(drive, str) else drive)
    for name, text in generate(model, interface(model), version, token="{t}").items():
        (folder / name).write_text(text)
    program = HERE / f"misuse{version[0]}.c"
    compiler = shutil.which("gcc") or shutil.which("clang")
    assert compiler, "the sanitizers need gcc or clang"
    command = [compiler, *SANITIZE, "-fno-sanitize-recover=undefined", "-I.", "-o", "driver", str(program)]
    subprocess.run([*command, *source_files(version), "-lm"], cwd=folder, check=True)
    return folder / "driver"


CASES = [
    pytest.param("msl/rotational/CoupledClutches.toml", "2.0", marks=pytest.mark.slow),
    pytest.param("msl/rotational/CoupledClutches.toml", "3.0", marks=pytest.mark.slow),
    pytest.param("dc_bench.toml", "3.0", marks=pytest.mark.slow),
    pytest.param(Echo(), "2.0", marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("drive", "version"), CASES, ids=str)
def test_wrong_calls_are_errors_and_a_thousand_instances_leave_nothing_behind(drive, version, tmp_path):
    """Leaks, overflows and undefined behaviour end the program; it counts calls that were answered wrongly itself."""
    result = subprocess.run([driver(drive, version, tmp_path), "1000"], capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, f"{result.stdout}\n{result.stderr}"
    assert result.stderr == ""
    if "Clutches" in str(drive):
        # References and sizes depend on how many variables the library's components declare.
        said = re.sub(r"value reference \d{1,4}\b", "value reference N", result.stdout)
        said = re.sub(r"\d+ bytes, not \d+", "N bytes, not N", said)
        lines = list(dict.fromkeys(said.splitlines()))
        expected = (HERE / f"messages{version[0]}.txt").read_text(encoding="utf-8")
        assert lines == expected.splitlines()
