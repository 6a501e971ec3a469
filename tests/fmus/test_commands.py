"""The commands validate and compare: what they print, and their exit codes."""

from collections.abc import Mapping
from pathlib import Path

from calls import called

EXAMPLES = Path(__file__).parents[2] / "examples"
Built = Mapping[tuple[str, str], Path]


def test_validate_prints_every_check(reference_fmus: Built) -> None:
    result = called(["validate", str(reference_fmus["machine_table", "2.0"])])
    assert result.exit_code == 0
    assert "libcosim CS                    passed   It runs to 0.4 s and ends with the same values." in result.stdout


def test_validate_of_a_broken_file_fails(tmp_path: Path) -> None:
    (tmp_path / "drive.fmu").write_text("nothing")
    result = called(["validate", str(tmp_path / "drive.fmu")])
    assert result.exit_code == 1
    assert "archive  failed   drive.fmu is not an FMU: it is not a valid zip archive." in result.stdout


def test_validate_of_no_file(tmp_path: Path) -> None:
    result = called(["validate", str(tmp_path / "drive.fmu")])
    assert result.exit_code == 2
    assert "drive.fmu' does not exist." in result.stderr


def test_compare_prints_deviations_and_draws(reference_fmus: Built, tmp_path: Path) -> None:
    netlist, picture = str(EXAMPLES / "machine_table_direct.toml"), tmp_path / "both.png"
    fmu = str(reference_fmus["machine_table", "3.0"])
    result = called(["compare", netlist, fmu, "--signal", "table.*", "--plot", str(picture)])
    assert result.exit_code == 0
    rows = {line.split()[0]: line.split() for line in result.stdout.splitlines() if line}
    assert rows["table.v"][2] == "m/s"
    assert float(rows["table.v"][3]) < 1e-6
    assert rows["clutch.mode"][1:3] == ["stuck", "0.2"]
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_compare_of_strangers_is_told(reference_fmus: Built) -> None:
    fmus = [str(reference_fmus[name, "2.0"]) for name in ("two_mass", "stick_slip")]
    result = called(["compare", *fmus])
    assert result.exit_code == 2
    assert result.stderr.startswith("two_mass_fmi2.fmu and stick_slip_fmi2.fmu have no signal in common.")
