"""Parameters with `fixed = false` that initial equations and algorithms of known numbers determine."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from modelica_like.netlist.modelica import fold, members, resolve
from modelica_like.netlist.modelica.algorithms import Algorithm, targets_of
from modelica_like.netlist.modelica.instance import Instance
from modelica_like.netlist.modelica.tree import ClassText, Expr, Statement, names_in
from modelica_like.netlist.modelica.types import basic_type


def value_from_start(owner: Instance, name: str) -> Expr | None:
    """Return what initial equations and algorithms of known numbers give an array or a choice, None if they do not."""
    for statement, text in _taken(owner, owner.initial_equations):
        resolver = resolve.Resolver(owner, text, numeric=True)
        if statement.kind == "=":
            left = statement.parts[0]
            targets = left.args if left.kind == "tuple" else (left,)
            places = [k for k, target in enumerate(targets) if target.path == name and not target.args[0][1]]
            if places:
                value = resolver(statement.parts[1])
                return value.args[places[0]] if value.kind == "tuple" else value
        elif statement.kind == "algorithm" and name in targets_of(statement.parts[0]):
            return _AtOnce(owner, text, statement.parts[0]).local[name]
    return None


def bind_at_start(owner: Instance) -> None:
    """Let parameters with `fixed = false` that initial equations give formulas of other parameters have these."""
    free = [name for name, member in owner.members.items() if "parameter" in member.declaration.prefixes
            and members.known_false(member.given.inner.get("fixed")) and member.given.value is None]  # fmt: skip
    if not free:
        return
    kept: list[tuple[Statement, ClassText]] = []
    for statement, text in _taken(owner, owner.initial_equations):
        left = statement.parts[0].path if statement.kind == "=" else ""
        member = owner.members[left] if left in free else None
        basic = basic_type(owner, member) if member is not None and not member.declaration.dimensions else None
        value = statement.parts[1] if basic is not None and basic.kind == "Real" else None
        if member is None or value is None or not _is_known(owner, resolve.Resolver(owner, text)(value)):
            kept.append((statement, text))
            continue
        inner = {key: entry for key, entry in member.given.inner.items() if key not in ("fixed", "start")}
        member.given = replace(member.given, value=value, scope=(owner, text), inner=inner, line=statement.line)
        free.remove(left)
        owner.free.clear()
    owner.initial_equations = kept


def _taken(owner: Instance, statements: Iterable[tuple[Statement, ClassText]]) -> Iterator[tuple[Statement, ClassText]]:
    """Yield initial equations, of an `if` that parameters decide those of its branch."""
    for statement, text in statements:
        if statement.kind != "if":
            yield statement, text
            continue
        resolver = resolve.Resolver(owner, text, numeric=True)
        for condition, inner in statement.parts:
            holds = Expr("boolean", (True,)) if condition is None else resolver(condition)
            if holds.kind != "boolean":
                yield statement, text
                break
            if holds.args[0]:
                yield from _taken(owner, ((each, text) for each in inner))
                break


def _is_known(owner: Instance, formula: Expr) -> bool:
    """Tell whether a formula has no other names than parameters that are known before the start."""
    names = [name.args[0][0] for name in names_in(formula)]
    declared = (owner.members[name].declaration for name in names if name in owner.members)
    parameters = [declaration for declaration in declared if "parameter" in declaration.prefixes]
    return len(parameters) == len(names) and not members.undetermined(owner, formula)


class _AtOnce(Algorithm):
    """An initial algorithm of known numbers."""

    def __init__(self, owner: Instance, text: ClassText, body: list[Statement]) -> None:
        super().__init__(owner.classes, text)
        self.owner = owner
        self.declared = {name: member.declaration for name, member in owner.members.items()}
        for name in set(targets_of(body)) & owner.members.keys():
            self.local[name] = fold.filled(fold.number(0), members.sizes(owner, owner.members[name]))
        self.run(body)

    def here(self, text: ClassText | None = None) -> resolve.Resolver:
        """Return what resolves expressions with the values so far."""
        return resolve.Resolver(self.owner, text or self.text, self.local, numeric=True)
