"""Ctrl-C while compiled code runs."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any


class Interrupts:
    """Raises exceptions of a SIGINT handler after foreign code instead of inside it.

    CasADi checks signals while it integrates, but treats the exception as a failure of the equations. There are
    signals only in the main thread.
    """

    def __init__(self) -> None:
        self._previous: Any = None
        self._foreign = self._alone = False
        self._raised: BaseException | None = None

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Replace the program's handler; once for many calls, because it costs as much as a short call."""
        alone = self._replace()
        try:
            yield
        finally:
            self._give_back(alone)

    def __enter__(self) -> None:
        """Run foreign code: an interrupt (or another exception of the program's handler) is raised at its end."""
        self._alone, self._foreign = self._replace(), True

    def __exit__(self, *_: object) -> None:
        self._foreign = False
        self._give_back(self._alone)
        if self._raised is not None:
            raised, self._raised = self._raised, None
            raise raised from None

    def _replace(self) -> bool:
        if self._previous is not None or threading.current_thread() is not threading.main_thread():
            return False
        previous = signal.getsignal(signal.SIGINT)
        if callable(previous):
            self._previous = previous
            signal.signal(signal.SIGINT, self._note)
        return callable(previous)

    def _give_back(self, alone: bool) -> None:
        if alone:
            signal.signal(signal.SIGINT, self._previous)
            self._previous = None

    def _note(self, number: int, frame: FrameType | None) -> None:
        try:
            self._previous(number, frame)
        except BaseException as error:
            if self._foreign:
                self._raised = error
            raise
