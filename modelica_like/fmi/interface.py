"""The FMI variables of a compiled model, and the place of each value."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property
from itertools import groupby
from typing import Any, Literal, NamedTuple

import numpy as np

from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import unknown_name
from modelica_like.flatten.model import FlatParameter, FlatVariable
from modelica_like.fmi.reach import Reach
from modelica_like.fmi.start_tables import StartTables, start_tables
from modelica_like.language.units import ONE, Unit, parse_unit

Causality = Literal["independent", "parameter", "calculatedParameter", "input", "output", "local"]
Variability = Literal["fixed", "tunable", "discrete", "continuous"]
ModesAs = Literal["output", "local", "integer"]
Initial = Literal["exact", "approx", "calculated"]
SlotKind = Literal["time", "state", "der", "variable", "parameter", "derived", "input", "discrete", "guard"]

_SECOND = parse_unit("s")


class FmuVariable(NamedTuple):
    """One variable of the description.

    Attributes:
        reference: value reference; the position among all variables.
        initial: None where FMI allows only one choice (inputs, parameters, time).
        slot: storage of the value, and its position there. Only the name of a state itself has the slot `state`; other
            names of the same motion are variables.
        unit: unit of `start`, `min`, `max` and `nominal`; it is coherent, or `1` or `*`.
        start: start value, if it has one.
        start_entry: position in the model's `starts` of the start value that an importer replaces when it sets this.
        derivative_of: value reference of the variable whose time derivative this is.
        modes: names of a mode's values, from zero.
        elements: of an array: consecutive value references of its numbers, row by row.
        dimensions: of an array: number of rows, and of columns.
    """

    name: str
    reference: int
    type: Literal["Float64", "Enumeration", "Int64"]
    causality: Causality
    variability: Variability
    initial: Initial | None
    slot: tuple[SlotKind, int]
    unit: Unit = ONE
    description: str = ""
    start: float | None = None
    min: float | None = None
    max: float | None = None
    nominal: float | None = None
    start_entry: int | None = None
    derivative_of: int | None = None
    modes: tuple[str, ...] = ()
    elements: tuple[int, ...] = ()
    dimensions: tuple[int, ...] = ()


@dataclass(frozen=True)
class Interface:
    """All FMI variables of a model.

    Attributes:
        variables: by value reference.
        states, derivatives: value references in the order of x.
        outputs: value references of continuous and discrete outputs.
        indicators: value references of the event indicators, in the order of the guards.
        start: start tables.
        reach: direct dependencies of the variables.
        arrays: tables whose numbers are parameters, as arrays of FMI 3; their references follow those of variables.
    """

    name: str
    variables: tuple[FmuVariable, ...]
    states: tuple[int, ...]
    derivatives: tuple[int, ...]
    outputs: tuple[int, ...]
    indicators: tuple[int, ...]
    start: StartTables
    reach: Reach
    arrays: tuple[FmuVariable, ...] = ()

    @cached_property
    def by_name(self) -> dict[str, FmuVariable]:
        """Variables by their names."""
        return {variable.name: variable for variable in self.variables}

    def __str__(self) -> str:
        counts: dict[str, int] = {}
        for variable in self.variables:
            counts[variable.causality] = counts.get(variable.causality, 0) + 1
        parts = ", ".join(f"{count} {causality}" for causality, count in counts.items())
        return f"Interface {self.name}: {len(self.states)} states; {parts}"


def interface(model: CompiledDae, outputs: Sequence[str] = (), modes: ModesAs = "output") -> Interface:
    """List the FMI variables of a model, with the same names as in Python.

    Signal outputs of components and modes are outputs, inputs of the model are inputs, everything else is local.

    Args:
        model: the compiled model.
        outputs: patterns of additional outputs, such as `load.w` or `*.tau`.
        modes: `output` (enumerations), `local` (enumerations without output), or `integer` (outputs).

    Raises:
        UnknownName: no variable matches a pattern.
        MissingStart, ContradictingStart: the start values do not determine all states.
    """
    build = _Builder(model, outputs)
    build.parameters()
    build.continuous()
    build.rates()
    build.discretes(modes)
    build.guards()
    states = range(len(model.states))
    chosen = tuple(variable.reference for variable in build.found if variable.causality == "output")
    return Interface(
        model.name, tuple(build.found), tuple(build.states[k] for k in states),
        tuple(build.derivatives[k] for k in states), chosen,
        tuple(build.indicators[k] for k in sorted(build.indicators)), build.starts.tables, build.reach,
        tuple(build.arrays()),
    )  # fmt: skip


class _Builder:
    def __init__(self, model: CompiledDae, outputs: Sequence[str]) -> None:
        self.model = model
        self.found: list[FmuVariable] = []
        self.states: dict[int, int] = {}
        self.derivatives: dict[int, int] = {}
        self.indicators: dict[int, int] = {}
        paths, chosen = [variable.path for variable in model.flat_variables], set[str]()
        for pattern in outputs:
            matches = [path for path in paths if fnmatchcase(path, pattern.replace("[", "[[]"))]
            if not matches:
                what = f"{model.name} has no variable '{pattern}' that could be an output"
                raise unknown_name(what, pattern, paths)
            chosen.update(matches)
        self.wanted = lambda variable: variable.kind == "output" or variable.path in chosen
        self.starts = _Starts(model)
        self.reach = Reach(model.equations.variables)
        # Variables change with time, at events only, or with parameters only.
        moving = self.reach.mask(*(name for name in model.equations.variables.name_in() if name not in ("p", "d")))
        switching = self.reach.mask("d")
        self.depends = [
            "continuous" if row & moving else "discrete" if row & switching else "tunable" for row in self.reach.rows
        ]
        self.add("time", ("time", 0), "independent", initial=None, unit=_SECOND, description="time")

    def add(
        self, name: str, slot: Any, causality: Any = "local", variability: Any = "continuous",
        initial: Any = "calculated", kind: Any = "Float64", **rest: Any,
    ) -> int:  # fmt: skip
        """Append a variable; return its value reference."""
        reference = len(self.found)
        self.found.append(FmuVariable(name, reference, kind, causality, variability, initial, slot, **rest))
        return reference

    def parameters(self) -> None:
        """Independent parameters, and those that follow from others."""
        # Parameters on which times of delays depend do not change during a run.
        pattern = self.model.events.delays.jac_sparsity(0, self.model.events.delays.name_in().index("p"))
        fixed = {number for row, number in zip(*pattern.get_triplet(), strict=True) if row % 2}
        for k, parameter in enumerate(self.model.flat_parameters):
            variability, start = "tunable" if parameter.tunable and k not in fixed else "fixed", float(self.model.p[k])
            self.add(parameter.path, ("parameter", k), "parameter", variability, None, start=start, **_about(parameter))
        for k, parameter in enumerate(self.model.flat_derived):
            self.add(parameter.path, ("derived", k), "calculatedParameter", "tunable", **_about(parameter))

    def continuous(self) -> None:
        """Inputs, states, and all other variables."""
        model = self.model
        taken = {*model.parameter_position, *model.derived_position}
        inputs = {variable: k for k, variable in enumerate(model.inputs)}
        states = {name: k for k, name in enumerate(model.states)}
        for k, variable in enumerate(model.flat_variables):
            if variable.hidden:
                continue
            about, causality = _about(variable), "output" if self.wanted(variable) else "local"
            if k in inputs:
                start = float(model.u[inputs[k]])
                self.add(variable.path, ("input", inputs[k]), "input", initial=None, start=start, **about)
            elif variable.path in states:
                slot, start = ("state", states[variable.path]), self.starts.of_variable(k)
                self.states[slot[1]] = self.add(variable.path, slot, causality, **start, **about)
            elif variable.path not in taken:  # an input with a value from a parameter is that parameter
                start, variability = self.starts.of_variable(k), self.depends[k]
                if start["initial"] != "calculated":
                    variability = "continuous"
                elif causality == "output" and variability == "tunable":
                    variability = "discrete"  # an output cannot become local
                self.add(variable.path, ("variable", k), causality, variability, **start, **about)

    def rates(self) -> None:
        """Derivatives of all states; states that are no variables, and derivatives without another name, come first."""
        model, names = self.model, self.model.states
        units = {name: model.units.get(name, ONE) for name in names if not name.startswith("der(")}
        unnamed = [k for k in range(len(names)) if k not in self.states]
        for k in sorted(unnamed, key=lambda k: names[k].count("der(")):
            if names[k] in units:
                self.states[k] = self.add(names[k], ("state", k), description="state that follows the motion")
                continue
            base = names[k].removeprefix("der(").removesuffix(")")
            units[names[k]] = units.get(base, model.units.get(base, ONE)) / _SECOND
            if base not in names:  # it is no state, because it follows from one that moves with it
                self.states[k] = self.add(fmi_name(names[k]), ("state", k), unit=units[names[k]])
                continue
            below = names.index(base)
            self.states[k] = self.derivatives[below] = self.add(
                fmi_name(names[k]), ("state", k), unit=units[names[k]], derivative_of=self.states[below],
                nominal=float(model.equations.nominals[k]),
            )  # fmt: skip
        for k, name in enumerate(names):
            if k not in self.derivatives:
                unit = units[name] / _SECOND
                name = fmi_name(f"der({name})")
                self.derivatives[k] = self.add(name, ("der", k), unit=unit, derivative_of=self.states[k])

    def discretes(self, modes: ModesAs) -> None:
        """Modes, and other discrete values, which are local; equations determine some at the start, too."""
        determined = {row.reset.index for row in self.model.events.update_rows if row.at_start}
        for k, discrete in ((k, d) for k, d in enumerate(self.model.flat_discretes) if not d.hidden):
            values = ", ".join(f"{k}: {name}" for k, name in enumerate(discrete.names))
            description = " – ".join(text for text in (discrete.description, values) if text)
            slot, about = ("discrete", k), {"unit": discrete.unit, "description": description}
            if discrete.names:
                kind, names = ("Int64", ()) if modes == "integer" else ("Enumeration", discrete.names)
                causality = "local" if modes == "local" else "output"
                about |= {"min": 0, "max": len(discrete.names) - 1, "modes": names}
                self.add(discrete.path, slot, causality, "discrete", kind=kind, **about)
            elif k in determined:
                self.add(discrete.path, slot, "local", "discrete", **about)
            else:
                self.add(discrete.path, slot, "local", "discrete", "exact", start=self.starts.discrete[k], **about)

    def guards(self) -> None:
        """One event indicator per state event, named by its mode."""
        for transition in self.model.events.transitions:
            if transition.timed or transition.index in self.indicators:
                continue
            mode = self.model.flat_discretes[transition.mode]
            every = len(transition.sources) == len(mode.names)
            leaving = "any mode" if every else " or ".join(mode.names[k] for k in transition.sources)
            description = f"{mode.path}: {leaving} → {mode.names[transition.target]} above zero"
            name = f"event_indicator[{transition.index + 1}]"
            self.indicators[transition.index] = self.add(name, ("guard", transition.index), description=description)

    def arrays(self) -> Iterator[FmuVariable]:
        """Tables: parameters `clutch.mu_pos[2,1]` belong together."""
        cells = (v for v in self.found if v.causality == "parameter" and v.name.endswith("]"))
        for number, (name, group) in enumerate(groupby(cells, lambda variable: variable.name.rpartition("[")[0])):
            numbers = tuple(group)
            dimensions = tuple(int(size) for size in numbers[-1].name[len(name) + 1 : -1].split(","))
            units = {str(variable.unit): variable.unit for variable in numbers}
            yield FmuVariable(
                name, len(self.found) + number, "Float64", "parameter", "tunable", None, numbers[0].slot,
                next(iter(units.values())) if len(units) == 1 else ONE, _table_text(numbers, dimensions),
                elements=tuple(variable.reference for variable in numbers), dimensions=dimensions,
            )  # fmt: skip


def _table_text(numbers: Sequence[FmuVariable], dimensions: tuple[int, ...]) -> str:
    columns = numbers[: dimensions[1]] if len(dimensions) > 1 else numbers[:1]
    return "rows of " + ", ".join(column.description.partition(" in row 1 of ")[0] for column in columns)


def fmi_name(name: str) -> str:
    """Write nested derivatives as structured names of FMI: `der(der(a.b))` becomes `der(a.b,2)`."""
    depth = name.count("der(") if name.startswith("der(") else 0
    return name if depth < 2 else f"der({name[4 * depth : -depth]},{depth})"


def _about(quantity: FlatVariable | FlatParameter) -> dict[str, Any]:
    about: dict[str, Any] = {
        "unit": quantity.unit,
        "description": quantity.description,
        "min": quantity.min,
        "max": quantity.max,
    }
    if isinstance(quantity, FlatVariable) and quantity.nominal != 1.0:
        about["nominal"] = abs(quantity.nominal)
    return about


class _Starts:
    """Start values that an importer may replace: of variables by their names, and `discrete` ones."""

    def __init__(self, model: CompiledDae) -> None:
        self.model, tables = model, start_tables(model)
        arguments = (0.0, model.starts.guesses, model.starts.z_guesses, model.p, model.u)
        discrete = model.starts.discretes(*arguments, np.zeros(model.discrete_size)).full().ravel()
        self._values = model.starts.values(*arguments, discrete).full().ravel()
        self.tables, self.discrete = tables, discrete.tolist()
        self._rows = {k for k, _, _ in tables.rows}
        used = self._rows | {k for _, k, _ in (*tables.direct, *tables.x_guesses, *tables.z_guesses)}
        if tables.steady is not None:
            used |= {k for _, k, _ in tables.defaults}
        self._of_variable = {entry.node: k for k, entry in reversed([*enumerate(model.starts.entries)]) if k in used}

    def of_variable(self, k: int) -> dict[str, Any]:
        """Start value of a flat variable, given for exactly this name."""
        number = self._of_variable.get(k)
        if number is None:
            return {"initial": "calculated"}
        exact = number in self._rows or self.model.starts.entries[number].strength == "fixed"
        exact = exact and self.tables.steady is None
        start = float(self._values[number])
        return {"initial": "exact" if exact else "approx", "start": start, "start_entry": number}
