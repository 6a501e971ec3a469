"""The run-time of other platforms, run in emulators: an ARM processor by qemu, Windows by wine."""

import os
import shutil
import struct
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from modelica_like import build
from modelica_like.fmi.build import PLATFORMS, native_platform
from modelica_like.fmi.interface import interface
from modelica_like.fmi.model_file import model_file
from modelica_like.fmi.runtime import runtime_library
from modelica_like.fmi.tables import make_tables

EXAMPLES = Path(__file__).parents[2] / "examples"
SOURCE = Path(__file__).parent / "elsewhere.c"
STEPS = 20
EMULATORS = {
    "aarch64-linux": (("qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"), ()),
    "x86_64-windows": (("wine64",), ("/usr/lib/wine/wine64",)),
}
DRIVES = {"machine_tool_startup": 1.0, "msl/rotational/CoupledClutches": 1.5, "msl/translational/PreLoad": 0.1}


def emulator(platform: str) -> list[str]:
    """Return the command of an emulator; elsewhere than in continuous integration, a test may do without."""
    command, homes = EMULATORS[platform]
    for program in (command[0], *homes):
        if shutil.which(program):
            return [program, *command[1:]]
    told = f"{command[0]} is not installed: make emulators"
    if "CI" in os.environ:
        pytest.fail(told)
    pytest.skip(told)


def program(platform: str, folder: Path) -> Path:
    """Compile `elsewhere.c` for a platform."""
    target = folder / ("elsewhere.exe" if "windows" in platform else "elsewhere")
    command = [sys.executable, "-m", "ziglang", "cc", "-target", PLATFORMS[platform].target, "-O1"]
    subprocess.run(
        [*command, str(SOURCE), "-o", str(target), *(() if "windows" in platform else ("-ldl",))], check=True
    )
    return target


def numbers(command: Sequence[str], drive: str, until: float, folder: Path, library: Path) -> np.ndarray:
    """Run a drive: its variables at equal distances, shape (steps, variables)."""
    model = build(EXAMPLES / f"{drive}.toml")
    face = interface(model)
    data = folder / f"{Path(drive).name}.bin"
    data.write_bytes(model_file(make_tables(model, face.start), face.variables, "{elsewhere}", 1e-9, 0.0))
    references = [str(one.reference) for one in face.variables if one.name in model.position]
    result = subprocess.run(
        [*command, str(library), str(data), str(until), str(len(references)), str(STEPS)],
        input="\n".join(references), capture_output=True, text=True, check=False,
        env={**os.environ, "WINEPREFIX": str(folder / "wine"), "WINEDEBUG": "-all"},
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    lines = [
        [struct.unpack(">d", bytes.fromhex(word.zfill(16)))[0] for word in line.split()]
        for line in result.stdout.splitlines()
    ]
    return np.array(lines)


@pytest.mark.slow
@pytest.mark.parametrize("platform", EMULATORS)
def test_other_platforms_run_the_same(platform: str, tmp_path: Path) -> None:
    """Linux has the same mathematical library everywhere; that of Windows rounds otherwise."""
    there = [*emulator(platform), str(program(platform, tmp_path))]
    (tmp_path / "here").mkdir()
    here = [str(program(native_platform(), tmp_path / "here"))]
    for drive, until in DRIVES.items():
        one = numbers(here, drive, until, tmp_path, runtime_library(native_platform()))
        other = numbers(there, drive, until, tmp_path, runtime_library(platform))
        assert one.shape == other.shape == (STEPS, one.shape[1])
        sizes = np.maximum(np.abs(one).max(axis=0), 1e-6)
        assert (np.abs(one - other) / sizes).max() <= (1e-9 if "windows" in platform else 0.0), drive
