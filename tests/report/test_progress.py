"""The progress bar appears late, and only where the end is known."""

import io
import sys
from types import SimpleNamespace

import pytest
from rich.console import Console

from modelica_like.show.report import progress
from modelica_like.show.report.progress import Bar


def test_a_short_run_shows_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with Bar("2 s") as bar:
        bar(0.5)
        bar(2.0)
    assert capsys.readouterr() == ("", "")


def test_a_long_run_shows_a_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "_PATIENCE", 0.0)
    terminal = io.StringIO()
    with Bar("2 s", Console(file=terminal, force_terminal=True, width=80)) as bar:
        bar(0.5)
    assert "simulating" in terminal.getvalue()
    assert "25 %" in terminal.getvalue()


def test_a_notebook_shows_a_bar_in_one_place(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    cell = SimpleNamespace(update=told.append)
    notebook = SimpleNamespace(HTML=str, display=lambda text, display_id: told.append(text) or cell)
    monkeypatch.setitem(sys.modules, "IPython.display", notebook)
    monkeypatch.setattr(progress, "_PATIENCE", 0.0)
    monkeypatch.setattr(progress, "_INTERVAL", 0.0)
    file = io.StringIO()
    with Bar("2 s", Console(file=file, force_jupyter=True)) as bar:
        bar(0.5)
        bar(1.0)
    assert told == [
        'simulating <progress value="0.5" max="2.0"></progress> 25%',
        'simulating <progress value="1.0" max="2.0"></progress> 50%',
        "",
    ]
    assert file.getvalue() == ""


def test_a_file_gets_no_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "_PATIENCE", 0.0)
    file = io.StringIO()
    with Bar("2 s", Console(file=file)) as bar:
        bar(0.5)
    assert file.getvalue() == ""


def test_an_end_that_cannot_be_read_is_left_to_the_simulation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "_PATIENCE", 0.0)
    file = io.StringIO()
    for end in ("2 m", None):
        with Bar(end, Console(file=file, force_terminal=True)) as bar:
            bar(0.5)
    assert file.getvalue() == ""
