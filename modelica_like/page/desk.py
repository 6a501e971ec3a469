"""One netlist that is being edited: its text with undo, its picture, its problems, and what its parts can be given."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from modelica_like.edit.document import Document
from modelica_like.edit.saving import rewritten
from modelica_like.edit.sheet import Sheet
from modelica_like.edit.suggested import title
from modelica_like.edit.wires import misfits
from modelica_like.errors import ModelicaLikeError, NetlistError, UntrustedModule
from modelica_like.language import Assembly
from modelica_like.language.inside import inside
from modelica_like.lsp import answers
from modelica_like.lsp.names import Names
from modelica_like.lsp.text import Text
from modelica_like.netlist.document import read_text
from modelica_like.netlist.read import load_thoroughly
from modelica_like.netlist.registry import library_types
from modelica_like.netlist.write import dumps
from modelica_like.page.palette import class_page, described, described_type
from modelica_like.page.placing import copied, pasted, placed
from modelica_like.show.draw.diagram import diagram
from modelica_like.show.draw.sheet import Sheet as Drawn
from modelica_like.show.draw.sheet import sheet as draw
from modelica_like.show.draw.svg import svg
from modelica_like.trust import trusting


def read(path: Path) -> str | None:
    """Return the text of a netlist; None if there is no file.

    Raises:
        NetlistError: it cannot be read.
    """
    return read_text(path, as_written=True) if path.exists() else None


Changed = Callable[[Document], Document]


class Desk:
    """A netlist with all that a page shows of it.

    Args:
        document: its text.
        on_disk: what the file has, None if there is none.
        trusted: run the modules of its folder.
        others: texts of other netlists that are being edited, by absolute path.

    Attributes:
        revision: counts the changes.
        drive: the assembly of the last valid text; None before there is one.
        valid: whether that is the present text.
        drawn: its schematic.
        problems: of the present text, as data for JSON.
    """

    def __init__(
        self, document: Document, on_disk: str | None, *, trusted: bool = False,
        others: Callable[[], Mapping[Path, str]] = dict,
    ) -> None:  # fmt: skip
        self.document, self.on_disk, self.trusted, self.others = document, on_disk, trusted, others
        self.lock = threading.RLock()
        self.revision, self.valid = 0, False
        self.drive: Assembly | None = None
        self.drawn: Drawn | None = None
        self.problems: list[dict[str, Any]] = []
        self.data: dict[str, Any] = {}
        self._picture = ""
        self._fixed = False
        self.refresh()

    @classmethod
    def of_drive(cls, drive: Assembly, folder: Path) -> Desk:
        """Return a desk for a drive; one that no netlist can contain is shown, and not changed.

        Args:
            drive: it may have been read from a file and changed since.
            folder: of the netlist, if it comes from none.
        """
        origin = Path(inside(drive).origin or folder / f"{drive.label}.toml")
        path = origin.with_suffix(".toml")
        try:
            kept = rewritten(drive, path) if inside(drive).text and origin == path else None
            text = kept or dumps(drive, folder=path.parent)
        except NetlistError as error:
            text = f"# {error.what}\n"
        desk = cls(Document.draft(path, text), read(path) if origin == path else None)
        if desk.drive is None:
            desk._fixed, desk.drive, desk.valid, desk.problems = True, drive, True, []
            desk._draw(drive)
        return desk

    @property
    def path(self) -> Path:
        """The file."""
        return self.document.path

    @property
    def folder(self) -> Path:
        """Its folder."""
        return self.path.resolve().parent

    @property
    def is_saved(self) -> bool:
        """Whether the file has the present text."""
        return self.document.text == (self.on_disk or "") and not self.document.pending

    def trusting(self) -> AbstractContextManager[None]:
        """Run the modules of the folder, if it is trusted."""
        home = self.folder
        return trusting(lambda folder: folder == home) if self.trusted else nullcontext()

    # -- changes -----------------------------------------------------------------------------------------------------

    def change(self, operation: Changed) -> None:
        """Change the document, and what is derived from it.

        Raises:
            ModelicaLikeError: the change is refused; then everything is as before.
        """
        with self.lock, self.trusting():
            if self._fixed:
                raise NetlistError("This drive was made in Python, and no netlist can contain it.")
            operation(self.document)
            self.refresh()

    def apply(self, request: Mapping[str, Any]) -> None:
        """Do an operation, several together (`together`), or one that a hand means: `place`, `paste`."""
        kind, sheet = request.get("op"), Sheet(self.document.text, str(self.path), self._texts())
        with self.trusting():
            if kind == "place":
                part = {key: request[key] for key in ("name", "kind", "values") if key in request}
                requests = placed(sheet, part, request.get("at") or {})
            elif kind == "paste":
                requests = pasted(sheet, str(request["text"]))
            else:
                requests = request["steps"] if kind == "together" else [request]
        self.change(lambda document: document.together(requests))

    def _texts(self) -> dict[Path, str]:
        return {**self.document.pending, **self.others()}

    def refresh(self) -> None:
        """Read the present text; what is not valid leaves the last valid picture."""
        self.revision += 1
        text = self.document.text
        self.problems, self.valid = [], True
        try:
            with self.trusting():
                self.data = Sheet(text, str(self.path)).data
                if self.data.get("parts"):
                    self.drive = load_thoroughly(self.path, text, self._texts())
                    self._draw(self.drive)
                else:
                    self.drive, self.drawn, self._picture = None, None, ""
        except ModelicaLikeError as error:
            self.valid = False
            self.problems = problems_of(error)
            if any(isinstance(problem, UntrustedModule) for problem in error.problems()):
                self.problems[0]["kind"] = UntrustedModule.__name__

    def _draw(self, drive: Assembly) -> None:
        before = {part.node.name: part.at[1] for part in self.drawn.parts} if self.drawn else None
        self.drawn = draw(diagram(drive, 0, open_ends=True), before)
        self._picture = svg(self.drawn, drive.label, background=False, handles=True)

    # -- answers -----------------------------------------------------------------------------------------------------

    def view(self) -> dict[str, Any]:
        """Return all that a page shows of the netlist, without runs."""
        with self.lock:
            behind, ahead = self.document.steps
            return {
                "revision": self.revision, "file": self.path.name, "folder": str(self.folder),
                "text": self.document.text, "saved": self.is_saved, "exists": self.on_disk is not None,
                "undo": behind, "redo": ahead,
                "valid": self.valid, "picture": self._picture, "problems": self.problems, "data": self.data,
                "notes": list(self.document.notes), "fixed": self._fixed, "trusted": self.trusted,
                "new": [file.name for file in self.document.pending],
            }  # fmt: skip

    def fits(self, end: str) -> dict[str, str]:
        """Return which ends can be joined to one, and why not; see `misfits`."""
        with self.trusting():
            return misfits(Sheet(self.document.text, str(self.path), self._texts()), end)

    def copy(self, names: Sequence[str]) -> str:
        """Return parts as netlist text; see `copied`."""
        return copied(Sheet(self.document.text, str(self.path)), names)

    def describe(self, kind: str, inner: Sequence[str] = ()) -> dict[str, Any] | None:
        """Return what a part of a type can be given; None if there is no such type.

        Args:
            kind: the type.
            inner: names that lead to a part inside, which is described instead.
        """
        if kind in library_types() and not inner:
            return described_type(kind)
        with self.trusting():
            owner = Names(Text(self.path, self.document.text)).type(kind)
        for name in inner:
            owner = owner.inner(name) if owner else None
        return described(owner) if owner else None

    def page(self, kind: str) -> dict[str, str] | None:
        """Return the page of a component class; None if there is none of that name."""
        with self.trusting():
            owner = Names(Text(self.path, self.document.text)).type(kind)
            return class_page(owner.kind) if owner and not issubclass(owner.kind, Assembly) else None

    def complete(self, text: str, offset: int) -> list[dict[str, Any]]:
        """Return the words that can stand at a place of a text, as `lsp` answers them."""
        with self.trusting():
            items = answers.complete(Text(self.path, text), offset)
        return [
            {"label": item.word.label, "about": item.word.about, "span": item.span, "text": item.text} for item in items
        ]

    def explain(self, text: str, offset: int) -> str:
        """Return what is known about the word at a place of a text, or nothing."""
        with self.trusting():
            answer = answers.explain(Text(self.path, text), offset)
        return answer[0] if answer else ""


def problems_of(error: ModelicaLikeError) -> list[dict[str, Any]]:
    """Return problems as data, with the words on the button of those that have a suggestion (`fix`)."""
    problems = [problem.as_json() for problem in error.problems()]
    return [problem | ({"fix": title(told)} if (told := problem.get("suggestion")) else {}) for problem in problems]
