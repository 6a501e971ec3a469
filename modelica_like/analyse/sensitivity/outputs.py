"""Names of outputs: `table.s`, `max(shaft.tau)`, `clutch.lock_time`."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import UnknownName, ValueOutOfRange, did_you_mean
from modelica_like.solve.recorder import Event
from modelica_like.units import Unit, parse_unit, to_si

_CALL = re.compile(r"\s*(max|min|integral|at|series|time)\s*\((.*)\)\s*$")
_CHANGE = re.compile(
    r"\s*(?P<mode>[^:\s]+)\s*(?::\s*(?P<before>\w+)\s*)?(?:→|->)\s*(?P<after>\w+)\s*(?:,\s*(?P<number>\d+))?\s*$"
)
_ENERGY = {"loss_energy": 1, "source_energy": 2}
_POWERS = {"stored_energy": 0, "loss_power": 1, "source_power": 2}
_SECOND, _JOULE, _WATT = parse_unit("s"), parse_unit("J"), parse_unit("W")


@dataclass(frozen=True)
class Output:
    """One output to differentiate.

    Attributes:
        name: as given.
        unit: its unit.
        kind: `end`, `at`, `max`, `min`, `integral`, `series` or `time`.
        path: the variable, or the mode.
        moment: time of `at` in s.
        change: which mode change: names before (may be empty) and after, and its number among those.
    """

    name: str
    unit: Unit
    kind: str
    path: str
    moment: float = 0.0
    change: tuple[str, str, int] = ("", "", 1)

    def is_change(self, event: Event) -> bool:
        """Return whether an event is such a mode change."""
        before, after, _ = self.change
        return event.mode == self.path and before in ("", event.before) and after in ("", event.after)


def listed(names: str | Sequence[str], what: str) -> list[str]:
    """Return one name or several as a list.

    Raises:
        ValueOutOfRange: there is none.
    """
    found = [names] if isinstance(names, str) else list(names)
    if not found:
        raise ValueOutOfRange(f"There is no {what}: give at least one name.")
    return found


def read_output(model: CompiledDae, name: str) -> Output:
    """Read the name of an output.

    Raises:
        UnknownName: the model has no such output.
    """
    called = _CALL.match(name)
    if called is None:
        return _plain(model, name.strip())
    kind, inside = called.group(1), called.group(2).strip()
    if kind == "time":
        return _mode_change(model, name, inside)
    path, _, moment = inside.partition(",") if kind == "at" else (inside, "", "")
    unit = expression_of(model, path.strip())[1]
    if kind == "integral":
        unit = _JOULE if str(unit) == "W" else unit * _SECOND
    return Output(name, unit, kind, path.strip(), to_si(moment.strip(), _SECOND, name) if kind == "at" else 0.0)


def _plain(model: CompiledDae, name: str) -> Output:
    owner, _, last = name.rpartition(".")
    if name in model.position:
        return Output(name, expression_of(model, name)[1], "end", name)
    if last in _ENERGY and owner in model.components:
        return Output(name, _JOULE, "integral", name)
    if last in ("lock_time", "unlock_time"):
        found = _holding_mode(model, owner)
        if found is not None:
            mode, held = found
            return Output(name, _SECOND, "time", mode, change=("", held, 1) if last == "lock_time" else (held, "", 1))
    return Output(name, expression_of(model, name)[1], "end", name)


def _holding_mode(model: CompiledDae, owner: str) -> tuple[str, str] | None:
    """The mode of a component in which it holds a motion, and the name of that."""
    for one in model.holds:
        if one.component == owner:
            mode = model.flat_discretes[one.mode]
            return mode.path, mode.names[one.number]
    return None


def _mode_change(model: CompiledDae, name: str, inside: str) -> Output:
    parts = _CHANGE.match(inside)
    modes = {one.path: one.names for one in model.flat_discretes if one.names}
    if parts is None:
        raise UnknownName(
            f"'{name}' does not say which mode change.",
            advice="Write time(clutch.mode: forward -> stuck), and a number if it happens again: "
            "time(clutch.mode -> stuck, 2).",
        )
    mode = parts["mode"]
    if mode not in modes:
        raise UnknownName(f"{model.name} has no mode '{mode}'{did_you_mean(mode, modes) or '.'}")
    for one in (parts["before"], parts["after"]):
        if one is not None and one not in modes[mode]:
            raise UnknownName(
                f"{mode} has no mode '{one}'{did_you_mean(one, modes[mode]) or '.'} It has {', '.join(modes[mode])}."
            )
    return Output(
        name, _SECOND, "time", mode, change=(parts["before"] or "", parts["after"], int(parts["number"] or 1))
    )


def expression_of(model: CompiledDae, path: str) -> tuple[Callable[[], Any], Unit]:
    """Return a function that makes the SX of a variable or energy term in the model's arguments, and the unit.

    Raises:
        UnknownName: there is no such variable.
    """
    arguments = model.arguments.values()
    if path in model.position:
        k = model.position[path]
        return lambda: model.variables(*arguments)[k], model.units[path]
    owner, _, last = path.rpartition(".")
    columns = _POWERS | _ENERGY
    if last in columns and owner in model.components:
        # The model itself means all its components together.
        rows = [model.components.index(owner)] if owner else list(range(len(model.components)))
        unit = _JOULE if last in (*_ENERGY, "stored_energy") else _WATT
        return lambda: ca.sum1(model.energy(*arguments)[rows, columns[last]]), unit
    known = [*model.position, *(f"{one}.{last}" for one in model.components if last in columns)]
    if owner in model.components:
        known += [f"{owner}.{word}" for word in (*columns, "lock_time", "unlock_time")]
    raise UnknownName(
        f"{model.name} has no variable '{path}'{did_you_mean(path, known) or '.'}",
        advice="Other outputs are max(…), min(…), integral(…), at(…, time), series(…), "
        "time(mode: before -> after), and of components loss_energy, source_energy, lock_time, unlock_time.",
    )


def quadratures(model: CompiledDae, outputs: Sequence[Output]) -> tuple[Any, str]:
    """Return all integrands of outputs as one SX column, and a name for them."""
    paths = [one.path for one in outputs if one.kind == "integral"]
    column = ca.vertcat(*(expression_of(model, path)[0]() for path in paths)) if paths else ca.SX(0, 1)
    return column, ";".join(paths)
