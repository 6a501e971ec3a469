"""Values of discrete variables before the start: what initial equations say, by equations between plain variables."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from modelica_like.errors import ModelicaTextError, Source
from modelica_like.language.inside import inside
from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.lifting import renamed
from modelica_like.netlist.modelica.tree import Expr
from modelica_like.netlist.modelica.written import Happening, Written

Equation = tuple[Expr, Expr, Source]
Node = tuple[str, str]


class Before:
    """Discrete variables that equations make equal, before the start or at it.

    Args:
        equations: of an instance; they hold at the start, too.
        initial: its initial equations.
        is_discrete: tells whether a side is a variable that changes at events only, and no signal.
        changes_at_events: the same, of signals too.
        evaluated: puts the values of parameters into an expression.

    Attributes:
        memory: values before the start.
        late: those that only a run knows: `pre(…)` has them where it begins.
        others: initial equations that are left.
    """

    def __init__(
        self, equations: list[Equation], initial: list[Equation], is_discrete: Callable[[Expr], bool],
        changes_at_events: Callable[[Expr], bool], evaluated: Callable[[Expr], Expr],
    ) -> None:  # fmt: skip
        self.changes_at_events = changes_at_events
        self.memory: dict[str, Expr] = {}
        self.others: list[Equation] = []
        self.sets: list[set[Node]] = []
        values: list[Equation] = []
        begun_with = set[str]()
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
            if not names and is_discrete(left) and not uses_time(right):
                names = [left.args[0][0]]
                begun_with.update(names)
            if not names:
                self.others.append((left, right, source))
            for name in names:
                if self.memory.setdefault(name, right) != right:
                    raise ModelicaTextError(f"Initial equations give {name} two values.", where=source)
        for _ in self.memory:  # one may need that of another
            known = {name: self._known(value, begun_with) for name, value in self.memory.items()}
            self.memory = {name: value if uses_time(value) else evaluated(value) for name, value in known.items()}
        self.late = {name: value for name, value in self.memory.items() if value.kind not in fold.KNOWN}
        self.memory = {name: value for name, value in self.memory.items() if name not in self.late}

    def _known(self, value: Expr, begun_with: set[str]) -> Expr:
        """Return a value with those before the start that are known in place of `pre(…)`, and what begins with them."""
        if value.kind == "native":
            return fold.native(
                value.args[0], tuple(self._known(each, begun_with) for each in value.args[1:]), value.line
            )
        before = value.kind == "call" and value.args[0] == "pre"
        variable = value.args[1][0] if before else value
        if before or (value.kind in ("name", "condition") and value.args[0][0] in begun_with):
            known = self.memory.get(variable.args[0][0], value)
            return known if known.kind in fold.KNOWN else value
        if value.kind in (*fold.KNOWN, "name", "condition", "call", "object"):
            return value

        def inner(operands: tuple[Expr, ...]) -> tuple[Expr, ...]:
            return tuple(self._known(operand, begun_with) for operand in operands)

        if value.kind == "shared":
            return Expr("shared", (value.args[0], *inner(value.args[1:])), value.line)
        return fold.operation(value.kind, inner(value.args), value.line) if value.kind != "if" else value

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


def uses_time(value: Any) -> bool:
    """Tell whether an expression names the time: a run begins at any."""
    if isinstance(value, Expr):
        return (value.kind == "name" and value.args[0][0] == "time") or uses_time(value.args)
    return isinstance(value, tuple | list) and any(uses_time(inner) for inner in value)


def begun(node: Expr, late: dict[str, Expr]) -> Expr:
    """Return an expression in which values before an event are those of `late` where a run begins."""
    args = tuple(begun(argument, late) if isinstance(argument, Expr) else argument for argument in node.args)
    if node.kind != "call":
        return Expr(node.kind, args, node.line) if args != node.args else node
    word, given, named = node.args
    variable = given[0] if given else node
    if word in ("pre", "edge", "change") and variable.kind in ("name", "condition") and variable.args[0][0] in late:
        first = Expr("call", ("initial", (), ()), node.line)
        before = Expr("if", (first, late[variable.args[0][0]], fold.call("pre", given, node.line)), node.line)
        if word == "pre":
            return before
        if word == "change":
            return Expr("<>", (variable, before), node.line)
        return fold.operation("and", (variable, fold.operation("not", (before,), node.line)), node.line)
    return Expr("call", (word, tuple(begun(argument, late) for argument in given), named), node.line)


def begin_late(happening: Happening, late: dict[str, Expr]) -> Happening:
    """Return a `when` that gives its variables their values where a run begins, if it does not happen there."""
    branches = [
        (tuple(begun(each, late) for each in conditions), {name: begun(new, late) for name, new in values.items()})
        for conditions, values in happening.branches
    ]
    own = {
        name: late[name] for name in dict.fromkeys(name for _, values in branches for name in values) if name in late
    }
    branches = [branch for branch in branches if branch[0] or happening.text]  # one of what only begins has none
    if own:
        branches.append(((Expr("call", ("initial", (), ())),), own))
    return Happening(tuple(branches), happening.source, happening.text)


def begin_parts(component: Written, own: dict[str, Expr]) -> None:
    """Let equations and whens of a component see what parts have before the start, if only a run knows it.

    Args:
        component: with its parts, equations and whens.
        own: such values of its own variables.
    """
    record, late = inside(component), dict[str, Expr]()
    for name, part in component.parts.items():
        if isinstance(part, Written):
            late |= {f"{name}.{path}": _seen_from_above(value, name) for path, value in inside(part).late.items()}
    if late:
        record.statements = tuple((left, begun(right, late), source) for left, right, source in record.statements)
        record.happenings = tuple(begin_late(happening, late) for happening in record.happenings)
    record.late = own | late


def _seen_from_above(value: Expr, part: str) -> Expr:
    return renamed(value, lambda path: path if path == "time" else f"{part}.{path}")
