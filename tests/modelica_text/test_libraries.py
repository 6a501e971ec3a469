"""Libraries of Modelica text: where classes are found, and which one wins."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from modelica_like import load, simulate
from modelica_like.errors import ModelicaTextError
from modelica_like.netlist.modelica.classes import with_libraries

USER = """
model User
  Drives.Parts.Slow a(k = 2);
  annotation(experiment(StopTime = 1));
end User;
"""


@pytest.fixture
def library(tmp_path: Path) -> Path:
    """A package in folders; one file does not say where it belongs."""
    folder = tmp_path / "lib" / "Drives 2.1"
    (folder / "Parts").mkdir(parents=True)
    (folder / "package.mo").write_text("package Drives\n  constant Real two = 2;\nend Drives;\n")
    (folder / "package.order").write_text("two\nParts\n")
    (folder / "Parts" / "package.mo").write_text(
        "within Drives;\npackage Parts\n  import Drives.two;\n  partial model Base\n    parameter Real k = 1;\n"
        "  end Base;\nend Parts;\n"
    )
    (folder / "Parts" / "Slow.mo").write_text(
        "model Slow\n  extends Base;\n  Real x(start = 1, fixed = true);\nequation\n  der(x) = -k*x/two;\nend Slow;\n"
    )
    return tmp_path / "lib"


def _end(path: Path) -> float:
    return simulate(load(path), rtol=1e-9).final["a.x"]


def test_a_library_is_a_folder_of_packages_or_a_package(library: Path, tmp_path: Path) -> None:
    (tmp_path / "u.mo").write_text(USER)
    for place in (library, library / "Drives 2.1", library / "Drives 2.1" / "package.mo"):
        with with_libraries([place]):
            assert _end(tmp_path / "u.mo") == pytest.approx(np.exp(-1))


def test_the_environment_and_a_netlist_name_libraries(library: Path, tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "u.mo").write_text(USER)
    drive = 'name = "d"\n[parts]\na = { is = "./u.mo:User" }\n[simulate]\nuntil = "1 s"\nstart = "rest"\n'
    (tmp_path / "d.toml").write_text(drive + '[modelica]\nlibraries = ["lib"]\n')
    assert simulate(load(tmp_path / "d.toml"), rtol=1e-9).final["a.a.x"] == pytest.approx(np.exp(-1))
    monkeypatch.setenv("MODELICAPATH", str(library))
    assert _end(tmp_path / "u.mo") == pytest.approx(np.exp(-1))


def test_own_classes_come_before_those_of_libraries(library: Path, tmp_path: Path) -> None:
    own = "package Drives\n  package Parts\n    model Slow\n      parameter Real k; Real x = 7*k;\n    end Slow;\n"
    (tmp_path / "u.mo").write_text(f"{own}  end Parts;\nend Drives;\n{USER}")
    with with_libraries([library]):
        assert _end(tmp_path / "u.mo") == 14


def test_the_command_line_names_libraries(library: Path, tmp_path: Path) -> None:
    (tmp_path / "u.mo").write_text(USER)
    command = [sys.executable, "-m", "modelica_like", "check", "u.mo", "--library"]
    done, failed = (
        subprocess.run([*command, place], cwd=tmp_path, capture_output=True, text=True) for place in ("lib", "nowhere")
    )
    assert done.returncode == 0, done.stderr
    assert failed.returncode == 2
    assert failed.stderr == (
        "There is no library of Modelica text at 'nowhere'.\n"
        "Name a package's folder or file, or a folder with packages.\n"
    )


def test_a_library_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(ModelicaTextError, match="There is no library of Modelica text at "):
        with_libraries([tmp_path / "nowhere"])


@pytest.mark.parametrize("words", [["--library"], ["--library="]])
def test_a_library_without_a_path_is_told(tmp_path: Path, words: list[str]) -> None:
    (tmp_path / "u.mo").write_text("model D\n  Real x(start = 1, fixed = true);\nequation\n  der(x) = -x;\nend D;\n")
    command = [sys.executable, "-m", "modelica_like", "check", "u.mo", *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == (
        "There is no library of Modelica text at ''.\nName a package's folder or file, or a folder with packages.\n"
    )
