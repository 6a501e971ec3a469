"""Print how many examples of each package run right: `python tests/modelica_library/counts.py [PACKAGE …]`."""

from __future__ import annotations

import sys
from collections import Counter, defaultdict

from library_examples import examples, package_of, run_example


def main(wanted: list[str]) -> None:
    """Run the examples of the packages that begin with one of these words, or all."""
    counts: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for name in examples():
        if wanted and not any(name.startswith(word) for word in wanted):
            continue
        outcome = run_example(name)
        counts[package_of(name)][outcome.kind] += 1
        if outcome.kind != "right":
            print(f"{outcome.kind:8}{name}: {outcome.words}", flush=True)
    print(f"\n{'package':50}{'of':>5}{'right':>7}{'refused':>9}{'wrong':>7}")
    for package, count in counts.items():
        print(f"{package:50}{count.total():5}{count['right']:7}{count['refused']:9}{count['wrong']:7}")


if __name__ == "__main__":
    main(sys.argv[1:])
