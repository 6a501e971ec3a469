"""CPU time to import modelica_like and to run its commands, as ratios to importing casadi and numpy.

Run with `python benchmarks/import_time.py [command words …]`. Each measurement is a fresh process; the shortest of
several counts, taken in turns so that other work on the machine meets all alike. Byte code is kept, as it is of an
installed package.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

PUBLIC = "; ".join(f"modelica_like.{name}" for name in ("Component", "Solution", "build", "load", "simulate"))
BASE = ["-c", "import casadi, numpy"]
COMMAND = ["-m", "modelica_like"]
DIRECT = str(Path(__file__).parents[1] / "examples" / "machine_table_direct.toml")
RUNS = 7


def seconds(words: list[str], cache: str) -> float:
    """CPU time of a fresh Python, that of the system included."""
    known = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = {**known, "PYTHONPYCACHEPREFIX": cache}
    subprocess.run([sys.executable, *words], stdout=subprocess.DEVNULL, env=environment, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main(words: list[str]) -> None:
    measured = {
        "import casadi, numpy": BASE,
        "import modelica_like, components": ["-c", f"import modelica_like, components; {PUBLIC}"],
        "modelica-like --help": [*COMMAND, "--help"],
        "modelica-like simulate machine_table_direct.toml": [*COMMAND, "simulate", DIRECT],
    }
    if words:
        measured["modelica-like " + " ".join(words)] = [*COMMAND, *words]
    best = dict.fromkeys(measured, float("inf"))
    with tempfile.TemporaryDirectory() as cache:
        for call in measured.values():
            seconds(call, cache)
        for _ in range(RUNS):
            best = {name: min(best[name], seconds(call, cache)) for name, call in measured.items()}
    base = best["import casadi, numpy"]
    for name, one in best.items():
        sys.stdout.write(f"{one:6.3f} s CPU   ratio {one / base:5.2f}   {name}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
