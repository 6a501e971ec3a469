"""First page, tutorial, cookbook, how-to pages and theory are run from top to bottom; what they print stands there."""

import contextlib
import io
import re
import shlex
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from calls import called

from modelica_like import load
from modelica_like.netlist import library_types
from modelica_like.page import PageServer, Session

DOCS = Path(__file__).parents[2] / "docs"
PAGES = [
    DOCS / "README.md",
    DOCS / "tutorial.md",
    DOCS / "cookbook.md",
    DOCS / "modelica_text.md",
    *sorted([*DOCS.glob("how_to/*.md"), *DOCS.glob("theory/*.md")]),
]
LONG = ("cosimulate", "fmu_in_importers")
"""They compile several FMUs."""


def command(line: str) -> None:
    words = shlex.split(line, comments=True)[1:]
    if words[0] in ("explore", "edit"):  # would wait for a browser
        with PageServer(Session(load(words[1]) if words[0] == "explore" else Path(words[1]))) as server:
            assert server.address.startswith("http://127.0.0.1")
        return
    result = called(words)
    assert result.exit_code == 0, f"{line}: {result.stderr}"


@pytest.mark.parametrize("page", [
    pytest.param(page, id=page.stem, marks=pytest.mark.slow if page.stem in LONG else ()) for page in PAGES
])  # fmt: skip
def test_a_page_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": "page"}
    printed = ""
    text = page.read_text(encoding="utf-8")
    for before, language, block in re.findall(r"([^\n]*)\n*```(\w+)\n(.*?)```", text, re.DOTALL):
        if language == "sh":
            for line in block.splitlines():
                command(line)
        elif language in ("toml", "modelica"):
            (name,) = re.findall(r"`(\w+\.(?:toml|mo))`", before)
            Path(name).write_text(block, encoding="utf-8")
        elif language == "python":
            # In a thread: what drives a browser leaves a loop of events in this one, and asyncio.run needs its own.
            with contextlib.redirect_stdout(io.StringIO()) as stream, ThreadPoolExecutor(1) as thread:
                thread.submit(exec, compile(block, str(page), "exec"), names).result()
            printed = stream.getvalue()
        else:
            assert language == "text"
            assert block == printed


def test_types_named_for_newcomers_exist() -> None:
    """What stands in code in the right column and begins with a capital is a component, or a word of the language."""
    words = {"Component", "Assembly", "Flange", "LinearFlange", "Pin", "HeatPort", "Mode", "Parameter", "Variable"}
    known = words | set(library_types())
    text = (DOCS / "coming_from.md").read_text(encoding="utf-8")
    right = [row.split("|")[2] for row in text.splitlines() if row.startswith("| ")]
    named = {name for cell in right for name in re.findall(r"`([A-Z]\w+)`", cell)}
    assert len(named) > 40
    assert named <= known
