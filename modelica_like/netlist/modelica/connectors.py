"""Connectors of a text, and connectors within connectors."""

from __future__ import annotations

from typing import Any

from modelica_like.errors import Source
from modelica_like.language import Connector, flow, var
from modelica_like.language.fields import Discrete, Input, Variable
from modelica_like.language.inside import inside
from modelica_like.netlist.modelica.attributes import check_attributes
from modelica_like.netlist.modelica.elements import elements_of, place_of
from modelica_like.netlist.modelica.instance import Instance, Member, refused
from modelica_like.netlist.modelica.library import Known, connector_type
from modelica_like.netlist.modelica.members import part_of, sizes
from modelica_like.netlist.modelica.tree import Expr
from modelica_like.netlist.modelica.types import basic_type
from modelica_like.netlist.modelica.values import Notes, nominal_of, unit_of
from modelica_like.netlist.modelica.wiring import INSIDE, Wire, bundled
from modelica_like.netlist.modelica.written import Written, WrittenConnector, written_class


def connector_of(instance: Instance) -> WrittenConnector:
    """Return the connector of an instance: its variables become its own fields."""
    connector = WrittenConnector(instance.text.description, free=True)
    for name, member in instance.members.items():
        basic = basic_type(instance, member)
        if basic is not None and {"parameter", "constant"} & member.declaration.prefixes:
            continue
        if basic is None or basic.kind != "Real":
            raise refused(f"{name} in a connector", member.text, member.declaration.line)
        check_attributes(name, basic, member.text)
        unit = unit_of(basic, Notes())
        for path, _ in elements_of(name, sizes(instance, member)):
            quantity = flow(unit) if "flow" in member.declaration.prefixes else var(unit)
            quantity.owner, quantity.name, quantity.nominal = instance.text.name, path, nominal_of(basic)
            quantity.check()
            inside(connector).own_fields = {**inside(connector).own_fields, path: quantity}
    connector.kind = instance.text.path
    return connector


def bundle(path: str, instance: Instance, owner: Instance, wires: list[Wire]) -> Written:
    """Return connectors within a connector as a part.

    One that is connected inside joins two sides, so that each has its own flow; else equations here determine it.
    """
    kind: Any = written_class(instance.text.name)
    component: Written = kind(instance.text.name, description=instance.text.description)
    equations: list[tuple[Expr, Expr, Source]] = []
    place = instance.text.place(instance.text.line)
    joined = {end for wire in wires for end in wire.ends}
    for leaf in bundled(instance):
        name = leaf.partition("[")[0]
        part = part_of(instance, instance.members[name], place_of(leaf))
        outer, inner = (_side(leaf, part, instance.members[name]) for _ in (0, 1))
        setattr(component, leaf, outer)
        if f"{path}.{INSIDE}{leaf}" not in joined:
            flows = sum(quantity.is_flow for quantity in outer.quantities.values())
            inside(component).lent += flows
            owner.balance -= flows
            continue
        setattr(component, f"{INSIDE}{leaf}", inner)
        for key, quantity in outer.quantities.items():
            here, there = (Expr("name", ((f"{side}{leaf}.{key}", ()),)) for side in ("", INSIDE))
            equations.append((here, Expr("neg", (there,)) if quantity.is_flow else there, place))
    inside(component).text, inside(component).statements = instance.text.path, tuple(equations)
    return component


def _side(leaf: str, part: Instance | Known | str, member: Member) -> Connector:
    """Return a connector within a connector; there are two of it, towards the outside and the inside."""
    kind = connector_type(part) if isinstance(part, str) else None
    if kind is not None:
        return kind(member.declaration.description, free=True)
    if not isinstance(part, Instance) or part.text.kind != "connector" or bundled(part):
        raise refused(f"{leaf} in a connector", member.text, member.declaration.line)
    return connector_of(part)


def lend(record: Written, owner: Instance) -> None:
    """Let variables of a record that have no equations in it have them in its owner, as own ones."""
    kept = inside(record)
    fields = {name: field for name, field in record.fields.items() if not isinstance(field, Input)}
    discretes = {name: field.kind for name, field in fields.items() if isinstance(field, Discrete)}
    own = [left for left, _, _ in kept.statements if left.kind != "name" or left.args[0][0] not in discretes]
    missing = sum(isinstance(field, Variable) for field in fields.values()) - len(own) - kept.lent
    kept.lent += missing
    owner.balance -= missing
    counted = {name for name, kind in discretes.items() if kind != "number"}
    kept.elsewhere |= counted - {left.args[0][0] for left, _, _ in kept.statements if left.kind == "name"}
