"""Names of readings, such as `table.s`, `peak(2*clutch.tau)`, `clutch.lock_time`, and what they consist of."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import casadi as ca
import numpy as np

from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import UnknownName, ValueOutOfRange, did_you_mean
from modelica_like.language.units import ONE, Unit, parse_unit, to_si
from modelica_like.runs.calls import call_of, formula_beside
from modelica_like.runs.signals import formula_of, si_value, unit_of
from modelica_like.solve.recorder import Event

_CONDITION = re.compile(r"(.+?)(<=?|>=?)(.+)")
_CHANGE = re.compile(
    r"\s*(?P<mode>[^:\s]+)\s*(?::\s*(?P<before>\w+)\s*)?(?:→|->)\s*(?P<after>\w+)\s*(?:,\s*(?P<number>-?\d+))?\s*$"
)
_ENERGY = ("loss_energy", "source_energy")
"""Integrals of powers over the whole run."""
_TERMS = {"stored_energy": 0, "loss_power": 1, "source_power": 2}
"""Columns of the energies, which have values over time."""
_HELD = ("lock_time", "unlock_time")
_SECOND, _JOULE, _WATT = parse_unit("s"), parse_unit("J"), parse_unit("W")


_SIGNED: dict[str, tuple[str, ...]] = {"max": ("plain",), "min": ("negative",), "peak": ("plain", "negative")}
INTEGRATED = ("integral", "mean", "rms", "duration")
"""Kinds with an integral."""
CONDITIONS = ("first", "reach")
"""Kinds that are the first time of a condition."""
Form = Literal["plain", "negative", "square", "mode"]
Change = tuple[str, str, str]
"""A mode, its name before (empty: any), and its name after."""


@dataclass(frozen=True)
class Part:
    """What engines read off a run: a reading follows from few kinds of parts.

    Attributes:
        kind: value at the end or at a moment, largest value, integral, first time above zero, first time not below it,
            time of a mode change, energy in J lost in impacts.
        text: variable, energy term or formula; the mode of a change; the component of impacts (empty: all).
        form: of its value: as it is, negative, its square, or 1 where a mode has the number `change[1]`, else 0.
        moment: in s.
        change: numbers of the modes before and after (-1: any), and which of several such changes.
    """

    kind: Literal["end", "at", "max", "integral", "first", "reach", "change", "impact"]
    text: str
    form: Form = "plain"
    moment: float = 0.0
    change: tuple[int, int, int] = (-1, -1, 1)

    def expression(self, model: CompiledDae) -> Any:
        """Return its value at an instant as an SX in the model's arguments."""
        if self.form == "mode":
            return ca.SX(model.arguments["d"][model.discrete_position[self.text]] == self.change[1])
        value = expression_of(model, self.text)[0]()
        return {"plain": value, "negative": -value, "square": value**2}[self.form]


@dataclass(frozen=True)
class Output:
    """A number to read off a run.

    Attributes:
        name: as given.
        unit: its unit.
        kind: `end`, `at`, `max`, `min`, `peak` (largest amount), `integral`, `mean`, `rms`, `first` (when a condition
            with `>` or `<` is true for the first time), `reach` (one with `>=` or `<=`), `duration` (how long a mode
            lasts in all), `time` (of a mode change), `series`, or `formula` of other outputs.
        path: the variable, the formula, or the (first) mode.
        moment: time of `at` in s.
        changes: which mode changes: modes, their names before (may be empty) and after; the first of all counts.
        number: which of several such changes, of one kind.
        struck: whether the integral of a loss contains the energy lost in impacts.
        operands: of a formula, by their names in it; else empty.
    """

    name: str
    unit: Unit
    kind: str
    path: str
    moment: float = 0.0
    changes: tuple[Change, ...] = ()
    number: int = 1
    struck: bool = False
    operands: tuple[Output, ...] = ()

    def is_change(self, event: Event) -> bool:
        """Return whether an event is such a mode change."""
        return any(
            event.mode == mode and before in ("", event.before) and after == event.after
            for mode, before, after in self.changes
        )

    def parts(self, model: CompiledDae) -> list[Part]:
        """Return what it consists of, unless it is a formula."""
        if self.kind in _SIGNED:
            return [Part("max", self.path, form) for form in _SIGNED[self.kind]]  # type: ignore[arg-type]
        if self.kind in ("time", "duration"):
            numbers = [(mode, *_numbers(model, mode, names)) for mode, *names in self.changes]
            if self.kind == "duration":
                return [Part("integral", mode, "mode", change=(-1, after, 1)) for mode, _, after in numbers]
            return [Part("change", mode, change=(before, after, self.number)) for mode, before, after in numbers]
        if self.kind in ("integral", "mean", "rms"):
            parts = [Part("integral", self.path, "square" if self.kind == "rms" else "plain")]
            return [*parts, Part("impact", self.path.rpartition(".")[0])] if self.struck else parts
        return [Part(self.kind, self.path, moment=self.moment)]  # type: ignore[arg-type]

    def combined(self, parts: Vector, span: Any) -> Vector:
        """Return the number from its parts, shape (…, parts), over runs of so many seconds; shape (…,)."""
        match self.kind:
            case "min":
                return -parts[..., 0]
            case "peak":
                return np.max(parts, axis=-1)
            case "mean" | "rms":
                mean = parts[..., 0] / span
                return mean if self.kind == "mean" else np.sqrt(mean)
            case "time":
                return np.fmin.reduce(parts, axis=-1)
            case _:
                return np.sum(parts, axis=-1)

    def formula(self) -> ca.Function:
        """Return a formula as a function of the column of its operands: its value, and the row of its derivatives."""
        names = [operand.name for operand in self.operands]
        column, formula = ca.SX.sym("operands", len(names)), formula_of(self.path)
        assert formula is not None
        quantity: Callable[[str], Any] = lambda text: ca.SX(si_value(text))  # noqa: E731
        value = formula.evaluate(lambda name: column[names.index(name)], quantity)
        return ca.Function("formula", [column], [value, ca.densify(ca.jacobian(value, column))])


def _numbers(model: CompiledDae, mode: str, names: Sequence[str]) -> tuple[int, ...]:
    """Return the numbers of names of a mode; -1 of an empty one."""
    all_names = model.flat_discretes[model.discrete_position[mode]].names
    return tuple(all_names.index(name) if name else -1 for name in names)


def leaves(outputs: Sequence[Output]) -> list[Output]:
    """Return outputs with the operands of formulas in their place."""
    return [leaf for output in outputs for leaf in output.operands or (output,)]


def by_output(outputs: Sequence[Output], values: Sequence[Any]) -> list[list[Any]]:
    """Return what there is of leaves in a list per output."""
    left = iter(values)
    return [[next(left) for _ in output.operands or (output,)] for output in outputs]


def joined(outputs: Sequence[Output], numbers: Sequence[Any]) -> list[Any]:
    """Return the numbers of outputs from those of their leaves, which are floats or have the shape (runs,)."""
    pairs = zip(outputs, by_output(outputs, numbers), strict=True)
    return [np.ravel(output.formula()(np.array(of))[0].full()) if output.operands else of[0] for output, of in pairs]


def listed(names: str | Sequence[str], what: str) -> list[str]:
    """Return one name or several as a list.

    Raises:
        ValueOutOfRange: there is none.
    """
    result = [names] if isinstance(names, str) else list(names)
    if not result:
        raise ValueOutOfRange(f"There is no {what}: give at least one name.")
    return result


def read_number(model: CompiledDae, name: str) -> Output:
    """Read the name of an output that is a number, not a trajectory.

    Raises:
        UnknownName: the model has no such output.
        ValueOutOfRange: it is a trajectory.
    """
    if is_series(name):
        raise ValueOutOfRange(f"{name} is a trajectory, not a number.", advice="Take it from the results.")
    return read_output(model, name)


def is_series(name: str) -> bool:
    """Return whether this is a trajectory, not a number."""
    return name.replace(" ", "").startswith("series(")


def does_not_happen(name: str) -> UnknownName:
    """Return the error about a mode change or condition that a run does not have."""
    return UnknownName(f"'{name}' does not happen in this run.")


def read_output(model: CompiledDae, name: str) -> Output:
    """Read the name of an output.

    Raises:
        UnknownName: the model has no such output.
    """
    called = call_of(name)
    if called is None:
        return _plain(model, name.strip())
    kind, inside = called
    if kind == "time":
        return _mode_change(model, name, inside)
    if kind == "duration":
        mode, _, state = (part.strip() for part in inside.rpartition(":"))
        _check_mode(model, mode, state)
        return Output(name, _SECOND, kind, mode, changes=((mode, "", state),))
    if kind == "first":
        return Output(name, _SECOND, *_condition(model, name, inside))
    path, _, moment = inside.rpartition(",") if kind == "at" else (inside, "", "")
    unit = expression_of(model, path.strip())[1]
    if kind == "integral":
        unit = _JOULE if str(unit) == "W" else unit * _SECOND
    return Output(name, unit, kind, path.strip(), to_si(moment.strip(), _SECOND, name) if kind == "at" else 0.0)


def met(kind: str, value: Any) -> Any:
    """Return whether values of the formula of a condition make it true: signals that step stay at a limit."""
    return value >= 0 if kind == "reach" else value > 0


def _condition(model: CompiledDae, name: str, inside: str) -> tuple[str, str]:
    """Return the kind of a condition, and a formula that is positive, or not negative, where it is true."""
    sides = _CONDITION.fullmatch(inside)
    if sides is None:
        raise UnknownName(
            f"'{name}' has no condition.",
            advice="Compare two values: first(motor.w > 100 rad/s), first(a.tau < b.tau).",
        )
    left, sign, right = (part.strip() for part in sides.groups())
    formula = f"{left} - ({right})" if sign[0] == ">" else f"{right} - ({left})"
    expression_of(model, formula)
    return "reach" if sign.endswith("=") else "first", formula


def _plain(model: CompiledDae, name: str) -> Output:
    """Return a number of the whole run, a value at its end, or a formula of these."""
    whole = _of_whole_run(model, name)
    if whole is not None:
        return whole
    formula = None if _is_variable(model, name) else formula_beside(name)
    names = [] if formula is None else list(dict.fromkeys(formula.names()))
    if formula is None or not any(_of_whole_run(model, path) for path in names):
        return Output(name, expression_of(model, name)[1], "end", name)
    operands = tuple(_plain(model, path) for path in names)
    unit = unit_of(formula, {operand.name: str(operand.unit) for operand in operands}, model.name)
    return Output(name, parse_unit(unit), "formula", name, operands=operands)


def _is_variable(model: CompiledDae, name: str) -> bool:
    """Whether this has a value at every instant by its own name."""
    return name == "time" or any(
        name in positions for positions in (model.position, model.parameter_position, model.discrete_position)
    )


def _of_whole_run(model: CompiledDae, name: str) -> Output | None:
    """Return an energy or the time of a change of a component; None if this is something else."""
    owner, _, last = name.rpartition(".")
    if _is_variable(model, name):
        return None
    if last in _ENERGY and owner in model.components:
        return Output(name, _JOULE, "integral", f"{name.removesuffix('energy')}power", struck=last == "loss_energy")
    changes = _locks(model, owner) if last in _HELD else ()
    if last == "unlock_time":
        changes = tuple((mode, after, before) for mode, before, after in changes)
    return Output(name, _SECOND, "time", changes[0][0], changes=changes) if changes else None


def _without_values(name: str) -> ValueOutOfRange:
    """Return the error about values over time of what is a number of the whole run."""
    advice = f"Ask for {name} itself, or for a formula of such numbers, e.g. 2*{name}."
    if name.endswith(_ENERGY):
        power = f"{name.removesuffix('energy')}power"
        advice = (
            f"Over time there is {power}: ask for integral({power}) or max({power}), or for {name} of a shorter run."
        )
    return ValueOutOfRange(f"{name} is one number of a whole run: it has no values over time.", advice=advice)


def _locks(model: CompiledDae, owner: str) -> tuple[Change, ...]:
    """Return the mode changes by which a component begins to hold a motion: backlash holds in each direction."""
    holds = [(model.flat_discretes[hold.mode], hold.number) for hold in model.held.motions if hold.component == owner]
    held = {(mode.path, mode.names[number]): mode for mode, number in holds}
    return tuple(
        (mode.path, before, after)
        for (_, after), mode in held.items()
        for before in mode.names
        if (mode.path, before) not in held
    )


def _mode_change(model: CompiledDae, name: str, inside: str) -> Output:
    parts = _CHANGE.match(inside)
    if parts is None and _CONDITION.fullmatch(inside) and "->" not in inside:
        advice = f"When a condition is true for the first time is first({inside.strip()})."
        raise UnknownName(f"'{name}': only mode changes have a time(…).", advice=advice)
    if parts is None:
        raise UnknownName(
            f"'{name}' does not say which mode change.",
            advice="Write time(clutch.mode: forward -> stuck), and a number if it happens again: "
            "time(clutch.mode -> stuck, 2).",
        )
    mode = parts["mode"]
    _check_mode(model, mode, *(value for value in (parts["before"], parts["after"]) if value is not None))
    number = int(parts["number"] or 1)
    if number < 1:
        first = inside.rpartition(",")[0].strip()
        raise ValueOutOfRange(
            f"'{name}' asks for mode change {number}: they are counted from 1.",
            advice=f"The first one is time({first}), the second one time({first}, 2).",
        )
    return Output(name, _SECOND, "time", mode, changes=((mode, parts["before"] or "", parts["after"]),), number=number)


def _check_mode(model: CompiledDae, mode: str, *names: str) -> None:
    modes = {discrete.path: discrete.names for discrete in model.flat_discretes if discrete.names}
    if mode not in modes:
        raise UnknownName(f"{model.name} has no mode '{mode}'{did_you_mean(mode, modes) or '.'}")
    for name in names:
        if name not in modes[mode]:
            raise UnknownName(
                f"{mode} has no mode '{name}'{did_you_mean(name, modes[mode]) or '.'} It has {', '.join(modes[mode])}."
            )


def expression_of(model: CompiledDae, path: str) -> tuple[Callable[[], Any], Unit]:
    """Return a function that makes the SX of a variable, energy term or formula in the model's arguments, and the unit.

    Raises:
        UnknownName: there is no such variable.
        ValueOutOfRange: it is a number of a whole run.
        NetlistError, UnitError: it is no formula, or its units do not fit together.
    """
    arguments = model.arguments.values()
    if path in model.position:
        k = model.position[path]
        return lambda: model.equations.variables(*arguments)[k], model.units[path]
    fixed = {"p": model.parameter_position, "d": model.discrete_position, "t": {"time": 0}}
    for symbol, positions in fixed.items():
        if path in positions:
            unit = _SECOND if symbol == "t" else model.units.get(path, ONE)
            value = ca.SX(model.arguments[symbol][positions[path]])
            return partial(ca.SX, value), unit
    formula = formula_of(path)
    if formula is not None:
        parts = {name: expression_of(model, name) for name in formula.names()}
        unit = unit_of(formula, {name: str(unit) for name, (_, unit) in parts.items()}, model.name)
        quantity: Callable[[str], Any] = lambda text: ca.SX(si_value(text))  # noqa: E731
        return lambda: formula.evaluate(lambda name: parts[name][0](), quantity), parse_unit(unit)
    owner, _, last = path.rpartition(".")
    if last in _TERMS and owner in model.components:
        # The model itself means all its components together.
        rows = [model.components.index(owner)] if owner else list(range(len(model.components)))
        unit = _JOULE if last == "stored_energy" else _WATT
        return lambda: ca.sum1(model.energy(*arguments)[rows, _TERMS[last]]), unit
    if _of_whole_run(model, path) is not None:
        raise _without_values(path)
    energies = (*_TERMS, *_ENERGY)
    words = [*model.position, *(f"{component}.{last}" for component in model.components if last in energies)]
    if owner in model.components:
        held = _HELD if _locks(model, owner) else ()
        words += [f"{owner}.{word}" for word in (*energies, *held)]
    raise UnknownName(
        f"{model.name} has no variable '{path}'{did_you_mean(path, words) or '.'}",
        advice="Other outputs are peak(…), max(…), min(…), integral(…), mean(…), rms(…), at(…, time), first(… > …), "
        "duration(mode: name), series(…), time(mode: before -> after), and of components loss_energy, source_energy, "
        "lock_time, unlock_time.",
    )


def quadratures(model: CompiledDae, outputs: Sequence[Output]) -> tuple[Any, str]:
    """Return all integrands of outputs as one SX column, and a name for them."""
    parts = [part for leaf in leaves(outputs) for part in leaf.parts(model) if part.kind == "integral"]
    column = ca.vertcat(*(part.expression(model) for part in parts)) if parts else ca.SX(0, 1)
    return column, ";".join(f"{part.text} {part.form} {part.change}" for part in parts)
