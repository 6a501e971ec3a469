"""FMU export: time and size of CoupledClutches and of elastic chains.

Run with `python benchmarks/fmu_export.py [N …]`. The baseline of each time is the export of CoupledClutches in the same
run; how time and size grow with N is told as the exponent between neighbouring sizes (1 is linear).
"""

from __future__ import annotations

import math
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

from chain import Chain

from modelica_like import export_fmu

NETLIST = Path(__file__).parent.parent / "examples" / "msl" / "rotational" / "CoupledClutches.toml"
LARGEST_SECONDS = {"CoupledClutches": 0.15, "chain of 1000": 3.0}
LARGEST_BYTES = 330_000


def measure(drive: Any, folder: Path) -> tuple[float, int]:
    """CPU time in s and size in bytes of one export, without the run against IDAS."""
    begin = time.process_time()
    done = export_fmu(drive, folder / "drive.fmu", "3.0", check=False)
    return time.process_time() - begin, done.size


def exponents(sizes: list[int], amounts: list[float]) -> list[str]:
    """Growth between neighbouring sizes: amounts go with size to this power."""
    pairs = zip(pairwise(sizes), pairwise(amounts), strict=True)
    return [f"{math.log(after / before) / math.log(large / small):.2f}" for (small, large), (before, after) in pairs]


def main(sizes: list[int]) -> None:
    """Export and print."""
    with tempfile.TemporaryDirectory() as work:
        folder = Path(work)
        base, size = min(measure(NETLIST, folder) for _ in range(3))
        sys.stdout.write(
            f"CoupledClutches {base:6.2f} s (limit {LARGEST_SECONDS['CoupledClutches']:.2f} s) "
            f"{size / 1000:8.0f} kB (limit {LARGEST_BYTES / 1000:.0f} kB)\n"
        )
        results = []
        for n in sizes:
            results.append(measure(Chain(n=n), folder))
            seconds, size = results[-1]
            limit = LARGEST_SECONDS.get(f"chain of {n}")
            sys.stdout.write(
                f"chain of {n:6d} {seconds:6.2f} s{f' (limit {limit:.0f} s)' if limit else ''} {size / 1000:8.0f} kB   "
                f"ratio of times to CoupledClutches {seconds / base:5.2f}\n"
            )
            sys.stdout.flush()
        times, bytes_ = ([float(one[k]) for one in results] for k in (0, 1))
        sys.stdout.write(
            f"exponents of growth: time {', '.join(exponents(sizes, times))}; "
            f"size {', '.join(exponents(sizes, bytes_))}\n"
        )


if __name__ == "__main__":
    main([int(argument) for argument in sys.argv[1:]] or [10, 100, 1000])
