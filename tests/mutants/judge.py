"""Runs tests against a change, each time in a process of its own.

A `Judge` has a copy of the repository and a session of pytest that has collected all tests. For a change of a function
the session forks, the code of the function is replaced, and its tests run, fastest first. A change of what is executed
at import takes a session that imports everything anew. Files are changed, too, for what runs in further processes.
"""

from __future__ import annotations

import contextlib
import gc
import os
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import Pipe
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

import pytest
from changes import Change
from lines import ROOT, cpu

LONGEST = 240
"""Time of the processor for the tests of one change, in s."""
SECONDS = 60
"""And for one test; a test that usually needs far less gets less. What waits without end is ended, too, but late."""
PASSED, FAILED, IMPORT_FAILED, BROKEN = 0, 1, 2, 99
_OPTIONS = [
    "-x", "-q", "-n", "0", "-p", "no:cacheprovider", "--hypothesis-seed=0", "-m", "not slow", "--assert=plain",
    "-o", "tmp_path_retention_policy=none", "--ignore=tests/mutants",
]  # fmt: skip


@dataclass(frozen=True)
class Order:
    """Tests, fastest first, with their usual times, and the change in whose presence they run, or are imported anew."""

    tests: dict[str, float]
    change: Change | None = None
    longest: float = LONGEST
    anew: bool = False


@dataclass(frozen=True)
class Verdict:
    """How tests went: exit code or minus a signal, the last test that ran, how many ran."""

    code: int
    test: str = ""
    ran: int = 0


class Judge:
    """Runs tests in a copy of the repository; to be used as a context."""

    def __enter__(self) -> Judge:
        self.work = Path(tempfile.mkdtemp(prefix="mutants_"))
        self.place = self.work / "tree"
        hidden = shutil.ignore_patterns(".git", ".venv", "build", "__pycache__", ".hypothesis", "node_modules")
        shutil.copytree(ROOT, self.place, ignore=hidden)
        self.pipe, there = Pipe()
        self.session = os.fork()
        if not self.session:
            self._pytest([], _Session(there))
        there.close()
        self.pipe.recv()  # all is imported: files may be changed now
        return self

    def __exit__(self, *_: object) -> None:
        self.pipe.send(None)
        os.waitpid(self.session, 0)
        shutil.rmtree(self.work, ignore_errors=True)

    def run(self, order: Order) -> Verdict:
        """Run tests, with the change if there is one, until one fails or the time is over."""
        change = order.change
        if change is None:
            return self._asked(order)
        file = self.place / change.file
        text = file.read_text(encoding="utf-8")
        file.write_text(change.applied(text), encoding="utf-8")
        try:
            found = Verdict(BROKEN) if order.anew else self._asked(order)
            if found.code == BROKEN:
                files = list(dict.fromkeys(test.partition("::")[0] for test in order.tests))
                found = forked(lambda told: self._pytest(files, _Once(order, told)), 10 * order.longest + 600)
        finally:
            file.write_text(text, encoding="utf-8")
        return found

    def _asked(self, order: Order) -> Verdict:
        self.pipe.send(order)
        return self.pipe.recv()

    def _pytest(self, files: list[str], plugin: object) -> int:
        """Run pytest in the copy; the process ends with it."""
        os.chdir(self.place)
        os.environ["PYTHONPATH"] = str(self.place)
        sys.path.insert(0, str(self.place))
        sys.dont_write_bytecode = True
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        os._exit(int(pytest.main([*_OPTIONS, f"--basetemp={self.work}/{os.getpid()}", *files], plugins=[plugin])))


class _Session:
    """Plugin: a session that runs whatever it is told, in children."""

    def __init__(self, pipe: Any) -> None:
        self.pipe = pipe

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        functions: dict[tuple[str, str, int], list[FunctionType]] = defaultdict(list)
        for one in gc.get_objects():
            if isinstance(one, FunctionType):
                functions[_key(one.__code__)].append(one)
        gc.freeze()
        self.pipe.send(None)
        while (order := self.pipe.recv()) is not None:

            def tried(told: int, order: Order = order) -> int:
                if order.change and not _replaced(order.change, functions):
                    return BROKEN
                return _run(session, order, told)

            self.pipe.send(forked(tried, 10 * order.longest + 600))
        return True


class _Once:
    """Plugin: a session for one order."""

    def __init__(self, order: Order, told: int) -> None:
        self.order, self.told = order, told

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        if session.testsfailed:  # files could not be imported
            os._exit(IMPORT_FAILED)
        os._exit(_run(session, self.order, self.told))


def _run(session: pytest.Session, order: Order, told: int) -> int:
    there = {item.nodeid: item for item in session.items}
    items = [there[test] for test in order.tests if test in there]
    session.config._tmp_path_factory._given_basetemp = Path.cwd().parent / str(os.getpid())  # type: ignore[attr-defined]
    session.config._tmp_path_factory._basetemp = None  # type: ignore[attr-defined]
    begin = cpu()
    for number, item in enumerate(items, 1):
        if cpu() - begin > order.longest:
            break
        os.write(told, f"{number} {item.nodeid}\n".encode())
        usual = order.tests[item.nodeid]
        _limit(max(min(SECONDS, 10 + 5 * usual), 2 * usual))
        after = items[number] if number < len(items) else None
        item.config.hook.pytest_runtest_protocol(item=item, nextitem=after)
        if session.testsfailed:
            return FAILED
    return PASSED


def _limit(seconds: float) -> None:
    """End this process when it has used as much more time of the processor; C code, too, stops at that."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (int(used.ru_utime + used.ru_stime + seconds) + 1, hard))


def forked(work: Callable[[int], int], seconds: float) -> Verdict:
    """Do some work in a child, which may write lines `number test`; its children end with it, at the latest in time."""
    with tempfile.TemporaryFile() as told:
        child = os.fork()
        if not child:
            code = BROKEN
            try:
                os.setpgid(0, 0)
                code = work(told.fileno())
            finally:  # whatever happens, this process never comes back
                os._exit(code)
        done, end = 0, time.monotonic() + seconds
        while not done:
            time.sleep(0.02)
            done, status = os.waitpid(child, os.WNOHANG)
            if not done and time.monotonic() > end:
                os.kill(child, signal.SIGKILL)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child, signal.SIGKILL)
        told.seek(0)
        number, _, test = ["", *told.read().decode().splitlines()][-1].partition(" ")
    return Verdict(os.waitstatus_to_exitcode(status), test, int(number or 0))


def at_import(change: Change, text: str) -> bool:
    """Is there a difference in what is executed at import, or in how many functions there are?"""
    olds, news = (_codes(compile(one, change.file, "exec")) for one in (text, change.applied(text)))
    if len(olds) != len(news):
        return True
    pairs = [pair for pair in zip(olds, news, strict=True) if not _is_function(pair[0])]
    return any(_outside(old) != _outside(new) for old, new in pairs)


def _replaced(change: Change, functions: dict[tuple[str, str, int], list[FunctionType]]) -> bool:
    """Give the functions of a file that is changed, but imported already, their new code."""
    path = Path.cwd() / change.file
    new = path.read_text(encoding="utf-8")
    old = new[: change.start] + change.before + new[change.start + len(change.after) :]
    codes = (_codes(compile(text, str(path), "exec")) for text in (old, new))
    done = 0
    for before, after in zip(*codes, strict=True):
        if _is_function(before) and before != after:
            for function in functions[_key(before)]:
                if before.co_freevars != after.co_freevars:
                    return False
                function.__code__ = after
                done += 1
    return done > 0 or str(path) not in {getattr(one, "__file__", None) for one in list(sys.modules.values())}


def _codes(code: CodeType) -> list[CodeType]:
    """A module, its classes and its functions, without what stands in functions."""
    inside = (one for one in code.co_consts if isinstance(one, CodeType))
    return [code, *(one for part in inside for one in ([part] if _is_function(part) else _codes(part)))]


def _is_function(code: CodeType) -> bool:
    return bool(code.co_flags & 1)  # its variables are optimised, those of a class or module are not


def _outside(code: CodeType) -> tuple[object, ...]:
    return code.co_code, code.co_names, tuple(one for one in code.co_consts if not isinstance(one, CodeType))


def _key(code: CodeType) -> tuple[str, str, int]:
    return code.co_filename, code.co_qualname, code.co_firstlineno
