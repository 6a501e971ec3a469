"""The notebooks run, and say what stands in them."""

import runpy
from pathlib import Path
from typing import Any

import pytest

FOLDER = Path(__file__).parents[2] / "docs" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
LARGEST = 60_000
"""Bytes of a light notebook."""


def told(notebook: dict[str, Any]) -> list[tuple[list[str], list[str]]]:
    """Return what cells print, and the kinds of what they show."""
    outputs = [cell["outputs"] for cell in notebook["cells"] if cell["cell_type"] == "code"]
    return [
        ([line for one in some for line in one.get("text", [])], [kind for one in some for kind in one.get("data", {})])
        for some in outputs
    ]


def test_there_are_five_light_ones() -> None:
    assert len(NOTEBOOKS) == 5
    assert all(path.stat().st_size < LARGEST for path in NOTEBOOKS)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_says_what_stands_in_it(path: Path) -> None:
    made = runpy.run_path(str(FOLDER / "run.py"))
    notebook = made["read"](path)
    found = made["executed"](notebook)
    assert told(found) == told(notebook)
    assert sum(bool(printed) for printed, _ in told(notebook)) >= 2
    assert path.read_text(encoding="utf-8") == made["written"](notebook)
