"""Time until bad input is answered: whole processes, against one that only imports casadi and numpy.

Run with `python benchmarks/bad_input.py`. Medians of several runs.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

RUNS = 5
TWO_SOURCES = """
[parts]
left = { is = "ConstantSpeed", w_fixed = "100 rpm" }
right = { is = "ConstantSpeed", w_fixed = "200 rpm" }
[connect]
shaft = ["left.flange", "right.flange"]
[simulate]
until = "1 s"
"""
INPUTS = {
    "unknown type": '[parts]\na = { is = "Inertja", J = 1 }\n',
    "two speed sources": TWO_SOURCES,
    "10 MB of brackets": "x = " + "[" * 10_000_000,
}


def seconds(command: list[str], expected: int) -> float:
    """Median wall time of a process that ends with the expected exit code."""
    times: list[float] = []
    for _ in range(RUNS):
        begin = time.perf_counter()
        result = subprocess.run(command, capture_output=True, check=False)
        times.append(time.perf_counter() - begin)
        if result.returncode != expected:
            sys.exit(result.stderr.decode())
    return statistics.median(times)


def main() -> None:
    base = seconds([sys.executable, "-c", "import casadi, numpy"], 0)
    with tempfile.TemporaryDirectory() as folder:
        for name, text in INPUTS.items():
            file = Path(folder) / "bad.toml"
            file.write_text(text)
            taken = seconds([sys.executable, "-m", "modelica_like", "simulate", str(file)], 2)
            sys.stdout.write(
                f"bad input, {name}: {taken:.2f} s, ratio to importing casadi and numpy {taken / base:.1f}\n"
            )


if __name__ == "__main__":
    main()
