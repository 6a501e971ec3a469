"""Checks of an exported FMU: its description against the schemas, its run against IDAS."""

from __future__ import annotations

import re
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import fmpy
import lxml.etree as etree
from fmpy.model_description import ValidationError

from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import FmuFailed, SolveError
from modelica_like.fmi.run import run_fmu
from modelica_like.options import Options
from modelica_like.runs.curves import Curves, compare_solutions
from modelica_like.runs.solution import Solution
from modelica_like.simulation import seconds, simulate

_PART = 0.1
_POINTS = 50
_RESULTS = 500
_AGREEMENT = 1e-4
_ALLOWANCE = 10.0
_LEAST_RANGE = 1e-3
_ROUNDING = 1e-10
_TRUTH = 1e-9
_NAMED = 5
_LISTED = 12
_FIXED = (("In fixed steps", "the FMU fails."), ("The error of fixed steps", "is not known"))
_PART_NAME = r"(?:[_a-zA-Z]\w*|'[^'\\]+')(?:\[\d+(?:,\d+)*\])?"
_IDENTIFIER = rf"{_PART_NAME}(?:\.{_PART_NAME})*"
_NAME = re.compile(rf"{_IDENTIFIER}|der\({_IDENTIFIER}(?:,\d+)?\)", re.ASCII)
TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"


def problems(path: str | Path) -> list[str]:
    """Check an FMU without running it: schemas, names, units, structure, terminals, files.

    Returns:
        The messages of the validators; empty without errors.
    """
    result = description_problems(path)
    with zipfile.ZipFile(path) as archive:
        names = set(archive.namelist())
        if TERMINALS in names:
            result += _terminal_problems(archive.read(TERMINALS), archive.read("modelDescription.xml"), names)
    return result


def description_problems(path: str | Path) -> list[str]:
    """Check modelDescription.xml as `fmpy.validation.validate_fmu` does.

    Names are checked by a regular expression: FMPy's grammar takes half a minute for ten thousand of them.

    Args:
        path: an FMU, or a folder with its files.
    """
    try:
        description = fmpy.read_model_description(str(path), validate=True, validate_model_structure=True)
    except ValidationError as error:
        return list(error.problems)
    names = (variable.name for variable in description.modelVariables)
    return [f"The variable name '{name}' is not legal." for name in names if not _NAME.fullmatch(name)]


def _terminal_problems(content: bytes, description: bytes, names: set[str]) -> list[str]:
    parser = etree.XMLParser(resolve_entities=False, no_network=True)
    top: Any = etree.fromstring(content, parser)
    schema = etree.XMLSchema(file=str(Path(fmpy.__file__).parent / "schema/fmi3/fmi3TerminalsAndIcons.xsd"))
    result = [] if schema.validate(top) else [f"{TERMINALS}: {error.message}" for error in schema.error_log]
    variables: Any = etree.fromstring(description, parser).find("ModelVariables")
    listed = {variable.get("name") for variable in variables}
    for member in top.iter("TerminalMemberVariable"):
        if member.get("variableName") not in listed:
            result.append(f"{TERMINALS}: there is no variable {member.get('variableName')}.")
    for picture in top.iter("TerminalGraphicalRepresentation"):
        icon = f"terminalsAndIcons/{picture.get('iconBaseName')}.png"
        if icon not in names:
            result.append(f"{TERMINALS}: {icon} is missing.")
    return result


@dataclass(frozen=True)
class Check:
    """Result of the comparison of an FMU with IDAS.

    Attributes:
        sentence: message; empty if they agree.
        curves: both runs, if both finished; states sorted by deviation.
        differs: whether they differ by more than solvers at the FMU's tolerance do, or the FMU failed.
        picture: file with the curves that differ.
    """

    sentence: str = ""
    curves: Curves | None = None
    differs: bool = False
    picture: Path | None = None


def compare_with_idas(path: Path, model: CompiledDae, kind: Literal["me", "cs"], fixed_step: float = 0.0) -> Check:
    """Run the first tenth of an FMU's time, or with fixed steps the whole, and compare its states with IDAS.

    The limit takes tolerances into account, because fast oscillations drift in phase: above 1e-4 of a state's range,
    ten times the difference between IDAS at the FMU's tolerance and IDAS at a fine one is allowed. The error of fixed
    steps is reported by variable.

    Args:
        path: the FMU.
        model: the model in it.
        kind: `me` or `cs`.
        fixed_step: size of its fixed steps in s.
    """
    until, rtol = seconds(model.settings.get("until", "1 s")), float(model.settings.get("rtol", Options.rtol))
    step = communication_step(until, fixed_step, _RESULTS) if fixed_step else _PART * until / _POINTS
    points = int(until / step * (1 + _ROUNDING)) if fixed_step else _POINTS
    end = points * step
    nominals = {
        n: abs(size) for n, size in zip(model.states, model.equations.nominals, strict=True) if n in model.position
    }
    if not nominals or not points:
        return Check()
    fails, unknown = f"The FMU fails in the first {end:g} s of its run.", "The FMU runs, but nothing was compared"
    if fixed_step:
        fails, unknown = (f"{text} of {fixed_step:g} s {rest}" for text, rest in _FIXED)
    # Modes, whose changes match the curves; an FMU has only those that are declared.
    modes = (discrete.path for discrete in model.flat_discretes if discrete.names and not discrete.hidden)
    try:
        run = run_fmu(path, stop=end, kind=kind, step=step, outputs=[*nominals, *modes])
        truth = _idas(model, end, points, _TRUTH, rtol)
    except FmuFailed as error:
        return Check(f"{fails} {error}", differs=True)
    except SolveError as error:
        return Check(f"{unknown}, because IDAS gave up: {error.what}")
    curves = compare_solutions(truth, run, list(nominals), ("IDAS", "FMU"), _LEAST_RANGE)
    if fixed_step:
        return _fixed_error(curves, fixed_step, end)
    off = [d for d in curves.deviations if d.relative > _AGREEMENT and d.largest > _ROUNDING * nominals[d.signal]]
    if not off:
        return Check(curves=curves)
    usual = compare_solutions(truth, _idas(model, end, points, rtol), list(nominals), ("", ""), _LEAST_RANGE)
    beyond = [d for d in off if d.relative > _ALLOWANCE * usual[d.signal].relative]
    reason = "by more than its tolerance explains" if beyond else f"as its tolerance {rtol:g} lets it"
    shares = ", ".join(f"{d.signal} by {d.relative:.2g}" for d in (beyond or off)[:_NAMED])
    message = f"Until t = {end:g} s the FMU differs from IDAS {reason}: {shares} of the range."
    return Check(message, curves, bool(beyond))


def _fixed_error(curves: Curves, step: float, end: float) -> Check:
    """Return the error of fixed steps by variable."""
    shares = ", ".join(f"{d.signal} {d.relative:.2g}" for d in curves.deviations[:_LISTED])
    others = len(curves.deviations) - _LISTED
    rest = f"; {others} others less" if others > 0 else ""
    message = f"Error of fixed steps of {step:g} s until t = {end:g} s, against IDAS, over the range: {shares}"
    return Check(f"{message}{rest}.", curves)


def communication_step(end: float, step: float, points: int) -> float:
    """Return a whole number of fixed steps, such that a run has about `points` of them."""
    return step * max(1, round(end / points / step))


def _idas(model: CompiledDae, end: float, points: int, *tolerances: float) -> Solution:
    """Run with the first tolerance that succeeds."""
    first, *rest = tolerances
    try:
        return simulate(model, end, points=points, rtol=first, atol=first / 100, solver="idas")
    except SolveError:
        if not rest:
            raise
        return _idas(model, end, points, *rest)
