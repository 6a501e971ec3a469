"""Ctrl-C while foreign code runs, which would take the exception for its own."""

import contextlib
import signal
import threading

import pytest

from modelica_like.solve.interrupts import Interrupts


def ctrl_c() -> None:
    signal.raise_signal(signal.SIGINT)
    for _ in range(100):  # handlers run at a jump at the latest
        pass


def foreign(interrupts: Interrupts, told: list[str]) -> None:
    with interrupts:
        with contextlib.suppress(KeyboardInterrupt):
            ctrl_c()
        told.append("it goes on")


def own(interrupts: Interrupts) -> None:
    with interrupts.watched():  # within another one
        ctrl_c()


def test_an_interrupt_of_foreign_code_is_raised_behind_it() -> None:
    interrupts, before, told = Interrupts(), signal.getsignal(signal.SIGINT), list[str]()
    with interrupts.watched():
        with pytest.raises(KeyboardInterrupt):
            foreign(interrupts, told)
        with pytest.raises(KeyboardInterrupt):
            own(interrupts)
        assert signal.getsignal(signal.SIGINT) is not before
        with interrupts:
            told.append("once only")
    assert told == ["it goes on", "once only"]
    assert signal.getsignal(signal.SIGINT) is before


def test_an_interrupt_before_foreign_code_is_raised_once() -> None:
    interrupts = Interrupts()
    with pytest.raises(KeyboardInterrupt):
        own(interrupts)
    with interrupts:
        pass


def test_an_interrupt_between_foreign_calls_waits_for_where_it_is_not_lost() -> None:
    """Raised at any line it may be in a callback's first one, which loses it: a tenth of interrupted runs went on."""
    interrupts, told = Interrupts(), list[str]()
    with interrupts.watched():
        ctrl_c()
        told.append("it goes on")
        with pytest.raises(KeyboardInterrupt), interrupts:
            told.append("never")
        ctrl_c()
        with pytest.raises(KeyboardInterrupt):
            interrupts.check()
    assert told == ["it goes on"]


def test_an_interrupt_counts_more_than_a_run_that_fails() -> None:
    interrupts, before = Interrupts(), signal.getsignal(signal.SIGINT)

    def fail() -> None:
        with interrupts.watched():
            ctrl_c()
            raise ValueError

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert signal.getsignal(signal.SIGINT) is before
    interrupts.check()


def test_the_handler_returns_after_each_call_alone() -> None:
    interrupts, before = Interrupts(), signal.getsignal(signal.SIGINT)
    for _ in range(2):
        with interrupts:
            assert signal.getsignal(signal.SIGINT) is not before
        assert signal.getsignal(signal.SIGINT) is before


def test_there_are_no_signals_in_other_threads() -> None:
    found = []

    def run() -> None:
        with Interrupts().watched():
            found.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert found == [signal.getsignal(signal.SIGINT)]
