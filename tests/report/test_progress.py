"""The progress bar appears late, and only where the end is known."""

import io

import pytest
from rich.console import Console

from modelica_like.report import progress
from modelica_like.report.progress import Bar


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
