"""Systems from whatever describes them: a system file, an SSP, or a netlist with FMUs as parts."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from modelica_like.cosimulation.files import read_system, read_toml
from modelica_like.cosimulation.system import System
from modelica_like.netlist.read import FMU_PART


def load_system(path: Path, work: Path) -> System:
    """Read a system: a TOML file, an SSP, or a netlist with FMUs as parts.

    Args:
        path: the file.
        work: an empty folder for what has to be unpacked or exported.

    Raises:
        NetlistError, UnknownName: it is none of these, or something in it is wrong.
        FmuRefused: an SSP is not sound.
        ModelicaLikeError: the netlist's own parts cannot be exported.
    """
    if path.suffix.lower() == ".ssp":
        from modelica_like.cosimulation.ssp import load_ssp

        return load_ssp(path, work)
    data, lines = read_toml(path)
    if "fmus" not in data and "parts" in data:
        from modelica_like.cosimulation.fmu_parts import system_of_netlist

        return system_of_netlist(path, work)
    return read_system(data, lines, path)


def describes_system(path: Path) -> bool:
    """Return whether a file describes FMUs that run together, and not a netlist that is simulated.

    Raises:
        NetlistError: it is not TOML, or does not exist.
    """
    if path.suffix.lower() == ".ssp":
        return True
    data, _ = read_toml(path)
    parts = data.get("parts")
    parts = parts.values() if isinstance(parts, dict) else ()
    return "fmus" in data or any(isinstance(part, dict) and part.get("is") == FMU_PART for part in parts)


@contextmanager
def opened(path: Path) -> Iterator[System]:
    """Open a system, and keep what had to be unpacked for it as long as it is needed; see `load_system`."""
    with tempfile.TemporaryDirectory(prefix="modelica_like_", ignore_cleanup_errors=True) as work:
        yield load_system(path, Path(work))
