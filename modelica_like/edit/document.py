"""A netlist that is edited: operations by name, undone and done again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, Self

from modelica_like.arguments import check_names, checked
from modelica_like.edit import grouping, suggested, values, wires
from modelica_like.edit.sheet import Sheet
from modelica_like.errors import DuplicateName, ModelicaLikeError, NetlistError, UnknownName, did_you_mean
from modelica_like.flatten import flatten
from modelica_like.netlist.document import parse, read_text
from modelica_like.netlist.read import assemble
from modelica_like.trust import trusting
from modelica_like.writing import write_text

_P = ParamSpec("_P")
_Operation = Callable[Concatenate[Sheet, _P], None]
OPERATIONS: Mapping[str, Callable[..., None]] = {
    "add": values.add, "insert": wires.insert, "connect": wires.connect, "disconnect": wires.disconnect,
    "remove": wires.remove, "rename": wires.rename, "replace": values.replace, "set": values.set,
    "unset": values.unset, "duplicate": values.duplicate, "group": grouping.group,
}  # fmt: skip
_SUGGESTED: Mapping[str, Callable[..., None]] = {
    "replace": suggested.respell, "set": suggested.give, "free": suggested.free, "connect": wires.connect,
    "insert": wires.insert,
}  # fmt: skip
"""By the `operation` of a suggestion."""


@dataclass(frozen=True)
class Edited:
    """The result of an operation.

    Attributes:
        text: of the netlist.
        notes: sentences about what goes besides, or still uses what has gone.
        files: texts of netlists that are new, by absolute path.
    """

    text: str
    notes: tuple[str, ...] = ()
    files: Mapping[Path, str] = field(default_factory=dict[Path, str])


@checked
def apply(
    text: str, request: Mapping[str, Any], *, file: str | Path = "netlist.toml", files: Mapping[Path, str] | None = None
) -> Edited:
    """Do an operation on the text of a netlist.

    Args:
        text: TOML.
        request: name of the operation as `op`, and its arguments: `{"op": "connect", "first": "a.y", "second": "b.u"}`;
            or the suggestion of a problem, to whose `set` a `value` is added.
        file: path of the netlist; netlists and modules used as parts are searched in its folder.
        files: texts of netlists that are not written yet, by absolute path.

    Raises:
        UnknownName: there is no such operation or argument.
        NetlistError: an argument is missing, or the text is not TOML.
        ModelicaLikeError: the operation is refused.
    """
    arguments = dict(request)
    is_suggested = "op" not in arguments and "operation" in arguments
    if is_suggested:
        arguments.pop("file", None)
    name, known = arguments.pop("operation" if is_suggested else "op", None), _SUGGESTED if is_suggested else OPERATIONS
    operation = known.get(name) if isinstance(name, str) else None
    if operation is None:
        names = ", ".join(known)
        raise UnknownName(f"There is no operation '{name}'{did_you_mean(name, known) or '.'} There are {names}.")
    check_names(name, operation, arguments)
    return _do(text, file, files or {}, operation, **arguments)


def _do(
    text: str, file: str | Path, files: Mapping[Path, str], operation: Callable[..., None], /, *args: Any, **more: Any
) -> Edited:
    sheet = Sheet(text, str(file), files)
    operation(sheet, *args, **more)
    return Edited(sheet.text, tuple(sheet.notes), sheet.files)


def on_text(operation: _Operation[_P]) -> Callable[Concatenate[str, _P], str]:
    """Return an operation as a function from text to text."""

    def function(text: str, /, *args: _P.args, **kwargs: _P.kwargs) -> str:
        return _do(text, "netlist.toml", {}, operation, *args, **kwargs).text

    function.__name__, function.__doc__ = operation.__name__, operation.__doc__
    return function


def _method(operation: _Operation[_P]) -> Callable[Concatenate[Document, _P], Document]:
    def method(document: Document, /, *args: _P.args, **kwargs: _P.kwargs) -> Document:
        return document._done(operation, *args, **kwargs)

    method.__name__, method.__doc__ = operation.__name__, operation.__doc__
    return method


class Document:
    """A netlist file that is edited; every operation returns the document itself.

    Args:
        path: of the file.
        trust: run Python modules beside it, as in `load`.

    Raises:
        NetlistError: it cannot be read, or is not TOML.
    """

    @checked
    def __init__(self, path: str | Path, *, trust: bool = False) -> None:
        text = read_text(Path(path), as_written=True)
        _ = Sheet(text, str(path)).data
        self._begin(Path(path), text, trust)

    @classmethod
    def new(cls, path: str | Path, *, trust: bool = False) -> Self:
        """Begin an empty netlist.

        Args:
            path: of the file, which `save` writes.
            trust: as in `load`.

        Raises:
            DuplicateName: it exists already.
        """
        if Path(path).exists():
            raise DuplicateName(f"'{path}' exists already.", advice=f'Open it: Document("{path}").')
        return cls.draft(path, trust=trust)

    @classmethod
    @checked
    def draft(cls, path: str | Path, text: str = "", *, trust: bool = False) -> Self:
        """Begin with a text that is being written: it need not be TOML, and no file is read.

        Args:
            path: of the file, which `save` writes.
            text: of the netlist.
            trust: as in `load`.
        """
        document = cls.__new__(cls)
        document._begin(Path(path), text, trust)
        return document

    def _begin(self, path: Path, text: str, trust: bool) -> None:
        self.path, self._trust = path, trust
        self._states, self._at = [Edited(text)], 0
        self._written: dict[Path, str] = {}

    add = _method(values.add)
    insert = _method(wires.insert)
    connect = _method(wires.connect)
    disconnect = _method(wires.disconnect)
    remove = _method(wires.remove)
    rename = _method(wires.rename)
    replace = _method(values.replace)
    set = _method(values.set)
    unset = _method(values.unset)
    duplicate = _method(values.duplicate)
    group = _method(grouping.group)

    def apply(self, request: Mapping[str, Any]) -> Document:
        """Do an operation by its name; see `modelica_like.edit.apply`."""
        state = self.state
        with self._trusting():
            return self._keep(apply(state.text, request, file=self.path, files=self.pending))

    @checked
    def together(self, requests: Sequence[Mapping[str, Any]]) -> Document:
        """Do several operations by their names as one, which is undone as one; see `modelica_like.edit.apply`."""
        state, notes = Edited(self.text, (), self.pending), list[str]()
        with self._trusting():
            for request in requests:
                state = apply(state.text, request, file=self.path, files=state.files)
                notes += state.notes
        return self._keep(Edited(state.text, tuple(notes), state.files))

    @checked
    def write(self, text: str) -> Document:
        """Replace the whole text by one that was typed; it need not be TOML."""
        return self._keep(Edited(text, (), self.pending))

    def _done(self, operation: Callable[..., None], *args: Any, **kwargs: Any) -> Document:
        state = self.state
        with self._trusting():
            return self._keep(_do(state.text, self.path, self.pending, operation, *args, **kwargs))

    def _keep(self, state: Edited) -> Document:
        self._at += 1
        self._states[self._at :] = [state]
        return self

    def _trusting(self) -> Any:
        return trusting() if self._trust else nullcontext()

    @property
    def state(self) -> Edited:
        """The text as it is now, what the last operation has to say, and netlists that are to be written."""
        return self._states[self._at]

    @property
    def pending(self) -> Mapping[Path, str]:
        """Texts of netlists that `group` has made and `save` has not written yet, by absolute path."""
        files = self.state.files.items()
        return {file: text for file, text in files if self._written.get(file) != text}

    @property
    def text(self) -> str:
        """The text as it is now."""
        return self.state.text

    @property
    def notes(self) -> tuple[str, ...]:
        """What the last operation has to say."""
        return self.state.notes

    @property
    def steps(self) -> tuple[int, int]:
        """How many operations can be taken back, and how many done again."""
        return self._at, len(self._states) - 1 - self._at

    def undo(self) -> Document:
        """Take the last operation back.

        Raises:
            NetlistError: there is none.
        """
        return self._step(-1, "undo")

    def redo(self) -> Document:
        """Do the operation again that was taken back last.

        Raises:
            NetlistError: there is none.
        """
        return self._step(1, "redo")

    def _step(self, step: int, what: str) -> Document:
        if not 0 <= self._at + step < len(self._states):
            raise NetlistError(f"There is nothing to {what}.")
        self._at += step
        return self

    def problems(self) -> list[ModelicaLikeError]:
        """Return the errors of the present text, of its parts and its connections; none if it is a drive."""
        try:
            with self._trusting():
                flatten(assemble(parse(self.text, str(self.path)), self.path, self.pending))
        except ModelicaLikeError as error:
            return list(getattr(error, "errors", [error]))
        return []

    def save(self, path: str | Path | None = None) -> Document:
        """Write the netlist, and netlists that `group` made, each completely or not at all.

        Args:
            path: of another file in the same folder, which the document then is.

        Raises:
            NetlistError: the file is in another folder, where the netlist's own files are not.
            DuplicateName: a new netlist exists already, with another text.
            OSError: it cannot be written.
        """
        target = Path(path or self.path)
        if target.resolve().parent != self.path.resolve().parent:
            advice = "Use `save(load(…), path)` of modelica_like.netlist, which names its files anew."
            raise NetlistError(f"'{target}' is in another folder than '{self.path}'.", advice=advice)
        for file, text in self.pending.items():
            if file.exists() and read_text(file, as_written=True) != text:
                raise DuplicateName(f"'{file}' exists already.", advice="Undo the grouping and name another file.")
            write_text(file, text)
            self._written[file] = text
        write_text(target, self.text)
        self.path = target
        return self
