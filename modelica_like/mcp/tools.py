"""What programs can do with the netlists of a folder: one method for each tool, which returns data for JSON."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from modelica_like.analyse.operating.steady import steady
from modelica_like.analyse.sensitivity.derivatives import sensitivities
from modelica_like.arguments import check_names, checked, wrong_kind
from modelica_like.edit import Document
from modelica_like.edit.document import OPERATIONS
from modelica_like.errors import (
    Interrupted,
    MissingValue,
    ModelicaLikeError,
    NetlistError,
    SolveError,
    UnknownName,
    did_you_mean,
)
from modelica_like.fmi.export import export_fmu
from modelica_like.lsp.names import described, owner_of
from modelica_like.mcp import answers
from modelica_like.netlist import load
from modelica_like.netlist.document import read_text
from modelica_like.netlist.modelica.write import modelica_text
from modelica_like.netlist.registry import find_type, library_types
from modelica_like.runs.readings import read_number
from modelica_like.runs.solution import Solution
from modelica_like.show.draw import save_schematic
from modelica_like.show.report.analysis import point_report, sensitivity_report
from modelica_like.show.report.plausible import notes
from modelica_like.show.report.problems import netlist_problems
from modelica_like.show.report.run import run_report
from modelica_like.show.report.structure import structure_report
from modelica_like.simulation import simulate
from modelica_like.trust import require_confined
from modelica_like.writing import write_text

Answer = dict[str, Any]
_FILES, _TYPES, _TOLD = 200, 40, 3
"""Netlists and types that are listed; problems that an operation tells besides: `check` has all."""
SECONDS = 120.0
"""Of a call, after which it is stopped: nobody waits longer for an answer."""
ARGUMENTS = {
    "file": "path of the netlist in the folder, ending in .toml",
    "suggestion": "of a problem, as check has it",
    "value": "for a suggestion that sets a value: a number, or a text with a unit",
    "search": "a word in the name or the description",
    "kind": "name of the type to describe, as `is` has it",
    "until": 'end time such as "2 s"; by default that of the netlist',
    "readings": "numbers of the run: load.w (at its end), at(load.w, 0.3 s), max(…), min(…), peak(…), mean(…), rms(…), "
    "integral(…), clutch.lock_time",
    "show": "names or patterns of variables whose values are told",
    "parameters": 'other values by path, such as {"motor.tau": "3 N.m"}',
    "start": "given, rest or steady; by default that of the netlist",
    "to": "parameters; by default all, the most important first",
    "hold": 'variables with values that they are to have, such as {"motor.w": "4000 rpm"}',
    "by": "parameters to find, as many as are held",
    "output": "path of the new file in the folder, whose ending tells the format",
    "fmi": "version of FMI, 2.0 or 3.0",
}
"""What the arguments of the tools are."""


class Tools:
    """The tools of a folder; operations of `edit` are among them by their names.

    Args:
        root: the folder, in which all files are that tools read and write.

    Raises:
        NetlistError: there is no such folder.
    """

    def __init__(self, root: Path) -> None:
        self._root = root.resolve()
        if not self._root.is_dir():
            raise NetlistError(f"'{root}' is not a folder.")
        self._documents: dict[Path, Document] = {}
        self._runs: dict[Path, tuple[str, Solution]] = {}

    def _path(self, name: str, *endings: str) -> Path:
        if not name.strip() or not name.isprintable():
            raise NetlistError(f"{name!r} is no name of a file.")
        path = self._root / name
        require_confined(path)
        if path.suffix.lower() not in endings:
            raise NetlistError(f"'{name}' must end in {' or '.join(endings)}.")
        return path

    def _name(self, path: Path) -> str:
        return path.relative_to(self._root).as_posix()

    def _document(self, file: str) -> Document:
        """Return a netlist as it is on disk; operations before a change by others cannot be undone any more."""
        path = self._path(file, ".toml")
        if path not in self._documents or self._documents[path].text != read_text(path, as_written=True):
            self._documents[path] = Document(path)
        return self._documents[path]

    def _saved(self, document: Document, change: Callable[..., Document], *args: Any) -> Answer:
        """Change a netlist and write it."""
        before = document.text
        change(*args)
        try:
            document.save()
        except (KeyboardInterrupt, ModelicaLikeError, OSError):
            del self._documents[document.path]
            raise
        left = [problem["what"] for problem in netlist_problems(document.path, document.text)]
        files = [self._name(file) for file in document.state.files]
        more = {"notes": [*document.notes], "files": files, "problems": answers.first(left, _TOLD)}
        changed = answers.changed(before, document.text)
        return {"changed": changed, **{key: value for key, value in more.items() if value}}

    def operate(self, name: str, arguments: Mapping[str, Any]) -> Answer:
        """Do an operation of `edit` on a file, and write it."""
        check_names(name, self.text, [key for key in arguments if key == "file"])
        if not isinstance(file := arguments["file"], str):
            raise wrong_kind("file", file, str, f"{name}: ")
        document = self._document(file)
        request = {key: value for key, value in arguments.items() if key != "file"}
        return self._saved(document, document.apply, {**request, "op": name})

    # -- netlists ------------------------------------------------------------------------------------------------------

    def netlists(self) -> Answer:
        """List the netlists of the folder, and of folders in it."""
        files = (file for file in sorted(self._root.rglob("*.toml")) if file.resolve().is_relative_to(self._root))
        return {"netlists": answers.first([*map(self._name, files)], _FILES)}

    def text(self, file: str) -> Answer:
        """Return the text of a netlist."""
        return {"text": self._document(file).text}

    def new(self, file: str) -> Answer:
        """Begin an empty netlist, never over a file; then add parts."""
        path = self._path(file, ".toml")
        path.parent.mkdir(parents=True, exist_ok=True)
        self._documents[path] = Document.new(path).save()
        return {"written": self._name(path)}

    def undo(self, file: str) -> Answer:
        """Take the last operation on a netlist back."""
        document = self._document(file)
        return self._saved(document, document.undo)

    def apply(self, file: str, suggestion: Mapping[str, Any], value: Any = None) -> Answer:
        """Make the change that a problem suggests."""
        document, more = self._document(file), {} if value is None else {"value": value}
        return self._saved(document, document.apply, {**suggestion, **more})

    def library(self, search: str = "", kind: str | None = None) -> Answer:
        """List component types, or describe one: its parameters and ends."""
        if kind is not None:
            owner = owner_of(find_type(kind, self._root))
            values = {name: described(schema) for name, schema in owner.values.items()}
            return {"about": owner.about, "values": values, "ends": owner.ends()}
        about = {name: inspect.cleandoc(of.__doc__ or "").partition("\n")[0] for name, of in library_types().items()}
        names = [f"{name}: {text}" for name, text in about.items() if search.lower() in f"{name} {text}".lower()]
        return {"types": answers.first(names, _TYPES)}

    def check(self, file: str) -> Answer:
        """Check a netlist: problems with suggestions, and what the drive consists of."""
        document = self._document(file)
        listed = netlist_problems(document.path, document.text)
        valid = all(problem["kind"] == "note" for problem in listed)
        structure = answers.report(structure_report(load(document.path))) if valid else {}
        return {"problems": answers.problems(self._root, listed), **structure}

    # -- runs ----------------------------------------------------------------------------------------------------------

    def simulate(
        self, file: str, until: float | str | None = None, readings: Sequence[str] = (), show: Sequence[str] = (),
        parameters: Mapping[str, Any] | None = None, start: str | None = None,
    ) -> Answer:  # fmt: skip
        """Simulate a netlist: mode changes, readings, energy balance, what looks like a slip."""
        path = self._path(file, ".toml")
        text, drive = read_text(path), load(path)
        how: dict[str, Any] = {"parameters": parameters, "start": start, "readings": readings}
        run = simulate(drive, until, **how)
        self._runs[path] = text, run
        said = notes(drive, run)
        answer = {**answers.report(run_report(run, show=show)), "readings": _numbers(run, readings)}
        return {**answer, **({"notes": said} if said else {})}

    def values(self, file: str, readings: Sequence[str]) -> Answer:
        """Read numbers off the last run of a netlist."""
        path = self._path(file, ".toml")
        text, run = self._runs.get(path, ("", None))
        if run is None or text != read_text(path):
            raise MissingValue(f"There is no run of '{file}' as it is now.", advice="Use simulate first.")
        return _numbers(run, readings)

    def sensitivities(
        self, file: str, readings: Sequence[str], to: Sequence[str] = (), until: float | str | None = None
    ) -> Answer:
        """Differentiate readings of a run by parameters, exactly through its events."""
        result = sensitivities(load(self._path(file, ".toml")), readings, to, until=until)
        return answers.report(sensitivity_report(result))

    def steady(
        self, file: str, hold: Mapping[str, Any] | None = None, by: Sequence[str] = (), show: Sequence[str] = ()
    ) -> Answer:
        """Find an operating point: powers, losses, efficiency, values (by default of the states)."""
        return answers.report(point_report(steady(load(self._path(file, ".toml")), hold, by), show))

    # -- files ---------------------------------------------------------------------------------------------------------

    def export(self, file: str, output: str, fmi: str = "2.0") -> Answer:
        """Write a drive as an FMU (.fmu), which is compared with the drive, or as Modelica text (.mo)."""
        drive, target = load(self._path(file, ".toml")), self._path(output, ".fmu", ".mo")
        if target.suffix.lower() == ".mo":
            write_text(target, modelica_text(drive))
            return {"written": self._name(target)}
        return {"written": self._name(target), "text": str(export_fmu(drive, target, fmi)).replace(str(target), output)}

    def draw(self, file: str, output: str) -> Answer:
        """Draw the schematic of a drive: .svg, .png or .pdf."""
        target = self._path(output, ".svg", ".png", ".pdf")
        save_schematic(load(self._path(file, ".toml")), target)
        return {"written": self._name(target)}


def too_long(name: str, seconds: float, interrupt: KeyboardInterrupt) -> SolveError:
    """Return the error of a tool that was stopped.

    Args:
        name: of the tool.
        seconds: that it had.
        interrupt: by which it was stopped.
    """
    run = interrupt.run if isinstance(interrupt, Interrupted) else None
    reached = f" at t = {run.time[-1]:g} s" if run else ""
    advice = "Give an earlier end as `until`." if name in ("simulate", "sensitivities") else ""
    return SolveError(f"{name} took more than {seconds:g} s, and was stopped{reached}.", advice=advice)


def _numbers(run: Solution, names: Sequence[str]) -> Answer:
    units = [str(read_number(run.model, name).unit) for name in names]
    numbers = zip(names, run.read(*names), units, strict=True)
    return {name: {"value": value, "unit": unit} for name, value, unit in numbers}


def _tool(function: Callable[..., Answer]) -> Callable[..., Answer]:
    function.__qualname__ = function.__name__  # as messages have it
    return checked(function)


OWN = {name: _tool(tool) for name, tool in vars(Tools).items() if not name.startswith("_") and name != "operate"}
"""The tools, without operations of `edit`."""


def use(tools: Tools, name: str, arguments: Mapping[str, Any]) -> Answer:
    """Use a tool.

    Args:
        tools: of the folder.
        name: of a method, or of an operation, which has the argument `file`, too.
        arguments: by name.

    Raises:
        UnknownName: there is no such tool or argument.
        NetlistError: an argument is missing, or a file is outside of the folder.
        ModelicaLikeError: the tool refuses what is asked.
    """
    if name in OWN:
        check_names(name, OWN[name], arguments)
        return OWN[name](tools, **arguments)
    if name in OPERATIONS:
        return tools.operate(name, arguments)
    names = [*OPERATIONS, *OWN]
    raise UnknownName(f"There is no tool '{name}'{did_you_mean(name, names) or '.'} There are {', '.join(names)}.")
