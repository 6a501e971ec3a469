"""docs/command_line.md is what docs/command_line.py writes from the commands, and leads to pages that exist."""

import re
import runpy
import shlex
from pathlib import Path

import pytest

from modelica_like.cli import command
from modelica_like.cli.reader import reader

DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_is_written_from_the_commands() -> None:
    made = runpy.run_path(str(DOCS / "command_line.py"))
    assert (DOCS / "command_line.md").read_text(encoding="utf-8") == made["page"]() + "\n", (
        "python docs/command_line.py"
    )
    for page, _ in made["MORE"].values():
        assert (DOCS / page).is_file() or page.startswith("components/")


def test_commands_in_all_pages_are_commands() -> None:
    """Each of their lines has options and values that the command takes."""
    count = 0
    for page in (DOCS.parent / "README.md", *DOCS.rglob("*.md")):
        for block in re.findall(r"```(?:sh|bash)?\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
            for line in re.findall(r"^modelica-like (.*)$", block, re.MULTILINE):
                name, *words = (word for word in shlex.split(line, comments=True) if word != "--trust")
                try:
                    reader(name, command(name)).read(words)
                except SystemExit:
                    pytest.fail(f"{page.name}: {line}")
                count += 1
    assert count > 50
