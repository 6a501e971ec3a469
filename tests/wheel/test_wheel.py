"""The wheel where the repository is not: it is built by way of the sdist, installed, and its commands do their work.

`MODELICA_LIKE_WHEEL` names a wheel to try instead of one that is built here for this machine; it is installed with its
dependencies, by the interpreter `MODELICA_LIKE_PYTHON` if there is one. Without it they are those of this environment.
"""

import csv
import json
import os
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

from modelica_like.fmi.build import RUNTIMES, native_platform

ROOT = Path(__file__).parents[2]
SCRIPTS = "Scripts" if os.name == "nt" else "bin"
pytestmark = [pytest.mark.wheel, pytest.mark.slow]


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    given = os.environ.get("MODELICA_LIKE_WHEEL")
    if given:
        return Path(given).resolve()
    folder = tmp_path_factory.mktemp("dist")
    environment = {name: value for name, value in os.environ.items() if name != "MODELICA_LIKE_PLATFORMS"}
    command = [sys.executable, "-m", "build", "--outdir", folder, ROOT]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert len(list(folder.glob("*.tar.gz"))) == 1
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="session")
def home(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An environment with the wheel."""
    folder = tmp_path_factory.mktemp("clean") / "venv"
    clean = "MODELICA_LIKE_WHEEL" in os.environ
    python = os.environ.get("MODELICA_LIKE_PYTHON", sys.executable) if clean else sys.executable
    subprocess.run([python, "-m", "venv", folder], check=True)
    install = [folder / SCRIPTS / "python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    if not clean:  # what is here, but nothing that it installs from elsewhere: no path file is read in a folder of one
        packages = subprocess.run(
            [folder / SCRIPTS / "python", "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"],
            capture_output=True, text=True, check=True,
        ).stdout.strip()  # fmt: skip
        (Path(packages) / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
        install.append("--no-deps")
    subprocess.run([*install, wheel], check=True)
    return folder


@pytest.fixture
def run(home: Path, tmp_path: Path):
    """Run a command of the environment in an empty folder, with nothing else on the path: no compiler, no cache."""

    def run(*words: str | Path, path: str = "") -> str:
        kept = ("SYSTEMROOT", "TEMP", "TMP")  # Windows cannot do without
        environment = {name: os.environ[name] for name in kept if name in os.environ} | {
            "PATH": os.pathsep.join((str(home / SCRIPTS), path)), "MODELICA_LIKE_CACHE": str(tmp_path / "cache"),
            "HOME": str(tmp_path), "PYTHONUTF8": "1", "MPLBACKEND": "Agg",
        }  # fmt: skip
        command = [home / SCRIPTS / str(words[0]), *words[1:]]
        done = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, encoding="utf-8", check=False
        )
        assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
        return done.stdout

    return run


@pytest.fixture
def examples(run) -> Path:
    return Path(run("python", "-c", "import modelica_like; print(modelica_like.__path__[0])").strip()) / "examples"


def test_the_repository_is_not_there(examples: Path, home: Path) -> None:
    assert examples.resolve().is_relative_to(home.resolve())


def test_demo(run, tmp_path: Path) -> None:
    told = run("modelica-like", "demo", "--pictures", "pictures")
    assert "0.265473" in told  # s until the machine table locks up: tests/system/test_demo.py has the source
    assert len(list((tmp_path / "pictures").glob("*.png"))) == 4


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_simulate(run, examples: Path, tmp_path: Path, solver: str) -> None:
    """Newton: 5 N.m speed up 0.02 kg.m2 and 0.08 kg.m2 for 0.5 s."""
    run("modelica-like", "simulate", examples / "two_mass.toml", "--csv", "run.csv", "--solver", solver)
    with (tmp_path / "run.csv").open(encoding="utf-8") as file:
        *_, last = csv.DictReader(file)
    assert 0.02 * float(last["J1.w"]) + 0.08 * float(last["J2.w"]) == pytest.approx(5 * 0.5, rel=1e-6)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_export_takes_no_compiler(run, examples: Path, tmp_path: Path, version: str) -> None:
    run("modelica-like", "export", examples / "machine_tool_startup.toml", "-o", "drive.fmu", "--fmi", version)
    with zipfile.ZipFile(tmp_path / "drive.fmu") as archive:
        assert len([name for name in archive.namelist() if name.startswith("binaries/")]) == 1
    told = run("modelica-like", "validate", "drive.fmu", path=os.environ["PATH"])
    assert told.count("passed") >= 6
    assert "failed" not in told
    assert not (tmp_path / "cache").exists()


def test_new(run, examples: Path, tmp_path: Path) -> None:
    for drive, name in (("winch", "winch"), ("launch", "launch"), ("servo", "servo_axis"), ("blank", "blank")):
        run("modelica-like", "new", drive)
        assert (tmp_path / f"{drive}.toml").read_bytes() == (examples / f"{name}.toml").read_bytes()


def test_schema(run) -> None:
    assert "Clutch" in json.dumps(json.loads(run("modelica-like", "schema")))


def test_library(run) -> None:
    assert "LossyGear" in run("modelica-like", "library")
    assert "fn_max" in run("modelica-like", "describe", "Clutch")


def test_the_platforms_in_it(run, wheel: Path, examples: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        platforms = {name.split("/")[3] for name in archive.namelist() if "/fmi/runtimes/" in name}
    if "all" not in os.environ.get("MODELICA_LIKE_PLATFORMS", ""):
        assert platforms == {native_platform()}
        machine, _, system = native_platform().partition("-")
        assert system != "linux" or wheel.stem.endswith(f"-py3-none-manylinux_2_17_{machine}")
        return
    assert platforms == {*RUNTIMES}
    run("modelica-like", "export", examples / "two_mass.toml", "-o", "drive.fmu", "--platform", "all")
    with zipfile.ZipFile(tmp_path / "drive.fmu") as archive:
        assert len([name for name in archive.namelist() if name.startswith("binaries/")]) == 6
    run("modelica-like", "export", examples / "two_mass.toml", "--html", "drive.html")
    assert (tmp_path / "drive.html").stat().st_size > 1e5
    assert not (tmp_path / "cache").exists()
