"""What a foreign FMU can do to its process, and the sentence that tells it; tests/fmus has FMUs that really do."""

import json
from pathlib import Path

import pytest

from modelica_like.errors import FmuCrashed, FmuFailed, FmuRefused, FmuTimeout, ModelicaLikeError
from modelica_like.fmi.failures import tell_error
from modelica_like.fmi.process import run_child, workplace
from modelica_like.fmi.run import run_fmu

ENDS = {
    "crashes": (
        "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)",
        pytest.raises(FmuCrashed),
        "drive.fmu crashed with SIGSEGV before the end of its first step.\nIt ran in a separate process.",
    ),
    "leaves": (
        "import struct; open('progress', 'wb').write(struct.pack('d', 0.25)); raise SystemExit(7)",
        pytest.raises(FmuCrashed),
        "drive.fmu ended its process with exit code 7, after t = 0.25 s.\nIt ran in a separate process.",
    ),
    "hangs": (
        "while True: pass",
        pytest.raises(FmuTimeout),
        "drive.fmu did not finish within 0.5 s, and was stopped before the end of its first step.\n"
        "Give it more time with `timeout`, or a shorter run.",
    ),
}


@pytest.mark.parametrize("end", ENDS)
def test_a_process_that(end: str, tmp_path: Path) -> None:
    script, expected, sentence = ENDS[end]
    (tmp_path / "script.py").write_text(script)
    with expected as told, workplace({}) as folder:
        run_child("drive.fmu", tmp_path / "script.py", folder, 0.5 if end == "hangs" else 30.0)
    assert str(told.value) == sentence


def test_what_an_fmu_says(tmp_path: Path) -> None:
    error = {"kind": "failed", "text": "fmi2DoStep failed.", "messages": ["x is \x1b[31mnan", "giving up"]}
    (tmp_path / "error.json").write_text(json.dumps(error))
    with pytest.raises(FmuFailed) as told:
        tell_error(tmp_path, {"": "drive.fmu"})
    assert str(told.value) == (
        "drive.fmu failed: fmi2DoStep failed.\n"
        "It reported: x is \N{REPLACEMENT CHARACTER}[31mnan\nIt reported: giving up"
    )


def test_no_fmu(tmp_path: Path) -> None:
    (tmp_path / "drive.fmu").write_text("no archive")
    with pytest.raises(FmuRefused) as told:
        run_fmu(tmp_path / "drive.fmu")
    assert isinstance(told.value, ModelicaLikeError)
    assert str(told.value) == "drive.fmu is not an FMU: it is not a valid zip archive.\nFile is not a zip file."
