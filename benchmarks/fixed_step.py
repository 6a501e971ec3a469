"""How evenly fixed steps of 1 ms take their time: median and worst case over a million steps, events at random phases.

Run with `python benchmarks/fixed_step.py [name …] [--steps=1e6]`; it takes a C compiler and about ten minutes. Every
step is timed by a C program (`fixed_step.c`) around `fmi2DoStep`; of several repeats of the same step the shortest
counts, which tells apart what the machine does besides.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from modelica_like.compile import compile
from modelica_like.flatten import flatten
from modelica_like.fmi.build import compiler_command, flags, native_platform
from modelica_like.fmi.interface import interface
from modelica_like.fmi.model_file import generate
from modelica_like.netlist import load
from modelica_like.simulation import seconds
from modelica_like.structure import reduce

HERE = Path(__file__).parent
NETLISTS = {
    "000 direct": "examples/machine_table_direct",
    "000 geared": "examples/machine_table_geared",
    "003": "examples/machine_tool_startup",
    "CoupledClutches": "examples/msl/rotational/CoupledClutches",
    "winch": "tests/system/new_drives/winch",
    "Lepelletier": "examples/lepelletier",
}
STEP, REPEATS, TOKEN = 1e-3, 10, "{timed}"


def timed(netlist: Path, steps: float) -> tuple[float, ...]:
    """Return the number of steps, median, 99.99 % and worst time in s."""
    model = compile(reduce(flatten(load(netlist), open_inputs=True)))
    sources = generate(model, interface(model), token=TOKEN, fixed_step=STEP)
    with tempfile.TemporaryDirectory() as folder:
        for name, text in sources.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        files = [name for name in sources if name.endswith(".c")]
        chosen = [flag for flag in flags(native_platform()) if flag not in ("-shared", "-fPIC", "-fvisibility=hidden")]
        token = f'-DTOKEN="{TOKEN}"'
        command = [*compiler_command(native_platform()), *chosen, token, "-I.", *files, str(HERE / "fixed_step.c")]
        subprocess.run([*command, "-o", "timed", "-lm"], cwd=folder, check=True)
        given = [f"{STEP}", f"{seconds(model.settings['until'])}", f"{steps}", f"{REPEATS}"]
        told = subprocess.run([f"{folder}/timed", *given], capture_output=True, text=True, check=True).stdout
    return tuple(map(float, told.split()))


def main() -> None:
    """Print a row per drive."""
    asked = [name for name in sys.argv[1:] if not name.startswith("--")] or list(NETLISTS)
    steps = next((float(one.split("=")[1]) for one in sys.argv[1:] if one.startswith("--steps=")), 1e6)
    print(f"{'drive':16} {'steps':>9} {'median':>9} {'99.99 %':>9} {'worst':>9} {'worst/median':>13}")
    for name in asked:
        count, median, most, worst = timed(HERE.parent / f"{NETLISTS[name]}.toml", steps)
        times = "".join(f" {1e6 * value:6.2f} µs" for value in (median, most, worst))
        print(f"{name:16} {count:9.0f}{times} {worst / median:13.2f}", flush=True)


if __name__ == "__main__":
    main()
