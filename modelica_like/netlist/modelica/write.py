"""A drive as Modelica text on classes of the standard library: the inverse of reading."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from modelica_like.errors import ModelicaTextError
from modelica_like.language import Assembly, Component, Connector, Input, Output, Parameter
from modelica_like.language.fields import Value
from modelica_like.language.formula import Formula
from modelica_like.language.inside import declarations, inside
from modelica_like.language.places import located
from modelica_like.language.units import coherent, parse_unit, read_quantity, to_si
from modelica_like.netlist.convert import as_assembly
from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.elements import extent, in_braces, named_at, place_of
from modelica_like.netlist.modelica.library import Known, by_component, table
from modelica_like.netlist.modelica.lift import is_given, lifted
from modelica_like.netlist.modelica.own_classes import class_of_equations, connector_class
from modelica_like.netlist.modelica.parse import parse_expression
from modelica_like.netlist.modelica.tokens import identifier
from modelica_like.netlist.modelica.tree import calls_in, names_in
from modelica_like.netlist.modelica.written import InsideWritten

_PRECEDENCE = {"+": 1, "-": 1, "*": 2, "/": 2, "**": 4}
_BLOCKS = "Modelica.Blocks.Interfaces.Real"


def modelica_text(model: Component) -> str:
    """Return a drive as Modelica text; reading it gives the same drive.

    Args:
        model: an assembly, or a component that has only parts and connections.

    Raises:
        ModelicaTextError: a part, or one of its values, has no counterpart in Modelica.
        NetlistError: the model has equations of its own.
    """
    assembly = model if isinstance(model, Assembly) else as_assembly(model)
    return "\n\n".join(_Writer().classes(lifted(assembly))) + "\n"


class _Writer:
    """Collects the classes of assemblies and of components with equations; the drive itself is the last one."""

    def __init__(self) -> None:
        self.made: dict[str, str] = {}

    def classes(self, assembly: Assembly) -> list[str]:
        name = _class_name(assembly)
        text = self.model(assembly, name)
        while name in self.made:
            name = f"{name}_"
            text = self.model(assembly, name)
        return [*self.made.values(), text]

    def model(self, assembly: Assembly, name: str) -> str:
        """Return the class of an assembly."""
        record = inside(assembly)
        if isinstance(record, InsideWritten) and (record.statements or record.initial or record.happenings):
            raise ModelicaTextError(
                f"{assembly.label} is {record.text}, a class of Modelica text with equations of its own.",
                where=assembly.place_of(),
                advice="Parts and connections are written, such a class is not: use the text it comes from.",
            )
        joined = {_path(assembly, end) for ends in self._wires(assembly) for end in ends}
        quoted = inside(assembly).description.replace("\\", "\\\\").replace('"', '\\"')
        lines = [f'model {name} "{quoted}"' if quoted else f"model {name}"]
        for key, field in assembly.fields.items():
            if isinstance(field, Parameter):
                lines.append(self._parameter(assembly, key, field))
        lines += [f"  {connector_class(c)} {identifier(key)};" for key, c in assembly.connectors.items()]
        for key, field in assembly.fields.items():
            if isinstance(field, Input | Output):
                lines.append(f"  {_BLOCKS}{type(field).__name__} {identifier(key)};")
        arrays: dict[str, dict[str, Component]] = {}
        for key, part in assembly.parts.items():
            arrays.setdefault(key.partition("[")[0], {})[key] = part
        lines += [f"  {self._declaration(assembly, key, parts, joined)};" for key, parts in arrays.items()]
        lines.append("equation")
        lines += [f"  connect({left}, {right});" for left, right in self._pairs(assembly)]
        until = inside(assembly).simulate.get("until")
        if until is not None:
            seconds = to_si(until, parse_unit("s"), "until")
            first = to_si(inside(assembly).simulate.get("from", 0.0), parse_unit("s"), "from")
            begin = f"StartTime = {_number(first)}, " if first else ""
            lines.append(f"  annotation(experiment({begin}StopTime = {_number(seconds)}));")
        return "\n".join([*lines, f"end {name};"])

    # -- declarations ------------------------------------------------------------------------------------------------

    def _parameter(self, assembly: Assembly, key: str, field: Parameter) -> str:
        """Return the declaration of a parameter, by its default if the owner's modification has its value."""
        value = assembly.value(key)
        if value is None:
            raise ModelicaTextError(f"{assembly.label}.{key} has no value.")
        if is_given(assembly, key):
            value = replace(value, formula=None, number=None) if field.default is None else field.read(field.default)
        unit = str(coherent(value.unit))
        attribute = f'(unit = "{unit}")' if unit not in ("1", "*", "") else ""
        text = "" if value.formula is None and value.number is None else f" = {self.value(value, assembly)}"
        return f"  parameter Real {identifier(key)}{attribute}{text};"

    def _declaration(self, owner: Assembly, name: str, parts: dict[str, Component], joined: set[str]) -> str:
        """Return the declaration of a part, or of the elements of an array."""
        arguments = [self._part(owner, path, part, joined) for path, part in parts.items()]
        if name in parts:
            return f"{arguments[0][0]} {identifier(name)}{_arguments(arguments[0][1])}"
        shape = extent(map(place_of, parts))
        kinds = {kind for kind, _ in arguments}
        keys = {tuple(values) for _, values in arguments}
        if len(kinds) != 1 or len(keys) != 1:
            raise ModelicaTextError(
                f"{owner.label}.{name} is an array of different parts, which Modelica does not have.",
                where=owner.source_of(f"parts.{name}"), advice="Give each part a name of its own.",
            )  # fmt: skip
        values = {
            key: (f"each {key}", arguments[0][1][key])
            if all(a[key] == arguments[0][1][key] for _, a in arguments)
            else (key, in_braces([a[key] for _, a in arguments], shape))
            for key in keys.pop()
        }
        return f"{kinds.pop()} {identifier(name)}{named_at('', shape)}{_arguments(dict(values.values()))}"

    def _part(self, owner: Assembly, path: str, part: Component, joined: set[str]) -> tuple[str, dict[str, str]]:
        """Return the class of a part and the arguments of its modification."""
        if isinstance(part, Assembly):
            name = _class_name(part)
            text = self.model(part, name)
            while self.made.get(name, text) != text or name in owner.parts:
                name = f"{name}_"
                text = self.model(part, name)
            self.made[name] = text
            values = inside(part).values.items()
            return name, {identifier(key): self.value(value, owner) for key, value in values if is_given(part, key)}
        entry = by_component().get(type(part).__name__)
        if entry is None or entry.type is not type(part):
            for key, connector in part.connectors.items():
                inside(connector).used = not connector.optional or f"{path}.{key}" in joined
            name = f"{type(part).__name__}_{re.sub('[^a-zA-Z0-9]', '_', path)}"
            driven = frozenset(key for key in part.fields if f"{path}.{key}" in joined)
            text = class_of_equations(part, name, lambda formula: formula_text(formula, part), driven)
            self.made[name] = text
            given = {identifier(key): self.value(value, owner) for key, value in inside(part).values.items()}
            return name, {**given, **self._starts(part, None, owner)}
        values = _Arguments(self, owner, path, part, entry, joined)
        return entry.path, {**values.read(), **self._starts(part, entry, owner)}

    def _starts(self, part: Component, entry: Known | None, owner: Assembly) -> dict[str, str]:
        starts: dict[str, dict[str, Value]] = {}
        below = [(f"{node.path.removeprefix(f'{part.path}.')}.", node) for node in part.walk() if node is not part]
        every = [("", part), *below]
        given = [(f"{path}{name}", value) for path, node in every for name, value in inside(node).starts.items()]
        for name, value in given:
            there = entry.there(name) if entry else name
            if "." in there:
                raise ModelicaTextError(f"The start value of {part.label}.{name} has no counterpart in Modelica text.")
            starts.setdefault(there.partition("[")[0], {})[there] = value
        if inside(part).start_modes:
            raise ModelicaTextError(f"{part.label} has a start mode, which Modelica text does not say here.")
        return dict.fromkeys((self._start(base, start, part, owner) for base, start in starts.items()), "")

    def _start(self, base: str, given: dict[str, Value], part: Component, owner: Assembly) -> str:
        """Return the modification of a start value, or of those of all elements of an array."""
        if base in given:
            fixed = ", fixed = true" if given[base].fixed else ""
            return f"{identifier(base)}(start = {self.value(given[base], owner)}{fixed})"
        elements = [given.get(name) for name in part.fields if name.startswith(f"{base}[")]
        values = ", ".join("0" if element is None else self.value(element, owner) for element in elements)
        fixed = ", ".join(str(element is not None and element.fixed).lower() for element in elements)
        return f"{identifier(base)}(start = {{{values}}}, fixed = {{{fixed}}})"

    def value(self, value: Value, owner: Component) -> str:
        return _number(value.number or 0.0) if value.formula is None else formula_text(value.formula, owner)

    # -- connections -------------------------------------------------------------------------------------------------

    def _wires(self, assembly: Assembly) -> Iterator[list[Any]]:
        for statement, _ in located(assembly.equations()):
            ends = getattr(statement, "ends", None)
            if ends is not None:
                yield list(ends)

    def _pairs(self, assembly: Assembly) -> Iterator[tuple[str, str]]:
        for ends in self._wires(assembly):
            texts = [_there(assembly, end) for end in ends]
            for text in texts[1:]:
                yield texts[0], text


class _Arguments:
    """The values of a component as parameters of its class."""

    def __init__(
        self, writer: _Writer, owner: Assembly, path: str, part: Component, entry: Known, joined: set[str]
    ) -> None:
        self.writer, self.owner, self.path, self.part, self.known, self.joined = (
            writer,
            owner,
            path,
            part,
            entry,
            joined,
        )
        self.declared, self.values = declarations(part), inside(part).values
        self.done: dict[str, str] = {}

    def read(self) -> dict[str, str]:
        replaced = {name for text in self.known.put.values() for name in _fields(text)}
        replaced |= {scale for name in self.declared.tables for scale in self._scales(name)}
        for name, value in self.values.items():
            if name in self.known.instead:
                for there, text in self.known.instead[name].items():
                    self.done[there] = self._expression(text)
            elif name in self.known.absent:
                raise self._refused(name, value.given)
            elif name not in replaced:
                there = self.known.there(name)
                self.done.setdefault(there, self.writer.value(value, self.owner))
        for name in self.declared.structural:
            if name not in replaced:
                self._structural(name, getattr(self.part, name))
        for there, text in self.known.put.items():
            self._put(there, text)
        self._defaults()
        for name, field in self.part.fields.items():
            value = self.part.value(name) if isinstance(field, Input) else None
            if value is not None and name not in replaced and f"{self.path}.{name}" not in self.joined:
                self.done.setdefault(self.known.there(name), self.writer.value(value, self.owner))
        for name, flag in (("support", "useSupport"), ("heat_port", "useHeatPort")):
            if f"{self.path}.{name}" in self.joined:
                self.done[flag] = "true"
        return self.done

    def _structural(self, name: str, value: Any) -> None:
        if name in self.known.fix:
            if value != self.known.fix[name]:
                # The last value holds: a row more makes the last slope zero.
                if name != "extrapolate" or value != "hold":
                    raise self._refused(name, value)
                for table in self.declared.tables:
                    rows = getattr(self.part, table)
                    if len(rows) > 1 and rows[-1][1:] != rows[-2][1:]:
                        more = (*rows, (rows[-1][0] + max(abs(rows[-1][0]), 1.0), *rows[-1][1:]))
                        self.done[self.known.there(table)] = self._plain(table, more)
        elif value != self.declared.structural[name] or any(self._scales(name)):
            if name in self.known.absent:
                raise self._refused(name, value)
            self.done.setdefault(self.known.there(name), self._plain(name, value))

    def _scales(self, name: str) -> list[str]:
        """Return the parameters that scale the columns of a table, empty where none is given."""
        columns = self.declared.tables[name].columns if name in self.declared.tables else ()
        given = (column.scale in self.values and column.scale not in self.known.names for column in columns)
        return [column.scale if scaled else "" for column, scaled in zip(columns, given, strict=True)]

    def _put(self, there: str, text: str) -> None:
        if text.startswith("connected "):
            if f"{self.path}.{text.split()[1]}" in self.joined:
                self.done[there] = "true"
            return
        names = _fields(text)
        if any(f"{self.path}.{name}" in self.joined for name in names):
            return
        given = [name for name in names if name in self.values or name in self.declared.structural]
        if given or all(name in self.declared.structural or self.part.value(name) is not None for name in names):
            self.done[there] = self._expression(text)

    def _expression(self, text: str) -> str:
        """Return an expression of the component's fields with their values."""
        result = text
        for name in _fields(text):
            if name in self.declared.structural:
                value = self._plain(name, getattr(self.part, name))
            else:
                field_value = self.part.value(name)
                value = self.writer.value(field_value, self.owner) if field_value is not None else name
                value = value if re.fullmatch(r"[\w.]+", value) else f"({value})"
            result = re.sub(rf"(?<![\w.]){name}(?![\w.])", lambda _, value=value: value, result)
        node = parse_expression(result)
        if any(True for _ in names_in(node)) or any(True for _ in calls_in(node)):
            return result
        value = fold.known(node)
        return result if value.kind == "array" else self._plain("", value.args[0])

    def _defaults(self) -> None:
        """Write what the component takes where its class has another default."""
        for there in self.known.default:
            here = self.known.here(there)
            if there in self.done or there in self.known.only or there in self.known.put:
                continue
            if here in self.declared.structural:
                self.done[there] = self._plain(here, getattr(self.part, here))
                continue
            value = self.part.value(here) if here in self.part.fields else None
            if value is not None:
                self.done[there] = self.writer.value(value, self.owner)
        for there, only in self.known.only.items():
            default = self.known.default.get(there, only)
            if default != only:
                self.done[there] = str(only).lower()

    def _plain(self, name: str, value: Any) -> str:
        if isinstance(value, bool):
            return str(value).lower()
        if isinstance(value, int | float):
            return _number(value)
        if isinstance(value, str):
            for kind, choices in table()["enumerations"].items():
                for choice, ours in choices.items():
                    if ours == value and (kind == "Extrapolation") == (name == "extrapolate"):
                        return f"Modelica.Blocks.Types.{kind}.{choice}"
            raise self._refused(name, value)
        if value and isinstance(value[0], tuple):
            factors = [f"*{self._expression(scale)}" if scale else "" for scale in self._scales(name)]
            factors += [factors[-1] if factors else ""] * len(value[0])
            rows = (
                ", ".join(f"{_number(number)}{by}" for number, by in zip(row, factors, strict=False)) for row in value
            )
            return f"[{'; '.join(rows)}]"
        return "{" + ", ".join(self._plain(name, item) for item in value) + "}"

    def _refused(self, name: str, value: Any) -> ModelicaTextError:
        return ModelicaTextError(
            f"{self.path}.{name} = {value} has no counterpart in {self.known.path}.",
            where=self.owner.source_of(f"parts.{self.path.partition('[')[0]}"),
        )


def formula_text(formula: Formula, owner: Component, outer: int = 0) -> str:
    """Return a formula as Modelica text; quantities become numbers in SI units."""
    kind, operands = formula.operation, formula.operands
    if kind == "number":
        return _number(operands[0]) if operands[0] >= 0 else f"({_number(operands[0])})"
    if kind == "quantity":
        number, unit = read_quantity(operands[0]) or (0.0, None)
        return _number(to_si(operands[0], unit, "quantity") if unit is not None else number)
    if kind == "name":
        path = operands[0] if isinstance(operands[0], str) else operands[0].name
        part, _, name = path.rpartition(".")
        entry = by_component().get(type(owner.find(part)).__name__) if part else None
        return identifier(f"{part}.{entry.there(name) if entry else name}" if part else name)
    if kind == "neg":
        return f"(-{formula_text(operands[0], owner, 3)})"
    if kind not in _PRECEDENCE:
        return f"{kind}({', '.join(formula_text(operand, owner) for operand in operands)})"
    precedence = _PRECEDENCE[kind]
    left, right = (
        formula_text(operands[0], owner, precedence + (kind == "**")),
        formula_text(operands[1], owner, precedence + 1),
    )
    text = f"{left}{'^' if kind == '**' else f' {kind} '}{right}"
    return f"({text})" if precedence < outer else text


def _fields(text: str) -> list[str]:
    if text.startswith("connected "):
        return []
    return sorted({name.path for name in names_in(parse_expression(text))}, key=len, reverse=True)


def _there(assembly: Assembly, end: Any) -> str:
    """Return the path of an end in Modelica."""
    path = _path(assembly, end)
    owner, _, name = path.rpartition(".")
    if not owner:
        return identifier(name)
    head, *rest = owner.split(".")
    part = assembly.parts[head]
    entry = by_component().get(type(part).__name__)
    inner = ".".join([*rest, name])
    return identifier(f"{head}.{entry.there(inner) if entry and entry.type is type(part) else inner}")


def _path(assembly: Assembly, end: Any) -> str:
    whole = end.path if isinstance(end, Connector) else ".".join(filter(None, (end.owner.path, end.name)))
    return whole.removeprefix(f"{assembly.path}.") if assembly.path else whole


def _class_name(assembly: Assembly) -> str:
    told = (inside(assembly).description and Path(inside(assembly).origin).stem) or inside(assembly).name
    name = re.sub(r"\W", "_", re.sub(r"\[\d+\]$", "", told))  # elements of an array have one class
    name = name or "drive"
    return name[:1].upper() + name[1:] if not name[0].isdigit() else f"Drive_{name}"


def _arguments(values: Mapping[str, str]) -> str:
    texts = [f"{key} = {value}" if value else key for key, value in values.items()]
    # A modification has no dots: record.P = 1 is record(P = 1).
    texts = [re.sub(r"^(each )?(\w+)\.(\w+ = .*)$", r"\1\2(\3)", text) for text in texts]
    return f"({', '.join(texts)})" if texts else ""


def _number(value: float) -> str:
    whole = float(value)
    return str(int(whole)) if whole == int(whole) and abs(whole) < 1e15 else repr(whole)
