"""A drive as one model with all of its equations: `from-modelica --flat`.

Records hold the declarations, so names stay what they are; every equation stands in the model, with full names.
"""

from __future__ import annotations

import re
from textwrap import indent
from typing import Any

import casadi as ca

from modelica_like.errors import ModelicaTextError
from modelica_like.flatten.flatten import flatten
from modelica_like.language.assembly import Assembly
from modelica_like.language.component import Component
from modelica_like.language.declared import Connector
from modelica_like.language.expr import symbol_of
from modelica_like.language.fields import Discrete, Field, Input, Parameter, Variable
from modelica_like.language.inside import inside
from modelica_like.netlist.modelica.elements import Place, elements_of, extent, in_braces, named_at, place_of
from modelica_like.netlist.modelica.own_classes import (
    NO_EQUATIONS,
    beyond_equations,
    equation_lines,
    event_lines,
    value_text,
)
from modelica_like.netlist.modelica.tokens import identifier

_Tree = dict[str, Any]
"""Modifications by name: a text, or those within a part or a variable."""
_ABSENT = {"start": "0", "fixed": "false"}
"""Of an element of an array, where another one has it."""


def flat_text(root: Assembly) -> str:
    """Return the flattened equations of a drive as a model of Modelica text; reading it gives the same run.

    Args:
        root: the drive.

    Raises:
        ModelicaTextError: a part has modes that hold a motion or are ideal, or what Modelica text does not have.
        MissingValue, FreeFlange, WiringErrors: the drive is not complete.
    """
    for part in root.walk():
        if what := beyond_equations(part):
            raise ModelicaTextError(
                f"{part.label} has {what}, so it is not written flat.", where=part.place_of(), advice=NO_EQUATIONS
            )
    return _Flat(root).text()


class _Flat:
    def __init__(self, root: Assembly) -> None:
        self.root, self.flat = root, flatten(root)
        items = [*self.flat.variables, *self.flat.parameters, *self.flat.derived, *self.flat.discretes]
        self.units = {item.path: str(item.unit) for item in items}
        self.records: dict[str, str] = {}
        self.given = _Tree()

    def text(self) -> str:
        self._values()
        lines = self._members(self.root, "")
        equations, begin, events = list[str](), list[str](), list[str]()
        for part in self.root.walk():
            equations += equation_lines(part.equations(), self.root)
            begin += equation_lines(part.initial_equations(), self.root)
            modes = [name for name in part.modes if f"{part.path}.{name}".lstrip(".") in self.units]
            events += event_lines(part, self.root, modes)
        body = [*lines, "equation", *self._connections(), *equations, *events]
        body += ["initial equation", *begin] if begin else []
        until = inside(self.root).simulate.get("until")
        first = inside(self.root).simulate.get("from", "0 s").split()[0]
        if until is not None:
            body.append(f"  annotation(experiment(StartTime = {first}, StopTime = {until.split()[0]}));")
        records = [f"  record {name}\n{indent(members, '  ')}\n  end {name};" for members, name in self.records.items()]
        name = re.sub(r"\W", "_", inside(self.root).name or type(self.root).__name__)
        about = inside(self.root).description
        return (
            "\n".join([f"model {name}" + f' "{_quoted(about)}"' * bool(about), *records, *body, f"end {name};"]) + "\n"
        )

    def _values(self) -> None:
        """Gather what is given to parameters, and the start values, by path."""
        known = ((self._meant(item.path), item.value) for item in self.flat.parameters)
        self._known = ca.vertcat(*(value if symbol is None else symbol for symbol, value in known))
        formulas = ca.vertsplit(self.flat.formulas) if self.flat.derived else []
        pairs = [(item.path, ca.SX(item.value)) for item in self.flat.parameters]
        pairs += [(item.path, formula) for item, formula in zip(self.flat.derived, formulas, strict=True)]
        for path, value in pairs:
            if self._meant(path) is not None:
                self._give(path.split("."), self._expression(value))
        for start in self.flat.starts:
            variable = self.flat.variables[start.node]
            if not variable.hidden:
                way = variable.path.split(".")
                self._give([*way, "start"], self._expression(start.value))
                if start.strength == "fixed":
                    self._give([*way, "fixed"], "true")
        for item in self.flat.discretes:
            if not item.hidden:
                start = str(item.start) if item.names else self._expression(item.start)
                self._give([*item.path.split("."), "start"], start)

    def _owner(self, path: str) -> tuple[Any, str]:
        *names, name = path.split(".")
        owner: Any = self.root
        for step in names:
            owner = owner.connectors[step] if step in owner.connectors else owner.parts[step]
        return owner, name

    def _meant(self, path: str) -> Any:
        """Return the symbol of a parameter, None of an input with a value."""
        owner, name = self._owner(path)
        return symbol_of(owner, name) if isinstance(owner.fields[name], Parameter) else None

    def _expression(self, value: Any) -> str:
        return value_text(ca.substitute(ca.SX(value), self.flat.p, self._known), self.root)

    def _give(self, way: list[str], text: str) -> None:
        tree = self.given
        for step in way[:-1]:
            tree = tree.setdefault(step, {})
        tree[way[-1]] = text

    def _members(self, owner: Component | Connector, prefix: str) -> list[str]:
        """Return the declarations of a part, those of the drive itself with all values; arrays have one."""
        values = _merged(self.given) if owner is self.root else {}
        kinds: dict[str, dict[str, str]] = {}
        about: dict[str, str] = {}
        for name, field in owner.fields.items():
            if f"{prefix}{name}" in self.units:
                base = name.partition("[")[0]
                kinds.setdefault(base, {})[name] = self._kind(owner, field)
                values[base] = self._attributes(f"{prefix}{name}", field, values.get(base, {}), each="[" in name)
                about[base] = field.description
        if isinstance(owner, Component):
            for name, mode in owner.modes.items():
                if f"{prefix}{name}" in self.units:
                    kinds[name] = {name: "Integer"}
                    about[name] = ", ".join(f"{number}: {each}" for number, each in enumerate(mode.names))
            within: dict[str, Any] = {key: c for key, c in owner.connectors.items() if c.used}
            for name, part in {**within, **owner.parts}.items():
                kinds.setdefault(name.partition("[")[0], {})[name] = self._record(part, f"{prefix}{name}.")
        lines = list[str]()
        for base, elements in kinds.items():
            if len({*elements.values()}) > 1:
                what = f"{prefix}{base} is an array of different parts, which Modelica does not have."
                raise ModelicaTextError(what, advice="Give each part a name of its own.")
            size = named_at("", extent(map(place_of, elements)))
            text = f"  {next(iter(elements.values()))} {identifier(base)}{size}{_modified(values.get(base))}"
            lines.append(f'{text} "{_quoted(about[base])}";' if about.get(base) else f"{text};")
        return lines

    def _kind(self, owner: Component | Connector, field: Field) -> str:
        """Return what stands before the name of a variable."""
        if isinstance(field, Parameter) or (isinstance(field, Variable) and field.constant):
            return "parameter Real"
        if isinstance(field, Discrete):
            return "discrete Real"
        return "input Real" if isinstance(field, Input) and owner is self.root else "Real"

    def _attributes(self, path: str, field: Field, given: Any, *, each: bool) -> dict[str, str]:
        """Return the attributes of a variable, or of all elements of an array; a value has no name."""
        word = "each " if each else ""
        result = {f"{word}unit": f'"{self.units[path]}"'} if self.units[path] not in ("1", "*", "") else {}
        if field.nominal != 1.0:
            result[f"{word}nominal"] = repr(field.nominal)
        if isinstance(field, Variable) and field.state != "default":
            result[f"{word}stateSelect"] = f"StateSelect.{field.state}"
        if isinstance(field, Variable) and field.constant:
            result[f"{word}fixed"] = "false"
        return {**result, **(given if isinstance(given, dict) else {"": given})}

    def _record(self, part: Any, prefix: str) -> str:
        """Return the name of the record with the declarations of a part."""
        lines = "\n".join(self._members(part, prefix))
        if lines not in self.records:
            base, numbers = type(part).__name__, range(1, len(self.records) + 2)
            self.records[lines] = next(n for k in numbers if (n := f"{base}_{k}") not in self.records.values())
        return self.records[lines]

    def _connections(self) -> list[str]:
        """Return the equations of connections, of ends that are free, and of inputs with a value."""
        lines = list[str]()
        for row in self.flat.linear:
            if row.row is not None:
                continue
            (first, sign), *others = row.terms
            # All coefficients are 1 or -1.
            terms = [f"{'-' if c == sign else '+'} {identifier(self.flat.node_name(node))}" for node, c in others]
            right = " ".join(terms).removeprefix("+ ") or self._expression(-ca.SX(row.constant) / sign)
            lines.append(f"  {identifier(self.flat.node_name(first))} = {right};")
        return lines


def _merged(tree: _Tree) -> _Tree:
    """Return modifications in which those of `x[1]` and `x[2]` are those of the array `x`."""
    result, arrays = _Tree(), dict[str, dict[Place, Any]]()
    for name, value in tree.items():
        each = _merged(value) if isinstance(value, dict) else value
        if place := place_of(name):
            arrays.setdefault(name.partition("[")[0], {})[place] = each
        else:
            result[name] = each
    for base, elements in arrays.items():
        shape = extent(elements)
        result[base] = _joined(base, [elements.get(place, {}) for _, place in elements_of(base, shape)], shape)
    return result


def _joined(name: str, elements: list[Any], shape: tuple[int, ...]) -> Any:
    keys = dict.fromkeys(key for each in elements if isinstance(each, dict) for key in each)
    if keys:
        return {key: _joined(key, [each.get(key, {}) for each in elements], shape) for key in keys}
    return in_braces([each or _ABSENT[name] for each in elements], shape)


def _modified(given: Any) -> str:
    """Return a modification; a value without a name is that of what is modified."""
    if not isinstance(given, dict):
        return f" = {given}" if given else ""
    parts = [f"{_name(key)}{_modified(each)}" for key, each in given.items() if key]
    return (f"({', '.join(parts)})" if parts else "") + _modified(given.get(""))


def _name(key: str) -> str:
    each, _, name = key.rpartition(" ")
    return f"{each} {identifier(name)}".lstrip()


def _quoted(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"')
