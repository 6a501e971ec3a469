"""Values of discrete variables before the start: what initial equations say, by equations between plain variables."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from modelica_like.errors import ModelicaTextError, Source
from modelica_like.netlist.modelica.tree import Expr

Equation = tuple[Expr, Expr, Source]
Node = tuple[str, str]


class Before:
    """Discrete variables that equations make equal, before the start or at it.

    Args:
        equations: of an instance; they hold at the start, too.
        initial: its initial equations.
        is_discrete: tells whether a side is a variable that changes at events only, and no signal.
        changes_at_events: the same, of signals too.

    Attributes:
        memory: values before the start.
        others: initial equations that are left.
    """

    def __init__(
        self, equations: list[Equation], initial: list[Equation], is_discrete: Callable[[Expr], bool],
        changes_at_events: Callable[[Expr], bool],
    ) -> None:  # fmt: skip
        self.changes_at_events = changes_at_events
        self.memory: dict[str, Expr] = {}
        self.others: list[Equation] = []
        self.sets: list[set[Node]] = []
        values: list[Equation] = []
        for left, right, _ in (*equations, *initial):
            nodes = [node for node in (self._node(left), self._node(right)) if node is not None]
            if len(nodes) == 2:
                touched = [group for group in self.sets if group & {*nodes}]
                self.sets = [group for group in self.sets if group not in touched]
                self.sets.append({*nodes}.union(*touched))
        for left, right, source in initial:
            if left.kind == right.kind == "number":  # of parameters that are known when the text is read
                continue
            if self._node(left) is None or self._node(right) is None:
                values.append((left, right, source))
        for left, right, source in values:
            node = self._node(left)
            names = self._befores(node) if node is not None else []
            if not names and is_discrete(left) and not _uses_time(right):
                names = [left.args[0][0]]
            if not names:
                self.others.append((left, right, source))
            for name in names:
                if self.memory.setdefault(name, right) != right:
                    raise ModelicaTextError(f"Initial equations give {name} two values.", where=source)

    def _befores(self, node: Node) -> list[str]:
        """Return the variables whose value before the start a node is."""
        group = next((group for group in self.sets if node in group), {node})
        return sorted(name for word, name in group if word == "pre")

    def _node(self, side: Expr) -> Node | None:
        before = side.kind == "call" and side.args[0] == "pre"
        variable = side.args[1][0] if before else side
        if variable.kind not in ("name", "condition") or not (before or self.changes_at_events(variable)):
            return None
        return "pre" if before else "", variable.args[0][0]


def _uses_time(value: Any) -> bool:
    """Tell whether an expression names the time: a run begins at any."""
    if isinstance(value, Expr):
        return (value.kind == "name" and value.args[0][0] == "time") or _uses_time(value.args)
    return isinstance(value, tuple | list) and any(_uses_time(inner) for inner in value)
