"""Checks of one component class: number of equations, and dimensions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import casadi as ca

from modelica_like.errors import ComponentUnbalanced, ModelicaLikeError, Source, UnitMismatch, raise_together_or_one
from modelica_like.flatten.dimensions import Dimensions, check_equation, check_expression
from modelica_like.language.component import Component
from modelica_like.language.declared import Declared
from modelica_like.language.delay import Part
from modelica_like.language.discrete import Pre
from modelica_like.language.equation import Equation
from modelica_like.language.expr import TIME, symbols_in
from modelica_like.language.fields import Field, Input, Parameter, Variable
from modelica_like.language.inside import inside
from modelica_like.language.units import ANY, ONE, Unit, parse_unit

_SECOND = parse_unit("s")
_PAIR = 2
"""Fewer values cannot disagree."""
_ENERGY_UNITS = {"stored_energy": parse_unit("J"), "loss_power": parse_unit("W"), "source_power": parse_unit("W")}


def unit_of_field(owner: Declared, name: str) -> Unit:
    """Return the unit of a field: as declared, or that of its value where `*` is declared."""
    declared = owner.fields[name].unit
    if declared == ANY and isinstance(owner, Component) and isinstance(owner.fields[name], Parameter | Input):
        value = owner.value(name)
        return ANY if value is None else value.unit
    return declared


def check_balance(component: Component, equations: list[Equation], joined: set[str]) -> None:
    """Check that a component has as many equations as unknowns of its own.

    Args:
        component: of the class to check.
        equations: its own.
        joined: own signals and connectors in its connections, which give outputs and flows their equations.

    Raises:
        ComponentUnbalanced: it does not.
    """
    variables = [n for n, f in component.fields.items() if isinstance(f, Variable) and not isinstance(f, Input)]
    unknowns = [n for n in variables if n not in joined]
    used = {name: c for name, c in component.connectors.items() if c.used and name not in joined}
    unknowns += [f"{name}.{n}" for name, c in used.items() for n, f in c.quantities.items() if f.is_flow]
    if len(equations) + inside(component).lent == len(unknowns):
        return
    kind = type(component).__name__
    count = f"{len(equations)} equation{'s' if len(equations) != 1 else ''}"
    listed = f"{len(unknowns)} unknowns ({', '.join(unknowns)})" if unknowns else "no unknowns of its own"
    what = f"{kind} declares {count} for {listed}."
    base = type(component).__mro__[1]
    missing = len(equations) < len(unknowns)
    if missing and not component.units_checked:
        advice = "Each own variable, output and flow needs one: add an equation, or take the unknown away."
    elif missing and getattr(base, "equations", Component.equations) is not Component.equations:
        advice = f"Its base {base.__name__} has equations of its own: is `yield from super().equations()` missing?"
    elif missing:
        advice = "Each own variable, output and flow needs one: is a `yield` missing?"
    elif driven := _driven_input(component, equations):
        advice = (
            f"{driven} is an input of a part: inputs are connected, not set by equations. "
            f"Declare an output in {kind}, and yield connect(self.…, self.{driven})."
            if component.units_checked
            else f"{driven} is an input of a part: connect it, or write one equation, {driven} = …"
        )
    else:
        advice = "Each own variable, output and flow takes one: remove an equation, or declare the missing unknown."
    where = equations[-1].source if equations else component.place_of()
    raise ComponentUnbalanced(what, where=where, advice=advice)


def _driven_input(component: Component, equations: list[Equation]) -> str:
    """Return an input of a part that occurs in an equation, relative to the component, or an empty text."""
    leaves = (symbol for e in equations for side in (e.left, e.right) for symbol in symbols_in(side))
    foreign = (symbol for symbol in leaves if isinstance(symbol.owner, Component) and symbol.owner is not component)
    prefix = component.path
    paths = (f"{s.owner.path}.{s.name}" for s in foreign if isinstance(s.owner.fields.get(s.name), Input))
    return next((path.removeprefix(f"{prefix}.") for path in paths), "")


def check_units(
    component: Component, equations: list[Equation], events: Sequence[Any], updates: Sequence[Any],
    delays: Sequence[Any],
) -> dict[str, Unit]:  # fmt: skip
    """Check every equation; return the units that `*` outputs take from their equations.

    Args:
        component: of the class to check.
        equations: its own.
        events: its transitions and start modes.
        updates: new values at events.
        delays: delayed values, with their places.

    Raises:
        UnitMismatch, LanguageError: all errors, reported together.
    """
    inferred, errors, wrong = dict[str, Unit](), list[ModelicaLikeError](), set[Source]()
    dimensions = Dimensions(lambda leaf: _unit_of_leaf(component, inferred, leaf, dimensions))
    kind = type(component).__name__

    def attempt(check: Any, *arguments: Any) -> None:
        try:
            check(*arguments)
        except ModelicaLikeError as error:
            if str(error) not in map(str, errors):  # both directions of a relation have the same one
                errors.append(error)

    for equation in equations:
        before = len(errors)
        attempt(_infer, component, equation, dimensions, inferred)
        attempt(check_equation, equation.left, equation.right, dimensions, kind, equation.source)
        if len(errors) > before:
            wrong.add(equation.source)
    for event in events:
        if event.when is not None and event.source not in wrong:  # its steps are told with the equation
            attempt(check_expression, event.when, ONE, dimensions, f"{kind}, condition", event.source)
        if getattr(event, "at", None) is not None:
            attempt(check_expression, event.at, _SECOND, dimensions, f"{kind}, time of an event", event.source)
        for target, value in getattr(event, "reset", {}).items():
            attempt(check_equation, target, ca.SX(value), dimensions, kind, event.source)
    for update in updates:
        attempt(check_expression, update.active, ONE, dimensions, f"{kind}, condition", update.source)
        attempt(check_equation, ca.SX(update.target), ca.SX(update.value), dimensions, kind, update.source)
    for delay, source in delays:
        attempt(check_expression, delay.offset, _SECOND, dimensions, f"{kind}, delay", source)
    for label, unit in _ENERGY_UNITS.items():
        attempt(check_expression, getattr(component, label)(), unit, dimensions, f"{kind}.{label}")
    if errors:
        raise _by_any_units(component, errors) or raise_together_or_one(errors)
    return inferred


def _by_any_units(component: Component, errors: Sequence[ModelicaLikeError]) -> UnitMismatch | None:
    """Say which units of `*` parameters do not fit together; the equations of a library do not tell that."""
    fields, values = component.fields.items(), inside(component).values
    given = [(name, unit_of_field(component, name)) for name, field in fields
             if isinstance(field, Parameter) and field.unit_text == "*" and name in values]  # fmt: skip
    if len(given) < _PAIR or not all(isinstance(error, UnitMismatch) for error in errors):
        return None
    units = ", ".join(f"{name} in {unit}" for name, unit in given)
    return UnitMismatch(f"{component.label} ({type(component).__name__}): its units do not fit together: {units}.",
                        where=component.place_of(), why=errors[0].what)  # fmt: skip


def _unit_of_leaf(component: Component, inferred: dict[str, Unit], leaf: Any, dimensions: Dimensions) -> Unit:
    symbol = symbols_in(leaf)[0]
    symbol = symbol.of if isinstance(symbol, Pre) else symbol
    if symbol is TIME:
        return _SECOND
    if isinstance(symbol, Part):
        return dimensions.unit_or_any(symbol.of)
    if symbol.owner is None or not isinstance(symbol.owner.fields.get(symbol.name), Field):
        return ONE
    unit = unit_of_field(symbol.owner, symbol.name)
    if unit == ANY and symbol.owner is component:
        unit = inferred.get(symbol.name, ANY)
    return unit / _SECOND**symbol.order


def _infer(component: Component, equation: Equation, dimensions: Dimensions, inferred: dict[str, Unit]) -> None:
    for side, other in ((equation.left, equation.right), (equation.right, equation.left)):
        if not cast(Any, side).is_symbolic():
            continue
        symbol = symbols_in(side)[0]
        declared = component.fields.get(symbol.name) if symbol.owner is component and symbol.order == 0 else None
        if isinstance(declared, Variable) and declared.unit == ANY:
            unit = dimensions.unit_or_any(other)
            if unit != ANY:
                inferred.setdefault(symbol.name, unit)
