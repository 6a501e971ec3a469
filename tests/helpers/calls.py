"""Commands called in this process."""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from unittest import mock

from modelica_like.cli import run


@dataclass(frozen=True)
class Called:
    """How a command ended, with what it printed; `exception` is what `--debug` lets through."""

    exit_code: int
    stdout: str
    stderr: str
    exception: Exception | None = None


def called(words: Sequence[str]) -> Called:
    """Call `modelica-like` with words, whatever the program is that runs the tests."""
    code, exception = 0, None
    with (
        mock.patch.object(sys, "argv", ["modelica-like", *words]), contextlib.redirect_stdout(io.StringIO()) as out,
        contextlib.redirect_stderr(io.StringIO()) as told,
    ):  # fmt: skip
        try:
            run(words)
        except SystemExit as end:
            code = int(end.code or 0)
        except Exception as error:  # noqa: BLE001 - as the interpreter does
            code, exception = 1, error
    return Called(code, out.getvalue(), told.getvalue(), exception)
