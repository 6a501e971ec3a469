"""Calls in the main thread, one after another: there an interrupt stops a run wherever it is, as Ctrl-C does."""

from __future__ import annotations

import signal
import threading
from _thread import interrupt_main
from collections.abc import Callable
from concurrent.futures import Future
from queue import SimpleQueue
from typing import Generic, TypeVar

_T = TypeVar("_T")


class Call(Generic[_T]):
    """A call that waits for its turn, works, or has an answer.

    Args:
        work: returns the answer.
        stopped: returns the answer of a call that was stopped.
    """

    def __init__(self, work: Callable[[], _T], stopped: Callable[[KeyboardInterrupt], _T]) -> None:
        self.work, self.stopped, self.is_stopped = work, stopped, False
        self.answer = Future[_T]()


class Turns(Generic[_T]):
    """Calls that other threads want to be done."""

    def __init__(self) -> None:
        self._waiting, self._lock = SimpleQueue[Call[_T] | None](), threading.Lock()
        self._now: Call[_T] | None = None

    def add(self, call: Call[_T] | None) -> None:
        """Let a call wait for its turn; with None the work ends."""
        self._waiting.put(call)

    def stop(self, call: Call[_T]) -> None:
        """Stop a call that works or waits; one that has an answer keeps it."""
        with self._lock:
            # Once only: a second interrupt could meet the next call.
            if self._now is call and not call.is_stopped:
                interrupt_main()
            call.is_stopped = True

    def work(self) -> None:
        """Do the calls, in the main thread, until there is None.

        Raises:
            KeyboardInterrupt: somebody else has interrupted the process.
        """
        # A process that was started in the background of a shell ignores interrupts, also those of `stop`.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        while (call := self._waiting.get()) is not None:
            call.answer.set_result(self._answer(call))

    def _answer(self, call: Call[_T]) -> _T:
        try:
            try:
                with self._lock:
                    self._now = call
                return call.stopped(KeyboardInterrupt()) if call.is_stopped else call.work()
            finally:
                with self._lock:
                    self._now = None
                _arrive()
        except KeyboardInterrupt as interrupt:
            if not call.is_stopped:
                raise
            return call.stopped(interrupt)


def _arrive() -> None:
    """Let an interrupt that was sent before come now, and not later: Python looks for it where a function begins."""
