"""The demo: every number of the published start-ups, within the tolerance of its source."""

import io
from pathlib import Path

import pytest
from rich.console import Console

from modelica_like.demo import EXAMPLES, Case, cases, pages, run_case
from modelica_like.errors import NetlistError

EXACT = 1e-6
SIMULATED = 1e-3
SETTLED = 1e-5


@pytest.mark.parametrize("case", cases(), ids=lambda case: case.title)
def test_numbers(case: Case) -> None:
    runs, _ = run_case(case, EXAMPLES)
    tolerance = EXACT if "formula" in case.source or "balance" in case.source else SIMULATED
    for number in case.numbers:
        limit = SETTLED if "settled" in number.name else tolerance
        assert number.computed(runs) == pytest.approx(number.expected, rel=limit), number.name
    for number in (number for number in case.numbers if number.published is not None):
        # The documents calculate with truncated intermediate results: up to 0.22 % off.
        assert number.computed(runs) == pytest.approx(number.published, rel=3e-3), number.name
    assert runs.whole.energy().closure < 1e-8


def test_pages_tell_everything_and_pictures_are_written(tmp_path: Path) -> None:
    console = Console(width=160, record=True, file=io.StringIO())
    for page in pages(EXAMPLES, tmp_path):
        console.print(page)
    text = console.export_text()
    for expected in (
        "slip energy",
        "5452.82",
        "0.265473",
        "clutch.mode",
        "energy balance in J",
        "with reading and compiling",
    ):
        assert expected in text
    assert sorted(file.name[:1] for file in tmp_path.glob("*.png")) == ["1", "2", "3", "4"]


def test_without_the_examples_it_says_so(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("modelica_like.demo.EXAMPLES", tmp_path / "nothing")
    from modelica_like.demo import run_demo

    with pytest.raises(NetlistError, match="The demo needs the folder of examples"):
        run_demo(Console(), tmp_path)
