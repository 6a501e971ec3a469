"""The C sources of the run-time: the same for all models.

This module needs only the standard library, so that a wheel build can import it.
"""

from __future__ import annotations

from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path
from typing import Literal

from modelica_like.errors import ExportError

Version = Literal["2.0", "3.0"]
Face = Literal["2.0", "3.0", "native"]

_ENGINE = Path(__file__).parents[1] / "engine"

RUNTIME = (
    "model.c", "resources.c", "tape.c", "special.c", "code.c", "linear.c", "start.c", "steady.c", "holds.c",
    "impacts.c", "ideal.c", "events.c", "crowd.c", "resets.c", "panels.c", "locate.c", "edges.c", "integrate.c",
    "fixed.c", "values.c", "delay.c", "derivatives.c", "series.c", "adjoint.c", "kinks.c", "meetings.c", "graze.c",
    "integrals.c", "instants.c", "gradient.c", "instance.c",
)  # fmt: skip
LOG_CATEGORIES = {
    "logStatusError": "errors: what went wrong, where, and what to do",
    "logStatusWarning": "doubtful but possible requests",
    "logEvents": "mode changes with their time",
    "logIntegrator": "steps of the Co-Simulation integrator with their size and estimated error",
}
"""Log categories of every FMU with a description; errors are always reported."""

_FACES = {
    "2.0": ("fmi.h", "fmi2.c"),
    "3.0": ("fmi.h", "fmi3.c"),
    "native": ("native.c", "batch.c"),
}
_HEADERS = {
    "2.0": ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
    "3.0": ("fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h"),
    "native": (),
}


def source_files(version: Version) -> tuple[str, ...]:
    """Names of the C files that are compiled together."""
    return ("model_data.c", *RUNTIME, *(name for name in _FACES[version] if name.endswith(".c")))


def runtime_sources(faces: Iterable[Face]) -> dict[str, str]:
    """Read the C sources of the run-time with its interfaces, without a model.

    Returns:
        File name to text: C files and their headers.

    Raises:
        ExportError: FMPy, which has the headers of the standard, is not installed.
    """
    wanted = tuple(faces)
    return own_sources(wanted) | {name: _header(name) for face in wanted for name in _HEADERS[face]}


def own_sources(faces: Iterable[Face]) -> dict[str, str]:
    """Read the same without the headers of the standard."""
    files = (name for face in faces for name in _FACES[face])
    headers = (
        "adjoint.h", "code.h", "codes.h", "core.h", "types.h", "model.h", "modelica_like.h", "operations.h", "rodas.h",
    )  # fmt: skip
    names = (*headers, "model_data.c", *RUNTIME, *files)
    return {name: (_ENGINE / name).read_text(encoding="utf-8") for name in names}


def licenses(version: Version) -> str:
    """Return the licences of the sources in an FMU: that of the generated code, and that of the standard's headers."""
    engine = (_ENGINE / "license.txt").read_text(encoding="utf-8")
    text = _header(_HEADERS[version][0])
    comment = text[text.index("Copyright") : text.index("*/")]
    lines = [line.strip().strip("-") for line in comment.splitlines()]
    return f"The C code of the model:\n\n{engine}\nThe headers fmi*.h:\n\n" + "\n".join(lines).strip() + "\n"


def _header(name: str) -> str:
    spec = find_spec("fmpy")
    if spec is None or spec.origin is None:
        raise ExportError("FMPy is not installed; it has the headers of the standard.", advice="pip install fmpy")
    return (Path(spec.origin).parent / "c-code" / name).read_text(encoding="utf-8")
