"""How every public call grows with the number of parts: what grows faster than it should fails.

Run with `python benchmarks/growth.py [parts parts] [word …]`: only calls with one of these words, by default all, and
with so many parts, by default 300 and 3,000. Two drives are measured at both sizes: a chain of inertias and springs,
read from a netlist, and the random tree of `large.py` with clutches, backlash and gears; and a mass whose force follows
a table of so many rows, and Modelica text with arrays of so many elements. Tenfold parts may take up to 15 times as
long: what is linear takes 10 times, sorting and memory that leaves the caches add to it, what is quadratic takes 100
times. Times are CPU times, the shortest of some repeats; only their growth decides.

Three calls may grow somewhat more (`STEEPER`). All eigenvalues of a matrix take a time that grows with its cube by
their nature: they are asked of a tenth of the parts, shown, and do not decide.
"""

from __future__ import annotations

import gc
import io
import resource
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from large import Drive
from rich.console import Console

from modelica_like import (
    build,
    compare,
    export_fmu,
    export_html,
    linearize,
    load,
    overlay,
    run_fmu,
    save_report,
    schematic,
    sensitivities,
    simulate,
    steady,
    sweep,
)
from modelica_like.edit import apply
from modelica_like.netlist import dumps, loads, save
from modelica_like.netlist.modelica.write import modelica_text
from modelica_like.page import Session
from modelica_like.show.report.plausible import notes
from modelica_like.show.report.run import run_report
from modelica_like.show.report.start import start_report
from modelica_like.show.report.structure import structure_report
from modelica_like.show.report.types import describe_netlist

SIZES, WARM = (300, 3000), 30
LIMIT = 15.0
FLOOR = 2e-2
"""A shorter time of the small drive counts as this one, in s: below, what does not depend on the size decides, and that
the numbers of the small drive alone are in the caches of the processor. A quadratic call of 3 ms is still found."""
UNTIL, SHORT = 0.01, 1e-4
"""Ends of the runs in s: of the chain, and of the tree, before the first of its many events."""
POINTS = 1000
"""Results of the run that is read: of both drives too many to be kept together."""
REPEATS, PATIENCE = 4, 2.0
"""A call is done twice, so that what the first one has made and kept does not count, and again until it has been done
so often or has taken this many seconds. First runs are done once."""
NEEDED = "load", "build", "run, idas", "export", "tree: build"
"""Calls whose results others take."""
STEEPER = {"schematic": 25.0, "edit in the picture": 25.0, "compare": 20.0}
"""Calls that may grow more, by their nature: the places of parts are found by a linear programme, whose steps grow with
its size (1.9 s of 3.6 s with 3,000 parts), and tables of all signals leave the caches."""
PUSHED = """[simulate]
until = 1
[parts]
push = { is = "Force" }
mass = { is = "Mass", m = 2, s = 0, v = 0 }
[connect]
end = ["push.flange", "mass.flange_a"]
"""
TEXT = """model Chain
  parameter Real c = 2;
  parameter Real k[{elements}] = {{i*c for i in 1:{elements}}};
  Real x[{elements}](each start = 1, each fixed = true);
equation
  der(x[1]) = -k[1]*x[1];
  for i in 2:{elements} loop
    der(x[i]) = k[i]*(x[i - 1] - x[i]);
  end for;
end Chain;
"""
MODES = "all modes, of a tenth of the parts"

Call = tuple[str, Callable[[], Any]]


def netlist(parts: int) -> str:
    """Write a chain that a torque drives and a damper brakes."""
    masses = range(parts // 2)
    entries = ['motor = { is = "ConstantTorque", tau_constant = "1 N.m" }', 'ground = { is = "Fixed" }']
    entries += [f'm{k} = {{ is = "Inertia", J = "0.1 kg.m2" }}' for k in masses]
    entries += [f's{k} = {{ is = "SpringDamper", c = "1000 N.m/rad", d = "1 N.m.s/rad" }}' for k in masses[1:]]
    entries += ['load = { is = "Damper", d = "1 N.m.s/rad" }']
    series = ["motor", "m0", *(name for k in masses[1:] for name in (f"s{k}", f"m{k}")), "load", "ground"]
    starts = ['"m0.phi" = 0', '"m0.w" = 1', *(f'"s{k}.phi_rel" = 0\n"m{k}.w" = 0' for k in masses[1:])]
    head = f'name = "chain"\n[simulate]\nuntil = "{UNTIL} s"\n[parts]'
    return "\n".join([head, *entries, f"[series]\nshaft = {series}", "[start]", *starts])


def shown(report: Any) -> None:
    """Print what the command line prints."""
    Console(file=io.StringIO(), width=120).print(report)


def of_chain(parts: int, folder: Path) -> Iterator[Call]:
    """Yield the calls on a chain, which follow each other as those of a user: what is kept counts once."""
    file = folder / "chain.toml"
    file.write_text(netlist(parts), encoding="utf-8")
    now: dict[str, Any] = {}

    def keep(name: str, make: Callable[[], Any]) -> Callable[[], Any]:
        return lambda: now.update({name: make()})

    yield "load", keep("drive", lambda: load(file))
    yield "build", keep("model", lambda: build(now["drive"]))
    yield "first run, idas", lambda: simulate(now["model"], UNTIL)
    yield "build and run, native", lambda: simulate(now["drive"], UNTIL, solver="native")
    yield "run, idas", keep("run", lambda: simulate(now["model"], UNTIL, points=POINTS))
    yield "run, native", lambda: simulate(now["model"], UNTIL, solver="native")
    yield "run with parameters", lambda: simulate(now["model"], UNTIL, parameters={"m1.J": 0.2})
    yield "run with readings", lambda: simulate(now["model"], UNTIL, readings=["max(s1.tau)", "integral(m2.w)"])
    drive, model, run = (now[name] for name in ("drive", "model", "run"))
    yield "native handle", lambda: model.native(["m0.J"], ["m1.w"]).run(UNTIL, 5)
    yield "read a variable", lambda: run["m1.w"]
    yield "read a derivative", lambda: run["der(m1.w)"]
    yield "read an energy", lambda: run["s1.loss_power"]
    yield "read by attribute", lambda: run.m1.w
    yield "values at a time", lambda: (run.at(0.5 * UNTIL)["m1.w"], run.final["m1.w"])
    yield "names", lambda: run.names
    yield "read all, as a table", run.to_pandas
    yield "read all, as a dataset", run.to_xarray
    yield "reading max", lambda: run.read("max(s1.tau)")
    yield "reading integral", lambda: run.read("integral(m1.w)")
    yield "energy balance", lambda: shown(str(simulate(model, UNTIL).energy()))
    yield "report of a run", lambda: shown(run_report(run))
    yield "notes", lambda: notes(drive, run)
    yield from of_run(drive, model, run, folder)


def of_run(drive: Any, model: Any, run: Any, folder: Path) -> Iterator[Call]:
    """Yield the calls on a drive, its model and its run."""
    yield "page of a run", lambda: save_report(drive, run, folder / "run.html")
    yield "page to simulate", lambda: export_html(drive, folder / "drive.html")
    yield "export without check", lambda: export_fmu(drive, folder / "plain.fmu", check=False)
    yield "export", lambda: export_fmu(drive, folder / "drive.fmu")
    yield "export, FMI 3", lambda: export_fmu(drive, folder / "drive3.fmu", "3.0")
    yield "run of an FMU", lambda: run_fmu(folder / "drive.fmu", stop=UNTIL, outputs=["m1.w"])
    yield "describe", lambda: shown(describe_netlist(drive))
    yield "check", lambda: shown(structure_report(drive))
    yield "check of start values", lambda: shown(start_report(drive, model))
    yield "netlist as text", lambda: dumps(drive)
    yield "save", lambda: save(drive, folder / "saved.toml")
    text = (folder / "chain.toml").read_text(encoding="utf-8")
    for request in (
        {"op": "insert", "name": "new", "kind": "Inertia", "after": "m1"}, {"op": "remove", "name": "s1"},
        {"op": "connect", "first": "m1.flange_b", "second": "m3.flange_b"},
        {"op": "disconnect", "first": "m1", "second": "s2"},
        {"op": "rename", "old": "m1", "new": "new"}, {"op": "replace", "name": "s1", "kind": "Damper"},
        {"op": "set", "path": "m1.J", "value": 2}, {"op": "duplicate", "name": "m1", "new": "new"},
        {"op": "group", "names": ["m1", "s2"], "name": "new"},
    ):  # fmt: skip
        yield f"edit: {request['op']}", lambda request=request: apply(text, request, file=folder / "chain.toml")
    session = Session(folder / "chain.toml")
    yield "edit in the picture", lambda: session.apply({"request": {"op": "set", "path": "m1.J", "value": 2}})
    yield "as Modelica", lambda: modelica_text(drive)
    yield "schematic", lambda: schematic(drive)
    yield "plot", lambda: run.plot()
    yield "plot of one", lambda: run.plot("m1.w")
    yield "overlay", lambda: overlay({"first": run, "second": run}, "m1.w")
    yield "compare", lambda: compare(run, run)
    yield "linearize", lambda: linearize(model, inputs=["motor.tau_constant"], outputs=["m1.w"])
    yield "steady", lambda: steady(model)
    yield "sensitivities by one", lambda: sensitivities(run, "s1.tau", ["m1.J"])
    yield "sensitivities by all", lambda: sensitivities(run, "s1.tau")
    yield "sweep", lambda: sweep(model, {"m1.J": [0.1, 0.2, 0.3]}, ["max(s1.tau)"], until=UNTIL, processes=1)


def of_tree(parts: int, folder: Path) -> Iterator[Call]:
    """Yield the calls on a tree of all kinds of parts."""
    now: dict[str, Any] = {}
    yield "tree: build", lambda: now.update(model=build(Drive(n=parts)))
    yield "tree: first run", lambda: simulate(now["model"], SHORT)
    yield "tree: run, native", lambda: simulate(now["model"], SHORT, solver="native")
    yield "tree: energy balance", lambda: simulate(now["model"], SHORT).energy()
    yield "tree: export without check", lambda: export_fmu(now["model"], folder / "tree.fmu", check=False)
    yield "tree: linearize", lambda: linearize(now["model"])
    yield MODES, lambda: linearize(build(loads(netlist(parts // 10)))).modes()


def of_rows(rows: int, folder: Path) -> Iterator[Call]:
    """Yield runs whose input follows a measured table of so many rows, each of which is an event."""
    drive, times = loads(PUSHED), np.linspace(0.0, 1.0, rows)
    inputs = {"push.f": np.c_[times, np.sin(40 * times)]}
    yield "rows: run, idas", lambda: simulate(drive, inputs=inputs)
    yield "rows: run, native", lambda: simulate(drive, inputs=inputs, solver="native")


def of_text(elements: int, folder: Path) -> Iterator[Call]:
    """Yield the reading of Modelica text whose loop is about arrays of so many elements."""
    file = folder / "Chain.mo"
    file.write_text(TEXT.format(elements=elements), encoding="utf-8")
    yield "text: read", lambda: load(file)


def chosen(parts: int, words: list[str]) -> Iterator[Call]:
    """Yield the calls that are asked for."""
    with tempfile.TemporaryDirectory() as work:
        for calls in (of_chain, of_tree, of_rows, of_text):
            for name, call in calls(parts, Path(work)):
                if not words or name in NEEDED or any(word in name for word in words):
                    yield name, call


def shortest(name: str, call: Callable[[], Any]) -> float:
    """Return the shortest CPU time of a call, in s."""
    once = "first" in name
    gc.unfreeze()
    gc.collect()
    gc.freeze()  # what others have left is not searched for garbage
    times: list[float] = []
    while len(times) < (1 if once else 2) or (not once and len(times) < REPEATS and sum(times) < PATIENCE):
        begin = time.process_time()
        call()
        times.append(time.process_time() - begin)
    return min(times)


def main(arguments: list[str]) -> int:
    """Measure, print, and return the exit code."""
    words = [word for word in arguments if not word.isdigit()]
    few, many = map(int, [word for word in arguments if word.isdigit()] or SIZES)
    for _, call in chosen(WARM, words):
        call()  # what is loaded and compiled once is not growth
    steep = measured(few, many, words)
    if steep:  # perhaps others have used the machine: what grows too much does so a second time
        sys.stdout.write(f"Measured again: {', '.join(steep)}\n")
        steep = [name for name in measured(few, many, steep) if name in steep]
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    sys.stdout.write(f"CPU time {time.process_time():.0f} s, peak memory {memory:.0f} MB\n")
    return int(bool(steep))


def measured(few: int, many: int, words: list[str]) -> list[str]:
    """Measure both sizes, print, and return the names of the calls that grow too much."""
    small, steep = {name: shortest(name, call) for name, call in chosen(few, words)}, []
    limit = LIMIT / 10 * many / few
    sys.stdout.write(f"{'CPU time in s':32s} {few:9d} {many:9d}  growth (limit {limit:g})\n")
    for name, call in chosen(many, words):
        most = limit * STEEPER.get(name, LIMIT) / LIMIT * max(small[name], FLOOR)
        seconds = shortest(name, call)
        growth = seconds / max(small[name], FLOOR)
        verdict = "  by its nature" if name == MODES else "  TOO MUCH" if seconds > most else ""
        if verdict == "  TOO MUCH":
            steep.append(name)
        sys.stdout.write(f"{name:32s} {small[name]:9.4f} {seconds:9.4f}  {growth:6.1f}{verdict}\n")
        sys.stdout.flush()
    return steep


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
