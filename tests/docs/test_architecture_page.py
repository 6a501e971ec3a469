"""docs/architecture.md names files and tests that exist, and sets the exercises that are solved beside this."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")


def test_files_that_the_page_names_exist() -> None:
    known = {one.name for folder in ("modelica_like", "components") for one in (ROOT / folder).rglob("*.*")}
    known |= {one.name for one in ROOT.glob("*.*")} | {"netlist.toml", "model.mo"}
    tables = [cell for row in PAGE.splitlines() if row.startswith("|") for cell in row.split("|")[:4]]
    named = {one for cell in tables for one in re.findall(r"`(\w+\.(?:py|c|h|toml))`", cell)}
    assert len(named) > 30
    assert {one for one in named if not one.startswith("test_")} <= known


def test_tests_that_the_page_names_exist() -> None:
    rows = [row.split("|") for row in PAGE.splitlines() if row.startswith("| ")]
    named = [one for row in rows for one in re.findall(r"`((?:\w+/)?test_\w+(?:\*|\.py))`", row[-2])]
    assert len(named) > 20
    tests = ROOT / "tests"
    assert [one for one in named if not [*tests.glob(one), *tests.glob(f"*/{one}")]] == []


def test_the_page_sets_the_exercises() -> None:
    solved = (Path(__file__).parent / "test_exercises.py").read_text(encoding="utf-8")
    for word in ("Governor", "smooth_step", "fmi2GetDirectionalDerivative"):
        assert word in PAGE
        assert word in solved
