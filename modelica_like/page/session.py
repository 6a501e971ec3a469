"""What a page asks for: changes, pictures, runs, what can be put on the sheet, and files."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from modelica_like.edit.document import Document
from modelica_like.errors import ModelicaLikeError, NetlistError
from modelica_like.language import Assembly
from modelica_like.netlist.further import thoroughly
from modelica_like.page import files
from modelica_like.page.desk import Desk, problems_of, read
from modelica_like.page.palette import palette
from modelica_like.page.runs import Runs, number
from modelica_like.show.draw.running import running
from modelica_like.show.draw.svg import svg
from modelica_like.show.report.plausible import drive_notes
from modelica_like.show.report.problems import note_problem
from modelica_like.show.report.start import start_notes
from modelica_like.simulation import build

Request = Mapping[str, Any]
_STALE = {"stale": True}


def new_file(folder: Path) -> Path:
    """Return a name for a new netlist in a folder."""
    return next(path for k in range(10_000) if not (path := folder / f"drive{k or ''}.toml").exists())


class Session:
    """The netlists that a page has open, the last model that was built, and the answers to requests.

    Args:
        drive: a netlist file, which need not exist; or an assembly.
        until: end time of runs; by default that of the netlist.
        show: names, patterns or formulas of the first curves.
        folder: for exported files.
        trusted: run the modules beside the netlist.
        autosave: write the file after each valid change.

    Raises:
        NetlistError, OSError: the file cannot be read.
    """

    def __init__(
        self, drive: Assembly | Path, until: float | str | None = None, *, show: Sequence[str] = (),
        folder: Path = Path(), trusted: bool = False, autosave: bool = False,
    ) -> None:  # fmt: skip
        self.folder, self.until, self.show, self.autosave = folder, until, tuple(show), autosave
        self._trusted = trusted
        self.desks, self.trail = dict[Path, Desk](), list[Path]()
        first = self._opened(drive) if isinstance(drive, Path) else Desk.of_drive(drive, folder)
        self.desks[first.path.resolve()] = first
        self.trail.append(first.path.resolve())
        self._building = threading.Lock()
        self._built: tuple[Desk, int, Runs] | None = None
        self._designs = 0, 1

    @property
    def desk(self) -> Desk:
        """The netlist that is shown."""
        return self.desks[self.trail[-1]]

    def _opened(self, path: Path) -> Desk:
        text = read(path)
        return Desk(Document.draft(path, text or ""), text, trusted=self._trusted, others=self._texts)

    def _texts(self) -> dict[Path, str]:
        return {path: desk.document.text for path, desk in self.desks.items() if path not in self.trail[-1:]}

    def runs(self, request: Request) -> Runs:
        """Return the model that a request means.

        Raises:
            NetlistError: the netlist has changed since.
        """
        built = self._built
        if built is None or built[0] is not self.desk or built[1] != request["revision"]:
            raise NetlistError("The netlist has changed since.")
        return built[2]

    # -- changes -----------------------------------------------------------------------------------------------------

    def state(self, request: Request) -> dict[str, Any]:
        """Return the present state."""
        return self.desk.view() | {"trail": [path.name for path in self.trail], "autosave": self.autosave}

    def _changed(self, operation: Callable[[Document], Any] | None = None) -> dict[str, Any]:
        if operation is not None:
            self.desk.change(operation)
        if self.autosave and self.desk.valid and self.desk.on_disk is not None:
            files.save(self.desk)
        return self.state({})

    def apply(self, request: Request) -> dict[str, Any]:
        """Do the operation `request`."""
        self.desk.apply(request["request"])
        return self._changed()

    def text(self, request: Request) -> dict[str, Any]:
        """Replace the text."""
        text = str(request["text"])
        return self._changed(lambda document: document.write(text))

    def undo(self, request: Request) -> dict[str, Any]:
        """Take a change back."""
        return self._changed(Document.undo)

    def redo(self, request: Request) -> dict[str, Any]:
        """Do a change again."""
        return self._changed(Document.redo)

    # -- runs --------------------------------------------------------------------------------------------------------

    def model(self, request: Request) -> dict[str, Any]:
        """Build the present netlist: what can be set and shown, or what is wrong with it."""
        desk, shown = self.desk, [str(name) for name in request["shown"]] or [*self.show]
        with self._building, desk.trusting():
            with desk.lock:
                revision, drive = desk.revision, desk.drive
                if revision != request["revision"]:
                    return _STALE
                if not desk.valid or drive is None:
                    return {"revision": revision, "problems": desk.problems, "content": None}
            try:
                runs, problems = self._build(drive)
                content = runs.content(shown)
                self._built = desk, revision, runs
            except ModelicaLikeError as error:
                content, problems = None, problems_of(error)
        return {"revision": revision, "problems": problems, "content": content}

    def _build(self, drive: Assembly) -> tuple[Runs, list[dict[str, Any]]]:
        with thoroughly(drive):
            model = build(drive)
        notes = [note_problem(drive, sentence) for sentence in (*drive_notes(drive), *start_notes(model))]
        return Runs(drive, model, self.until), notes

    def ranking(self, request: Request) -> dict[str, Any]:
        """Return what decides the final value of an output."""
        runs = self.runs(request)
        return runs.ranking(runs.values(request), number(request["until"]), str(request["output"]))

    def starts(self, request: Request) -> list[dict[str, Any]]:
        """Return the start values of the present model, with their origins."""
        return self.runs(request).starts()

    def instant(self, request: Request) -> dict[str, Any]:
        """Return the picture at a time of a run: modes and powers."""
        runs, drawn = self.runs(request), self.desk.drawn
        if drawn is None:
            return _STALE
        run = runs.solution(runs.values(request))
        time = min(max(number(request["time"]), float(run.time[0])), float(run.time[-1]))
        shown = running(drawn, run, at=time, flow=True)
        return {"picture": svg(drawn, self.desk.path.stem, background=False, handles=True, run=shown)}

    def scale(self, request: Request) -> list[tuple[float, float]]:
        """Return by which factors and offsets numbers in other units are numbers in SI units."""
        return self.runs(request).scales([(str(name), str(unit)) for name, unit in request["units"]])

    def calibrate(self, request: Request, wanted: Callable[[], bool]) -> dict[str, Any] | None:
        """Return the values that fit measured curves best; None if they are not wanted any more."""
        runs, free = self.runs(request), {str(name): (number(low), number(high)) for name, low, high in request["free"]}
        time = [number(one) for one in request["time"]]
        columns = {str(name): [math.nan if one is None else number(one) for one in column]
                   for name, column in request["columns"]}  # fmt: skip
        return runs.calibrated(runs.values(request), time, columns, free, wanted)

    def optimize(self, request: Request, wanted: Callable[[], bool]) -> dict[str, Any] | None:
        """Return the best design that the netlist asks for; None if it is not wanted any more."""
        runs = self.runs(request)
        self._designs = 0, 1

        def count(designs: int, most: int) -> None:
            self._designs = designs, most

        return runs.optimized(runs.values(request), wanted, count)

    def progress(self, request: Request) -> tuple[int, int]:
        """Return how many designs the search has tried, and about the most that it may try."""
        return self._designs

    # -- what can be put there ---------------------------------------------------------------------------------------

    def palette(self, request: Request) -> dict[str, Any]:
        """Return types that have some words."""
        return palette(self.desk.folder, str(request["words"]), self.desk.path)

    def kind(self, request: Request) -> dict[str, Any] | None:
        """Return what a part of a type, or a part inside it, can be given."""
        return self.desk.describe(str(request["kind"]), [str(name) for name in request.get("inner", ())])

    def page(self, request: Request) -> dict[str, str] | None:
        """Return the page of a component class."""
        return self.desk.page(str(request["kind"]))

    def fits(self, request: Request) -> dict[str, str]:
        """Return which ends can be joined to one."""
        return self.desk.fits(str(request["end"]))

    def copy(self, request: Request) -> str:
        """Return parts as netlist text."""
        return self.desk.copy([str(name) for name in request["names"]])

    def complete(self, request: Request) -> list[dict[str, Any]]:
        """Return words that can stand at a place of a text."""
        return self.desk.complete(str(request["text"]), int(request["offset"]))

    def explain(self, request: Request) -> str:
        """Return what is known about a word of a text."""
        return self.desk.explain(str(request["text"]), int(request["offset"]))

    # -- files -------------------------------------------------------------------------------------------------------

    def save(self, request: Request) -> dict[str, Any]:
        """Write the netlist, also by another name."""
        files.save(self.desk, request.get("name") and str(request["name"]))
        self.desks, self.trail[-1] = {**self.desks, self.desk.path.resolve(): self.desk}, self.desk.path.resolve()
        return self.state({})

    def export(self, request: Request) -> str:
        """Write the drive, with the values of the page, as another kind of file; return its path."""
        runs = self.runs(request)
        return str(files.export(runs, str(request["what"]), runs.values(request), self.folder, self.desk.path.stem))

    def watch(self, request: Request) -> dict[str, Any]:
        """Return whether there is something new: of another page, or of another editor that has written the file."""
        conflict = files.look(self.desk)
        return {"revision": self.desk.revision, "conflict": conflict, "file": self.desk.path.name}

    def take(self, request: Request) -> dict[str, Any]:
        """Decide between the text of the page and that of the file."""
        files.settle(self.desk, theirs=bool(request["theirs"]))
        return self.state({})

    def trust(self, request: Request) -> dict[str, Any]:
        """Run the modules of the folder, as long as this page is open."""
        self._trusted = self.desk.trusted = True
        self.desk.refresh()
        return self.state({})

    def open(self, request: Request) -> dict[str, Any]:
        """Show another netlist of the folder, such as one that is used as a part."""
        path = files.beside(self.desk.path, str(request["file"]).removeprefix("./"))
        key = path.resolve()
        if key in self.desk.document.pending:
            raise NetlistError(f"'{path.name}' is not written yet.", advice="Save the netlist first, and then open it.")
        if key not in self.desks:
            self.desks[key] = self._opened(path)
        self.trail.append(key)
        self.desk.refresh()
        return self.state({})

    def back(self, request: Request) -> dict[str, Any]:
        """Show the netlist again from which this one was opened."""
        if len(self.trail) > 1:
            self.trail.pop()
            self.desk.refresh()
        return self.state({})
