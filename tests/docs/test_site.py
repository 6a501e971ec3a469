"""What the site makes of mathematics."""

import runpy
from pathlib import Path

import pytest

pytest.importorskip("latex2mathml")
MATHEMATICS = runpy.run_path(str(Path(__file__).parents[2] / "docs" / "site" / "mathml.py"))


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
