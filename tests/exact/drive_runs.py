"""The product against the exact solver, drive by drive.

python tests/exact/drive_runs.py                 all drives, and what failed, by category
python tests/exact/drive_runs.py --range 0 150
python tests/exact/drive_runs.py --drive 137     one drive: its netlist, and what happened
python tests/exact/drive_runs.py --drive 137 --shrink   the smallest drive that still fails in this way
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import sys
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import repeat
from types import FrameType

import numpy as np
from exact_drives import Drive, Element, Run, run_exactly
from random_drives import assembly, random_drive

from modelica_like import ModelicaLikeError, Solution, simulate
from modelica_like.netlist import dumps

DRIVES = int(os.environ.get("RANDOM_DRIVES", "500"))
SPEED = 1e-8
"""Largest error of a final speed, relative to the largest speed of that inertia, and ROUNDING of all inertias."""
ROUNDING = 1e-5
"""Slips are states, i.e. differences of speeds: SPEED times this is what rounding may cost the slowest inertia."""
CLOSURE = 1e-12
"""Largest part of the throughput that the product's own balance may miss."""
LOSS = 1e-8
"""Largest error of the dissipated energy, relative to the throughput."""
NOTHING = 1e-18
"""Energy in J that is nothing but rounding."""
RTOL = 1e-9
"""Relative tolerance of the runs: tighter than what is demanded of them."""
SECONDS = 20


@dataclass(frozen=True)
class Outcome:
    """What the product made of a drive.

    Attributes:
        category: empty if it is right; else in what way it is not.
        detail: the message, or the errors.
        speed: error of the final speeds, relative to each one's largest.
        closure: of the energy balance, as the product tells it.
        loss: error of the dissipated energy over the throughput.
        events: of the product's run.
        seconds: of the product, CPU time.
    """

    number: int
    category: str = ""
    detail: str = ""
    speed: float = 0.0
    closure: float = 0.0
    loss: float = 0.0
    events: int = 0
    seconds: float = 0.0

    def __str__(self) -> str:
        told = f"drive {self.number}: {self.category or 'right'}"
        figures = f"speed {self.speed:.1e}, closure {self.closure:.1e}, loss {self.loss:.1e}, {self.events} events"
        return f"{told}\n{figures}, {self.seconds:.2f} s" + (f"\n{self.detail}" if self.detail else "")


class _TooLongError(Exception):
    """A drive took more than its time."""


@contextmanager
def _limited(seconds: int) -> Iterator[None]:
    def ring(number: int, frame: FrameType | None) -> None:
        raise _TooLongError

    # Of CPU time: what else the machine does must not count.
    before = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def judge(drive: Drive, number: int = -1, given: bool = False) -> Outcome:
    """Run a drive in both, and compare."""
    exact = run_exactly(drive)
    begin = time.process_time()
    try:
        with _limited(SECONDS):
            run = simulate(assembly(drive, given), drive.until, start="rest", points=4, rtol=RTOL)
            outcome = compared(drive, number, run, exact)
    except _TooLongError:
        outcome = Outcome(number, "takes too long")
    except ModelicaLikeError as error:
        outcome = Outcome(number, f"refused: {type(error).__name__}: {_pattern(error.what)}", str(error))
    except (ArithmeticError, np.linalg.LinAlgError, RuntimeError, ValueError, AssertionError, LookupError) as error:
        outcome = Outcome(number, f"crash: {type(error).__name__}: {_pattern(str(error))}", str(error))
    return replace(outcome, seconds=time.process_time() - begin)


def compared(drive: Drive, number: int, run: Solution, exact: Run) -> Outcome:
    """Compare a run with the exact one: final speeds, balance and losses."""
    # Impacts are rounded by the speeds before them.
    every = max(*exact.largest, *(abs(float(w)) for w in drive.w)) or 1.0
    speed = max(
        abs(run.final[f"J{k}.w"] - w) / (largest + ROUNDING * every)
        for k, (w, largest) in enumerate(zip(exact.final, exact.largest, strict=True))
    )
    balance = run.energy()
    lost = float(exact.friction + exact.impact)
    # A drive that stands still has no throughput; what rounding leaves is compared with next to nothing.
    throughput = max(balance.throughput, float(max(exact.stored)), abs(float(exact.work)), lost, NOTHING)
    loss = abs(balance.lost - lost) / throughput
    closure = balance.power_closure * balance.throughput / throughput
    wrong = [
        f"wrong {name}"
        for name, error, most in (("speed", speed, SPEED), ("closure", closure, CLOSURE), ("loss", loss, LOSS))
        if not error <= most
    ]
    told = [f"exact {exact.final}", f"found {[run.final[f'J{k}.w'] for k in range(len(exact.final))]}",
            f"exact events {[(float(t), name, what) for t, name, what in exact.events]}",
            f"found events {[(e.time, e.mode, e.after) for e in run.events]}",
            f"lost {lost} exactly, found {balance.lost}"]  # fmt: skip
    detail = "\n".join(told) if wrong else ""
    category = ", ".join(wrong) + (" with an impact" if wrong and exact.impact else "")
    return Outcome(number, category, detail, speed, closure, loss, len(run.events))


def _pattern(message: str) -> str:
    """Give the kind of a message: without names and numbers."""
    line = message.splitlines()[0] if message else ""
    line = re.sub(r"\b[A-Za-z]+\d+(_\w+)?(\.\w+)*", "…", line)
    return re.sub(r"…(, …)+( and …)?", "…", re.sub(r"-?\d+(\.\d+)?(e[-+]?\d+)?", "#", line))[:90]


# -- the smallest drive that fails in the same way ---------------------------------------------------------------------


def shrunk(drive: Drive, category: str, given: bool = False) -> Drive:
    """Give a smaller drive whose outcome has the same category: nothing can be left out or made simpler."""
    going = True
    while going:
        going = False
        for smaller in _smaller(drive):
            if judge(smaller, given=given).category == category:
                drive, going = smaller, True
                break
    return drive


def _smaller(drive: Drive) -> Iterator[Drive]:
    size = len(drive.J)
    for k in range(size if size > 1 else 0):
        yield _without(drive, k)
    for n in range(len(drive.elements)):
        yield replace(drive, elements=drive.elements[:n] + drive.elements[n + 1 :])
    for n in range(len(drive.torques)):
        yield replace(drive, torques=drive.torques[:n] + drive.torques[n + 1 :])
    for n, (inertia, steps) in enumerate(drive.torques):
        for fewer in [steps[:1], steps[:-1], ((0.0, 1.0),)]:
            if fewer and fewer != steps:
                yield replace(drive, torques=(*drive.torques[:n], (inertia, fewer), *drive.torques[n + 1 :]))
    for n, e in enumerate(drive.elements):
        for simpler in _simpler(e):
            yield replace(drive, elements=(*drive.elements[:n], simpler, *drive.elements[n + 1 :]))
    for k in range(size):
        if drive.J[k] != 1.0:
            yield replace(drive, J=(*drive.J[:k], 1.0, *drive.J[k + 1 :]))
        for w in (0.0, 1.0):
            if drive.w[k] not in (0.0, w):
                yield replace(drive, w=(*drive.w[:k], w, *drive.w[k + 1 :]))
    if drive.until != 1.0 and not _jumps(drive):
        yield replace(drive, until=1.0)


def _jumps(drive: Drive) -> bool:
    return any(len(steps) > 1 for steps in [*(s for _, s in drive.torques), *(e.capacity for e in drive.elements)])


def _simpler(e: Element) -> Iterator[Element]:
    if e.ratio != 1.0:
        yield replace(e, ratio=1.0)
    if len(e.capacity) > 1:
        yield replace(e, capacity=e.capacity[:1])
    if e.capacity and e.capacity != ((0.0, 1.0),):
        yield replace(e, capacity=((0.0, 1.0),))


def _without(drive: Drive, gone: int) -> Drive:
    """Leave out an inertia, with its elements and torques."""

    def moved(k: int) -> int:
        return k - (k > gone)

    return replace(
        drive,
        J=drive.J[:gone] + drive.J[gone + 1 :],
        w=drive.w[:gone] + drive.w[gone + 1 :],
        elements=tuple(
            replace(e, a=None if e.a is None else moved(e.a), b=moved(e.b))
            for e in drive.elements
            if gone not in (e.a, e.b)
        ),
        torques=tuple((moved(k), steps) for k, steps in drive.torques if k != gone),
    )


# -- command line ------------------------------------------------------------------------------------------------------


def _judged(number: int, given: bool) -> Outcome:
    return judge(random_drive(number), number, given)


def judged(numbers: Iterable[int], jobs: int = 1, given: bool = False) -> Iterator[Outcome]:
    """Judge the drives of some numbers, in so many processes."""
    if jobs == 1:
        yield from map(_judged, numbers, repeat(given))
        return
    with ProcessPoolExecutor(jobs) as pool:
        yield from pool.map(_judged, numbers, repeat(given), chunksize=4)


def summary(outcomes: list[Outcome]) -> str:
    """Tell how many are right, the largest errors of those, and the others by category with their numbers."""
    right = [o for o in outcomes if not o.category]
    lines = [f"{len(right)} of {len(outcomes)} right in {sum(o.seconds for o in outcomes):.0f} s CPU"]
    if right:
        lines += [
            f"  largest {name} {max(getattr(o, name) for o in right):.1e}" for name in ("speed", "closure", "loss")
        ]
    categories: dict[str, list[int]] = {}
    for o in outcomes:
        if o.category:
            categories.setdefault(o.category, []).append(o.number)
    for category, numbers in sorted(categories.items(), key=lambda item: -len(item[1])):
        lines.append(f"{len(numbers):5d}  {category}: {', '.join(map(str, numbers[:12]))}")
    return "\n".join(lines)


def netlist(drive: Drive, given: bool = False) -> str:
    """Give a drive as a netlist that the command line runs."""
    text = dumps(assembly(drive, given))
    return f'{text}\n[simulate]\nuntil = {drive.until!r}\nstart = "rest"\n'


def main() -> None:
    """Read the command line and run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drive", type=int)
    parser.add_argument("--shrink", action="store_true")
    parser.add_argument("--range", type=int, nargs=2, default=(0, DRIVES))
    parser.add_argument("--given", action="store_true", help="give speeds of zero, too")
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args()
    if asked.drive is None:
        sys.stdout.write(summary(list(judged(range(*asked.range), asked.jobs, asked.given))) + "\n")
        return
    drive = random_drive(asked.drive)
    outcome = judge(drive, asked.drive, asked.given)
    if asked.shrink and outcome.category:
        drive = shrunk(drive, outcome.category, asked.given)
        outcome = judge(drive, asked.drive, asked.given)
    sys.stdout.write(f"{netlist(drive, asked.given)}\n{drive}\n{outcome}\n")


if __name__ == "__main__":
    main()
