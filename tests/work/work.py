"""What every example costs: equations left, operations, start values assumed, steps and events of its run.

    python tests/work/work.py      renews `work.toml`; read its difference before you commit it

Whether results are right is told by other tests. This one tells when a change makes a model larger, a start assume
something else, or a run dearer, although its results stay within their tolerances: a worse choice of what is torn, an
edge too many, an estimate of an error that sees more or less. The steps of a run may differ by a tenth: other
processors round otherwise. A run whose events change when all parameters change in their last digits (chatter that is
resolved) has none in the table.
"""

from __future__ import annotations

import re
import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from modelica_like import build, load, simulate
from modelica_like.compile.compiled import CompiledDae
from modelica_like.netlist import spell
from modelica_like.show.report.start import start_values

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
TABLE = Path(__file__).with_name("work.toml")
SHAKEN, TIMES, STEADY = 1e-14, 4, 0.1
"""Relative changes of all parameters in a repeated run, number of these, and change of steps that is left."""
_LINE = re.compile(r"given in .*")
_FUNCTIONS = ("ode", "alg", "variables", "guards", "guard_rates", "guards_soon", "resets", "updates", "start_values",
              "discrete_starts", "hold_terms", "determinants")  # fmt: skip


def netlists() -> list[str]:
    """Return the examples that say how long they run."""
    found = (path for path in EXAMPLES.rglob("*.toml") if path.parent.name != "cosim")
    texts = {path: tomllib.loads(path.read_text(encoding="utf-8")) for path in found}
    runs = (path for path, text in texts.items() if "parts" in text and "until" in text.get("simulate", {}))
    return sorted(path.relative_to(EXAMPLES).with_suffix("").as_posix() for path in runs)


def work(name: str) -> dict[str, Any]:
    """Return what an example costs: its structure, its start, and its run."""
    drive = load(EXAMPLES / f"{name}.toml")
    model = build(drive)
    rows = start_values(drive, model, model.settings.get("start", "given"))
    return {
        "states": list(model.states), "implicit": list(model.implicit), "operations": operations(model),
        "start": [f"{one.path}: {_LINE.sub('given', one.origin)}" for one in rows], "run": costs(model),
    }  # fmt: skip


def operations(model: CompiledDae) -> dict[str, int]:
    """Return the number of operations of each function that has some."""
    functions: dict[str, ca.Function] = {name: model.functions[name] for name in _FUNCTIONS}
    return {name: one.n_instructions() for name, one in functions.items() if one.numel_out(0)}


def costs(model: CompiledDae) -> dict[str, int]:
    """Return how many steps a run takes, and how many events it has."""
    own = simulate(model).statistics
    return {"steps": own.steps, "events": own.events}


def steady(name: str) -> dict[str, Any]:
    """Return what an example costs, without what the last digits of its parameters decide."""
    found = work(name)
    run = found["run"]
    for other in (_shaken(name, seed) for seed in range(TIMES)):
        if other["events"] != run.get("events"):
            run.pop("events", None)
        if abs(other["steps"] - run.get("steps", 0)) > STEADY * other["steps"]:
            run.pop("steps", None)
    return found


def _shaken(name: str, seed: int) -> dict[str, int]:
    model = build(EXAMPLES / f"{name}.toml")
    noise = np.random.default_rng(seed).uniform(-SHAKEN, SHAKEN, len(model.p))
    return costs(replace(model, p=model.p * (1.0 + noise)))


def renew() -> None:
    """Write the table."""
    table: dict[str, Any] = {}
    for name in netlists():
        table[name] = steady(name)
        sys.stdout.write(f"{name}\n")
    head = "# What every example costs; renewed by `python tests/work/work.py`.\n\n"
    TABLE.write_text(head + spell.document(table), encoding="utf-8")


if __name__ == "__main__":
    renew()
