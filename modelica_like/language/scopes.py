"""Whose names a formula uses: those of the file or class in which it stands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from modelica_like.errors import Source, UnknownName
from modelica_like.language.component import Component
from modelica_like.language.fields import Input, Parameter, Value
from modelica_like.language.inside import inside
from modelica_like.language.places import NOWHERE


def give_by_path(component: Component, path: str, value: Any, *, above: int = 0) -> None:
    """Set a value by its path; see `Component.set`.

    Args:
        component: where the path begins.
        path: of the value.
        value: as for `Component.give`.
        above: how many levels above the component a formula stands, whose names are parameters there.

    Raises:
        UnknownName: there is no such part, parameter or variable.
    """
    owner_path, _, name = path.rpartition(".")
    owner, levels = component.find(owner_path), path.count(".") + above
    owner.give(name, value)
    record = inside(owner)
    for store in (record.values, record.starts):
        if name in store and store[name].formula is not None:
            store[name] = replace(store[name], levels=max(levels, 1))


def owners(component: Component, levels: int) -> list[Component]:
    """Return the owners of a component, the nearest first: as many as there are, and at most `levels`."""
    above: list[Component] = []
    owner = inside(component).owner
    while isinstance(owner, Component) and len(above) < levels:
        above.append(owner)
        owner = inside(owner).owner
    return above


def scopes_of(component: Component, value: Value, *, given: bool) -> list[Component]:
    """Return the components whose names the formula of a value uses; the first that knows a name counts.

    A given value uses the names where its formula stands; what is unknown there is sought in the owner. A default uses
    those of the component itself.
    """
    above = owners(component, value.levels) if given else []
    return [above[-1], *above[:1]] if above else [component]


def scope_for(scopes: Sequence[Component], path: str) -> Component:
    """Return the first of the components that knows a parameter, or the very first one."""
    if len(scopes) == 1:
        return scopes[0]
    return next((scope for scope in scopes if _knows(scope, path)), scopes[0])


def _knows(scope: Component, path: str) -> bool:
    owner, _, name = path.rpartition(".")
    try:
        return isinstance(scope.find(owner).fields.get(name), Parameter | Input)
    except UnknownName:
        return False


def given_above(component: Component, name: str) -> Source:
    """Return the place of a value in the netlist of an owner, which need not be the nearest one."""
    record = inside(component)
    value = record.values.get(name) or record.starts.get(name)
    if value is None or record.owner is None or (value.levels < 2 and name in record.starts):
        return NOWHERE
    above = owners(component, value.levels)[-1]
    inner = f"{component.path}.{name}".removeprefix(f"{above.path}.")
    sources = (above.source_of(key) for key in (f"start.{inner}", f"guess.{inner}"))
    part = inner.partition(".")[0].partition("[")[0]
    return next((source for source in sources if source.file), above.source_of(f"parts.{part}"))
