"""Time to import modelica_like with its public names, on top of casadi and numpy.

Run with `python benchmarks/import_time.py`. Each measurement is a fresh process; the medians of both are compared.
"""

from __future__ import annotations

import statistics
import subprocess
import sys

BASE = "import casadi, numpy"
PUBLIC = "; ".join(f"modelica_like.{name}" for name in ("Component", "Solution", "build", "load", "simulate"))
RUNS = 7


def seconds(code: str) -> float:
    """Median import time of a fresh process."""
    program = f"import time; t = time.perf_counter(); {code}; print(time.perf_counter() - t)"
    times = [
        float(subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout)
        for _ in range(RUNS)
    ]
    return statistics.median(times)


def main() -> None:
    base = seconds(BASE)
    ours = seconds(f"{BASE}; import modelica_like, components; {PUBLIC}")
    sys.stdout.write(
        f"import: casadi and numpy {base:.2f} s, with modelica_like and components {ours:.2f} s; "
        f"{ours - base:.2f} s more, ratio {ours / base:.2f}\n"
    )


if __name__ == "__main__":
    main()
