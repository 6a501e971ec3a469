"""The code of docs/plots.md runs, and its pictures stand in the repository."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "plots.md"


def test_pictures_are_drawn_and_committed(page):
    text, _, folder = page
    shown = re.findall(r"\(pictures/(.*?)\)", text)
    assert sorted(shown) == sorted(file.name for file in folder.glob("*.png"))
    assert all((ROOT / "docs" / "pictures" / name).stat().st_size > 5000 for name in shown)
