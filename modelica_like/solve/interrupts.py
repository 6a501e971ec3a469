"""Ctrl-C while compiled code runs."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def interruptible() -> Iterator[None]:
    """Let an interrupt inside leave as what it is.

    CasADi looks for signals while it evaluates equations, but an integrator takes the exception for a failure of the
    equations. What a handler of Python raised is kept here and raised again outside. In other threads than the main
    one there are no signals.

    Raises:
        KeyboardInterrupt: or what else the program's own handler raises.
    """
    previous = signal.getsignal(signal.SIGINT)
    if not callable(previous) or threading.current_thread() is not threading.main_thread():
        yield
        return
    raised: list[BaseException] = []

    def note(number: int, frame: Any) -> None:
        try:
            previous(number, frame)
        except BaseException as error:
            raised.append(error)
            raise

    signal.signal(signal.SIGINT, note)
    try:
        yield
    except BaseException:
        if not raised:
            raise
    finally:
        signal.signal(signal.SIGINT, previous)
    if raised:
        raise raised[0] from None
