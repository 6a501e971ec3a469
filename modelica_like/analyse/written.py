"""What a netlist says about its own analysis, and where."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import ModelicaLikeError
from modelica_like.language import Assembly, Component


@contextmanager
def placed(drive: Component | CompiledDae, key: str) -> Iterator[None]:
    """Add the line of a section's entry, such as `optimize.free`, to an error without a place."""
    try:
        yield
    except ModelicaLikeError as error:
        source = drive.source_of(key) if isinstance(drive, Assembly) else None
        error.where = error.where or ((source,) if source is not None and source.file else ())
        raise
