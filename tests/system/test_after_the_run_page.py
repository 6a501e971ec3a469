"""The code of docs/after_the_run.md runs, and what it prints stands there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "after_the_run.md"


def test_printed_numbers_are_those_of_the_page(page):
    text, names, _ = page
    damage = (names["spectrum"] * 1e4).damage(names["shaft"])
    servo = names["step_metrics"](names["servo"], "table.phi")
    for printed in (f"{names['spectrum']}\n{damage:.4g}", names["orders"], servo):
        assert f"```text\n{printed}\n```" in text
    seen = names["seen"]
    assert seen.order(2)[:40].mean() / seen.order(0)[:40].mean() == pytest.approx(0.8, rel=2e-3)


def test_pictures_are_drawn_and_committed(page):
    text, _, folder = page
    shown = re.findall(r"\(pictures/(.*?)\)", text)
    assert sorted(shown) == sorted(file.name for file in folder.glob("*.png"))
    assert all((ROOT / "docs" / "pictures" / name).stat().st_size > 5000 for name in shown)
