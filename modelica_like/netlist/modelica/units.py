"""Units of what connections join: each end says its own, and one that says none takes any."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from modelica_like.errors import ModelicaTextError, Source, UnitError
from modelica_like.language.inside import declarations
from modelica_like.language.units import parse_unit, same_dimension
from modelica_like.netlist.modelica.elements import Place, place_of
from modelica_like.netlist.modelica.instance import Instance, Member
from modelica_like.netlist.modelica.library import Known, connector_type
from modelica_like.netlist.modelica.members import element, exists, part_at
from modelica_like.netlist.modelica.types import basic_type
from modelica_like.netlist.modelica.values import known
from modelica_like.netlist.modelica.wiring import INSIDE

_ANY = ("", "1", "*")
"""Units that fit all: libraries write `1` for numbers of any kind, too."""
Units = dict[str, tuple[str, Source]]
"""By the names of variables, that of a signal being empty: the unit, and where it is declared."""


def check_units(instance: Instance, pairs: Iterable[tuple[str, str, Source]]) -> None:
    """Refuse connections of variables whose units differ.

    Args:
        instance: whose connections they are.
        pairs: paths of ends, with the place of the connection.

    Raises:
        ModelicaTextError: two units differ; numbers of a text are not converted, also not from kW to W.
    """
    units: dict[str, Units] = {}
    for left, right, source in pairs:
        for end in (left, right):
            if end not in units:
                units[end] = dict(_units(instance, end))
        for name in units[left].keys() & units[right].keys():
            (one, first), (other, second) = units[left][name], units[right][name]
            if _differ(one, other):
                ends = [f"{end}.{name}".rstrip(".") for end in (left, right)]
                raise ModelicaTextError(
                    f"{ends[0]} is in {one}, and {ends[1]} in {other}.", where=[source, first, second],
                    advice="Declare both in one unit, or convert between them: a connection does not.",
                )  # fmt: skip


def _differ(one: str, other: str) -> bool:
    if one == other or one in _ANY or other in _ANY:
        return False
    try:
        units = parse_unit(one), parse_unit(other)
    except UnitError:  # one that is not known here may be the same as the other
        return False
    return not same_dimension(*units) or len({(unit.factor, unit.offset) for unit in units}) > 1


def _units(instance: Instance, path: str) -> Iterator[tuple[str, tuple[str, Source]]]:
    """Yield the variables at an end of a connection with their units."""
    head, _, rest = path.partition(".")
    name = head.removeprefix(INSIDE).partition("[")[0]
    member = instance.members.get(name)
    if member is None:
        return
    part, source = part_at(instance, head.removeprefix(INSIDE)), member.text.place(member.declaration.line)
    if part is None and exists(instance, member):
        yield from _unit(instance, member, place_of(head), "")
    if isinstance(part, Instance) and rest:
        yield from _units(part, rest)
    elif isinstance(part, Instance):
        for key, inner in part.members.items():
            if basic_type(part, inner) is not None and not {"parameter", "constant"} & inner.declaration.prefixes:
                yield from _unit(part, inner, (), key)
    elif isinstance(part, Known):
        declared = declarations(part.type)
        if rest in declared.fields and "[" not in part.there(rest):  # elements of one input have no units there
            yield "", (declared.fields[rest].unit_text, source)
        elif rest in declared.connectors:
            yield from ((key, (field.unit_text, source)) for key, field in declared.connectors[rest].fields.items())
    elif kind := connector_type(part) if part else None:
        yield from ((key, (field.unit_text, source)) for key, field in declarations(kind).fields.items())


def _unit(instance: Instance, member: Member, place: Place, name: str) -> Iterator[tuple[str, tuple[str, Source]]]:
    basic = basic_type(instance, member)
    if basic is not None and basic.kind == "Real" and "unit" in basic.given.inner:
        unit = known(element(basic.given, place).inner["unit"])
        yield name, (str(unit or ""), member.text.place(member.declaration.line))
