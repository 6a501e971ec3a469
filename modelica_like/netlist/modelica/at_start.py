"""Parameters with `fixed = false` that initial equations and algorithms of known numbers determine."""

from __future__ import annotations

from modelica_like.netlist.modelica import fold, members, resolve
from modelica_like.netlist.modelica.algorithms import Algorithm, targets_of
from modelica_like.netlist.modelica.instance import Instance
from modelica_like.netlist.modelica.tree import ClassText, Expr, Statement


def value_from_start(owner: Instance, name: str) -> Expr | None:
    """Return what initial equations and algorithms of known numbers give an array or a choice, None if they do not."""
    pending = list(owner.initial_equations)
    for statement, text in pending:
        resolver = resolve.Resolver(owner, text, numeric=True)
        if statement.kind == "if":
            for condition, body in statement.parts:
                holds = Expr("boolean", (True,)) if condition is None else resolver(condition)
                if holds.kind == "boolean" and holds.args[0]:
                    pending += [(inner, text) for inner in body]
                    break
        elif statement.kind == "=":
            left = statement.parts[0]
            targets = left.args if left.kind == "tuple" else (left,)
            places = [k for k, target in enumerate(targets) if target.path == name and not target.args[0][1]]
            if places:
                value = resolver(statement.parts[1])
                return value.args[places[0]] if value.kind == "tuple" else value
        elif statement.kind == "algorithm" and name in targets_of(statement.parts[0]):
            return _AtOnce(owner, text, statement.parts[0]).local[name]
    return None


class _AtOnce(Algorithm):
    """An initial algorithm of known numbers."""

    def __init__(self, owner: Instance, text: ClassText, body: list[Statement]) -> None:
        super().__init__(owner.classes, text)
        self.owner = owner
        self.declared = {name: member.declaration for name, member in owner.members.items()}
        for name in set(targets_of(body)) & owner.members.keys():
            value = fold.number(0)
            for size in reversed(members.sizes(owner, owner.members[name])):
                value = Expr("array", (value,) * size)
            self.local[name] = value
        self.run(body)

    def here(self, text: ClassText | None = None) -> resolve.Resolver:
        """Return what resolves expressions with the values so far."""
        return resolve.Resolver(self.owner, text or self.text, self.local, numeric=True)
