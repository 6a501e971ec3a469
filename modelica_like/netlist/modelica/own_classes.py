"""Components without a counterpart in the standard library, written out as classes with their equations."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable
from typing import Any

import casadi as ca

from modelica_like.errors import ModelicaTextError
from modelica_like.flatten.names import relative_path
from modelica_like.flatten.steps import event_steps
from modelica_like.language import Component, Connector, Equations, Input, Output, Parameter, Variable
from modelica_like.language.discrete import INITIAL, TERMINAL, Assertion, Ending, Marker, Pre, When, silence
from modelica_like.language.equation import Equation, as_statement
from modelica_like.language.expr import TIME, Symbol, operands, symbols_in
from modelica_like.language.fields import Discrete
from modelica_like.language.formula import Formula
from modelica_like.language.inside import inside
from modelica_like.language.mode import StartMode, Transition
from modelica_like.language.places import located
from modelica_like.language.units.unit import coherent
from modelica_like.netlist.modelica.library import connector_type, table
from modelica_like.netlist.modelica.tokens import identifier

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
NO_EQUATIONS = "Impacts, shared loads and states that modes take away are no equations of Modelica text."
_JOINING = {ca.OP_AND, ca.OP_OR, ca.OP_NOT}
_CONDITIONS = {*_JOINING, ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE}


def class_of_equations(
    component: Component, name: str, write_formula: Callable[[Formula], str], driven: frozenset[str]
) -> str:
    """Return the text of a class with the equations of a component, its values as defaults.

    Args:
        component: without parts.
        name: of the class.
        write_formula: writes the formula of a default.
        driven: names of the connected signals; other inputs become parameters.

    Raises:
        ModelicaTextError: it has parts, or a mode that is ideal or holds a motion.
    """
    what = "parts of its own" if component.parts else beyond_equations(component)
    if what:
        raise ModelicaTextError(
            f"{component.label} is a {type(component).__name__}, for which the Modelica Standard Library has no class, "
            f"and it has {what}.",
            where=component.place_of(),
            advice=NO_EQUATIONS,
        )
    lines = [f"model {name}", *_declarations(component, write_formula, driven), "equation"]
    lines += [*equation_lines(component.equations(), component), *event_lines(component, component, component.modes)]
    if begin := equation_lines(component.initial_equations(), component):
        lines += ["initial equation", *begin]
    return "\n".join([*lines, f"end {name};"])


def beyond_equations(component: Component) -> str:
    """Return what of the modes of a component no equation says, or an empty text."""
    held = ((key, mode) for key, mode in component.modes.items() if mode.holds or mode.ideal)
    phrases = (f"the mode {key}, which {'is ideal' if mode.ideal else 'holds a motion'}" for key, mode in held)
    return next(phrases, "")


def equation_lines(written: Equations, root: Component) -> list[str]:
    """Return equations as lines of text, with names as seen from `root`."""
    lines: list[str] = []
    for item, source in located(written):
        statement = as_statement(item, source, type(root).__name__)
        if isinstance(statement, Equation):
            sides = ca.vertsplit(ca.cse(ca.vertcat(statement.left, statement.right)))
            events = event_steps(sides[0] - sides[1])
            left, right = (value_text(side, root, events=events) for side in sides)
            lines.append(f"  {left} = {right};")
    return lines


def event_lines(component: Component, root: Component, modes: Iterable[str]) -> list[str]:
    """Return the equations of the modes: a mode changes where a transition from its value before has its condition.

    Args:
        component: whose events are written.
        root: names are as seen from it.
        modes: those that have an equation; others never change, and nothing uses them.

    Raises:
        ModelicaTextError: there are events that are not written.
    """
    events = [e for e, _ in located(component.events())]
    lines: list[str] = []
    for name, mode in ((name, component.modes[name]) for name in modes):
        goes = [e for e in events if isinstance(e, Transition) and e.mode.mode is mode and not e.fails]
        begins = [e for e in events if isinstance(e, StartMode) and e.mode.mode is mode]
        chosen = " else".join(f"if {_condition(b.when, root, True)} then {mode.number(b.target)}" for b in begins)
        first = str(mode.number(component.start_mode(name)))
        first = f"{chosen} else {first}" if chosen else first
        rest = "".join(f" elseif {_due(t, component, root)} then {mode.number(t.target)}" for t in goes)
        name = identifier(relative_path(component, root, name))
        lines.append(f"  {name} = if initial() then ({first}){rest} else pre({name});")
    resets = [e for e in events if isinstance(e, Transition) and e.reset]
    for k, event in enumerate(resets):
        # What is true from the start has no edge in Modelica; here it fires at the start.
        lines.append(f"  {'elsewhen' if k else 'when'} not initial() and {_due(event, component, root)} then")
        for target, value in event.reset.items():
            symbol, new = symbols_in(target)[0], value_text(value, root, True)
            field = symbol.owner.fields[symbol.name]
            _check_reset(component, symbol, value)
            path = identifier(relative_path(symbol.owner, root, symbol.name))
            lines.append(f"    {path} = {new};" if isinstance(field, Discrete) else f"    reinit({path}, {new});")
    lines += ["  end when;"] if resets else []
    for event in events:
        if isinstance(event, When):
            lines += _when_lines(event, component, root)
        elif isinstance(event, Assertion):
            lines.append(f"  assert({_condition(event.condition, root)}, {_words(event.text)});")
        elif isinstance(event, Transition) and event.fails:
            words = event.notice.replace('"', "'")
            lines.append(f'  assert(not ({_due(event, component, root, before=False)}), "{words}");')
    return lines


def _when_lines(event: When, component: Component, root: Component) -> list[str]:
    """Return a `when` as lines of text."""
    if 1 < len(event.branches) != len(event.conditions):
        raise ModelicaTextError(
            f"{component.label} has an 'elsewhen' and several conditions in a branch, which is not written.",
            where=event.source, advice="Join the conditions by a Boolean variable.",
        )  # fmt: skip
    conditions = [_instant(each, root) for each in event.conditions]
    if len(event.branches) == 1 and len(conditions) > 1:
        conditions = [f"{{{', '.join(conditions)}}}"]
    lines: list[str] = []
    for condition, (_, values) in zip(conditions, event.branches, strict=True):
        lines.append(f"  {'elsewhen' if lines else 'when'} {condition} then")
        for target, value in values.items():
            symbol, new = symbols_in(target)[0], value_text(value, root)
            if isinstance(symbol, Ending):
                lines.append(f"    assert({new} < 0.5, {_words(symbol.text)});" if symbol.fails else
                             f"    terminate({_words(symbol.text)});")  # fmt: skip
                continue
            path = identifier(relative_path(symbol.owner, root, symbol.name))
            discrete = isinstance(symbol.owner.fields[symbol.name], Discrete)
            lines.append(f"    {path} = {new};" if discrete else f"    reinit({path}, {new});")
    return [*lines, "  end when;"]


def _instant(condition: Any, root: Component) -> str:
    """Return the condition of a `when`, which may be a tick."""
    clocks = [s for s in symbols_in(condition) if isinstance(s, Marker) and s.kind == "clock"]
    if clocks:
        return f"sample({value_text(clocks[0].offset, root)}, {value_text(clocks[0].of, root)})"
    return _condition(condition, root)


def _words(text: str) -> str:
    """Return what a message says as a text of Modelica, which has no values in braces."""
    return '"' + re.sub(r"[{}]", "", text).replace('"', "'") + '"'


def _due(transition: Transition, component: Component, root: Component, *, before: bool = True) -> str:
    """Return the condition of a transition, with modes and discrete values before the event or after it."""
    name = identifier(relative_path(component, root, transition.mode.mode.name))
    name = f"pre({name})" if before else name
    sources = " or ".join(f"{name} == {transition.mode.mode.number(source)}" for source in transition.sources)
    when = (
        f"time >= {value_text(transition.at, root, before)}"
        if transition.when is None
        else _condition(transition.when, root, before)
    )
    return f"({sources}) and {when}"


def _check_reset(component: Component, target: Symbol, value: Any) -> None:
    """Refuse a new value that follows from what it sets: Modelica takes variables after the event."""
    if not isinstance(component.fields.get(target.name), Discrete):
        return
    equations = (as_statement(item, source, "") for item, source in located(component.equations()))
    sides = [side for e in equations if isinstance(e, Equation) for side in (e.left, e.right)]
    states = {s.name for side in sides for s in symbols_in(side) if s.order}
    for symbol in symbols_in(ca.SX(value)):
        if (
            symbol is not TIME
            and isinstance(symbol.owner.fields.get(symbol.name), Variable)
            and symbol.name not in states
        ):
            raise ModelicaTextError(
                f"{component.label} sets {target.name} at an event by {symbol.name} before it, which has no Modelica "
                "text."
            )


def _declarations(component: Component, write_formula: Callable[[Formula], str], driven: frozenset[str]) -> list[str]:
    lines = [f"  {connector_class(c)} {identifier(key)};" for key, c in component.connectors.items() if c.used]
    for key, field in component.fields.items():
        if isinstance(field, Parameter) or (isinstance(field, Input) and key not in driven):
            value = component.value(key)
            if value is None:
                continue
            given, default = key in inside(component).values, ""
            if not given:
                default = f" = {value.number!r}" if value.formula is None else f" = {write_formula(value.formula)}"
            lines.append(f"  parameter Real {identifier(key)}{_attributes(str(coherent(value.unit)))}{default};")
        elif isinstance(field, Input | Output):
            kind = "RealInput" if isinstance(field, Input) else "RealOutput"
            lines.append(f"  Modelica.Blocks.Interfaces.{kind} {identifier(key)}{_attributes(field.unit_text)};")
        elif isinstance(field, Variable):
            begin = f"start = {field.default!r}" if isinstance(field.default, int | float) else ""
            chosen = "" if field.state == "default" else f"stateSelect = StateSelect.{field.state}"
            # What initial equations determine is a parameter.
            kind, chosen = ("parameter Real", "fixed = false") if field.constant else ("Real", chosen)
            lines.append(f"  {kind} {identifier(key)}{_attributes(field.unit_text, begin, chosen)};")
        elif isinstance(field, Discrete):
            start = component.start(key)
            number = 0.0 if start is None else start.number
            text = write_formula(start.formula) if start is not None and start.formula is not None else repr(number)
            lines.append(f"  discrete Real {identifier(key)}(start = {text});")
    for key, mode in component.modes.items():
        numbers = ", ".join(f"{number}: {name}" for number, name in enumerate(mode.names))
        lines.append(f'  Integer {identifier(key)}(start = {mode.number(component.start_mode(key))}) "{numbers}";')
    return _arrays(lines)


def _arrays(lines: list[str]) -> list[str]:
    """Join the declarations of `x[1]` and `x[2]` to one of an array: they differ in their index only."""
    joined: dict[str, tuple[str, int]] = {}
    for line in lines:
        whole, index = re.sub(r"(?<=\w)\[\d+\]", "[#]", line, count=1), re.search(r"(?<=\w)\[(\d+)\]", line)
        each = whole if index is None else re.sub(r"\b(unit|start|stateSelect) =", r"each \1 =", whole)
        joined[whole] = each, max(int(index[1]) if index else 0, joined.get(whole, ("", 0))[1])
    return [each.replace("[#]", f"[{count}]", 1) for each, count in joined.values()]


def _attributes(unit: str, *more: str) -> str:
    texts = [f'unit = "{unit}"'] if unit not in ("1", "*", "") else []
    texts += [operand for operand in more if operand]
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


def _is_condition(node: Any) -> bool:
    """Return whether an expression is a condition; in the language it is also the number 1 or 0, in Modelica not."""
    if node.is_symbolic():
        symbol = symbols_in(node)[0]
        return isinstance(symbol, Marker) and symbol.kind == "relation"
    return not node.is_constant() and node.op() in _CONDITIONS


def _condition(expression: Any, component: Component, before: bool = False, events: Collection[int] = ()) -> str:
    """Return a condition as text; for the arguments see `_text`."""
    node = ca.SX(expression)
    if node.is_constant():
        return str(bool(float(node))).lower()
    text = _text(node, component, before, events)
    # A Boolean variable is a number here.
    return f"({text} > 0.5)" if node.is_symbolic() and symbols_in(node)[0].owner is not None else text


def value_text(expression: Any, component: Component, before: bool = False, events: Collection[int] = ()) -> str:
    """Return a number as text; for the arguments see `_text`."""
    node = ca.SX(expression)
    text = _text(node, component, before, events)
    if not _is_condition(node):
        return text
    text = f"if {text} then 1 else 0"
    return f"({text})" if _has_events(node, events) else f"noEvent({text})"


def _text(expression: Any, component: Component, before: bool = False, events: Collection[int] = ()) -> str:
    """Return an expression as text, with values before an event or the present ones, and steps that make events."""
    node = ca.SX(expression)
    if node.is_constant():
        number = float(node)
        return repr(number) if number >= 0 else f"({number!r})"
    if node.is_symbolic():
        symbol = symbols_in(node)[0]
        if any(symbol is each for each in (TIME, INITIAL, TERMINAL)):
            return symbol.name
        if isinstance(symbol, Pre) and symbol.owner is not None and symbol.of.name in symbol.owner.fields:
            return f"pre({identifier(relative_path(symbol.owner, component, symbol.of.name))})"
        if isinstance(symbol, Marker) and symbol.kind in ("relation", "floor"):
            if symbol.kind == "relation":
                return _condition(symbol.of, component, before)
            return f"floor({value_text(symbol.of, component, before)})"
        owner = symbol.owner  # None of what only the language has, such as a delay
        field = owner.fields.get(symbol.name) if owner is not None else None
        if owner is None or (field is None and symbol.name not in getattr(owner, "modes", {})):
            raise ModelicaTextError(f"{component.label} asks for {symbol.name}, which Modelica text cannot say.")
        path = identifier(relative_path(owner, component, symbol.name))
        if before and (field is None or isinstance(field, Discrete)):
            return f"pre({path})"
        return "der(" * symbol.order + path + ")" * symbol.order
    if silence(node):
        return _condition(node.dep(0), component, before)
    operation, args = node.op(), list[str]()
    compared = operation in (ca.OP_EQ, ca.OP_NE) and all(map(_is_condition, operands(node)))
    for k, operand in enumerate(operands(node)):
        joined = operation in _JOINING or compared or (operation == ca.OP_IF_ELSE_ZERO and k == 0)
        args.append((_condition if joined else value_text)(operand, component, before, events))
    quiet = not _has_events(node, events)
    if operation in _SIGNS:
        return f"({args[0]} {_SIGNS[operation]} {args[1]})"
    if operation in _SINGLE:
        return _SINGLE[operation](args[0])
    if operation == ca.OP_IF_ELSE_ZERO:
        text = f"if {args[0]} then {args[1]} else 0"
        return f"noEvent({text})" if quiet else f"({text})"
    if operation in _FUNCTIONS:
        text = f"{_FUNCTIONS[operation]}({', '.join(args)})"
        return f"noEvent({text})" if quiet and _FUNCTIONS[operation] in ("sign", "floor", "ceil") else text
    raise ModelicaTextError(f"{component.label} uses a function that Modelica text does not have here.")


def _has_events(node: Any, identities: Collection[int]) -> bool:
    """Tell whether an expression has steps that make events."""
    if node.is_symbolic():
        return isinstance(symbols_in(node)[0], Marker)
    return node.element_hash() in identities or any(_has_events(operand, identities) for operand in operands(node))
