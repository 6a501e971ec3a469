"""`pre(x)` of a variable that changes all the time: its equation with what discrete variables were before the event."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from modelica_like.errors import ModelicaTextError, Source
from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.instance import Instance
from modelica_like.netlist.modelica.tree import Expr, with_operands
from modelica_like.netlist.modelica.types import basic_type
from modelica_like.netlist.modelica.written import Happening

_OF_EVENTS = ("pre", "edge", "change", "previous", "initial", "terminal", "sample", "Clock")


class LeftLimits:
    """Values that variables of an instance had before an event.

    Args:
        instance: that declares them.
        equations: of the instance.
        states: names whose derivatives are in the equations.
        is_discrete: tells whether a resolved name changes at events only.
    """

    def __init__(
        self, instance: Instance, equations: Iterable[tuple[Expr, Expr, Source]], states: set[str],
        is_discrete: Callable[[Expr], bool],
    ) -> None:  # fmt: skip
        self.instance, self.states, self.is_discrete = instance, states, is_discrete
        self.rules = {left.args[0][0]: right for left, right, _ in equations if left.kind == "name"}

    def of(self, happening: Happening) -> Happening:
        """Return a `when` whose new values have these limits in place of `pre(…)`.

        Raises:
            ModelicaTextError: no equation of the instance tells one.
        """
        branches = tuple(
            (conditions, {name: self._new(value, happening.source) for name, value in new.items()})
            for conditions, new in happening.branches
        )
        return replace(happening, branches=branches)

    def _new(self, node: Expr, source: Source) -> Expr:
        if node.kind == "call" and node.args[0] == "pre" and node.args[1][0].kind == "name":
            name = node.args[1][0]
            return self._limit(name, source, (name.args[0][0],)) if self._moves(name) else node
        return with_operands(node, lambda operand: self._new(operand, source))

    def _moves(self, name: Expr) -> bool:
        """Tell whether a name is an own variable that changes all the time, and no state."""
        member = self.instance.members.get(name.args[0][0].partition("[")[0])
        basic = basic_type(self.instance, member) if member is not None else None
        fixed = member is not None and {"parameter", "constant"} & member.declaration.prefixes
        return basic is not None and not fixed and not self.is_discrete(name) and name.args[0][0] not in self.states

    def _limit(self, node: Expr, source: Source, asked: tuple[str, ...]) -> Expr:
        """Return an expression as it was before an event."""
        if node.kind in ("name", "condition"):
            path = node.args[0][0]
            if self.is_discrete(node):
                return fold.call("pre", (node,), node.line)
            if not self._moves(node) and "." not in path:
                return node
            rule = self.rules.get(path)
            if rule is None or path in asked[1:]:
                what = (
                    f"pre({asked[0]}): no equation of {self.instance.text.name} tells what {path} was before an event."
                )
                advice = "Keep it in a discrete variable that is set where it changes."
                raise ModelicaTextError(what, where=source, advice=advice)
            return self._limit(rule, source, (*asked, path))
        if node.kind == "call" and node.args[0] in _OF_EVENTS:
            return node
        return with_operands(node, lambda operand: self._limit(operand, source, asked))
