"""Output of commands from a complete or partial run: report, table, pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from modelica_like.cli.shared import Page, warn
from modelica_like.errors import DEFECTS, Interrupted, ModelicaLikeError, SolveError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from modelica_like.runs.trajectories import Trajectories

Picture = tuple[Path | None, "Callable[[Trajectories], Figure]"]


class Outcome:
    """Makes the outputs of a run one by one; a failing output is a warning, because the run is still valid.

    Args:
        run: starts the run.
        debug: raise instead of warning.
    """

    def __init__(self, run: Callable[[], Trajectories], *, debug: bool) -> None:
        self._debug = debug
        self._written: list[str] = []
        self._unwritten: OSError | None = None
        self.stopped: SolveError | Interrupted | None = None
        try:
            self.solution = run()
        except (SolveError, Interrupted) as error:
            if error.run is None:
                raise
            self.stopped, self.solution = error, error.run

    def attempt(self, what: str, make: Callable[[], object], file: Path | None = None) -> bool:
        """Make one output, and its file; False if it failed."""
        try:
            make()
        except OSError as error:
            self._unwritten = self._unwritten or error
        except (ModelicaLikeError, *DEFECTS) as error:
            if self._debug:
                raise
            warn(f"{what} could not be made: {str(error) or type(error).__name__}")
        else:
            self._written += [str(file)] if file else []
            return True
        return False

    def write(
        self, table: Path | None, *, units: bool, pictures: Sequence[Picture],
        display: Mapping[str, str] | None = None, show: Sequence[str] = (),
    ) -> None:  # fmt: skip
        """Write the requested files.

        Raises:
            SolveError, KeyboardInterrupt: the run has stopped; a note lists the files.
            OSError: a file could not be written; the others were.
        """
        if table:
            from modelica_like.show.report.files import write_solution

            options: Any = {"units": units, "display": display, "show": show}
            self.attempt("The table", lambda: write_solution(self.solution, table, **options), table)
        for file, draw in pictures:
            if file:
                self.attempt(f"The picture {file.name}", lambda file=file, draw=draw: self._draw(file, draw), file)
        if self.stopped is not None:
            files = ", ".join(self._written)
            kept = f"are in {files}" if files else "are lost: neither --csv nor --plot is given"
            self.stopped.add_note(f"The results up to t = {self.solution.time[-1]:.6g} s {kept}.")
            raise self.stopped
        if self._unwritten is not None:
            raise self._unwritten

    def _draw(self, file: Path, draw: Callable[[Trajectories], Figure]) -> None:
        from modelica_like.show.plot import save_plot

        save_plot(draw(self.solution), file)

    def tell(self, report: Callable[[Any], Any], page: Page) -> None:
        """Print a report."""
        self.attempt("The report", lambda: page.print(report(self.solution)))
