"""docs/command_line.md is what docs/command_line.py writes from the commands, and leads to pages that exist."""

import runpy
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_is_written_from_the_commands() -> None:
    made = runpy.run_path(str(DOCS / "command_line.py"))
    assert (DOCS / "command_line.md").read_text(encoding="utf-8") == made["page"]() + "\n", (
        "python docs/command_line.py"
    )
    for page, _ in made["MORE"].values():
        assert (DOCS / page).is_file() or page.startswith("components/")
