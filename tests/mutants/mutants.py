"""Small wrong changes of the product, one after the other: does a narrow test fail?

`python tests/mutants/mutants.py --sample 300 --seed 1` tries a random sample, `--in structure/alias.py` all changes of
files whose path has this in it, `--list` only tells them. A change is killed if a test fails, or needs a minute; what
survives is told with its place. `equivalents.toml` lists changes that change nothing, with the reason.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import re
import shutil
import signal
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from changes import Change, changes

ROOT = Path(__file__).parents[2]
FOLDERS = ("components", *(f"modelica_like/{name}" for name in (
    "structure", "initialize", "solve", "flatten", "compile",
)))  # fmt: skip
PICTURES = ("plot.py", "sankey.py", "style.py")
"""They draw; what they draw is looked at."""
NARROW = {
    "components/sizing": ["sizing"],
    "components": ["library/test_audit.py", "library/test_component_examples.py", "library/test_energy.py"],
    "modelica_like/structure": ["structure", "library/test_one_instant.py", "solve/test_initialize.py"],
    "modelica_like/initialize": [
        "solve/test_initialize.py", "solve/test_rest.py", "solve/test_initial_modes.py", "library/test_one_instant.py",
        "exact/test_small_drives.py", "analyse/test_steady.py",
    ],
    "modelica_like/solve": [
        "solve/test_looks.py", "solve/test_guards.py", "solve/test_time_events.py", "solve/test_events.py",
        "solve/test_reading.py", "solve/test_solution.py", "solve/test_energy_balance.py", "solve/test_accuracy.py",
        "library/test_one_instant.py",
    ],
    "modelica_like/flatten": [
        "flatten", "solve/test_guards.py", "language/test_equations.py", "language/test_modes.py", "structure",
        "solve/test_events.py",
    ],
    "modelica_like/compile": [
        "solve/test_initialize.py", "structure/test_build.py", "language/test_modes.py", "solve/test_events.py",
        "library/test_one_instant.py",
    ],
}  # fmt: skip
"""Tests by the longest beginning of a path that fits; tests that name the module or its classes come before."""
_BROKEN = 99
_SLOW = ("test_rounding.py", "test_robustness.py", "test_endless_events.py", "test_number_kinds.py")
PAGES = ("tests/report/test_component_pages.py::test_the_pages_are_current",)
"""They tell defaults and limits."""
SECONDS = 60
LONGEST = 240
"""Time of the processor for one test, and for one change."""


def sources() -> list[str]:
    """Files that are changed."""
    found = (path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py")))
    return [str(one.relative_to(ROOT)) for one in found if one.name not in PICTURES]


def wanted(change: Change) -> bool:
    """Leave out constants of the whole module, which are tolerances."""
    return change.place != "module"


@cache
def equivalents() -> list[dict[str, str]]:
    """Changes that change nothing, with their reasons."""
    return tomllib.loads((Path(__file__).parent / "equivalents.toml").read_text(encoding="utf-8"))["equivalent"]


def known(change: Change) -> bool:
    """Is it listed as equivalent?"""
    about = str(change)
    return any(
        re.sub(r":\d+ ", " ", about, count=1) == f"{one['file']} {one['place']}: {one['change']}"
        for one in equivalents()
    )


@cache
def narrow_tests(file: str) -> tuple[str, ...]:
    """Tests that should notice changes in the functions of a file, the closest ones first."""
    text = (ROOT / file).read_text(encoding="utf-8")
    module = file.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    names = [module] if not file.startswith("components") else re.findall(r"^(?:class|def) ([A-Za-z]\w+)", text, re.M)
    mention = re.compile(rf"\b(?:{'|'.join(map(re.escape, names or [module]))})\b")
    folders = ("sizing",) if "sizing" in file else ("library", "solve", "structure", "flatten", "language")
    near = [
        path
        for folder in folders
        for path in sorted((ROOT / "tests" / folder).glob("test_*.py"))
        if path.name not in _SLOW and mention.search(path.read_text())
    ]
    near.sort(key=lambda path: -len(mention.findall(path.read_text())))
    general = next(tests for start, tests in NARROW.items() if file.startswith(start))
    return tuple(
        dict.fromkeys([*(str(one.relative_to(ROOT)) for one in near[:4]), *(f"tests/{one}" for one in general)])
    )


@contextlib.contextmanager
def copied() -> Iterator[Path]:
    """A copy of the repository in which changes are made."""
    with tempfile.TemporaryDirectory(prefix="mutants_", ignore_cleanup_errors=True) as work:
        place = Path(work) / "tree"
        hidden = shutil.ignore_patterns(".git", ".venv", "build", "__pycache__", ".hypothesis", "node_modules")
        shutil.copytree(ROOT, place, ignore=hidden)
        yield place


class _Limit:
    """Plugin: a test that needs too much time of the processor fails."""

    def pytest_runtest_setup(self) -> None:
        signal.signal(signal.SIGPROF, self._stop)
        signal.setitimer(signal.ITIMER_PROF, SECONDS)

    def pytest_runtest_teardown(self) -> None:
        signal.setitimer(signal.ITIMER_PROF, 0)

    def _stop(self, *_: object) -> None:
        raise TimeoutError


def survives(place: Path, change: Change) -> str:
    """Run the tests of a change in a process of its own; an empty text if one fails, else what was run."""
    declared = change.file.startswith("components/") and "." not in change.place and "sizing" not in change.file
    tests = [*narrow_tests(change.file), *(PAGES if declared else ())]
    original = (place / change.file).read_text(encoding="utf-8")
    (place / change.file).write_text(change.applied(original), encoding="utf-8")
    try:
        child = os.fork()
        if child == 0:
            try:
                os._exit(_tested(place, tests))
            finally:  # whatever happens, this process never comes back
                os._exit(_BROKEN)
        _, status = os.waitpid(child, 0)
    finally:
        (place / change.file).write_text(original, encoding="utf-8")
    code = os.WEXITSTATUS(status) if os.WIFEXITED(status) else 1
    if code not in (0, 1, 2):  # 2: a file of tests cannot be imported any more
        raise SystemExit(f"The tests of {change.file} could not be run: {code}.")
    return ", ".join(tests) if code == 0 else ""


def _tested(place: Path, tests: list[str]) -> int:
    import resource  # not on Windows

    resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST))
    os.chdir(place)
    os.environ["PYTHONPATH"] = str(place)
    sys.path.insert(0, str(place))
    sys.dont_write_bytecode = True
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    import pytest

    options = [
        "-x",
        "-q",
        "-n",
        "0",
        "-p",
        "no:cacheprovider",
        "--hypothesis-seed=0",
        "-m",
        "not slow",
        "--assert=plain",
    ]
    return int(pytest.main([*options, "-m", "not slow", *tests], plugins=[_Limit()]))


def main() -> None:
    """Try the changes that are asked for."""
    read = argparse.ArgumentParser(description=__doc__)
    read.add_argument("--sample", type=int, default=0)
    read.add_argument("--seed", type=int, default=1)
    read.add_argument("--in", dest="inside", default="")
    read.add_argument("--at", type=int, default=0, help="line")
    read.add_argument("--list", action="store_true")
    asked = read.parse_args()
    found = [one for file in sources() if asked.inside in file for one in changes(ROOT, file) if wanted(one)]
    found = [one for one in found if not asked.at or one.line == asked.at]
    if asked.sample:
        found = random.Random(asked.seed).sample(found, min(asked.sample, len(found)))
    if asked.list:
        sys.stdout.writelines(f"{one}\n" for one in found)
        return
    _preload()
    lost, same, begin = 0, 0, time.monotonic()
    with copied() as place:
        for number, change in enumerate(found, 1):
            source = (place / change.file).read_text(encoding="utf-8")
            alike = known(change) or change.applied(source) == source
            same += alike
            left = not alike and survives(place, change)
            lost += bool(left)
            verdict = "equivalent" if alike else "survived" if left else "killed"
            sys.stdout.write(f"{verdict:10} {change}\n")
            sys.stdout.flush()
            if number == len(found) or number % 25 == 0:
                killed = number - lost - same
                share = 100 * killed / max(number - same, 1)
                seconds = time.monotonic() - begin
                sys.stdout.write(f"{number} changes: {killed} killed ({share:.1f} %), {lost} survived, "
                                 f"{same} equivalent, {seconds:.0f} s\n")  # fmt: skip


def _preload() -> None:
    """Load what every run of the tests needs, but nothing of the product."""
    import casadi  # noqa: F401
    import fmpy  # noqa: F401
    import lxml.etree  # noqa: F401
    import numpy  # noqa: F401
    import scipy.integrate  # noqa: F401
    import tomlkit  # noqa: F401


if __name__ == "__main__":
    main()
