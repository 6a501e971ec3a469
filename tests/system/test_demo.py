"""The demo: every number of the published start-ups, within the tolerance of its source."""

import importlib.util
import io
import sys
from pathlib import Path
from typing import Any

import pytest
from calls import called
from rich.console import Console

from modelica_like.cli import validation

ROOT = Path(__file__).parents[2]


def script() -> Any:
    """examples/demo.py"""
    spec = importlib.util.spec_from_file_location("demo_of_the_examples", ROOT / "examples" / "demo.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


demo = script()
EXACT = 1e-6
SIMULATED = 1e-3
SETTLED = 1e-5


@pytest.mark.parametrize("case", demo.cases(), ids=lambda case: case.title)
def test_numbers(case: Any) -> None:
    runs, _ = demo.run_case(case, demo.EXAMPLES)
    tolerance = EXACT if "formula" in case.source or "balance" in case.source else SIMULATED
    for number in case.numbers:
        limit = SETTLED if "settled" in number.name else tolerance
        assert number.computed(runs) == pytest.approx(number.expected, rel=limit), number.name
    for number in (number for number in case.numbers if number.published is not None):
        # The documents calculate with truncated intermediate results: up to 0.22 % off.
        assert number.computed(runs) == pytest.approx(number.published, rel=3e-3), number.name
    assert runs.whole.energy().power_closure < 1e-8


def test_pages_tell_everything_and_pictures_are_written(tmp_path: Path) -> None:
    console = Console(width=160, record=True, file=io.StringIO())
    for page in demo.pages(demo.EXAMPLES, tmp_path):
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
    monkeypatch.setattr(validation, "DEMO", tmp_path / "nothing")
    result = called(["demo", "--pictures", str(tmp_path)])
    assert result.exit_code == 2
    assert result.stderr == "The demo needs the folder of examples.\nRun it from a copy of the source.\n"


def test_the_command_runs_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "demo.py").write_text(
        "def run_demo(console, pictures):\n    console.print(f'pages and {pictures.name}')\n"
    )
    monkeypatch.setattr(validation, "DEMO", tmp_path / "demo.py")
    result = called(["demo", "--pictures", str(tmp_path / "pictures")])
    assert (result.exit_code, result.stdout) == (0, "pages and pictures\n")
