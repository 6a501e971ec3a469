"""Components without a counterpart in the standard library, written out as classes with their equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca

from modelica_like.errors import ModelicaTextError
from modelica_like.flatten.template import relative_path
from modelica_like.language import Component, Connector, Input, Output, Parameter, Variable
from modelica_like.language.equation import Equation, as_statement
from modelica_like.language.expr import TIME, symbols_in
from modelica_like.language.fields import Discrete
from modelica_like.language.formula import Formula
from modelica_like.language.places import located
from modelica_like.modelica_text.library import connector_type, table
from modelica_like.units.unit import coherent

_FUNCTIONS = {
    ca.OP_SIN: "sin", ca.OP_COS: "cos", ca.OP_TAN: "tan", ca.OP_ASIN: "asin", ca.OP_ACOS: "acos", ca.OP_ATAN: "atan",
    ca.OP_EXP: "exp", ca.OP_LOG: "log", ca.OP_SQRT: "sqrt", ca.OP_FABS: "abs", ca.OP_SINH: "sinh", ca.OP_COSH: "cosh",
    ca.OP_TANH: "tanh", ca.OP_SIGN: "sign", ca.OP_FLOOR: "floor", ca.OP_CEIL: "ceil", ca.OP_FMIN: "min",
    ca.OP_FMAX: "max", ca.OP_ATAN2: "atan2",
}  # fmt: skip
_SIGNS = {
    ca.OP_ADD: "+", ca.OP_SUB: "-", ca.OP_MUL: "*", ca.OP_DIV: "/", ca.OP_POW: "^", ca.OP_CONSTPOW: "^",
    ca.OP_LT: "<", ca.OP_LE: "<=", ca.OP_EQ: "==", ca.OP_NE: "<>", ca.OP_AND: "and", ca.OP_OR: "or",
}  # fmt: skip
_SINGLE: dict[int, Callable[[str], str]] = {
    ca.OP_NEG: lambda x: f"(-{x})", ca.OP_SQ: lambda x: f"{x}^2", ca.OP_TWICE: lambda x: f"(2*{x})",
    ca.OP_INV: lambda x: f"(1/{x})", ca.OP_NOT: lambda x: f"(not {x})", ca.OP_ASSIGN: lambda x: x,
}  # fmt: skip


def class_of_equations(component: Component, name: str, write_formula: Callable[[Formula], str]) -> str:
    """Return the text of a class with the equations of a component, its values as defaults.

    Args:
        component: without parts and modes.
        name: of the class.
        write_formula: writes the formula of a default.

    Raises:
        ModelicaTextError: it has parts, modes or discrete values.
    """
    discrete = [key for key, one in component.fields.items() if isinstance(one, Discrete)]
    if component.parts or component.modes or discrete:
        what = "parts of its own" if component.parts else f"the modes {', '.join([*component.modes, *discrete])}"
        raise ModelicaTextError(
            f"{component.label} is a {type(component).__name__}, for which the Modelica Standard Library has no class, "
            f"and it has {what}.",
            where=component.place_of(),
            advice="Only components whose equations are smooth are written out as classes.",
        )
    lines = [f"model {name}", *_declarations(component, write_formula), "equation"]
    for item, source in located(component.equations()):
        statement = as_statement(item, source, type(component).__name__)
        if isinstance(statement, Equation):
            lines.append(f"  {_text(statement.left, component)} = {_text(statement.right, component)};")
    return "\n".join([*lines, f"end {name};"])


def _declarations(component: Component, write_formula: Callable[[Formula], str]) -> list[str]:
    lines = [f"  {connector_class(one)} {key};" for key, one in component.connectors.items() if one.used]
    for key, field in component.fields.items():
        if isinstance(field, Parameter):
            value = component.value(key)
            if value is None:
                continue
            given, default = key in component._values, ""
            if not given:
                default = f" = {value.number!r}" if value.formula is None else f" = {write_formula(value.formula)}"
            lines.append(f"  parameter Real {key}{_attributes(str(coherent(value.unit)))}{default};")
        elif isinstance(field, Input | Output):
            kind = "RealInput" if isinstance(field, Input) else "RealOutput"
            lines.append(f"  Modelica.Blocks.Interfaces.{kind} {key}{_attributes(field.unit_text)};")
        elif isinstance(field, Variable):
            chosen = "" if field.state == "default" else f"stateSelect = StateSelect.{field.state}"
            lines.append(f"  Real {key}{_attributes(field.unit_text, chosen)};")
    return lines


def _attributes(unit: str, *more: str) -> str:
    texts = [f'unit = "{unit}"'] if unit not in ("1", "*", "") else []
    texts += [one for one in more if one]
    return f"({', '.join(texts)})" if texts else ""


def connector_class(connector: Connector) -> str:
    """Return the class of the standard library for a connector.

    Raises:
        ModelicaTextError: there is none.
    """
    for path in table()["connectors"]:
        if connector_type(path) is type(connector):
            return path
    raise ModelicaTextError(f"{connector.label} is a {type(connector).__name__}, which has no counterpart in Modelica.")


def _text(expression: Any, component: Component) -> str:
    node = ca.SX(expression)
    if node.is_constant():
        return repr(float(node))
    if node.is_symbolic():
        symbol = symbols_in(node)[0]
        path = "time" if symbol is TIME else relative_path(symbol.owner, component, symbol.name)
        return "der(" * symbol.order + path + ")" * symbol.order
    operation, args = node.op(), [_text(node.dep(k), component) for k in range(node.n_dep())]
    if operation in _SIGNS:
        return f"({args[0]} {_SIGNS[operation]} {args[1]})"
    if operation in _SINGLE:
        return _SINGLE[operation](args[0])
    if operation == ca.OP_IF_ELSE_ZERO:
        return f"noEvent(if {args[0]} then {args[1]} else 0)"
    if operation in _FUNCTIONS:
        made = f"{_FUNCTIONS[operation]}({', '.join(args)})"
        return f"noEvent({made})" if _FUNCTIONS[operation] in ("sign", "floor", "ceil") else made
    raise ModelicaTextError(f"{component.label} uses a function that Modelica text does not have here.")
