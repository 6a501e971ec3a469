"""docs/importers.md: importer × FMU × result, as this test run finds it."""

import importlib.util
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

SCRIPT = Path(__file__).parents[2] / "docs" / "importers.py"


def load() -> ModuleType:
    spec = importlib.util.spec_from_file_location("importers_page", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


page: Any = load()
REGENERATE = "the page is out of date: python docs/importers.py"


def test_what_fails_is_told_and_only_that() -> None:
    failing = {line.split(" | ")[0][2:] for part in page.SECTIONS for line in page.rows(part) if "fails" in line}
    section = page.PAGE.read_text(encoding="utf-8").partition("## What fails\n")[2].partition("\n## ")[0]
    assert failing == set(re.findall(r"^- `([^`]+)`", section, re.MULTILINE))


def test_has_every_drive_in_both_versions() -> None:
    listed = [line.strip("| ").split(" | ")[:2] for line in page.rows("exports")]
    assert listed == [[drive, version] for drive in page.drives() for version in page.VERSIONS], REGENERATE


def test_reference_fmus(tmp_path: Path) -> None:
    assert page.reference_rows(tmp_path) == page.rows("reference"), REGENERATE


@pytest.mark.slow
@pytest.mark.parametrize("drive", page.drives())
def test_drive(drive: str, tmp_path: Path) -> None:
    expected = [line for line in page.rows("exports") if line.startswith(f"| {drive} |")]
    assert page.drive_rows(drive, tmp_path) == expected, REGENERATE
