"""What else is wrong with a drive that has an error: as far as the one does not follow from the other."""

from __future__ import annotations

from collections.abc import Collection, Generator, Set
from contextlib import contextmanager

from modelica_like.errors import (
    FreeFlange,
    MissingInput,
    MissingValue,
    ModelicaLikeError,
    UnknownName,
    WrongConnection,
    raise_together_or_one,
)
from modelica_like.language import Assembly
from modelica_like.language.assembly import refused_wiring


@contextmanager
def thoroughly(drive: Assembly) -> Generator[None]:
    """Tell an error inside with all others that the drive has.

    Args:
        drive: is no longer of use after an error.

    Raises:
        ModelicaLikeError: several errors come as `WiringErrors`.
    """
    try:
        yield
    except ModelicaLikeError as error:
        told = {str(problem) for problem in error.problems()}
        others = [other for other in further(drive, (), frozenset()) if str(other) not in told]
        if not others:
            raise
        raise raise_together_or_one([*error.problems(), *others]) from None


def further(drive: Assembly, broken: Collection[str], refused: Set[str]) -> list[ModelicaLikeError]:
    """Return the errors of connections, and of values that are missing.

    Args:
        drive: loses the connections that have errors or name broken parts.
        broken: names of parts that it should have.
        refused: paths of values that it should have; `part.*` if it is not clear which.
    """
    from modelica_like.flatten.flatten import flatten  # most netlists have no errors

    errors, cut = refused_wiring(drive, broken)
    cut = cut or bool(broken)
    try:
        flatten(drive)
    except ModelicaLikeError as error:
        errors += (problem for problem in error.problems() if _is_independent(problem, refused, cut=cut))
    return errors


def head(path: str) -> str:
    """Return the name of the part in which a path begins."""
    return path.partition(".")[0].partition("[")[0]


def _is_independent(error: ModelicaLikeError, refused: Set[str], *, cut: bool) -> bool:
    """Tell whether an error cannot be the consequence of a connection or a value that is left out."""
    if isinstance(error, MissingValue) and not isinstance(error, MissingInput) and error.operation:
        path = error.operation["path"]
        return refused.isdisjoint({path, f"{path.rpartition('.')[0]}.*"})
    if isinstance(error, UnknownName):
        return head(error.word) not in refused
    if isinstance(error, FreeFlange | MissingValue):
        return not cut
    return isinstance(error, WrongConnection) or not (cut or refused)
