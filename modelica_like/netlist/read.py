"""From netlist files to a tree of components."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path
from typing import Any

from modelica_like.arguments import checked
from modelica_like.errors import (
    CyclicAssembly,
    ModelicaLikeError,
    NetlistError,
    Source,
    UnknownName,
    WiringErrors,
    raise_together_or_one,
)
from modelica_like.garbage import without_garbage_search
from modelica_like.language import Assembly, Component, Variable, guess
from modelica_like.language.fields import Discrete
from modelica_like.language.inside import declarations, inside
from modelica_like.language.scopes import give_by_path
from modelica_like.netlist.document import Document, read_text, survey
from modelica_like.netlist.further import further, head
from modelica_like.netlist.registry import find_type
from modelica_like.netlist.sections import check_part
from modelica_like.trust import trusting

_MAX_ERRORS = 100
"""Nobody reads more, and each looks for the name that is meant."""
_MAX_PARTS, _MAX_PARAMETERS, _MAX_DEPTH = 200_000, 10_000, 50
"""Of a netlist with all that it uses; of one file; of netlists in netlists."""
FMU_PART = "FMU"
"""Type `is` of parts that are FMUs."""


@checked
@without_garbage_search()
def load(path: str | Path, *, trust: bool = False) -> Assembly:
    """Read a netlist file and the netlists it uses.

    Args:
        path: a TOML file, or a Modelica text: `drive.mo`, with a class `drive.mo:Rotor`.
        trust: run Python modules beside these netlists; by default only those in trusted folders, because a netlist is
            data that others may have written. A module that the program has imported before needs no trust.

    Raises:
        UntrustedModule: a module is in a folder that is not trusted.
        NetlistError: the file cannot be read, or is not a netlist.
        CyclicAssembly: it contains itself.
        ModelicaLikeError: types, values or paths in it are wrong; several errors come as `WiringErrors`.
    """
    if is_modelica(path):
        return _modelica(path)
    with trusting() if trust else nullcontext():
        return _Loader().load(Path(path), ())


def _modelica(path: str | Path) -> Assembly:
    from modelica_like.netlist.modelica.read import load_modelica  # it makes components, and most netlists have no text

    return load_modelica(path)


def _libraries(document: Document, folder: Path) -> AbstractContextManager[None]:
    """Return what makes the libraries of Modelica text known that a netlist names."""
    if not document.modelica:
        return nullcontext()
    from modelica_like.netlist.modelica.classes import with_libraries

    return with_libraries([folder / place for place in document.modelica.get("libraries", [])])


@without_garbage_search()
def loads(text: str, file: str = "netlist.toml", *, trust: bool = False) -> Assembly:
    """Read a netlist from text; see `load`.

    Args:
        text: TOML.
        file: path for messages; netlists and modules used as parts are searched in its folder.
        trust: run Python modules in that folder.
    """
    with trusting() if trust else nullcontext():
        return _Loader().build(survey(text, file), (Path(file).resolve(),))


@without_garbage_search()
def load_thoroughly(path: Path, text: str | None = None, texts: Mapping[Path, str] | None = None) -> Assembly:
    """Read a netlist; its errors are told with those that are only seen in a whole drive.

    Args:
        path: see `load`.
        text: what the file will be, if it is being written.
        texts: of netlists used as parts that are being written, too, by absolute path.

    Raises:
        ModelicaLikeError: see `load`.
    """
    if is_modelica(path):
        return _modelica(path)
    loader = _Loader(texts, thorough=True)
    return loader.load(path, ()) if text is None else loader.build(survey(text, str(path)), (path.resolve(),))


def assemble(document: Document, file: Path, texts: Mapping[Path, str] | None = None) -> Assembly:
    """Build the assembly of an already read netlist; see `load`.

    Args:
        document: what was read.
        file: its path.
        texts: of netlists used as parts that are not written yet, by absolute path.
    """
    return _Loader(texts).build(document, (file.resolve(),))


class _Reported(Exception):
    """The errors of a netlist that is used again have been collected where it was used first."""


class _Loader:
    """Builds assemblies; every file is read once.

    Args:
        texts: of netlists that are not written yet, by absolute path.
        thorough: also tell what is wrong with the connections and values of a netlist with errors.
    """

    def __init__(self, texts: Mapping[Path, str] | None = None, *, thorough: bool = False) -> None:
        self.texts = texts or {}
        self.thorough = thorough
        self.assemblies: dict[Path, Assembly] = {}
        self.failed: set[Path] = set()
        self.parts = 0

    def load(self, path: Path, chain: tuple[Path, ...]) -> Assembly:
        key = path.resolve()
        if key in chain:
            names = " contains ".join(file.name for file in (*chain[chain.index(key) :], key))
            raise CyclicAssembly(f"A netlist contains itself: {names}.", advice="Remove one of them.")
        if len(chain) > _MAX_DEPTH:
            raise NetlistError(f"Netlists are in each other more than {_MAX_DEPTH} deep: '{path.name}' is the next.")
        if key in self.failed:
            raise _Reported
        if key not in self.assemblies:
            self.failed.add(key)
            text = self.texts[key] if key in self.texts else read_text(path, as_written=True)
            self.assemblies[key] = self.build(survey(text, str(path)), (*chain, key))
            self.failed.remove(key)
        return self.assemblies[key]

    def build(self, document: Document, chain: tuple[Path, ...]) -> Assembly:
        """Build the assembly of one file; all its errors are raised together."""
        if (number := len(document.parameters)) > _MAX_PARAMETERS:
            name = Path(document.lines.file).name
            raise NetlistError(f"'{name}' has {number} parameters, more than {_MAX_PARAMETERS}.")
        assembly = Assembly(
            document.name, connect=document.connect, series=document.series, free=document.free,
            description=document.description,
        )  # fmt: skip
        record = inside(assembly)
        record.origin, record.text = str(chain[-1]), document.text
        record.simulate, record.display = document.simulate, document.display
        if document.sizing:
            record.sizing = str(chain[-1].parent / document.sizing)
        record.optimize, record.tolerances = document.optimize, document.tolerances
        record.libraries = document.modelica
        Assembly.place(assembly, "tolerances", document.lines.source("tolerances"))
        for key in document.optimize:
            Assembly.place(assembly, f"optimize.{key}", document.lines.source("optimize", key))
        task = _Task(document, assembly, chain, self)
        with _libraries(document, chain[-1].parent):
            task.run()
        if task.errors and self.thorough and len(chain) == 1:
            task.errors += further(assembly, task.broken(), task.refused)
        if task.errors:
            raise raise_together_or_one(task.errors)
        if task.incomplete:
            raise _Reported
        return assembly

    def count(self, number: int) -> None:
        """Refuse netlists that multiply without bounds."""
        self.parts += number
        if self.parts > _MAX_PARTS:
            raise NetlistError(
                f"The netlist has more than {_MAX_PARTS} parts.",
                advice="Its assemblies are counted with all that is in them.",
            )


class _Task:
    """Fills the assembly of one document and collects the errors with their lines."""

    def __init__(self, document: Document, assembly: Assembly, chain: tuple[Path, ...], loader: _Loader) -> None:
        self.document = document
        self.assembly = assembly
        self.chain = chain
        self.loader = loader
        self.errors = [*document.errors]
        self.refused: set[str] = set()
        """Paths of values that were not understood."""
        self.incomplete = False

    def run(self) -> None:
        """Go through the sections, in an order in which each finds its references."""
        self._each("parameters", self.document.parameters, partial(Assembly.add_parameter, self.assembly))
        self._each("parts", self.document.parts, self._add_part)
        broken = self.broken()

        def whole(section: str) -> dict[str, Any]:
            entries = getattr(self.document, section).items()
            return {key: value for key, value in entries if head(value if section == "expose" else key) not in broken}

        self._each("start", whole("start"), self._start)
        self._each("guess", whole("guess"), lambda path, value: self._start(path, guess(value)))
        self._each("expose", whole("expose"), partial(Assembly.expose, self.assembly))
        for section in ("parameters", "start", "guess", "connect", "series", "expose"):
            for name in getattr(self.document, section):
                Assembly.place(self.assembly, f"{section}.{name}", self.document.lines.source(section, name))
        for end in self.document.free:
            Assembly.place(self.assembly, f"free.{end}", self.document.lines.source("free"))

    def broken(self) -> set[str]:
        """Return the names of the parts that could not be made."""
        declared = {path[1] for path in self.document.lines.numbers if path[0] == "parts" and len(path) > 1}
        return declared - inside(self.assembly).parts.keys()

    def _each(self, section: str, entries: Mapping[str, Any], action: Callable[[str, Any], None]) -> None:
        for name, entry in entries.items():
            if len(self.errors) > _MAX_ERRORS:
                break
            try:
                action(name, entry)
            except _Reported:
                self.incomplete = True
            except CyclicAssembly as error:
                error.where = (self.document.lines.source(section, name), *error.where)
                raise
            except ModelicaLikeError as error:
                self.refused.add(name)
                self._collect(error, self.document.lines.source(section, name))

    def _collect(self, error: ModelicaLikeError, source: Source) -> None:
        if isinstance(error, WiringErrors):
            self.errors.extend(error.errors)
            return
        # An error from an inner netlist keeps its place; the place on Python's stack is of no use here.
        if not any(place.file.endswith((".toml", ".mo")) for place in error.where):
            error.where = (source,)
        self.errors.append(error)
        if len(self.errors) == _MAX_ERRORS:
            self.errors.append(NetlistError(f"After {_MAX_ERRORS} errors, the netlist is not read on."))

    def _add_part(self, name: str, entry: Any) -> None:
        if isinstance(entry, list):
            part: Any = [self._part(f"{name}[{k}]", table) for k, table in enumerate(entry, 1)]
        else:
            part = self._part(name, entry)
            part = [part] * entry["count"] if "count" in entry else part
        setattr(self.assembly, name, part)
        Assembly.place(self.assembly, f"parts.{name}", self.document.lines.source("parts", name))
        if isinstance(entry, dict):
            first = part[0] if isinstance(part, list) else part
            for key in inside(first).starts.keys() & entry.keys():
                Assembly.place(self.assembly, f"parts.{name}.{key}", self.document.lines.source("parts", name, key))

    def _part(self, name: str, table: Mapping[str, Any], levels: int = 1) -> Component:
        values = {key: value for key, value in table.items() if key not in ("is", "count")}
        kind, folder, number = table["is"], Path(self.document.lines.file).parent, table.get("count", 1)
        if kind == FMU_PART:
            raise NetlistError(
                f"{name} is an FMU, which cannot be part of a system of equations.",
                why="An FMU computes its outputs in its own steps, and its equations are not known.",
                advice="Run the netlist as a co-simulation: cosim(…) or `modelica-like cosim`.",
            )
        if is_modelica(kind):
            part = self._copied(_modelica(folder / kind), number)
        elif kind.endswith(".toml"):
            part = self._copied(self.loader.load(folder / kind, self.chain), number)
        else:
            part = new_component(self._type(kind, folder, name), values)
            self.loader.count(number * sum(1 for _ in part.walk()))
        for key, value in values.items():
            try:
                self._give(part, key, value, f"{name}.{key}", levels)
            except CyclicAssembly:
                raise
            except ModelicaLikeError as error:
                meant = error.instead or ("*" if isinstance(error, UnknownName) and error.word == key else "")
                self.refused |= {f"{name}.{key}", f"{name}.{meant}"}
                self._collect(error, self.document.lines.within("parts", *name.split("."), key))
        return part

    def _type(self, name: str, folder: Path, part: str) -> type[Component]:
        try:
            return find_type(name, folder)
        except ModelicaLikeError as error:
            error.where = (self.document.lines.within("parts", *part.split("."), "is"),)
            raise

    def _copied(self, part: Component, number: int) -> Component:
        """Copy a part, if netlists in netlists do not multiply it without bounds."""
        self.loader.count(number * sum(1 for _ in part.walk()))
        return part.copy()

    def _give(self, part: Component, key: str, value: Any, label: str, levels: int = 1) -> None:
        """Set a value, a replaceable part (a table with `is`), or values inside a part (a table without).

        Names in formulas are those of this netlist, `levels` above the part.
        """
        if not isinstance(value, dict):
            give_by_path(part, key, value, above=levels)
        elif "is" in value:
            part.give(key, self._part(label, check_part(f"parts.{label}", value), levels + 1))
        else:
            for inner, inner_value in value.items():
                self._give(part.find(key), inner, inner_value, f"{label}.{inner}", levels + 1)

    def _start(self, path: str, value: Any) -> None:
        owner_path, _, name = path.rpartition(".")
        owner = self.assembly.find(owner_path)
        can_start = name in owner.modes or isinstance(owner.fields.get(name), Variable | Discrete)
        if not can_start and (name in owner.fields or name in declarations(owner).structural):
            raise UnknownName(
                f"{path} is a parameter, not a variable.", advice="Give its value where the part is declared."
            )
        give_by_path(self.assembly, path, value)


def is_modelica(path: str | Path) -> bool:
    """Tell whether a path names a Modelica text, or a class in one: `drive.mo`, `drive.mo:Rotor`."""
    return str(path).endswith(".mo") or ".mo:" in str(path)


def new_component(kind: type[Component], values: dict[str, Any]) -> Component:
    """Create a component; its structural fields must be known now, because they decide its parts."""
    structural = {key: values.pop(key) for key in declarations(kind).structural if key in values}
    for key, value in structural.items():
        kind.check_structural(key, value)
    try:
        return kind(**structural)
    except ModelicaLikeError:
        raise
    except (Exception, SystemExit) as error:  # code of users
        given = ", ".join(f"{key} = {value!r}" for key, value in structural.items())
        raise NetlistError(f"{kind.__name__} cannot be created with {given or 'no values'}: {error}.") from error


def assign(drive: Assembly, values: Mapping[str, Any], option: str = "") -> None:
    """Give a drive other values by path, whose place in messages is an option of the command line if they are its."""
    for path, value in values.items():
        place = Source(option, text=f"{path}={value}")
        try:
            drive.set(path, value)
        except ModelicaLikeError as error:
            error.where = (place,) if option else error.where
            raise
        if option:
            Assembly.place(drive, f"set.{path}", place)
