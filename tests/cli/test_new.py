"""The command new writes the examples, and nothing over a file."""

from pathlib import Path

import pytest
from calls import called

from modelica_like import load

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize(
    ("drive", "name"), [("winch", "winch"), ("launch", "launch"), ("servo", "servo_axis"), ("blank", "blank")]
)
def test_it_writes_the_example(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, drive: str, name: str) -> None:
    monkeypatch.chdir(tmp_path)
    result = called(["new", drive])
    assert result.exit_code == 0, result.stderr
    made = tmp_path / f"{drive}.toml"
    assert made.read_text(encoding="utf-8") == (EXAMPLES / f"{name}.toml").read_text(encoding="utf-8")
    load(made)


def test_it_keeps_a_file_that_exists(tmp_path: Path) -> None:
    kept = tmp_path / "mine.toml"
    kept.write_text("my work", encoding="utf-8")
    result = called(["new", "blank", "-o", str(kept)])
    assert result.exit_code == 2
    assert "exists, and is left as it is" in " ".join(result.stderr.split())
    assert kept.read_text(encoding="utf-8") == "my work"
