"""Formulas inside an assembly that use names outside: a class knows its own names only, so it gets parameters."""

from __future__ import annotations

import re
from dataclasses import replace

from modelica_like.errors import ModelicaTextError
from modelica_like.language import Assembly, Component, param
from modelica_like.language.assembly import declare
from modelica_like.language.fields import Value
from modelica_like.language.formula import Formula
from modelica_like.language.inside import inside
from modelica_like.language.scopes import owners, scope_for, scopes_of
from modelica_like.language.units import ANY, coherent


def lifted(model: Assembly) -> Assembly:
    """Return a copy in which formulas inside an assembly use its own names, or are values of its parameters.

    Args:
        model: the outermost assembly.

    Raises:
        ModelicaTextError: a formula uses names inside and outside.
    """
    model = model.copy()
    assemblies = [part for part in model.walk() if isinstance(part, Assembly) and part is not model]
    for assembly in reversed(assemblies):  # the innermost first: their parameters may have to go further out
        for part in [*assembly.walk()][1:]:
            own = inside(part)
            for store in (own.values, own.starts):
                for name, value in store.items():
                    depth = _depth(part, assembly)
                    if value.formula is not None and value.levels > depth:
                        store[name] = _inside(assembly, part, name, value, depth)
    return model


def is_given(part: Component, name: str) -> bool:
    """Return whether the owner of a part gives a parameter a formula, which is a modification."""
    value = inside(part).values.get(name)
    return inside(part).owner is not None and value is not None and value.formula is not None


def _inside(assembly: Assembly, part: Component, name: str, value: Value, depth: int) -> Value:
    """Return a value by names of the assembly, which gets a parameter if the formula uses names outside."""
    assert value.formula is not None
    scopes = scopes_of(part, value, given=True)
    outside = {path: scope_for(scopes, path) is scopes[0] for path in value.formula.names()}
    if not all(outside.values()):
        mixed = next((path for path, out in outside.items() if out), None)
        if mixed is None:  # the owner's names only
            return replace(value, levels=1)
        raise ModelicaTextError(
            f"{part.path}.{name} = {value.formula} uses {mixed}, which is outside of {assembly.path}, and names in it.",
            where=part.place_of(name), why=f"{assembly.path} becomes a class, which knows its own names only.",
            advice="Give it a number.",
        )  # fmt: skip
    key = re.sub(r"\W", "_", f"{part.path}.{name}".removeprefix(f"{assembly.path}."))
    while key in assembly.fields or key in assembly.parts or key in assembly.connectors:
        key += "_"
    unit = coherent(value.unit)
    declare(assembly, key, param("1" if unit == ANY else str(unit), part.fields[name].description))
    own = inside(assembly)
    own.values[key] = replace(value, levels=value.levels - depth, fixed=True)
    return replace(value, formula=Formula("name", (key,)), levels=depth)


def _depth(part: Component, assembly: Assembly) -> int:
    """Return how far an assembly is above a part."""
    chain = owners(part, 1000)
    return next(k for k, owner in enumerate(chain, 1) if owner is assembly)
