"""A progress bar that appears only when a run takes long."""

from __future__ import annotations

import time
from types import TracebackType
from typing import TYPE_CHECKING, Self

from rich.console import Console

from modelica_like.errors import ModelicaLikeError
from modelica_like.units import parse_unit, to_si

if TYPE_CHECKING:
    from rich.progress import Progress

_PATIENCE = 0.5
_INTERVAL = 0.1


class _LateBar:
    """A bar on a terminal that appears when its patience is over."""

    def __init__(self, title: str, console: Console | None) -> None:
        self._title = title
        self._console = Console(stderr=True) if console is None else console
        self._next = time.perf_counter() + _PATIENCE
        self._progress: Progress | None = None

    def __enter__(self) -> Self:
        return self

    def _show(self, reached: float, end: float) -> None:
        now = time.perf_counter()
        if now < self._next or end <= 0 or not self._console.is_terminal:
            return
        self._next = now + _INTERVAL
        if self._progress is None:
            from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

            columns = (
                TextColumn("{task.description}"),
                BarColumn(),
                TextColumn("{task.percentage:>3.0f} %"),
                TimeRemainingColumn(),
            )
            self._progress = Progress(*columns, console=self._console, transient=True)
            self._progress.add_task(self._title, total=end)
            self._progress.start()
        self._progress.update(self._progress.task_ids[0], completed=reached)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._progress is not None:
            self._progress.stop()


class Bar(_LateBar):
    """Shows how far a simulation has come; to be used as its `progress`.

    Args:
        until: end time, a number in s or a quantity; what cannot be read is left to the simulation to tell.
        console: where to show it, by default stderr; a console that is no terminal gets nothing.
    """

    def __init__(self, until: float | str | None, console: Console | None = None) -> None:
        super().__init__("simulating", console)
        try:
            self._end = to_si(until, parse_unit("s"), "until")
        except ModelicaLikeError:
            self._end = 0.0

    def __call__(self, reached: float) -> None:
        """Note the time reached, in s."""
        self._show(reached, self._end)


class RunsBar(_LateBar):
    """Shows how many runs of a sweep are done; to be used as its `progress`.

    Args:
        console: where to show it, by default stderr; a console that is no terminal gets nothing.
    """

    def __init__(self, console: Console | None = None) -> None:
        super().__init__("runs", console)

    def __call__(self, done: int, total: int) -> None:
        """Note how many are done."""
        self._show(done, total)
