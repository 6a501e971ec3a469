"""Runs a system of FMUs in a separate process: python child.py FOLDER.

Results are written to the folder as they are computed: before the first step `columns.json`, and `meta.json` at the
end; `rows`, doubles of the time, the columns, the energies and the counts.
"""

from __future__ import annotations

import sys
from array import array
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from modelica_like.fmi.cosimulation.master import Balance, Master, Signal
from modelica_like.fmi.cosimulation.slaves import Slave, Terminated
from modelica_like.fmi.inside import Job, Refused, about


class Recorder:
    """Writes rows of all variables, energies at the bonds and counts at once, so that a failure keeps them."""

    def __init__(
        self, slaves: list[Slave], outputs: list[list[str]], master: Master, interval: float, job: Job, file: Path
    ) -> None:
        self._readers = [slave.reader(names) for slave, names in zip(slaves, outputs, strict=True)]
        self._master, self._interval, self._job, self._last = master, interval, job, -float("inf")
        self._file = file.open("wb", buffering=0)

    def look(self, time: float) -> list[float]:
        """Read a row; only the time if the row before is nearer than the interval."""
        if time - self._last < self._interval * (1 - 1e-6):
            return [time]
        row = [time]
        for read in self._readers:
            row += read()
        for balance in self._master.balances:
            row += balance.told()
        return row

    def keep(self, row: list[float]) -> None:
        """Keep a row."""
        self._job.reach(row[0])
        if len(row) > 1:
            self._last = row[0]
            self._file.write(array("d", [*row, *vars(self._master.counts).values()]))

    def close(self, time: float) -> None:
        """Keep the end, even if it is near the row before."""
        if self._last != time:
            self._interval = 0.0
            self.keep(self.look(time))


def open_slaves(job: Job) -> list[Slave]:
    """Instantiate all FMUs, and check the names."""
    slaves: list[Slave] = []
    for k, unit in enumerate(job.asked["units"]):
        name = unit["name"]
        slaves.append(Slave(name, job.folder / str(k), job.hear, lambda k=k, name=name: job.call(k, name)))
        for name in unit["parameters"]:
            check_name(slaves[-1], name, "parameters")
    for link in job.asked["links"]:
        (n, name), *targets = link["ends"]
        check_name(slaves[n], name, "outputs")
        for n, name in targets:
            check_name(slaves[n], name, "inputs")
            if (causality := slaves[n].all[name].causality) != "input":
                inputs = [v for v, about in slaves[n].all.items() if about.causality == "input"]
                raise Refused(kind="no input", unit=slaves[n].name, name=name, causality=causality, known=inputs)
    if job.asked["tolerance"] is not None and (unable := [slave.name for slave in slaves if not slave.can_save]):
        raise Refused(kind="no rollback", unit=unable[0])
    return slaves


def check_name(slave: Slave, name: str, wanted: str) -> None:
    """Refuse a name that an FMU does not have."""
    if name not in slave.all:
        names = [n for n, v in slave.all.items() if wanted != "inputs" or v.causality == "input"]
        raise Refused(kind="unknown", unit=slave.name, name=name, known=names)


def choose(slaves: list[Slave], patterns: list[str] | None, *, own_names: bool) -> list[list[str]]:
    """Return the names of the variables to record, of each FMU."""
    names = [{name: name if own_names else f"{slave.name}.{name}" for name in slave.variables} for slave in slaves]
    if patterns is None:
        return [list(unique) for unique in names]
    full = [name for unique in names for name in unique.values()]
    for pattern in patterns:
        if not any(fits(name, pattern) for name in full):
            raise Refused(kind="no output", name=pattern, known=full)
    return [[name for name, variable in unique.items() if any(fits(variable, p) for p in patterns)] for unique in names]


def fits(name: str, pattern: str) -> bool:
    """Return whether a name matches."""
    return name == pattern or fnmatchcase(name, pattern)


def connect(slaves: list[Slave], job: dict[str, Any]) -> Master:
    """Make the master."""
    signals: list[Signal] = []
    for link in job["links"]:
        (n, name), *targets = link["ends"]
        nominal = getattr(slaves[n].all[name], "nominal", None)
        signals.append(Signal((n, name), [(m, other) for m, other in targets], float(nominal or 1.0)))
    if job["tolerance"] is not None:
        signals += results_of(slaves, signals)
    balances = [Balance(bond["flow"], bond["rate"], bond["name"]) for bond in job["bonds"]]
    return Master(slaves, signals, balances, job["master"] == "gauss-seidel", job["inputs"] == "linear")


def results_of(slaves: list[Slave], signals: list[Signal]) -> list[Signal]:
    """Return states and outputs that drive nothing, of FMUs that are driven: a variable step keeps their errors small.

    The values that FMUs exchange can be exact at communication points (a source, a gain), and say nothing of them.
    """
    sources, driven = {signal.source for signal in signals}, {n for signal in signals for n, _ in signal.targets}
    return [
        Signal((n, name), [], float(getattr(slaves[n].all[name], "nominal", None) or 1.0))
        for n in sorted(driven)
        for name in slaves[n].results
        if (n, name) not in sources
    ]


def start(slaves: list[Slave], master: Master, job: dict[str, Any]) -> None:
    """Initialize all FMUs together."""
    for slave, unit in zip(slaves, job["units"], strict=True):
        for name, value in unit["parameters"].items():
            slave.set(name, value)
    for slave in slaves:
        slave.enter_initialization(job["start"], job["until"], job["fmu_tolerance"])
    master.begin(job["start"])
    for slave in slaves:
        slave.exit_initialization()
    master.begin(job["start"])


def run(job: Job) -> None:
    """Run the job of a folder."""
    request, slaves, folder = job.asked, open_slaves(job), job.folder
    outputs = choose(slaves, request["outputs"], own_names=request["own_names"])
    master = connect(slaves, request)
    start(slaves, master, request)
    recorder = Recorder(slaves, outputs, master, request["interval"], job, folder / "rows")
    recorder.keep(recorder.look(request["start"]))
    width = (folder / "rows").stat().st_size // 8
    meta = {"units": columns_of(slaves, outputs), "open": open_inputs(slaves, request), "width": width}
    job.leave(meta, "columns.json")
    span = request["start"], request["until"], request["step"]
    try:
        if request["tolerance"] is None:
            master.run_fixed(*span, recorder)
        else:
            master.run_variable(*span, request["tolerance"], recorder)
        recorder.close(request["until"])
    except Terminated as end:  # results are those of the communication points before
        meta["ended"] = end.detail
    for slave in slaves:
        slave.close()
    job.leave(meta)


def columns_of(slaves: list[Slave], outputs: list[list[str]]) -> list[dict[str, Any]]:
    """Return the columns and parameters of each FMU."""
    return [
        {"columns": [about(slave.all[name]) for name in names], "constants": constants(slave)}
        for slave, names in zip(slaves, outputs, strict=True)
    ]


def open_inputs(slaves: list[Slave], job: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the unconnected inputs without a value."""
    driven = {(n, name) for link in job["links"] for n, name in link["ends"][1:]}
    opened: list[dict[str, Any]] = []
    for n, (slave, unit) in enumerate(zip(slaves, job["units"], strict=True)):
        inputs = [name for name, variable in slave.all.items() if variable.causality == "input"]
        names = [name for name in inputs if (n, name) not in driven and name not in unit["parameters"]]
        values = slave.reader(names)()
        opened += [
            about(slave.all[name]) | {"fmu": slave.name, "value": value}
            for name, value in zip(names, values, strict=True)
        ]
    return opened


def constants(slave: Slave) -> dict[str, float]:
    """Return the values of the parameters."""
    names = [name for name, v in slave.all.items() if v.causality == "parameter"]
    return dict(zip(names, slave.reader(names)(), strict=True))


if __name__ == "__main__":
    run(Job(Path(sys.argv[1])))
