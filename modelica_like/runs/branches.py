"""Variables of a run by attributes: `run.clutch.tau`, with completion in notebooks."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from modelica_like.errors import did_you_mean

if TYPE_CHECKING:
    from modelica_like.runs.trajectories import Trajectories


class Branch:
    """Variables of a run below a path.

    Args:
        run: the run.
        path: path of a part.
    """

    def __init__(self, run: Trajectories, path: str) -> None:
        self._run, self._path = run, path

    def __getattr__(self, name: str) -> Any:
        return member(self._run, f"{self._path}.{name}")

    def __dir__(self) -> list[str]:
        return next_names(self._run.names, f"{self._path}.")

    def __repr__(self) -> str:
        return f"<{self._path}: {', '.join(dir(self))}>"


def member(run: Trajectories, path: str) -> Any:
    """Return a variable, shape (n,), or what is below a part.

    Raises:
        AttributeError: there is no such path.
    """
    if path in run.names:
        return run[path]
    if next_names(run.names, f"{path}."):
        return Branch(run, path)
    before, dot, name = path.rpartition(".")
    near = did_you_mean(name, next_names(run.names, before + dot))
    raise AttributeError(f"The run of {run.model.name} has no '{path}'{near or '.'}")


def next_names(names: Iterable[str], before: str) -> list[str]:
    """Return the words that follow the beginning of a path, each once."""
    after = (name.removeprefix(before) for name in names if name.startswith(before))
    return [*dict.fromkeys(word for name in after if (word := name.partition(".")[0]).isidentifier())]
