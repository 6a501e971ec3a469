"""Finding classes by name: in the file, in the package around it, in the standard library's table."""

from __future__ import annotations

import os
import re
from collections.abc import Generator, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from modelica_like.errors import ModelicaTextError
from modelica_like.netlist.document import read_text
from modelica_like.netlist.modelica.library import Known, built_in, known_classes, table
from modelica_like.netlist.modelica.parse import parse_modelica
from modelica_like.netlist.modelica.tree import ClassText, Extends, Import

BASIC = ("Real", "Integer", "Boolean", "String", "StateSelect")
_SI = ("SI", "SIunits")
_MOST_STEPS = 1_000_000
"""Of about 10 microseconds; 10,000 parts of own classes, or 100,000 equations."""
_KEPT_FILES = 3_000
"""Files whose classes are kept by their text: the standard library has 2,555."""
_SUBSCRIPT = re.compile(r"\[[^]]*\]")
_libraries: ContextVar[tuple[Path, ...]] = ContextVar("libraries", default=())
Found = ClassText | Known | str
"""A class with its text, one with a component, or the name of a basic type or a connector of the standard library."""


def with_libraries(places: Sequence[str | Path]) -> AbstractContextManager[None]:
    """Read all texts inside with libraries of classes.

    Args:
        places: a package's folder or file each, or a folder of packages; the first wins, and all win over those that
            are given outside.

    Raises:
        ModelicaTextError: one of them is not there.
    """
    for place in places:
        if not str(place) or not Path(place).exists():  # an empty path is the present folder
            raise ModelicaTextError(
                f"There is no library of Modelica text at '{place}'.",
                advice="Name a package's folder or file, or a folder with packages.",
            )
    return _known(places)


@contextmanager
def _known(places: Sequence[str | Path]) -> Generator[None]:
    token = _libraries.set((*map(Path, places), *_libraries.get()))
    try:
        yield
    finally:
        _libraries.reset(token)


def given_libraries() -> tuple[Path, ...]:
    """Return the libraries of `with_libraries`."""
    return _libraries.get()


class Classes:
    """The classes that a file can name.

    Args:
        file: a `.mo` file; its package's other files are found beside it, by its `within`. Libraries are those of
            `with_libraries`, then those of the variable MODELICAPATH of the environment.
        table: whether components stand for classes of the standard library.

    Raises:
        NetlistError: the file cannot be read.
        ModelicaTextError: it is not Modelica.
    """

    def __init__(self, file: Path, *, table: bool = True) -> None:
        self.file = file
        self.table = table
        self.own = _parsed(file)
        within = self.own[0].within.split(".") if self.own[0].within else []
        # package.mo is the class of its folder.
        above = len(within) + (file.name == "package.mo")
        around = [file.resolve().parents[above]] if above and above < len(file.resolve().parents) else []
        everywhere = filter(None, os.environ.get("MODELICAPATH", "").split(os.pathsep))
        self.places = (*around, *_libraries.get(), *map(Path, everywhere))
        self.tops: dict[str, ClassText | None] = {}
        self.open: set[tuple[int, str]] = set()
        self.found: dict[tuple[int, str], Found | None] = {}
        self.inherited: dict[tuple[int, int], ClassText] = {}
        self.holders: dict[int, Any] = {}
        self.drawn: dict[tuple[int, ...], Any] = {}
        self.steps = 0
        self.lacking: dict[str, str] = {}
        self.untabled: set[str] = set()
        self.missing: dict[str, Any] = {}
        self.only_said = False

    @contextmanager
    def saying(self) -> Generator[None]:
        """Read values that only describe, such as units and limits: parameters in them may change afterwards."""
        before, self.only_said = self.only_said, True
        try:
            yield
        finally:
            self.only_said = before

    def chosen(self, name: str = "") -> ClassText:
        """Return the class to read: the one of this name, or the last model of the file.

        Raises:
            ModelicaTextError: there is none.
        """
        every = [inner for outer in self.own for inner in outer.walk()]
        models = [c for c in every if c.kind in ("model", "block", "class") and not c.partial]
        outermost = [model for model in models if model.owner is None] or models
        matches = (
            [candidate for candidate in every if candidate.path == name or candidate.name == name]
            if name
            else outermost[-1:]
        )
        elsewhere = self.text_of(name) if name and not matches else None
        if elsewhere is not None:
            return elsewhere
        if not matches:
            names = ", ".join(model.name for model in models) or "none"
            what = f"no class '{name}'" if name else "no model"
            raise ModelicaTextError(f"'{self.file.name}' has {what}. Its models: {names}.", where=self.own[0].place(1))
        return matches[0]

    @property
    def spent(self) -> bool:
        """Whether reading has taken all the steps it may."""
        return self.steps > _MOST_STEPS

    def spend(self, steps: int, text: ClassText, line: int) -> None:
        """Count what reading takes: 10 for a statement, 50 for a part, 5 for a step of an algorithm.

        Raises:
            ModelicaTextError: loops, arrays or classes within classes make too many of them.
        """
        self.steps += steps
        if self.spent:
            raise ModelicaTextError(
                f"The text has too many parts and equations: reading it takes more than {_MOST_STEPS} steps.",
                where=text.place(line),
                advice="Look for loops and arrays that are longer than meant, and for classes that contain each other.",
            )

    def find(self, name: str, scope: ClassText) -> Found | None:
        """Return the class that a name means inside a class."""
        if name in BASIC:
            return name
        key = id(scope), name
        if key not in self.found:
            own = scope.inherits and name == scope.name and scope.owner is not None
            self.found[key] = self._inherited(scope.owner, name) if own and scope.owner else self._found(name, scope)
        return self.found[key]

    def _found(self, name: str, scope: ClassText) -> Found | None:
        head, _, rest = name.partition(".")
        if not head:
            return self.full(rest)
        level: ClassText | None = scope
        outermost = scope
        while level is not None:
            class_text = (
                (self.inside(level.heir, name) if level.heir is not None else None)
                or self.inside(level, name)
                or self._imported(level, head, rest)
                or self.tabled(f"{level.path}.{name}")
            )
            if class_text is not None:
                return class_text
            outermost, level = level, level.owner
        package = outermost.within
        while package:
            around = self.full(package)
            class_text = self.full(f"{package}.{name}") or (
                self._imported(around, head, rest) if isinstance(around, ClassText) else None
            )
            if class_text is not None:
                return class_text
            package = package.rpartition(".")[0]
        return self.full(f"Modelica.Units.SI.{rest}" if head in _SI else name)

    def lineage(self, text: ClassText) -> Iterator[ClassText | Known]:
        """Yield a class and its bases."""
        yield text
        for base in [*(e for e in text.elements if isinstance(e, Extends)), *([text.short] if text.short else [])]:
            kind = self.find(base.base, text.owner or text if base is text.short else text)
            if isinstance(kind, ClassText) and kind is not text:
                yield from self.lineage(kind)
            elif isinstance(kind, Known):
                yield kind

    def around(self, text: ClassText) -> ClassText | None:
        """Return the class that encloses another one, which may have a file of its own."""
        outer = text.owner or (self.full(text.within) if text.within else None)
        return outer if isinstance(outer, ClassText) else None

    def _imported(self, level: ClassText, head: str, rest: str) -> Found | None:
        after = f".{rest}" if rest else ""
        for element in level.elements:
            if not isinstance(element, Import):
                continue
            if not element.names and element.alias == head:
                return self.full(element.path + after)
            if head in element.names or "*" in element.names:
                class_text = self.full(f"{element.path}.{head}{after}")
                if class_text is not None:
                    return class_text
        return None

    def inside(self, level: ClassText, name: str) -> Found | None:
        """Return a class declared or inherited in a class."""
        head, _, rest = name.partition(".")
        inner = level.classes.get(head) or self._beside(level, head)
        if inner is not None:
            return self.inside(inner, rest) if rest else inner
        return self._inherited(level, name)

    def _inherited(self, level: ClassText, name: str) -> Found | None:
        """Return a class that a class has from its bases; from those of a package, it sees what the package has."""
        head = name.partition(".")[0]
        key = id(level), head
        if key in self.open:  # a base is looked up among what its own class inherits
            return None
        self.open.add(key)
        try:
            bases = [element for element in level.elements if isinstance(element, Extends)] + (
                [level.short] if level.short else []
            )
            for extension in bases:
                base = self.find(extension.base, level)
                if isinstance(base, ClassText) and base is not level:
                    class_text = self.inside(base, name)
                    if class_text is not None:
                        return self._of_heir(class_text, level) if level.kind == "package" else class_text
            return None
        finally:
            self.open.remove(key)

    def _of_heir(self, inherited: Found, package: ClassText) -> Found:
        """Return a class as a package has it that inherits it."""
        if not isinstance(inherited, ClassText) or inherited.kind in ("package", "type", "connector"):
            return inherited
        key = id(inherited), id(package)
        if key not in self.inherited:
            self.inherited[key] = replace(inherited, heir=package)
        return self.inherited[key]

    def full(self, path: str) -> Found | None:
        """Return a class by its full name; names of version 3 of the standard library have those of version 4."""
        for old, new in table()["renamed"].items():
            if path == old or path.startswith(f"{old}."):
                path = f"{new}{path[len(old) :]}"
        for class_text in self.own:
            if path == class_text.path:
                return class_text
            if path.startswith(f"{class_text.path}."):
                own = self.inside(class_text, path[len(class_text.path) + 1 :])
                if own is not None:
                    return own
        if path in BASIC or self.tabled(path):
            return self.tabled(path) or path
        head, _, rest = path.partition(".")
        for top in (self._top(head), built_in().get(head)):
            inner = self.inside(top, rest) if top is not None and rest else top
            if inner is not None:
                return inner
        return None

    def text_of(self, path: str) -> ClassText | None:
        """Return the text of a class, of which there may be a component, too; None if no library has it."""
        known = self.full(path)
        if not isinstance(known, Known):
            return known if isinstance(known, ClassText) else None
        head, _, rest = known.path.partition(".")
        tops = filter(None, (self._top(head), built_in().get(head)))
        texts = (inner for top in tops if isinstance(inner := self.inside(top, rest), ClassText))
        return next(texts, None)

    def lack(self, part: str, path: str) -> None:
        """Remember that the component for a class cannot be what a text says of a part.

        Args:
            part: its path; elements of an array are one.
            path: of the class.
        """
        self.lacking[_SUBSCRIPT.sub("", part)] = path

    def reads(self, part: str) -> bool:
        """Tell whether the class of a part is read from its text, though there is a component."""
        return bool(self.untabled) and _SUBSCRIPT.sub("", part) in self.untabled

    def tabled(self, path: str) -> Known | str | None:
        """Return a class of the standard library that a component or a connector stands for."""
        if not self.table:
            return None
        return known_classes().get(path) or (path if path in table()["connectors"] else None)

    def _top(self, name: str) -> ClassText | None:
        """Return an outermost class of the package that the file belongs to, or of a library."""
        if name not in self.tops:
            files = (file for place in self.places for file in _homes(place, name))
            self.tops[name] = next((top for file in files for top in _parsed(file) if top.name == name), None)
        return self.tops[name]

    def _beside(self, level: ClassText, name: str) -> ClassText | None:
        """Return a class of a package that has a file of its own."""
        if level.owner is not None or Path(level.file).name != "package.mo":
            return None
        folder = Path(level.file).parent
        for file in (folder / f"{name}.mo", folder / name / "package.mo"):
            if file.is_file():
                for inner in _parsed(file):
                    if inner.name == name:
                        inner.within = level.path  # also of a file that does not say it
                        return inner
        return None


def _homes(place: Path, name: str) -> Iterator[Path]:
    """Yield the files of a library that may have an outermost class: `Modelica 4.1.0` is a folder of Modelica."""
    if place.is_file():
        yield place
    elif (place / "package.mo").is_file():
        yield place / "package.mo"
    else:
        folders = sorted(place.glob(f"{name} *"), reverse=True)
        files = (place / f"{name}.mo", *(folder / "package.mo" for folder in (place / name, *folders)))
        yield from (file for file in files if file.is_file())


def _parsed(file: Path) -> list[ClassText]:
    return _parsed_text(read_text(file), str(file))


@lru_cache(maxsize=_KEPT_FILES)
def _parsed_text(text: str, file: str) -> list[ClassText]:
    return parse_modelica(text, file)
