"""The page about design checks: its Python runs, its sizing files are sized."""

import re
from pathlib import Path

import pytest

from modelica_like.sizing import size

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "sizing.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


@pytest.mark.parametrize("number", range(3))
def test_python(number: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(ROOT)
    # Annotations of a class that no module holds cannot be looked up as text.
    exec(compile(blocks("python")[number], "sizing.md", "exec", dont_inherit=True), {"__name__": "components.sizing"})
    printed = capsys.readouterr().out
    assert ("40.5251  N", "11.77", "above the limit 15 N.m by 5 N.m (33.3 %)")[number] in printed


@pytest.mark.parametrize("number", range(2))
def test_sizing_files(number: int) -> None:
    made = ROOT / "examples" / "sizing" / "page_of_the_docs.toml"
    made.write_text(blocks("toml")[number], encoding="utf-8")
    try:
        assert size(made).exceeded == 0
    finally:
        made.unlink()


def test_every_example_is_on_the_page() -> None:
    for path in (ROOT / "examples" / "sizing").glob("*.toml"):
        assert f"`{path.name}`" in PAGE
