"""Which test runs which line of the product, and how long it takes.

`mutants.py --record` runs all tests that are not slow with this plugin of pytest. The caches of the product are emptied
before each test, so that a line counts for every test that would need it alone. What is found lies in `build/mutants`,
with the texts that ran: lines that have moved since are found again.
"""

from __future__ import annotations

import ast
import difflib
import gc
import os
import pickle
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator
from functools import _lru_cache_wrapper, cache
from pathlib import Path
from typing import Any

import pytest
from changes import Change

ROOT = Path(__file__).parents[2]
CACHE = ROOT / "build" / "mutants"
FILES = "MUTANTS_FILES"
"""Environment variable of a recording run: what is looked at."""
_IMPORT = "+"
"""Begins the context of what the import of a file of tests runs; that of a fixture begins with @."""


def cpu() -> float:
    """Time of the processor that this process and its children took, in s."""
    return sum(os.times()[:4])


def pytest_configure(config: pytest.Config) -> None:
    if FILES in os.environ and "PYTEST_XDIST_WORKER" in os.environ:
        config.pluginmanager.register(Recorder(os.environ[FILES].split(os.pathsep)))


class Recorder:
    """Plugin: notes lines, times, shared fixtures and component classes of each test."""

    def __init__(self, files: Iterable[str]) -> None:
        from coverage import Coverage

        self.seconds: dict[str, float] = {}
        self.fixtures: dict[str, tuple[str, ...]] = {}
        self.shared: dict[str, float] = defaultdict(float)
        self.classes: dict[str, set[str]] = {}
        self.measured = Coverage(data_file=None, include=[str(ROOT / file) for file in files], config_file=False)
        self.measured.start()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[Any]:
        _forget()
        self.fixtures[item.nodeid] = tuple(getattr(item, "fixturenames", ()))
        self.measured.switch_context(item.nodeid)
        begin = cpu()
        result = yield
        self.seconds[item.nodeid] = cpu() - begin
        self.measured.switch_context("")
        self.classes[item.nodeid] = {
            f"{base.__module__}.{base.__qualname__}" for kind in _used() for base in kind.__mro__
        }
        return result

    @pytest.hookimpl(wrapper=True)
    def pytest_make_collect_report(self, collector: pytest.Collector) -> Iterator[Any]:
        if not isinstance(collector, pytest.Module):
            return (yield)
        self.measured.switch_context(_IMPORT + collector.nodeid)
        result = yield
        self.measured.switch_context("")
        return result

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any, request: Any) -> Iterator[Any]:
        if fixturedef.scope == "function":
            return (yield)
        name, begin = f"@{fixturedef.baseid}@{fixturedef.argname}", cpu()
        self.measured.switch_context(name)
        result = yield
        self.shared[name] = max(self.shared[name], cpu() - begin)
        self.measured.switch_context(request._pyfuncitem.nodeid)
        return result

    def pytest_sessionfinish(self) -> None:
        self.measured.stop()
        data = self.measured.get_data()
        lines = {str(Path(file).relative_to(ROOT)): data.contexts_by_lineno(file) for file in data.measured_files()}
        part = (self.seconds, self.fixtures, dict(self.shared), self.classes, lines)
        (CACHE / f"{os.getpid()}.part").write_bytes(pickle.dumps(part))


def _used() -> Iterator[Any]:
    """Component classes of which the product keeps something."""
    language = sys.modules.get("modelica_like.language")
    kinds = [language.Component] if language else []
    while kinds:
        kind = kinds.pop()
        kinds += kind.__subclasses__()
        if kind._declared.templates:
            yield kind


def _forget() -> None:
    for kind in _used():
        kind._declared.templates.clear()
    for one in gc.get_objects():
        if isinstance(one, _lru_cache_wrapper) and str(one.__module__).startswith(("modelica_like", "components")):
            one.cache_clear()


class Lines:
    """What was recorded.

    Attributes:
        seconds: time of the processor by test, with the fixtures it shares with others.
        runs: tests by file and line; with a + before it, a file of tests whose import runs the line.
        classes: tests by component class, derived ones included.
        texts: the files as they were.
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.runs: dict[str, dict[int, set[str]]] = {}
        self.classes: dict[str, set[str]] = defaultdict(set)
        self.texts: dict[str, str] = {}

    @staticmethod
    def merged(parts: Iterable[Path], files: Iterable[str]) -> Lines:
        """Read the parts that the processes of a recording run wrote."""
        found, told = Lines(), [pickle.loads(part.read_bytes()) for part in parts]
        shared: dict[str, float] = {}
        members: dict[str, set[str]] = defaultdict(set)
        for *_, fixtures_shared, _, _ in told:
            shared |= fixtures_shared
        for seconds, fixtures, *_ in told:
            for test, own in seconds.items():
                mine = [f"@{base}@{one}" for one in fixtures[test] for base in _places(test)]
                found.seconds[test] = own + sum(shared.get(one, 0.0) for one in mine)
                for one in mine:
                    members[one].add(test)
        for *_, classes, lines in told:
            for test, names in classes.items():
                for name in names:
                    found.classes[name].add(test)
            for file, numbers in lines.items():
                runs = found.runs.setdefault(file, {})
                for number, contexts in numbers.items():
                    runs.setdefault(number, set()).update(
                        *(members[one] if one[:1] == "@" else {one} for one in contexts)
                    )
        found.texts = {file: (ROOT / file).read_text(encoding="utf-8") for file in files}
        return found

    def update(self, newer: Lines) -> None:
        """Take over what some files of tests run now, on the present texts."""
        files = {test.partition("::")[0] for test in newer.seconds}
        left = {test: time for test, time in self.seconds.items() if test.partition("::")[0] not in files}
        self.seconds = left | newer.seconds
        for file, text in newer.texts.items():
            old, new = self.runs.get(file, {}), newer.runs.get(file, {})
            before = _same_lines(self.texts.get(file, ""), text)
            self.runs[file] = {
                line: {
                    one
                    for one in old.get(before.get(line, 0), ())
                    if one in left or (one[:1] == _IMPORT and one[1:] not in files)
                }
                | new.get(line, set())
                for line in before.keys() | new.keys()
            }
        for name in self.classes.keys() | newer.classes.keys():
            self.classes[name] = self.classes[name] & left.keys() | newer.classes[name]
        self.texts = newer.texts

    def tests(self, change: Change, text: str) -> tuple[dict[str, float], dict[str, float]]:
        """Tests that run a change, and tests whose file runs it when it is imported; fastest first, with their times.

        Args:
            change: what is changed, in a function.
            text: the file without the change.
        """
        found = self._of_statement(change, text)
        # What a test runs in another process is not recorded; a file of tests that is called after the module may.
        name = f"/test_{Path(change.file).name}"
        called = {test for test in self.seconds if test.partition("::")[0].endswith(name)}
        found = found | called
        files = {one.removeprefix(_IMPORT) for one in found if one.startswith(_IMPORT)}
        if files:  # recorded are those that were the first to import it; others see its constants, too
            files.update(test.partition("::")[0] for test in called)
        return self._sorted(found), self._sorted(test for test in self.seconds if test.partition("::")[0] in files)

    def users(self, change: Change) -> dict[str, float]:
        """Tests that use the component class that a change is in, or else anything of its file."""
        module = change.file.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        kind = self.classes.get(f"{module}.{change.place.split('.')[0]}")
        return self._sorted(kind or set[str]().union(*self.runs.get(change.file, {}).values()))

    def _sorted(self, tests: Iterable[str]) -> dict[str, float]:
        known = [test for test in tests if test in self.seconds]
        return {test: self.seconds[test] for test in sorted(known, key=lambda one: (self.seconds[one], one))}

    def _of_statement(self, change: Change, text: str) -> set[str]:
        """Tests that run the line, or else the statement that it is in (a compound one ends before its body), or else,
        where that is newer than the record, the file."""
        first, last = _statement(text, change.line)
        runs, before = self.runs.get(change.file, {}), _same_lines(self.texts.get(change.file, ""), text)
        at = [runs.get(before[one], set()) for one in (change.line, *range(first, last + 1)) if one in before]
        return (at[0] or set[str]().union(*at)) if at else set(self.users(change))


@cache
def _same_lines(old: str, new: str) -> dict[int, int]:
    """Number of a line in the old text by its number in the new one."""
    blocks = difflib.SequenceMatcher(None, old.splitlines(), new.splitlines(), autojunk=False).get_matching_blocks()
    return {block.b + i + 1: block.a + i + 1 for block in blocks for i in range(block.size)}


def _places(test: str) -> Iterator[str]:
    """Where fixtures of a test may stand: its file, and the folders above."""
    file = test.partition("::")[0]
    yield file
    while "/" in file:
        file = file.rpartition("/")[0]
        yield file
    yield ""


def _statement(text: str, line: int) -> tuple[int, int]:
    found = (1, 1)
    for node in ast.walk(_parsed(text)):
        if isinstance(node, ast.stmt | ast.ExceptHandler):
            body = getattr(node, "body", None)
            last = body[0].lineno - 1 if body and body[0].lineno > node.lineno else node.end_lineno or node.lineno
            if found[0] <= node.lineno <= line <= last:
                found = (node.lineno, last)
    return found


@cache
def _parsed(text: str) -> ast.Module:
    return ast.parse(text)
