"""A progress bar that appears only for long runs."""

from __future__ import annotations

import time
from importlib import import_module
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from rich.console import Console

from modelica_like.arguments import checked
from modelica_like.errors import ModelicaLikeError
from modelica_like.language.units import parse_unit, to_si

if TYPE_CHECKING:
    from rich.progress import Progress

_PATIENCE = 0.5
_INTERVAL = 0.1


class Bar:
    """A bar on a terminal or in a notebook that appears after a delay, for the argument `progress`.

    Args:
        until: end time, a number in s or a quantity; the simulation reports an invalid one. None if the end comes with
            the progress.
        console: by default stderr; nothing is shown if it is neither a terminal nor a notebook.
        title: text before it.
    """

    @checked
    def __init__(
        self, until: float | str | None = None, console: Console | None = None, title: str = "simulating"
    ) -> None:
        self._title = title
        self._console = Console(stderr=True) if console is None else console
        self._next = time.perf_counter() + _PATIENCE
        self._progress: Progress | None = None
        self._cell: Any = None
        try:
            self._end = to_si(until, parse_unit("s"), "until")
        except ModelicaLikeError:
            self._end = 0.0

    def __enter__(self) -> Self:
        return self

    def __call__(self, reached: float, end: float | None = None) -> None:
        """Show the time in s, or the number of runs, that is reached."""
        end = self._end if end is None else end
        now = time.perf_counter()
        console = self._console
        if now < self._next or end <= 0 or not (console.is_terminal or console.is_jupyter):
            return
        self._next = now + _INTERVAL
        if console.is_jupyter:
            self._in_notebook(f'{self._title} <progress value="{reached}" max="{end}"></progress> {reached / end:.0%}')
            return
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

    def _in_notebook(self, text: str) -> None:
        """Show a text in the notebook, in the place of the last one."""
        notebook = import_module("IPython.display")  # a notebook has it
        if self._cell is None:
            self._cell = notebook.display(notebook.HTML(text), display_id=True)
        else:
            self._cell.update(notebook.HTML(text))

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._cell is not None:
            self._in_notebook("")
        if self._progress is not None:
            self._progress.stop()
