"""Small wrong changes of the product, one after the other: does a test that runs them fail?

    python tests/mutants/mutants.py --record             which test runs which line; once, and after greater changes
    python tests/mutants/mutants.py --record tests/…     the same for files of tests that are new or changed
    python tests/mutants/mutants.py --sample 300         a random sample; `--seed 2` another one
    python tests/mutants/mutants.py --in solve/panels.py [--at 63]    all changes of a file, or of a line
    python tests/mutants/mutants.py --list …             only tells them

The tests that run a changed line go one after the other, fastest first, for four minutes of the processor. A change is
killed if one fails, crashes, or needs far more time than usual; a test that fails without the change, too, does not
count. What survives is told with its place and the number of tests. `equivalents.toml` lists changes that change
nothing, with the reason.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import pickle
import re
import subprocess
import sys
import time
import tomllib
from collections import Counter
from dataclasses import dataclass
from functools import cache, partial
from multiprocessing import get_context
from multiprocessing.util import Finalize
from pathlib import Path

import pytest
from changes import Change, changes
from judge import LONGEST, PASSED, Judge, Order, Verdict, at_import
from lines import CACHE, FILES, ROOT, Lines

FOLDERS = ("components", *(f"modelica_like/{name}" for name in (
    "structure", "solve", "runs", "flatten", "compile",
)))  # fmt: skip
PICTURES = ("icons.py",)
"""They draw; what they draw is looked at."""
DECLARED = dict.fromkeys((f"tests/library/test_{name}" for name in (
    "declarations.py::test_declarations_are_what_netlists_rely_on",
    "declarations.py::test_what_netlists_cannot_name_is_only_a_base",
    "defaults.py::test_defaults_are_what_users_rely_on",
)), 1.0)  # fmt: skip
"""They tell defaults and limits, and which classes are bases, and import all they tell about."""
_RECORD = "lines.pickle"
_ANY_LINE = re.compile(r":\d+ ")


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
    about = _ANY_LINE.sub(" ", str(change), count=1)
    return any(about == f"{one['file']} {one['place']}: {one['change']}" for one in equivalents())


def sample(found: list[Change], size: int, seed: int) -> list[Change]:
    """Choose by hashes of what changes and where, so that another line in another file chooses no other sample."""
    alike, order = Counter[str](), list[tuple[bytes, Change]]()
    for one in found:
        about = _ANY_LINE.sub(" ", str(one), count=1)
        alike[about] += 1
        order.append((hashlib.sha256(f"{seed} {about} {alike[about]}".encode()).digest(), one))
    return [one for _, one in sorted(order, key=lambda entry: entry[0])[:size]]


def record(tests: list[str], jobs: int) -> None:
    """Run all tests, or some files of them once more, and keep which line each of them runs."""
    CACHE.mkdir(parents=True, exist_ok=True)
    for old in CACHE.glob("*.part"):
        old.unlink()
    paths = os.pathsep.join((str(ROOT), str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")))
    told = {**os.environ, "PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1", FILES: os.pathsep.join(sources())}
    options = ["-q", "-n", str(jobs), "-m", "not slow", "-p", "lines", "--ignore", "tests/mutants"]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *options, *(tests or ["tests"])], cwd=ROOT, env=told, check=False
    )
    if done.returncode not in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED):
        raise SystemExit(done.returncode)
    found = Lines.merged(sorted(CACHE.glob("*.part")), sources())
    if tests:
        newer, found = found, recorded()
        found.update(newer)
    (CACHE / _RECORD).write_bytes(pickle.dumps(found))


@cache
def recorded() -> Lines:
    """What `--record` found."""
    file = CACHE / _RECORD
    if not file.exists():
        raise SystemExit("Which test runs which line is not known yet: call this with --record.")
    return pickle.loads(file.read_bytes())


_judge = Judge()


def _start() -> None:
    """In each process: a copy of the repository, and what every session needs, but nothing of the product."""
    import casadi  # noqa: F401
    import fmpy  # noqa: F401
    import lxml.etree  # noqa: F401
    import scipy.integrate  # noqa: F401

    _judge.__enter__()
    Finalize(None, _judge.__exit__, exitpriority=1)


@dataclass(frozen=True)
class Tried:
    """One change, what became of it, and what is told about that."""

    change: Change
    what: str
    about: str


def tried(change: Change, longest: float) -> Tried:
    """Run the tests of a change."""
    text = (ROOT / change.file).read_text(encoding="utf-8")
    if known(change) or change.applied(text) == text:
        return Tried(change, "equivalent", "")
    if at_import(change, text):
        users = recorded().users(change)
        orders = [Order({**DECLARED, **users}, change, longest, anew=True)]
    else:
        run, imported = recorded().tests(change, text)
        orders = [Order(run, change, longest), Order(imported, change, longest, anew=True)]
    begin, ran = time.monotonic(), 0
    for order in orders:
        verdict = _decided(order)
        if verdict.code != PASSED:
            return Tried(change, "killed", f"{verdict.test or 'import'}, {time.monotonic() - begin:.0f} s")
        ran += verdict.ran
    count = sum(len(order.tests) for order in orders)
    return Tried(change, "survived", f"{ran} of {count} tests, {time.monotonic() - begin:.0f} s")


def _decided(order: Order) -> Verdict:
    """Run tests, again and again without those that fail anyway."""
    while order.tests:
        verdict = _judge.run(order)
        if verdict.code == PASSED or not verdict.test or _fine(verdict.test):
            return verdict
        del order.tests[verdict.test]
    return Verdict(PASSED)


@cache
def _fine(test: str) -> bool:
    """Does a test pass without a change?"""
    return _judge.run(Order({test: recorded().seconds[test]})).code == PASSED


def main() -> None:
    """Try the changes that are asked for."""
    read = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    read.add_argument("--record", nargs="*", metavar="TESTS")
    read.add_argument("--sample", type=int, default=0)
    read.add_argument("--seed", type=int, default=1)
    read.add_argument("--in", dest="inside", default="")
    read.add_argument("--at", type=int, default=0, help="line")
    read.add_argument("--list", action="store_true")
    read.add_argument("--jobs", type=int, default=os.cpu_count())
    read.add_argument("--longest", type=float, default=LONGEST, help="time of the processor for one change, in s")
    asked = read.parse_args()
    if asked.record is not None:
        record(asked.record, asked.jobs)
        return
    found = [one for file in sources() if asked.inside in file for one in changes(ROOT, file) if wanted(one)]
    found = [one for one in found if not asked.at or one.line == asked.at]
    if asked.sample:
        found = sample(found, asked.sample, asked.seed)
    if asked.list:
        sys.stdout.writelines(f"{one}\n" for one in found)
        return
    _try(found, asked.jobs, asked.longest)


def _try(found: list[Change], jobs: int, longest: float) -> None:
    recorded()
    counts, begin = Counter[str](), time.monotonic()
    with get_context("fork").Pool(jobs, _start) as pool:
        for number, one in enumerate(pool.imap_unordered(partial(tried, longest=longest), found), 1):
            counts[one.what] += 1
            sys.stdout.write(f"{one.what:10} {one.change}   ({one.about})\n")
            if number == len(found) or number % 25 == 0:
                killed, lost, same = (counts[what] for what in ("killed", "survived", "equivalent"))
                share = 100 * killed / max(killed + lost, 1)
                sys.stdout.write(f"{number} changes: {killed} killed ({share:.1f} %), {lost} survived, "
                                 f"{same} equivalent, {time.monotonic() - begin:.0f} s\n")  # fmt: skip
            sys.stdout.flush()
        pool.close()
        pool.join()


if __name__ == "__main__":
    main()
