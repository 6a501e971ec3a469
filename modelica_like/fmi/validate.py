"""Check that an FMU conforms to the standard and runs in other importers."""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import fmpy
import fmpy.validation
import lxml.etree as etree

from modelica_like.arguments import checked
from modelica_like.errors import FmuFailed, FmuRefused, ModelicaLikeError
from modelica_like.fmi import importers
from modelica_like.fmi.failures import tell_error
from modelica_like.fmi.process import run_child, workplace
from modelica_like.fmi.run import TIMEOUT, Kind, Solver, run_fmu
from modelica_like.fmi.unpack import refuse_missing, unpack
from modelica_like.runs.curves import ranges
from modelica_like.runs.recorded import RecordedSolution
from modelica_like.runs.trajectories import Values

PASSED, FAILED, ABSENT = "passed", "failed", "–"
_STEPS = 500
_EULER = "FMPy ME Euler"
_EULER_STEPS = 2000
_EULER_STEP = 1e-5
"""Largest explicit step in s: it must be stable for the stiffest shaft."""
_EULER_FRACTION = 0.01
"""Largest part of a run with explicit steps."""
_SAME = 1e-2
"""Largest deviation between two ways to run an FMU at its own tolerance, relative to a signal's range."""
_NEAR = 0.1
"""The same for explicit steps, which are of first order."""
_LEAST_RANGE = 1e-2
"""Relative to the largest value among the signals of a unit."""
_OBSERVED = 50
_ROUNDING = 1e-9
_SCHEMAS = {
    "model description": ("modelDescription.xml", "ModelDescription"),
    "terminals and icons": ("terminalsAndIcons/terminalsAndIcons.xml", "TerminalsAndIcons"),
    "build description": ("sources/buildDescription.xml", "BuildDescription"),
}


@dataclass(frozen=True)
class Check:
    """One check of an FMU.

    Attributes:
        name: of the check.
        verdict: `passed`, `failed`, or `–` if there is nothing to check.
        sentence: the finding.
    """

    name: str
    verdict: str
    sentence: str


@dataclass(frozen=True)
class Validation:
    """All checks of an FMU."""

    fmu: str
    checks: tuple[Check, ...]

    @property
    def passed(self) -> bool:
        """Whether no check failed."""
        return all(check.verdict != FAILED for check in self.checks)

    def __getitem__(self, name: str) -> Check:
        return next(check for check in self.checks if check.name == name)

    def __str__(self) -> str:
        width = max(len(check.name) for check in self.checks)
        lines = [f"{check.name:{width}}  {check.verdict:6}  {check.sentence}" for check in self.checks]
        return "\n".join([self.fmu, *lines])


@dataclass(frozen=True)
class _Subject:
    """The FMU under examination: the archive, FMPy's model description, and the time limit of each run in s."""

    path: Path
    description: Any
    timeout: float

    @cached_property
    def stop(self) -> float:
        """End of the runs, in s."""
        stop = getattr(self.description.defaultExperiment, "stopTime", None)
        return float(stop) if stop is not None else 1.0

    @property
    def step(self) -> float:
        """Communication step in s."""
        return self.stop / _STEPS

    @property
    def euler_stop(self) -> float:
        """End of the explicit steps: a result of the other runs, if there is one so early."""
        most = min(_EULER_FRACTION * self.stop, _EULER_STEPS * _EULER_STEP)
        return math.floor(most / self.step * (1 + _ROUNDING)) * self.step or most

    @cached_property
    def observed(self) -> list[str]:
        """Continuous outputs, or else some local variables."""
        reals = [v for v in self.description.modelVariables if v.type in ("Real", "Float64") and not v.shape]
        outputs = [v.name for v in reals if v.causality == "output"]
        return outputs or [v.name for v in reals if v.causality == "local"][:_OBSERVED]

    def run(self, kind: Kind, stop: float, step: float, solver: Solver = "CVode") -> RecordedSolution:
        """Run with FMPy."""
        return run_fmu(
            self.path, stop=stop, kind=kind, solver=solver, step=step, timeout=self.timeout, outputs=self.observed
        )

    def at(self, time: float, run: RecordedSolution) -> Values:
        """Return the values at a time from a run, or from a run to that time if it is before the first result."""
        return run.at(min(time, run.final.time)) if time >= self.step else self.run("me", time, time).final


@checked
def validate_fmu(path: str | Path, *, timeout: float = TIMEOUT) -> Validation:
    """Check an FMU against the standard, and run it with several importers.

    The XML against its schemas; FMPy's own checks; FMPy as Model Exchange (CVode and explicit Euler) and Co-Simulation;
    ecos (FMI 2.0 and 3.0) and libcosim (FMI 2.0) as Co-Simulation, where they are installed. Every run has its own
    process, and the final values of all runs must agree.

    Args:
        path: the FMU.
        timeout: time limit of each run in s.

    Raises:
        FmuRefused: there is no such file.
        OSError: the file cannot be read.
    """
    path = Path(path)
    refuse_missing(path)
    path = path.resolve()
    with tempfile.TemporaryDirectory(prefix="modelica_like_") as work:
        try:
            unpack(path, Path(work))
        except FmuRefused as error:
            return Validation(path.name, (Check("archive", FAILED, error.what),))
        return Validation(path.name, tuple(_checks(path, Path(work), timeout)))


def _checks(path: Path, folder: Path, timeout: float) -> Iterator[Check]:
    yield Check("archive", PASSED, "It is safe to unpack.")
    version = _version(folder)
    schemas = [_schema_check(name, folder / file, version, schema) for name, (file, schema) in _SCHEMAS.items()]
    yield from schemas
    problems = [str(problem).replace("\n", " ") for problem in fmpy.validation.validate_fmu(str(folder))]
    yield Check("fmpy validate_fmu", FAILED if problems else PASSED, " ".join(problems) or "It finds no errors.")
    if schemas[0].verdict == FAILED:
        return
    subject = _Subject(path, fmpy.read_model_description(str(folder), validate=False), timeout)
    runs: dict[str, RecordedSolution] = {}
    yield _run_check("FMPy ME CVode", subject, "me", "CVode", runs)
    yield _run_check(_EULER, subject, "me", "Euler", runs)
    yield _run_check("FMPy CS", subject, "cs", "CVode", runs)
    yield _importer_check("ecos CS", "ecos", subject, runs.get("FMPy CS"))
    yield _importer_check("libcosim CS", "libcosim", subject, runs.get("FMPy CS"))


def _version(folder: Path) -> str:
    """Return the first digit of the FMI version, read without trusting the rest."""
    try:
        root = etree.parse(folder / "modelDescription.xml").getroot()
    except etree.XMLSyntaxError:
        return ""
    return str(root.get("fmiVersion", ""))[:1]


def _schema_check(name: str, file: Path, version: str, schema: str) -> Check:
    """Check an XML file against FMPy's copy of the standard's schemas."""
    name = f"schema of {name}"
    if not file.exists():
        return Check(name, ABSENT, "It has none.")
    # Terminals and build descriptions follow FMI 3.0 even in FMUs of FMI 2.0.
    kind = version if schema == "ModelDescription" else "3"
    try:
        document = etree.parse(file)
    except etree.XMLSyntaxError as error:
        return Check(name, FAILED, f"It is not XML: {error.msg}.")
    xsd = Path(str(fmpy.__file__)).parent / "schema" / f"fmi{kind}" / f"fmi{'' if kind == '1' else kind}{schema}.xsd"
    if not xsd.exists():
        return Check(name, FAILED, "It does not state its version of the standard.")
    rules = etree.XMLSchema(etree.parse(xsd))
    if rules.validate(document):
        return Check(name, PASSED, "It conforms to the schema.")
    faults = "; ".join(f"line {entry.line}: {entry.message}" for entry in list(rules.error_log)[:3])
    return Check(name, FAILED, faults)


def _run_check(name: str, subject: _Subject, kind: Kind, solver: Solver, runs: dict[str, RecordedSolution]) -> Check:
    """Run with FMPy; the results must agree with those before."""
    part = subject.description.modelExchange if kind == "me" else subject.description.coSimulation
    if part is None:
        return Check(name, ABSENT, f"It has no {'Model Exchange' if kind == 'me' else 'Co-Simulation'}.")
    before = next(iter(runs.values()), None)
    stop, steps = (subject.euler_stop, _EULER_STEPS) if solver == "Euler" else (subject.stop, _STEPS)
    try:
        run = subject.run(kind, stop, stop / steps, solver)
        expected = before and subject.at(stop, before)
    except ModelicaLikeError as error:
        return Check(name, FAILED, str(error).replace("\n", " "))
    if run.notices:
        return Check(name, FAILED, run.notices[0])
    if solver != "Euler":
        runs[name] = run
    return _agreement(name, before, expected, {n: run[n][-1] for n in run.model.position}, stop)


def _importer_check(name: str, importer: str, subject: _Subject, run: RecordedSolution | None) -> Check:
    """Run with another importer; the final values must agree with those of FMPy."""
    if subject.description.coSimulation is None:
        return Check(name, ABSENT, "It has no Co-Simulation.")
    if not importers.installed(importer):
        return Check(name, ABSENT, 'It is not installed: pip install "modelica-like[importers]".')
    names = subject.observed
    try:
        values = _run_importer(importer, subject, names)
    except FmuFailed as error:
        if importer == "libcosim" and subject.description.fmiVersion.startswith("3"):
            return Check(name, ABSENT, f"{error.what} It does so with every FMU of FMI 3.0: the importer is at fault.")
        return Check(name, FAILED, error.what)
    if run is None:
        return Check(name, PASSED, f"It runs to {subject.stop:g} s; FMPy has no values to compare with.")
    return _agreement(name, run, run.final, values, subject.stop)


def _run_importer(importer: str, subject: _Subject, names: Sequence[str]) -> dict[str, float]:
    job = {"importer": importer, "fmu": str(subject.path), "step": subject.step, "steps": _STEPS, "names": list(names)}
    with workplace(job) as folder:
        # libcosim unpacks into the temporary folder, and leaves it there when it crashes.
        elsewhere = {"TMPDIR": str(folder)}
        name = f"{subject.path.name} in {importer}"
        run_child(name, Path(importers.__file__), folder, subject.timeout, elsewhere)
        tell_error(folder, {}, {"failed": (FmuFailed, f"{importer} says: {{text}}.", "", "")})
        return json.loads((folder / "meta.json").read_text())


def _agreement(
    name: str, run: RecordedSolution | None, expected: Values | None, values: dict[str, float], stop: float
) -> Check:
    """Compare values with those of another run at the same time, relative to their ranges in that run."""
    if run is None or expected is None:
        return Check(name, PASSED, f"It runs to {stop:g} s.")

    scales = ranges(run, values, _LEAST_RANGE)
    deviations = {signal: abs(values[signal] - expected[signal]) / scales[signal] for signal in values}
    worst = max(values, key=deviations.__getitem__, default="")
    if worst and not deviations[worst] <= (_NEAR if name == _EULER else _SAME):
        share = f"{deviations[worst]:.1e} of its range"
        return Check(name, FAILED, f"It runs to {stop:g} s, but {worst} ends {share} away from the other runs.")
    return Check(name, PASSED, f"It runs to {stop:g} s and ends with the same values.")
