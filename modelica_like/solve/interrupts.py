"""Ctrl-C while compiled code runs."""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any


class Interrupts:
    """Keeps what a handler of SIGINT raised; a context around everything that may be interrupted.

    CasADi looks for signals while it evaluates equations, but an integrator takes the exception for a failure of the
    equations. In other threads than the main one there are no signals.
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

    def _note(self, number: int, frame: FrameType | None) -> None:
        try:
            self._previous(number, frame)
        except BaseException as error:
            self._raised = error
            raise

    def check(self) -> None:
        """Raise what the handler raised, after something else came of it.

        Raises:
            KeyboardInterrupt: or what else the program's own handler raises.
        """
        if self._raised is not None:
            raise self._raised from None
