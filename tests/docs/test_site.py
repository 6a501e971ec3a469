"""What the site makes of mathematics, and its index for programs."""

import re
import runpy
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("latex2mathml")
SITE = Path(__file__).parents[2] / "docs" / "site"
LLMS = runpy.run_path(str(SITE / "llms.py"))
MATHEMATICS = runpy.run_path(str(SITE / "mathml.py"))


def test_aligned_equations_are_rows_of_a_table() -> None:
    """The converter leaves what it does not know as it is: one line with the signs of alignment in it."""
    made = MATHEMATICS["mathml"]("\\begin{aligned}\na &= b \\cr\nc &= d\n\\end{aligned}", "block")
    assert made.count("<mtr>") == 2
    assert "&</mi>" not in made


def test_no_page_has_an_environment_that_the_converter_does_not_know() -> None:
    for page in (Path(__file__).parents[2] / "docs").rglob("*.md"):
        for formula in page.read_text(encoding="utf-8").split("$$")[1::2]:
            made = MATHEMATICS["mathml"](formula.strip(), "block")
            assert "<mi>&</mi>" not in made, page.name


PAGE = """---
hide: toc
---

# A [page](a.md) of many

<!-- Written by a program. -->

![a picture](a.svg)

```sh
no text.
```

Of [bolts](b.md) (M 8. and more) and `nuts`:
see there. Another sentence.
"""


def test_a_page_is_told_by_its_title_and_its_first_sentence() -> None:
    assert LLMS["about"](PAGE) == ("A page of many", "Of bolts (M 8. and more) and `nuts`: see there.")
    assert LLMS["about"](PAGE.replace("nuts`:\nsee there. Another sentence.", "nuts`:"))[1].endswith("`nuts`.")
    with pytest.raises(ValueError, match="no title"):
        LLMS["about"]("no page")


def test_the_index_has_every_page_of_the_navigation(tmp_path: Path) -> None:
    config = tomllib.loads((SITE / "zensical.toml").read_text(encoding="utf-8"))
    paths = [*paths_of(config["project"]["nav"])]
    for path in paths:
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        source = SITE.parent / path
        text = source.read_text(encoding="utf-8") if source.is_file() else f"# {path}\n\nA generated page."
        (tmp_path / path).write_text(text, encoding="utf-8")
    index = LLMS["llms"](tmp_path, SITE / "zensical.toml")
    lines = [line for line in index.splitlines() if line.startswith("- ")]
    assert index.startswith("# modelica_like\n\n> Acausal models of drive-trains")
    assert len(lines) == len(paths) > 60
    assert all(re.fullmatch(r"- \[[^\]]+\]\([\w/]+\.html\): .{5,220}", line) for line in lines), lines
    assert "- [Netlists](netlists.html): A netlist is a TOML file with a tree of components" in index
    assert "(index.html)" in lines[0]


def paths_of(entry: Any) -> Iterator[str]:
    if isinstance(entry, str):
        yield entry
    else:
        for inner in entry.values() if isinstance(entry, dict) else entry:
            yield from paths_of(inner)
