"""The page about design checks: its Python runs, its sizing files are sized."""

import re
import shutil
from pathlib import Path

import pytest

from modelica_like.analyse.sizing import size

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "sizing.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


@pytest.mark.parametrize("number", range(3))
def test_python(number: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(ROOT)
    exec(compile(blocks("python")[number], "sizing.md", "exec", dont_inherit=True), {"__name__": "__main__"})
    printed = capsys.readouterr().out
    assert ("40.5251  N", "11.77", "above the limit 15 N.m by 5 N.m (33.3 %)")[number] in printed


@pytest.mark.parametrize("number", range(2))
def test_sizing_files(number: int, tmp_path: Path) -> None:
    (tmp_path / "sizing").mkdir()
    (tmp_path / "sizing" / "page.toml").write_text(blocks("toml")[number], encoding="utf-8")
    shutil.copy(ROOT / "examples" / "machine_table_direct.toml", tmp_path)
    assert size(tmp_path / "sizing" / "page.toml").exceeded == 0


def test_every_example_is_on_the_page() -> None:
    for path in (ROOT / "examples" / "sizing").glob("*.toml"):
        assert f"`{path.name}`" in PAGE


@pytest.mark.parametrize(
    ("page", "files"),
    [("test_bench", ("test_bench", "test_bench_motor")), ("ravigneaux", ("ravigneaux_strength",))],
)
def test_page_has_the_numbers_of_the_files(page: str, files: tuple[str, ...]) -> None:
    """Every row of a page that names a check has its line as `size` prints it."""
    text = (ROOT / "docs" / "examples" / f"{page}.md").read_text(encoding="utf-8")
    sizings = [size(ROOT / "examples" / "sizing" / f"{name}.toml") for name in files]
    checks = {check.name: check for sizing in sizings for check in sizing.checks}
    rows = re.findall(r"^\| `(\w+)\.(\w+)` \| ([^|]+) \|([^|]*)\|", text, re.MULTILINE)
    assert len(rows) > 10
    for check, name, value, unit in rows:
        line = next(line for line in checks[check].result.lines() if line.name == name)
        assert (line.value, line.unit) == (value, unit.strip()), f"{check}.{name}"
