"""Libraries of Modelica text: where classes are found, and which one wins."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from modelica_like import load, simulate
from modelica_like.errors import ModelicaLikeError, ModelicaTextError
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


@pytest.fixture
def standard(tmp_path: Path) -> Path:
    """Return a library with classes for which there are components, and more: a spring may be cubic."""
    folder = tmp_path / "std"
    folder.mkdir()
    (folder / "Modelica.mo").write_text("""
package Modelica
  package Mechanics
    package Rotational
      package Components
        model Spring
          Modelica.Mechanics.Rotational.Interfaces.Flange_a flange_a;
          Modelica.Mechanics.Rotational.Interfaces.Flange_b flange_b;
          parameter Real c;
          parameter Real c3 = 0 "of the third power";
          parameter Boolean useSensor = false;
          Modelica.Blocks.Interfaces.RealOutput sensor = twist if useSensor;
          Real twist = flange_b.phi - flange_a.phi;
        equation
          flange_b.tau = c*twist + c3*twist^3;
          flange_a.tau = -flange_b.tau;
        end Spring;
      end Components;
    end Rotational;
  end Mechanics;
end Modelica;
""")
    return folder


SPRUNG = """
model Sprung
  Modelica.Mechanics.Rotational.Components.Fixed wall;
  Modelica.Mechanics.Rotational.Components.Inertia rotor(J = 2, phi(fixed = true), w(start = 3, fixed = true));
  %s
equation
  connect(wall.flange, spring.flange_a);
  connect(spring.flange_b, rotor.flange_a);
  %s
  annotation(experiment(StopTime = 1));
end Sprung;
"""
SPRING = "Modelica.Mechanics.Rotational.Components.Spring"


@pytest.mark.parametrize(
    ("declared", "equation"),
    [
        (f"{SPRING} spring(c = 50, c3 = 40);", ""),
        (f"{SPRING} spring(c = 50, c3 = 40, useSensor = true); Real x;", "x = spring.twist;"),
        ("model Mine extends " + SPRING + "(c3 = 40); end Mine; Mine spring(c = 50);", ""),
    ],
)
def test_what_a_component_is_not_is_read_from_the_text(
    standard: Path, tmp_path: Path, declared: str, equation: str
) -> None:
    (tmp_path / "s.mo").write_text(SPRUNG % (declared, equation))
    with with_libraries([standard]):
        run = simulate(load(tmp_path / "s.mo"), rtol=1e-10)
    phi, w = run["rotor.phi"], run["rotor.w"]
    assert 2 * w**2 / 2 + 50 * phi**2 / 2 + 40 * phi**4 / 4 == pytest.approx(9.0, rel=1e-7)  # energy
    assert phi.max() == pytest.approx(np.sqrt((np.sqrt(25.0**2 + 4 * 10 * 9) - 25) / 20), rel=1e-4)


def test_an_end_that_a_component_lacks_is_read_from_the_text(standard: Path, tmp_path: Path) -> None:
    text = SPRUNG % (
        f"{SPRING} spring(c = 50, useSensor = true); Modelica.Blocks.Math.Gain twice(k = 2);",
        "connect(spring.sensor, twice.u);",
    )
    (tmp_path / "s.mo").write_text(text)
    with with_libraries([standard]):
        run = simulate(load(tmp_path / "s.mo"), rtol=1e-10)
    assert run["twice.y"] == pytest.approx(2 * 0.6 * np.sin(5 * run.time), abs=1e-7)
    assert run["rotor.phi"] == pytest.approx(0.6 * np.sin(5 * run.time), abs=1e-7)


def test_a_component_stands_for_its_class_where_it_can(standard: Path, tmp_path: Path) -> None:
    (tmp_path / "s.mo").write_text(SPRUNG % (f"{SPRING} spring(c = 50);", ""))
    with with_libraries([standard]):
        assert type(load(tmp_path / "s.mo").spring).__name__ == "Spring"
        assert "twist" not in load(tmp_path / "s.mo").spring.fields


def test_without_the_text_the_refusal_says_what_to_give(tmp_path: Path) -> None:
    (tmp_path / "s.mo").write_text(SPRUNG % (f"{SPRING} spring(c = 50, k3 = 40);", ""))
    with pytest.raises(ModelicaLikeError) as caught:
        load(tmp_path / "s.mo")
    assert f"{SPRING} has no 'k3' here" in str(caught.value)


def test_a_motion_and_its_flow_have_the_signs_of_the_library(tmp_path: Path) -> None:
    """Torque into a shaft that takes a motion: J*a, and the torque on a shaft that tells it is minus its input."""
    components = "Modelica.Mechanics.Rotational.Components"
    (tmp_path / "s.mo").write_text(f"""
model Signs
  Modelica.Blocks.Sources.Constant flow(k = 3);
  {components}.TorqueToAngleAdaptor told;
  {components}.Inertia free(J = 2, phi(fixed = true), w(fixed = true));
  {components}.AngleToTorqueAdaptor follows(use_w = false, use_a = false);
  {components}.Inertia led(J = 4);
equation
  connect(flow.y, told.tau);
  connect(told.flange, free.flange_a);
  connect(told.phi, follows.phi);
  connect(follows.flange, led.flange_a);
  annotation(experiment(StopTime = 1));
end Signs;
""")
    run = simulate(load(tmp_path / "s.mo"), rtol=1e-10)
    assert run["free.w"] == pytest.approx(-1.5 * run.time, abs=1e-9)
    assert run["follows.tau"][1:] == pytest.approx(-4 * 1.5 * np.ones(len(run.time) - 1))
    assert run["told.w"] == pytest.approx(run["free.w"], abs=1e-9)


def test_prescribed_motions_start_as_in_the_library(tmp_path: Path) -> None:
    sources = "Modelica.Mechanics.Rotational.Sources"
    (tmp_path / "s.mo").write_text(f"""
model Begin
  Modelica.Blocks.Sources.Constant one(k = 1);
  {sources}.Accelerate faster;
  {sources}.Speed turning;
  {sources}.Position standing;
  Modelica.Mechanics.Rotational.Components.Inertia a(J = 1, w(start = 7)), b(J = 1, phi(start = 5)), c(J = 1);
equation
  connect(one.y, faster.a_ref); connect(one.y, turning.w_ref); connect(one.y, standing.phi_ref);
  connect(faster.flange, a.flange_a); connect(turning.flange, b.flange_a); connect(standing.flange, c.flange_a);
  annotation(experiment(StopTime = 1));
end Begin;
""")
    run = simulate(load(tmp_path / "s.mo"), rtol=1e-10)
    assert run["a.w"] == pytest.approx(run.time, abs=1e-9)
    assert run["b.phi"] == pytest.approx(run.time, abs=1e-8)
    assert run["c.phi"] == pytest.approx(np.ones(len(run.time)), abs=1e-9)
