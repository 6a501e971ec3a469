"""Ctrl-C and failures: what was computed is kept, what was not finished is not there, and the exit code says so."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from modelica_like.analyse.calibration.calibrate import Numbers, calibrate
from modelica_like.analyse.sweeps.sweep import sweep
from modelica_like.fmi.cosimulation.run import cosim
from modelica_like.fmi.cosimulation.split import split
from modelica_like.fmi.export import export_fmu

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals to oneself")

DRIVE = Path(__file__).parents[2] / "examples" / "two_mass.toml"
# A command in whose progress Ctrl-C is pressed once.
PRESSED = """
import os, signal, sys
from modelica_like.show.report import progress
pressed, moment = [], float(sys.argv.pop(1))
def press(self, reached, *of):
    if reached >= moment and not pressed:
        pressed.append(reached)
        os.killpg(os.getpgrp(), signal.SIGINT)
progress.Bar.__call__ = press
from modelica_like.cli import main
main()
"""


def command(folder: Path, *words: str) -> "subprocess.CompletedProcess[str]":
    """Run a command with its children in a process group of its own, as a terminal does."""
    return subprocess.run(
        [sys.executable, *words], cwd=folder, capture_output=True, text=True, check=False, timeout=120,
        start_new_session=True,
    )  # fmt: skip


def test_an_interrupted_simulation_keeps_what_there_is(tmp_path: Path) -> None:
    words = ("simulate", str(DRIVE), "--until", "20 s", "--points", "20000")
    result = command(tmp_path, "-c", PRESSED, "5", *words, "--csv", "run.csv", "--plot", "run.png")
    assert result.returncode == 130
    told = re.fullmatch(r"Interrupted\. The results up to t = ([0-9.]+) s are in run\.csv, run\.png\.\n", result.stderr)
    assert told is not None, result.stderr
    table = np.genfromtxt(tmp_path / "run.csv", delimiter=",", names=True)
    assert table["time"][-1] == pytest.approx(float(told[1]), rel=1e-5)
    assert 5.0 <= table["time"][-1] < 20.0
    assert (tmp_path / "run.png").read_bytes()[:4] == b"\x89PNG"
    assert "two_mass  0 s to" in result.stdout
    assert "energy" not in result.stdout


def test_an_interrupted_simulation_says_what_is_lost(tmp_path: Path) -> None:
    result = command(tmp_path, "-c", PRESSED, "5", "simulate", str(DRIVE), "--until", "20 s", "--points", "20000")
    assert result.returncode == 130
    assert result.stderr.endswith(" s are lost: neither --csv nor --plot is given.\n")
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize("processes", ["1", "2"])
def test_an_interrupted_sweep_records_nothing_false(processes: str, tmp_path: Path) -> None:
    words = ("sweep", str(DRIVE), "--over", "J1.J=0.01:0.03:120", "--of", "J2.w", "--until", "0.2 s")
    keep = ("--processes", processes, "--checkpoint", "runs.zarr", "-o", "table.csv")
    result = command(tmp_path, "-c", PRESSED, "25", *words, *keep)
    assert result.returncode == 130, result.stderr
    told = re.fullmatch(
        r"Interrupted\. (\d+) of 120 runs are in runs\.zarr: the same sweep resumes there\.\n", result.stderr
    )
    assert told is not None, result.stderr
    assert 25 <= int(told[1]) < 120
    assert not (tmp_path / "table.csv").exists()
    counts = []
    found = sweep(
        DRIVE, {"J1.J": np.linspace(0.01, 0.03, 120)}, ["J2.w"], until="0.2 s", checkpoint=tmp_path / "runs.zarr",
        processes=1, progress=lambda done, total: counts.append(done),
    )  # fmt: skip
    assert counts[0] == int(told[1]) + 25
    assert found["failure"].to_numpy().tolist() == [""] * 120
    whole = sweep(DRIVE, {"J1.J": np.linspace(0.01, 0.03, 120)}, ["J2.w"], until="0.2 s", processes=1)
    np.testing.assert_array_equal(found["J2.w"], whole["J2.w"])


def test_an_interrupted_sweep_without_a_checkpoint(tmp_path: Path) -> None:
    words = ("sweep", str(DRIVE), "--over", "J1.J=0.01:0.03:50", "--of", "J2.w", "--until", "0.01 s")
    result = command(tmp_path, "-c", PRESSED, "25", *words)
    assert (result.returncode, result.stderr) == (
        130,
        "Interrupted. 25 of 50 runs are lost without a checkpoint.\n",
    )


FAILING = """
[parts]
up = { is = "Constant", k = 1 }
torque = { is = "Torque" }
a = { is = "Inertia", J = 1, phi = 0, w = 0 }
blow = { is = "blow:Blow", x = 1 }
[series]
s = ["torque", "a"]
[connect]
c = ["up.y", "torque.tau"]
[simulate]
until = "2 s"
"""
BLOW = """
from modelica_like.language import *

class Blow(Component):
    x: Variable = var("1", "grows without bound at 1 s")
    T: Parameter = param("s", "time", default=1.0)
    large = Mode("no", "yes")

    def equations(self):
        yield self.T * der(self.x) == self.x**2

    def events(self):
        yield self.large.go("no", "yes", when=self.x > 2)
"""


def test_a_failed_simulation_keeps_what_there_is(tmp_path: Path) -> None:
    """x = 1/(1 - t): the integrator gives up at 1 s; results up to there are those of the closed form."""
    (tmp_path / "drive.toml").write_text(FAILING)
    (tmp_path / "blow.py").write_text(BLOW)
    result = command(tmp_path, "-m", "modelica_like", "simulate", "drive.toml", "--trust", "--csv", "run.csv")
    assert result.returncode == 1
    assert result.stderr.startswith("IDAS gave up at about t = ")
    told = re.search(r"\nThe results up to t = ([0-9.]+) s are in run\.csv\.\n$", result.stderr)
    assert told is not None, result.stderr
    table = np.genfromtxt(tmp_path / "run.csv", delimiter=",", names=True)
    assert 0.9 < table["time"][-1] == pytest.approx(float(told[1]), rel=1e-5)
    np.testing.assert_allclose(table["aw"], table["time"], rtol=0, atol=1e-6)
    np.testing.assert_allclose(1 / table["blowx"], 1 - table["time"], rtol=0, atol=1e-5)
    assert re.search(r"0\.[45]\d* +blow\.large +no +yes", result.stdout)


BROKEN = """
import sys
from modelica_like.runs.solution import Solution
from modelica_like.errors import SolveError
def energy(self):
    raise {error}
Solution.energy = energy
from modelica_like.cli import main
main()
"""


@pytest.mark.parametrize(
    ("error", "reason"),
    [('SolveError("The powers cannot be integrated.")', "The powers cannot be integrated."), ("StopIteration", "Stop")],
)
def test_a_run_whose_balance_fails_is_a_run(error: str, reason: str, tmp_path: Path) -> None:
    words = ("simulate", str(DRIVE), "--until", "0.01", "--csv", "run.csv", "--sankey", "flow.png", "--plot", "run.png")
    result = command(tmp_path, "-c", BROKEN.format(error=error), *words)
    assert result.returncode == 0
    assert f"The energy balance could not be made: {reason}" in result.stderr
    assert f"The picture flow.png could not be made: {reason}" in result.stderr
    assert " steps, " in result.stdout
    assert {one.name for one in tmp_path.iterdir()} == {"run.csv", "run.png"}


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--plot", "x.foo"], "'x.foo': a picture can be avif, "),
        (["--sankey", "x.foo"], "'x.foo': a picture can be avif, "),
        (["--plot", "x.png", "--show", "nix.*"], "two_mass has no variable 'nix.*'."),
        (["--csv", "x.xls"], "'x.xls': a table can be .csv, .parquet, .nc."),
        (["--csv", "/proc/x.csv"], "/proc: No such file or directory."),
        (["--csv", "file/x.csv"], "Not a directory."),
        (["--csv", "folder.csv"], "folder.csv: Is a directory."),
    ],
)
def test_options_are_checked_before_the_run(options: list[str], told: str, tmp_path: Path) -> None:
    """The run itself would take hours."""
    (tmp_path / "file").write_text("")
    (tmp_path / "folder.csv").mkdir()
    result = command(tmp_path, "-m", "modelica_like", "simulate", str(DRIVE), "--until", "1e6 s", *options)
    assert (result.returncode, result.stdout) == (2, "")
    assert told in result.stderr


# -- in Python ---------------------------------------------------------------------------------------------------------


def press(*_: object) -> None:
    os.kill(os.getpid(), signal.SIGINT)


def test_an_interrupted_export_leaves_the_old_fmu(tmp_path: Path) -> None:
    path = tmp_path / "drive.fmu"
    path.write_text("old")
    for moment in ("compiling the model", "checking"):
        with pytest.raises(KeyboardInterrupt):
            export_fmu(DRIVE, path, platforms=(), report=lambda what, moment=moment: what == moment and press())
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_an_interrupted_cosimulation_ends_its_process(tmp_path: Path) -> None:
    system = split(DRIVE, "shaft", tmp_path, names=("motor", "wheel"), check=False).path
    with pytest.raises(KeyboardInterrupt) as told:
        cosim(system, "1000 s", step="0.1 ms", progress=press)
    kept, whole = told.value.run, cosim(system, "0.01 s", step="0.1 ms")
    assert 0.01 < kept.time[-1] < 1000
    assert kept.time[-1] == pytest.approx(1e-4 * kept.steps)
    assert len(kept.time) == kept.steps + 1
    for name in ("J2.w", "shaft.power", "shaft.residual_energy"):
        assert np.array_equal(kept[name][:101], whole[name])
    children = subprocess.run(["pgrep", "-P", str(os.getpid()), "-f", "cosimulation/child.py"], check=False)
    assert children.returncode == 1


@pytest.mark.parametrize(("until", "kept"), [("1000s", "run.csv, run.png"), ("1000s", "")])
def test_an_interrupted_cosim_command_says_what_it_kept(until: str, kept: str, tmp_path: Path) -> None:
    system = split(DRIVE, "shaft", tmp_path, names=("motor", "wheel"), check=False).path
    files = ["--csv", "run.csv", "--plot", "run.png"] if kept else []
    result = command(tmp_path, "-c", PRESSED, "0.01", "cosim", str(system), "--until", until, "--step", "0.1ms", *files)
    what = f"are in {kept}" if kept else "are lost: neither --csv nor --plot is given"
    said = re.fullmatch(rf"Interrupted\. The results up to t = ([0-9.]+) s {what}\.\n", result.stderr)
    assert (result.returncode, bool(said)) == (130, True), result.stderr
    assert "communication steps of 0.0001 s" in result.stdout
    if kept and said:
        rows = (tmp_path / "run.csv").read_text().splitlines()
        assert float(rows[-1].partition(",")[0]) == pytest.approx(float(said[1]), rel=1e-5)
        assert (tmp_path / "run.png").stat().st_size > 1000


def test_an_interrupted_calibration_is_no_failed_start() -> None:
    class Interrupted(Numbers):
        def residuals(self, *_: object) -> tuple[object, object]:
            press()
            raise AssertionError

    data = Interrupted({"J2.w": (1.0, 0.1)}, until=0.01)
    with pytest.raises(KeyboardInterrupt):
        calibrate(DRIVE, data, {"J1.J": (0.01, 0.03)}, starts=3)


# Kills its own process when workers have done something, and says so before.
KILLED = """
import os, sys
from modelica_like.show.report import progress
def kill(self, reached, *of):
    print("at work", flush=True)
    os.kill(os.getpid(), number)
progress.Bar.__call__ = kill
from modelica_like.cli import main
if __name__ == "__main__":  # workers import this module
    number = int(sys.argv.pop(1))
    main()
"""


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_workers_of_a_killed_sweep_end_with_it(tmp_path: Path, number: int) -> None:
    """They have its standard output, too, which ends when the last of them has ended."""
    (tmp_path / "killed.py").write_text(KILLED)
    words = ["sweep", str(DRIVE), "--over", "J1.J=0.01:0.03:5000", "--of", "J2.w", "--solver", "idas"]
    process = subprocess.Popen(
        [sys.executable, "killed.py", str(int(number)), *words, "--processes", "2", "-o", "table.csv"],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip
    assert process.wait(120) == -number
    told, _ = process.communicate(timeout=20)
    assert told == b"at work\n"
