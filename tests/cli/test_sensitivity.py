"""The command sensitivity: tables, tornado plot, exit codes."""

from pathlib import Path

import pytest
from calls import called

DIRECT = str(Path(__file__).parents[2] / "examples" / "machine_table_direct.toml")


def test_a_ranking_table() -> None:
    arguments = ["sensitivity", DIRECT, "--of", "clutch.lock_time", "--to", "load_torque", "--to", "acceleration_time"]
    result = called(arguments)
    assert result.exit_code == 0
    rows = {line.split()[0]: line.split() for line in result.stdout.splitlines() if line.strip()}
    # The clutch torque is sized for the acceleration time, whatever the load.
    assert rows["acceleration_time"][1:] == ["0.2", "s", "1", "1.0000"]
    assert float(rows["load_torque"][3]) == pytest.approx(0.0, abs=1e-12)
    assert result.stderr == ""


def test_a_tornado_plot(tmp_path: Path) -> None:
    picture = tmp_path / "tornado.png"
    result = called(["sensitivity", DIRECT, "--of", "clutch.loss_energy", "--tornado", str(picture)])
    assert result.exit_code == 0
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("wrong", [["--of", "clutch.lok_time"], ["--of", "table.s", "--to", "mu"]])
def test_a_wrong_name_is_told(wrong: list[str]) -> None:
    result = called(["sensitivity", DIRECT, *wrong])
    assert result.exit_code == 2
    assert result.stderr.startswith("machine_table_direct has no")
