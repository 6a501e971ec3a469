"""What is checked before an FMU is handed over: its description by the schemas, its run against IDAS."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from typing import Any, Literal

import fmpy
import lxml.etree as etree
import numpy as np
from fmpy.model_description import ValidationError

from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import ExportError
from modelica_like.simulation import seconds, simulate

_PART = 0.1
_POINTS = 50
_AGREEMENT = 1e-4
_SMALL = 1e-6
_TRUTH = 1e-9
_PART_NAME = r"(?:[_a-zA-Z]\w*|'[^'\\]+')(?:\[\d+(?:,\d+)*\])?"
_IDENTIFIER = rf"{_PART_NAME}(?:\.{_PART_NAME})*"
_NAME = re.compile(rf"{_IDENTIFIER}|der\({_IDENTIFIER}(?:,\d+)?\)", re.ASCII)
TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"


def problems(path: str | Path) -> list[str]:
    """Check an FMU without running it: schemas, names, units, structure, terminals, files.

    Returns:
        What is wrong, in the words of the validators; empty if nothing is.
    """
    found = description_problems(path)
    with zipfile.ZipFile(path) as archive:
        names = set(archive.namelist())
        if TERMINALS in names:
            found += _terminal_problems(archive.read(TERMINALS), archive.read("modelDescription.xml"), names)
    return found


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
    names = (one.name for one in description.modelVariables)
    return [f"The variable name '{name}' is not legal." for name in names if not _NAME.fullmatch(name)]


def _terminal_problems(content: bytes, description: bytes, names: set[str]) -> list[str]:
    parser = etree.XMLParser(resolve_entities=False, no_network=True)
    top: Any = etree.fromstring(content, parser)
    schema = etree.XMLSchema(file=str(Path(fmpy.__file__).parent / "schema/fmi3/fmi3TerminalsAndIcons.xsd"))
    found = [] if schema.validate(top) else [f"{TERMINALS}: {error.message}" for error in schema.error_log]
    variables: Any = etree.fromstring(description, parser).find("ModelVariables")
    known = {one.get("name") for one in variables}
    for member in top.iter("TerminalMemberVariable"):
        if member.get("variableName") not in known:
            found.append(f"{TERMINALS}: there is no variable {member.get('variableName')}.")
    for one in top.iter("TerminalGraphicalRepresentation"):
        icon = f"terminalsAndIcons/{one.get('iconBaseName')}.png"
        if icon not in names:
            found.append(f"{TERMINALS}: {icon} is missing.")
    return found


def compare_with_idas(path: Path, model: CompiledDae, kind: Literal["me", "cs"]) -> float:
    """Run the first tenth of an FMU's time, and compare its states with IDAS.

    Returns:
        Largest deviation of a state, in parts of its range.

    Raises:
        ExportError: they differ.
    """
    from modelica_like.fmi.run import run_fmu

    end = _PART * seconds(model.settings.get("until", "1 s"))
    nominals = {n: abs(size) for n, size in zip(model.states, model.nominals, strict=True) if n in model.position}
    if not nominals:
        return 0.0
    truth = simulate(model, end, points=_POINTS, rtol=_TRUTH, atol=_TRUTH / 100)
    run = run_fmu(path, stop=end, kind=kind, step=end / _POINTS, outputs=list(nominals))
    # Between the instants of the grid events would be blurred.
    instants = np.linspace(0.0, end, _POINTS + 1)
    place, other = (np.searchsorted(time, instants + 1e-9 * end, side="right") - 1 for time in (truth.time, run.time))
    worst, culprit = 0.0, ""
    for name, nominal in nominals.items():
        size = np.ptp(truth[name]) + 1e-3 * np.max(np.abs(truth[name])) + _SMALL * nominal
        deviation = float(np.max(np.abs(run[name][other] - truth[name][place])) / size)
        if not deviation <= worst:
            worst, culprit = deviation, name
    if not worst <= _AGREEMENT:
        raise ExportError(
            f"The FMU does not agree with IDAS: {culprit} differs by {worst:.2g} of its range until t = {end:g} s.",
            advice="Export without the check to look at it, and report this.",
        )
    return worst
