"""The code of docs/analysis.md runs, and its numbers are those of the documents."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "analysis.md"


def test_printed_modes_are_those_of_the_page(page):
    text, names, _ = page
    printed = "\n".join(str(mode) for mode in names["locked"].modes())
    assert f"```text\n{printed}\n```" in text


def test_pictures_are_drawn_and_committed(page):
    text, _, folder = page
    shown = re.findall(r"\(pictures/(.*?)\)", text)
    drawn = sorted(file.name for file in folder.glob("*.png"))
    assert sorted(shown) == drawn
    for name in shown:
        assert (ROOT / "docs" / "pictures" / name).stat().st_size > 5000


def test_numbers_of_document_002(page):
    _, names, _ = page
    assert names["point"]["first_load"] == pytest.approx(0.2116379, abs=1e-7)
    assert names["point"].efficiency == pytest.approx(0.660, abs=5e-4)


def test_friction_work_of_document_003(page):
    _, names, _ = page
    assert names["balance"]["clutch"].lost == pytest.approx(537.7, rel=2e-4)
    assert names["found"]["clutch.lock_time"].sel(h1=10.0, k1=6120.0).item() == pytest.approx(0.2655, abs=5e-5)
