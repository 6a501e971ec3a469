"""`modelica-like split` and `cosim`: what they write and print."""

from pathlib import Path

import pytest
from calls import called

NETLIST = str(Path(__file__).parents[2] / "examples" / "two_mass.toml")


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a drive that was split on the command line."""
    folder = tmp_path_factory.mktemp("split") / "parts"
    options = ["--at", "shaft", "--name", "motor", "--name", "wheel", "-o", str(folder), "--no-check"]
    result = called(["split", NETLIST, *options, "--set", "motor.tau=3 N.m"])
    assert result.exit_code == 0, result.stderr
    assert result.stdout == (
        f"{folder}/system.toml: motor.fmu, wheel.fmu\n"
        "  shaft.flange_b receives the motion and returns the load\n"
        "  J2.flange_a receives the load and returns the motion\n"
    )
    return folder


def test_split_writes_fmus_netlists_and_the_system(parts: Path) -> None:
    files = {file.name for file in parts.iterdir()}
    assert files == {"motor.fmu", "motor.toml", "wheel.fmu", "wheel.toml", "system.toml"}


def test_cosim_prints_the_energies_and_the_steps(parts: Path) -> None:
    result = called(["cosim", str(parts / "system.toml"), "--step", "1ms", "--until", "0.1s"])
    assert result.exit_code == 0, result.stderr
    assert result.stdout.startswith("two_mass  0 s to 0.1 s\n\nenergy at the couplings in J")
    assert "100 communication steps of 0.001 s, " in result.stdout


def test_cosim_writes_a_table_and_a_picture(parts: Path, tmp_path: Path) -> None:
    options = ["--rtol", "1e-3", "--master", "gauss-seidel", "--until", "20ms", "--set", "motor.motor.tau=0"]
    files = ["--csv", str(tmp_path / "run.csv"), "--units", "--plot", str(tmp_path / "run.svg"), "--show", "J*.w"]
    result = called(["cosim", str(parts / "system.toml"), *options, *files])
    assert result.exit_code == 0, result.stderr
    names, units, *rows = (line.split(",") for line in (tmp_path / "run.csv").read_text().splitlines())
    assert units[names.index("J2.w")] == "rad/s"
    assert float(rows[-1][0]) == 0.02
    assert {float(row[names.index("J2.w")]) for row in rows} == {0.0}, "without a torque nothing moves"
    assert (tmp_path / "run.svg").read_text().startswith("<?xml")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["split", NETLIST, "--at", "shft", "-o", "{folder}/x"], "two_mass has no shaft 'shft'; did you mean 'shaft'?"),
        (["cosim", "{folder}/system.toml", "--step", "1m"], "step expects s; '1m' is m."),
        (
            ["cosim", "{folder}/system.toml", "--set", "wheel.J2.K=1"],
            "wheel (wheel.fmu) has no variable 'J2.K'; did you",
        ),
        (
            ["cosim", "{folder}/system.toml", "--until", "1e9s", "--show", "J9.w"],
            "two_mass has no variable 'J9.w'; did",
        ),
        (["cosim", "{folder}/system.toml", "--until", "1e9s", "--plot", "x.foo"], "'x.foo': a picture can be"),
        (["cosim", "{folder}/system.toml", "--until", "1e9s", "--csv", "x.foo"], "'x.foo': a table can be"),
        (["cosim", "{folder}/none.toml"], "The netlist '"),
        (
            ["cosim", "{folder}/system.toml", "--set", "wheel.J2.J=1 kg"],
            "Invalid value for --set: 'wheel.J2.J=1 kg' is not FMU.PATH=NUMBER.\n",
        ),
    ],
)
def test_mistakes_are_told(parts: Path, arguments: list[str], told: str) -> None:
    result = called([one.format(folder=parts) for one in arguments])
    assert result.exit_code == 2
    assert result.stderr.startswith(told)
