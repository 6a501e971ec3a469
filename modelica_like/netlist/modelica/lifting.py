"""Equations that use what is outside of an instance: they stand in the instance above that has all of it.

A name outside has as many signs `^` before it as there are levels to go up.
"""

from __future__ import annotations

from collections.abc import Callable

from modelica_like.netlist.modelica.instance import Instance
from modelica_like.netlist.modelica.tree import Expr, with_operands

UP = "^"


def renamed(node: Expr, change: Callable[[str], str]) -> Expr:
    """Return a resolved expression with other paths of its variables."""
    if node.kind in ("name", "condition"):
        return Expr(node.kind, ((change(node.args[0][0]), ()),), node.line)
    return with_operands(node, lambda operand: renamed(operand, change))


def outside(node: Expr, levels: int) -> Expr:
    """Return an expression of an instance, seen from one that is so many levels below."""
    return renamed(node, lambda path: path if path == "time" else UP * levels + path) if levels else node


def height(node: Expr) -> int:
    """Return how many levels above an instance its expression begins."""
    if node.kind in ("name", "condition"):
        path = node.args[0][0]
        return len(path) - len(path.lstrip(UP))
    inner = node.args[1] if node.kind == "call" else node.args
    return max((height(argument) for argument in inner if isinstance(argument, Expr)), default=0)


def above(instance: Instance, levels: int) -> Callable[[str], str]:
    """Return what turns a path of an instance into one of the instance so many levels above."""
    names: list[str] = []
    for _ in range(levels):
        assert instance.owner is not None
        names.insert(0, instance.name)
        instance = instance.owner

    def path_there(path: str) -> str:
        bare = path.lstrip(UP)
        if bare == "time":
            return path
        return ".".join([*names[: levels - (len(path) - len(bare))], bare])

    return path_there


def levels_between(instance: Instance, scope: Instance) -> int | None:
    """Return how many levels a scope is above an instance, None if it is not above it."""
    levels, level = 0, instance
    while level is not scope:
        if level.owner is None:
            return None
        levels, level = levels + 1, level.owner
    return levels


def way(instance: Instance | None, scope: Instance) -> str:
    """Return what stands before the names of an instance above another one, or inside it."""
    assert instance is not None
    levels = levels_between(instance, scope)
    return UP * levels if levels is not None else f"{scope.path.removeprefix(instance.path).lstrip('.')}."


def owner_above(instance: Instance, levels: int) -> Instance:
    """Return the instance so many levels above."""
    for _ in range(levels):
        assert instance.owner is not None
        instance = instance.owner
    return instance
