"""A compiled model as C sources: its file as an array, and the run-time that is the same for all models."""

from __future__ import annotations

from modelica_like.compile.compiled import CompiledDae
from modelica_like.fmi.interface import Interface
from modelica_like.fmi.model_file import as_c, model_file
from modelica_like.fmi.sources import Version, runtime_sources
from modelica_like.fmi.tables import make_tables


def generate(
    model: CompiledDae,
    interface: Interface,
    version: Version = "2.0",
    *,
    token: str,
    tolerance: float = 1e-7,
    fixed_step: float = 0.0,
) -> dict[str, str]:
    """Write all C sources of an FMU, with the model compiled in.

    Args:
        model: the compiled model.
        interface: its FMI variables.
        version: FMI version.
        token: GUID (2.0) or instantiation token (3.0) of the description.
        tolerance: relative tolerance of Co-Simulation where the importer gives none.
        fixed_step: step size of Co-Simulation in s, 0 for one that accuracy asks for.

    Returns:
        File name to text; besides C files the headers that they include.

    Raises:
        MissingStart, ContradictingStart: the start values do not determine all states.
        LanguageError: a function has no counterpart in C.
    """
    data = model_file(make_tables(model, interface.start), interface.variables, token, tolerance, fixed_step)
    return runtime_sources((version,)) | {"model_data.c": as_c(data)}
