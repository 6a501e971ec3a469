"""What every example costs: equations left, operations, start values assumed, calls of compiled functions.

    python tests/work/work.py      renews `work.toml`; read its difference before you commit it

Whether results are right is told by other tests. This one tells when a change makes a model larger, a start assume
something else, or a run dearer, although its results stay within their tolerances: a worse choice of what is torn, a
panel too many, an estimate of an error that sees more or less. A count is exact if it stays when all parameters change
in their last digits; it is kept as `nearly` if it changes by a percent, and left out if rounding decides it.
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import casadi as ca
import numpy as np
import tomlkit

from modelica_like import build, load, simulate
from modelica_like.compile.buffers import Along, BufferedFunction
from modelica_like.compile.compiled import CompiledDae
from modelica_like.report.start import start_values

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
TABLE = Path(__file__).with_name("work.toml")
SHAKEN, TIMES, STEADY = 1e-14, 4, 0.01
"""Relative changes of all parameters in a repeated run, number of these, and change of a count that is left."""
_LINE = re.compile(r"given in .*")
_FUNCTIONS = ("ode", "alg", "variables", "guards", "guard_rates", "guards_soon", "resets", "updates", "start_values",
              "discrete_starts", "hold_terms", "determinants")  # fmt: skip


def netlists() -> list[str]:
    """Return the examples that say how long they run."""
    found = (path for path in EXAMPLES.rglob("*.toml") if path.parent.name != "cosim")
    texts = {path: tomllib.loads(path.read_text(encoding="utf-8")) for path in found}
    runs = (path for path, text in texts.items() if "parts" in text and "until" in text.get("simulate", {}))
    return sorted(path.relative_to(EXAMPLES).with_suffix("").as_posix() for path in runs)


@contextmanager
def counted() -> Iterator[Counter[str]]:
    """Count the points at which compiled functions are evaluated, by the names of these."""
    counts = Counter[str]()
    call, into = BufferedFunction.__call__, Along.into

    def one(self: BufferedFunction, *arguments: Any) -> Any:
        counts[self.function.name()] += 1
        return call(self, *arguments)

    def many(self: Along, results: Any, times: Any, *arguments: Any) -> None:
        counts["along"] += len(times)
        into(self, results, times, *arguments)

    with patch.object(BufferedFunction, "__call__", one), patch.object(Along, "into", many):
        yield counts


def work(name: str) -> dict[str, Any]:
    """Return what an example costs: its structure, its start, its run, and the energies of that."""
    drive = load(EXAMPLES / f"{name}.toml")
    model = build(drive)
    rows = start_values(drive, model, model.settings.get("start", "given"))
    return {
        "states": list(model.states), "implicit": list(model.implicit), "operations": operations(model),
        "start": [f"{one.path}: {_LINE.sub('given', one.origin)}" for one in rows], **calls(model),
    }  # fmt: skip


def operations(model: CompiledDae) -> dict[str, int]:
    """Return the number of operations of each function that has some."""
    functions: dict[str, ca.Function] = {name: getattr(model, name) for name in _FUNCTIONS}
    return {name: one.n_instructions() for name, one in functions.items() if one.numel_out(0)}


def calls(model: CompiledDae) -> dict[str, dict[str, int]]:
    """Return the counts of a run, and those of its energies."""
    with counted() as first:
        run = simulate(model)
    with counted() as second:
        run.energy()
    own = run.statistics
    return {"run": {"steps": own.steps, "events": own.events, **dict(sorted(first.items()))}, "energy": dict(second)}


def steady(name: str) -> dict[str, Any]:
    """Return the work of an example: counts that are exact, counts that are `nearly` so."""
    found = work(name)
    repeated = [_shaken(name, seed) for seed in range(TIMES)]
    for part in ("run", "energy"):
        own = found[part]
        change = {one: max(abs(other[part].get(one, 0) - n) for other in repeated) for one, n in own.items()}
        found[part] = {one: n for one, n in own.items() if not change[one]}
        found |= {f"nearly {part}": {one: n for one, n in own.items() if 0 < change[one] <= STEADY * n}}
    return found


def _shaken(name: str, seed: int) -> dict[str, dict[str, int]]:
    model = build(EXAMPLES / f"{name}.toml")
    noise = np.random.default_rng(seed).uniform(-SHAKEN, SHAKEN, len(model.p))
    return calls(replace(model, p=model.p * (1.0 + noise)))


def renew() -> None:
    """Write the table."""
    table = tomlkit.document()
    table.add(tomlkit.comment("What every example costs; renewed by `python tests/work/work.py`."))
    for name in netlists():
        one = tomlkit.table()
        for key, value in steady(name).items():
            if value or not key.startswith("nearly"):
                one.add(key, inline(value) if isinstance(value, dict) else value)
        table.add(name, one)
        sys.stdout.write(f"{name}\n")
    TABLE.write_text(tomlkit.dumps(table), encoding="utf-8")


def inline(value: dict[str, int]) -> Any:
    """Return a table in one line."""
    found = tomlkit.inline_table()
    found.update(value)
    return found


if __name__ == "__main__":
    renew()
