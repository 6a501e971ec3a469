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
        self._foreign = False
        self._raised: BaseException | None = None

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Replace the program's handler; once for many calls, because it costs as much as a short call."""
        alone = self._previous is None and threading.current_thread() is threading.main_thread()
        previous = signal.getsignal(signal.SIGINT) if alone else None
        if callable(previous):
            self._previous = previous
            signal.signal(signal.SIGINT, self._note)
        try:
            yield
        finally:
            if callable(previous):
                signal.signal(signal.SIGINT, previous)
                self._previous = None

    @contextmanager
    def swallowed(self) -> Iterator[None]:
        """Run foreign code.

        Raises:
            KeyboardInterrupt: or another exception of the program's handler.
        """
        self._foreign = True
        try:
            yield
        finally:
            self._foreign = False
            if self._raised is not None:
                raised, self._raised = self._raised, None
                raise raised from None

    def _note(self, number: int, frame: FrameType | None) -> None:
        try:
            self._previous(number, frame)
        except BaseException as error:
            if self._foreign:
                self._raised = error
            raise
