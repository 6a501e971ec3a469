"""Ctrl-C while compiled code runs."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any


class Interrupts:
    """Raises exceptions of a SIGINT handler where none is lost: not inside foreign code, nor where that calls Python.

    CasADi checks signals while it integrates, but treats the exception as a failure of the equations; ctypes drops what
    is raised just before a callback's first line. There are signals only in the main thread.
    """

    def __init__(self) -> None:
        self._previous: Any = None
        self._foreign = self._alone = False
        self._raised: BaseException | None = None

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Note interrupts, to be raised by `check`, the next foreign call, or at the end.

        Once for many calls: to replace the program's handler costs as much as a short call.
        """
        alone = self._replace()
        try:
            yield
        finally:
            self._give_back(alone)
            self.check()

    def check(self) -> None:
        """Raise what has been noted."""
        if self._raised is not None:
            raised, self._raised = self._raised, None
            raise raised from None

    def __enter__(self) -> None:
        """Run foreign code: an interrupt (or another exception of the program's handler) is raised at its end."""
        self.check()
        self._alone, self._foreign = self._replace(), True

    def __exit__(self, *_: object) -> None:
        self._foreign = False
        self._give_back(self._alone)
        self.check()

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
            self._raised = error
            if self._foreign:  # to end it
                raise
