"""Finding classes by name: in the file, in the package around it, in the standard library's table."""

from __future__ import annotations

from pathlib import Path

from modelica_like.errors import ModelicaTextError
from modelica_like.netlist.document import read_text
from modelica_like.netlist.modelica.library import Known, built_in, known_classes, table
from modelica_like.netlist.modelica.parse import parse_modelica
from modelica_like.netlist.modelica.tree import ClassText, Extends, Import

BASIC = ("Real", "Integer", "Boolean", "String", "StateSelect")
_SI = ("SI", "SIunits")
_RENAMED = (
    ("Modelica.SIunits.Conversions.NonSIunits", "Modelica.Units.NonSI"),
    ("Modelica.SIunits.Conversions", "Modelica.Units.Conversions"),
    ("Modelica.SIunits", "Modelica.Units.SI"),
)
_MOST_STEPS = 1_000_000
"""Of about 10 microseconds; 10,000 parts of own classes, or 100,000 equations."""
Found = ClassText | Known | str
"""A class with its text, one with a component, or the name of a basic type or a connector of the standard library."""


class Classes:
    """The classes that a file can name.

    Args:
        file: a `.mo` file; its package's other files are found beside it, by its `within`.

    Raises:
        NetlistError: the file cannot be read.
        ModelicaTextError: it is not Modelica.
    """

    def __init__(self, file: Path) -> None:
        self.file = file
        self.own = parse_modelica(read_text(file), str(file))
        within = self.own[0].within.split(".") if self.own[0].within else []
        # package.mo is the class of its folder.
        above = len(within) + (file.name == "package.mo")
        self.folder = file.resolve().parents[above] if above < len(file.resolve().parents) and within else None
        self.read: dict[Path, list[ClassText]] = {}
        self.open: set[tuple[int, str]] = set()
        self.found: dict[tuple[int, str], Found | None] = {}
        self.steps = 0

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
        elsewhere = self.full(name) if name and not matches else None
        if isinstance(elsewhere, ClassText):
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
            self.found[key] = self._found(name, scope)
        return self.found[key]

    def _found(self, name: str, scope: ClassText) -> Found | None:
        head, _, rest = name.partition(".")
        if not head:
            return self.full(rest)
        level: ClassText | None = scope
        outermost = scope
        while level is not None:
            class_text = (
                self._inside(level, name) or self._imported(level, head, rest) or _tabled(f"{level.path}.{name}")
            )
            if class_text is not None:
                return class_text
            outermost, level = level, level.owner
        package = outermost.within
        while package:
            class_text = self.full(f"{package}.{name}")
            if class_text is not None:
                return class_text
            package = package.rpartition(".")[0]
        return self.full(f"Modelica.Units.SI.{rest}" if head in _SI else name)

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

    def _inside(self, level: ClassText, name: str) -> Found | None:
        """Return a class declared or inherited in a class."""
        head, _, rest = name.partition(".")
        if head in level.classes:
            inner = level.classes[head]
            return self._inside(inner, rest) if rest else inner
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
                    class_text = self._inside(base, name)
                    if class_text is not None:
                        return class_text
            return None
        finally:
            self.open.remove(key)

    def full(self, path: str) -> Found | None:
        """Return a class by its full name; units of version 3 of the standard library have the names of version 4."""
        for old, new in _RENAMED:
            if path == old or path.startswith(f"{old}."):
                path = f"{new}{path[len(old) :]}"
        for class_text in self.own:
            if path == class_text.path:
                return class_text
            if path.startswith(f"{class_text.path}."):
                return self._inside(class_text, path[len(class_text.path) + 1 :])
        if path in BASIC or _tabled(path):
            return _tabled(path) or path
        head, _, rest = path.partition(".")
        built = built_in().get(head)
        inner = self._inside(built, rest) if built is not None and rest else None
        return inner if inner is not None else self._on_disk(path)

    def _on_disk(self, path: str) -> ClassText | Known | str | None:
        """Return a class of the package that the file belongs to."""
        if self.folder is None:
            return None
        names, place = path.split("."), self.folder
        for k, name in enumerate(names):
            for file in (place / f"{name}.mo", place / name / "package.mo"):
                if file.is_file():
                    class_text = self._of_file(file, name)
                    if class_text is not None and k + 1 == len(names):
                        return class_text
                    inner = self._inside(class_text, ".".join(names[k + 1 :])) if class_text is not None else None
                    if inner is not None:
                        return inner
            place = place / name
        return None

    def _of_file(self, file: Path, name: str) -> ClassText | None:
        if file.resolve() == self.file.resolve():
            return next((candidate for candidate in self.own if candidate.name == name), None)
        if file not in self.read:
            self.read[file] = parse_modelica(read_text(file), str(file))
        return next((candidate for candidate in self.read[file] if candidate.name == name), None)


def _tabled(path: str) -> Known | str | None:
    """Return a class of the standard library that a component or a connector stands for."""
    return known_classes().get(path) or (path if path in table()["connectors"] else None)
