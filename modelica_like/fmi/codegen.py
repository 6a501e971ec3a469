"""A compiled model as C sources: its tables, and the run-time that is the same for all models."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Literal

import fmpy

from modelica_like.compile.compiled import CompiledDae
from modelica_like.fmi.c_text import header, source
from modelica_like.fmi.interface import Interface
from modelica_like.fmi.tables import make_tables

Version = Literal["2.0", "3.0"]

RUNTIME = (
    "tape.c",
    "linear.c",
    "point.c",
    "start.c",
    "holds.c",
    "impacts.c",
    "events.c",
    "rosenbrock.c",
    "integrate.c",
    "values.c",
    "derivatives.c",
    "taylor.c",
    "instance.c",
)
LOG_CATEGORIES = {
    "logStatusError": "errors: what went wrong, where, and what to do",
    "logStatusWarning": "doubtful but possible requests",
    "logEvents": "mode changes with their time",
    "logIntegrator": "steps of the Co-Simulation integrator with their size and estimated error",
}
"""Log categories of every FMU with a description; errors are always reported."""

_FACES = {
    "2.0": ("fmi2.h", "fmi2.c", "fmi2_values.c"),
    "3.0": ("fmi3.h", "fmi3.c", "fmi3_values.c", "fmi3_unused.c"),
}
_HEADERS = {
    "2.0": ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
    "3.0": ("fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h"),
}


def source_files(version: Version) -> tuple[str, ...]:
    """Names of the C files that are compiled together."""
    return ("model.c", *RUNTIME, *(name for name in _FACES[version] if name.endswith(".c")))


def generate(
    model: CompiledDae, interface: Interface, version: Version = "2.0", *, token: str, tolerance: float = 1e-7
) -> dict[str, str]:
    """Write all C sources of an FMU.

    Args:
        model: the compiled model.
        interface: its FMI variables.
        version: FMI version.
        token: GUID (2.0) or instantiation token (3.0) of the description.
        tolerance: relative tolerance of Co-Simulation where the importer gives none.

    Returns:
        File name to text; besides C files the headers that they include.

    Raises:
        MissingStart, ContradictingStart: the start values do not determine all states.
        LanguageError: a function has no counterpart in C.
    """
    tables = make_tables(model)
    folder = files("modelica_like.fmi") / "templates"
    names = (
        "core.h",
        *(name for name in _FACES[version] if name.endswith(".h")),
        *(name for name in source_files(version) if name != "model.c"),
    )
    return {
        "model.h": header(tables, interface.variables, tolerance),
        "model.c": source(tables, interface.variables, token),
        **{name: (folder / name).read_text(encoding="utf-8") for name in names},
        **{name: _header(name) for name in _HEADERS[version]},
    }


def licenses(version: Version) -> str:
    """Return the licences of the sources in an FMU: that of the generated code, and that of the standard's headers."""
    own = (files("modelica_like.fmi") / "templates" / "license.txt").read_text(encoding="utf-8")
    text = _header(_HEADERS[version][0])
    comment = text[text.index("Copyright") : text.index("*/")]
    lines = [line.strip().strip("-") for line in comment.splitlines()]
    return f"The C code of the model:\n\n{own}\nThe headers fmi*.h:\n\n" + "\n".join(lines).strip() + "\n"


def _header(name: str) -> str:
    return (Path(fmpy.__file__).parent / "c-code" / name).read_text(encoding="utf-8")
