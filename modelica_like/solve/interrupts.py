"""Ctrl-C while compiled code runs."""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any


class Interrupts:
    """A context around foreign code that swallows interrupts: what a handler of SIGINT raises inside is raised behind.

    CasADi looks for signals while it integrates, but takes the exception for a failure of the equations. In other
    threads than the main one there are no signals.

    Raises:
        KeyboardInterrupt: or what else the program's own handler raises.
    """

    def __init__(self) -> None:
        self._previous: Any = None
        self._raised: BaseException | None = None

    def __enter__(self) -> Interrupts:
        if threading.current_thread() is threading.main_thread():
            previous = signal.getsignal(signal.SIGINT)
            if callable(previous):
                self._previous = previous
                signal.signal(signal.SIGINT, self._note)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._previous is not None:
            signal.signal(signal.SIGINT, self._previous)
            self._previous = None
        if self._raised is not None:
            raised, self._raised = self._raised, None
            raise raised from None

    def _note(self, number: int, frame: FrameType | None) -> None:
        try:
            self._previous(number, frame)
        except BaseException as error:
            self._raised = error
            raise
