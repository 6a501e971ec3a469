"""docs/validation.md is what docs/validation.py writes from the tests, whose files exist."""

import runpy
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_page_is_written_from_the_tests() -> None:
    made = runpy.run_path(str(ROOT / "docs" / "validation.py"))
    assert (ROOT / "docs" / "validation.md").read_text(encoding="utf-8") == made["page"](), "python docs/validation.py"
    for row in (row for rows in made["ROWS"].values() for row in rows):
        assert (ROOT / "tests" / row.test).exists(), row.test
