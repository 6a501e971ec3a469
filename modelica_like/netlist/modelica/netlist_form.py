"""From a component read from Modelica text to a netlist with units."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from modelica_like.errors import ModelicaLikeError, ModelicaTextError, UnitError
from modelica_like.language import Assembly, Component, Connector, Input, Output, Parameter, guess
from modelica_like.language.assembly import end_at
from modelica_like.language.fields import Field, Value
from modelica_like.language.formula import Formula
from modelica_like.language.inside import declarations, inside
from modelica_like.language.units import ANY, ONE, Unit, parse_unit, same_dimension
from modelica_like.netlist import dumps, loads
from modelica_like.netlist.modelica.read import load_modelica
from modelica_like.netlist.modelica.tree import Expr
from modelica_like.netlist.modelica.written import Written

_GAINS = {"Gain": 0, "FirstOrder": 0, "SecondOrder": 0, "TransferFunction": 0, "Integrator": -1, "Derivative": 1}
"""Blocks with y = k·u, and the power of the second in the unit of k beside y/u."""
_SECOND = parse_unit("s")


def netlist_text(model: Written, folder: Path, notes: list[str]) -> str:
    """Return the netlist of a model that is only parts and connections.

    Args:
        model: read from Modelica text.
        folder: where the netlist will lie.
        notes: remarks are appended.

    Raises:
        ModelicaTextError: it has equations of its own that its parts depend on.
        NetlistError: a part cannot be named in a netlist.
    """
    assembly = _Form(model, notes).assembly()
    text = dumps(assembly, folder=folder)
    loads(text, str(folder / "netlist.toml"))
    return text


class _Form:
    def __init__(self, model: Written, notes: list[str]) -> None:
        self.model, self.notes = model, notes
        self.units: dict[tuple[str, str], Unit] = {}
        self.wires = list(model.wires.values())
        self.parameters = {name: field.unit for name, field in model.fields.items() if isinstance(field, Parameter)}

    def assembly(self) -> Assembly:
        self._left_out()
        self._signal_units()
        self._parameter_units()
        parts = {
            name: [self._part(f"{name}[{k}]", element) for k, element in enumerate(part, 1)]
            if isinstance(part, list)
            else self._part(name, part)
            for name, part in inside(self.model).parts.items()
        }
        parameters: dict[str, Any] = {}
        for name, unit in self.parameters.items():
            value = self.model.value(name)
            if value is None:
                raise ModelicaTextError(f"{name} has no value.")
            parameters[name] = self._text(value, unit, name)
        assembly = Assembly(
            inside(self.model).name, parts=parts, free=self.model.free_ends, description=inside(self.model).description,
            parameters=parameters, connect={_wire_name(ends, k): ends for k, ends in enumerate(self.wires, 1)},
        )  # fmt: skip
        shown = {path: unit for path, unit in inside(self.model).display.items() if _is_shown(assembly, path, unit)}
        inside(assembly).simulate, inside(assembly).display = dict(inside(self.model).simulate), shown
        return assembly

    def _left_out(self) -> None:
        """Leave out variables that are only computed from the parts; refuse equations that the parts depend on."""
        signals = {name for name, field in self.model.fields.items() if not isinstance(field, Parameter)}
        joined = {end for ends in self.wires for end in ends}
        record = inside(self.model)
        defined = {left.args[0][0] for left, _, _ in record.statements if left.kind == "name"}
        if defined != signals or signals & joined or record.happenings or record.initial:
            raise ModelicaTextError(
                f"{inside(self.model).name} has equations of its own; a netlist contains only parts and connections.",
                where=[source for _, _, source in (*record.initial, *record.statements)[:1]],
                advice="Load the text itself: load and all commands read it like a netlist.",
            )  # fmt: skip
        if signals:
            self.notes.append(f"{', '.join(sorted(signals))}: left out, because a netlist has no equations.")

    # -- units -------------------------------------------------------------------------------------------------------

    def _end(self, end: str) -> tuple[Component, str] | None:
        """Return part and name of a signal, None for a connector."""
        resolved = end_at(self.model, end)
        return None if isinstance(resolved, Connector) else (resolved.owner, resolved.name)

    def _signal_units(self) -> None:
        """Find the units of signals whose blocks take any: from the ends that have one, through the blocks."""
        sets = [[place for end in ends if (place := self._end(end)) is not None] for ends in self.wires]
        blocks = [part for part in self.model.walk() if part is not self.model]
        while True:
            while self._along(sets) or any(self._through(block) for block in blocks):
                pass
            open_ends = [(part, name) for ends in sets for part, name in ends if self._unit(part, name) is None]
            if not open_ends:
                return
            self._set(*open_ends[0], ONE)

    def _along(self, sets: list[list[tuple[Component, str]]]) -> bool:
        changed = False
        for ends in sets:
            units = [unit for e in ends if (unit := self._unit(*e)) is not None]
            for end in ends:
                if units and self._unit(*end) is None:
                    self._set(*end, units[0])
                    changed = True
        return changed

    def _through(self, block: Component) -> bool:
        """Pass units through a block; tell whether one was found."""
        kind = type(block).__name__
        ports = [name for name, f in block.fields.items() if isinstance(f, Input | Output) and f.unit == ANY]
        if kind == "Product":
            y, u1, u2 = (self._unit(block, name) for name in ("y", "u1", "u2"))
            units_of = {
                "y": u1 * u2 if u1 and u2 else None,
                "u1": y / u2 if y and u2 else None,
                "u2": y / u1 if y and u1 else None,
            }
            new = [name for name, unit in units_of.items() if unit is not None and self._unit(block, name) is None]
            for name in new:
                self._set(block, name, units_of[name])
            return bool(new)
        value = block.value("k") if kind in _GAINS else None
        if kind in _GAINS and value is not None and value.formula is None:
            return False  # the unit of k may be any: it follows from both sides
        if kind in _GAINS:
            return self._gain(block, value)
        units = next((unit for name in ports if (unit := self._unit(block, name)) is not None), None)
        new = [name for name in ports if units is not None and self._unit(block, name) is None]
        for name in new:
            self._set(block, name, units)
        return bool(new)

    def _gain(self, block: Component, value: Value | None) -> bool:
        factor = self._formula_unit(value.formula) if value is not None and value.formula is not None else None
        u, y = self._unit(block, "u"), self._unit(block, "y")
        if factor is None or (u is None) == (y is None):
            return False
        factor = factor / _SECOND ** _GAINS[type(block).__name__]
        if u is not None:
            self._set(block, "y", u * factor)
        elif y is not None:
            self._set(block, "u", y / factor)
        return True

    def _unit(self, part: Component, name: str) -> Unit | None:
        declared = part.fields[name].unit
        takes_any = declared == ANY or (declared == ONE and not part.units_checked)  # the second one: of an own class
        return self.units.get((part.path, name)) if takes_any else declared

    def _set(self, part: Component, name: str, unit: Unit | None) -> None:
        if unit is not None:
            self.units[part.path, name] = unit

    def _own_unit(self, part: Component, name: str) -> Unit:
        """Return the unit of a parameter that takes any."""
        kind = type(part).__name__
        if kind in _GAINS and name == "k":
            u, y = self._unit(part, "u") or ONE, self._unit(part, "y") or ONE
            return y / u * _SECOND ** _GAINS[kind]
        ports = (self._unit(part, key) for key, field in part.fields.items() if isinstance(field, Input | Output))
        return next((unit for unit in ports if unit is not None), ONE)

    def _parameter_units(self) -> None:
        """A parameter without a unit takes that of the value it is given to as it is."""
        for part in self.model.parts.values():
            for name, value in inside(part).values.items():
                formula = value.formula
                if formula is not None and formula.operation == "name" and self.parameters.get(str(formula)) == ONE:
                    wanted = part.fields[name].unit
                    self.parameters[str(formula)] = wanted if wanted != ANY else self._own_unit(part, name)

    def _formula_unit(self, formula: Formula) -> Unit | None:
        """Return the unit of a formula of this model's parameters, None if its terms do not fit."""

        def unit_of(path: str) -> Unit:
            owner, _, name = path.rpartition(".")
            return self.parameters[path] if not owner else self.model.find(owner).fields[name].unit

        try:
            unit = formula.unit(unit_of)
        except UnitError:
            return None
        return None if unit == ANY else unit

    # -- values ------------------------------------------------------------------------------------------------------

    def _part(self, path: str, part: Component) -> Component:
        twin = part.copy()
        if isinstance(part, Written):
            self._check_class(path, part)
            return twin
        for name, field in part.fields.items():
            value = inside(part).values.get(name)
            free = isinstance(field, Parameter) and field.unit == ANY
            unit = self._own_unit(part, name) if free else field.unit
            default = field.default if value is None and free and isinstance(field.default, int | float) else None
            if value is not None:
                twin.give(name, self._text(value, unit, f"{path}.{name}"))
            elif default and not same_dimension(unit, ONE):
                twin.give(name, _quantity(float(default), unit))
            start = inside(part).starts.get(name)
            if start is not None:
                text = self._text(start, field.unit, f"{path}.{name}")
                twin.give(name, text if start.fixed else guess(text))
        return twin

    def _check_class(self, path: str, part: Written) -> None:
        """Refuse a part that its class alone does not give: a netlist changes numbers, not equations."""
        record = inside(part)
        if _equations(part) == _equations(load_modelica(record.origin)):
            return
        raise ModelicaTextError(
            f"{path} has other equations than its class {record.text}: it is given what a netlist cannot say, such as "
            "a Boolean, an Integer, an enumeration, a table, another class or the variables of a bus.",
            where=part.place_of(),
            advice="Give what it is a name of its own in the text and use that: "
            f"`model Mine extends {record.text}(…); end Mine;`.",
        )

    def _text(self, value: Value, unit: Unit, path: str) -> Any:
        """Return a number with its unit; a formula stays if its unit fits."""
        if value.formula is None:
            return _quantity(value.number or 0.0, unit)
        formula_unit = self._formula_unit(value.formula)
        if formula_unit is not None and (same_dimension(formula_unit, unit) or unit == ANY):
            return value.formula
        number = float(value.formula.evaluate(self._number))
        self.notes.append(
            f"{path} = {value.formula} is the number {number:g} now: the units of the formula do not fit."
        )
        return _quantity(number, unit)

    def _number(self, path: str) -> float:
        owner, _, name = path.rpartition(".")
        value = self.model.find(owner).value(name)
        if value is None:
            raise ModelicaTextError(f"{path} has no value.")
        return (value.number or 0.0) if value.formula is None else float(value.formula.evaluate(self._number))


def _equations(model: Component) -> list[Any]:
    """Return what numbers of a netlist do not change: parts with their structure, connections and equations."""
    every: list[Any] = []
    for part in model.walk():
        path = part.path.removeprefix(model.path)
        structure = {name: getattr(part, name) for name in declarations(part).structural}
        every.append((path, type(part).__name__, structure, sorted(part.fields)))
        if isinstance(part, Written):
            record = inside(part)
            pairs = [(left, right) for left, right, _ in (*record.initial, *record.statements)]
            happenings = [(happening.branches, happening.text) for happening in record.happenings]
            every.append(([*part.wires.values()], _without_lines((pairs, happenings))))
    return every


def _without_lines(node: Any) -> Any:
    """Return expressions without their places."""
    if isinstance(node, Expr):
        return node.kind, _without_lines(node.args)
    if isinstance(node, Mapping):
        return {name: _without_lines(value) for name, value in node.items()}
    return [_without_lines(part) for part in node] if isinstance(node, list | tuple) else node


def _quantity(number: float, unit: Unit) -> Any:
    plain = int(number) if number == int(number) and abs(number) < 1e15 else number
    return plain if same_dimension(unit, ONE) and str(unit) in ("1", "") else f"{plain!r} {unit}"


def _is_shown(model: Assembly, path: str, unit: str) -> bool:
    owner, _, name = path.rpartition(".")
    try:
        field: Field | None = model.find(owner).fields.get(name)
        return field is not None and not isinstance(field, Parameter) and same_dimension(field.unit, parse_unit(unit))
    except (UnitError, ModelicaLikeError):
        return False


def _wire_name(ends: tuple[str, ...], number: int) -> str:
    return f"{ends[0].partition('.')[0].partition('[')[0]}_{number}"
