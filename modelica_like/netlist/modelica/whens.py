"""Events of a text: whens and assertions."""

from __future__ import annotations

from dataclasses import dataclass, field

from modelica_like.errors import ModelicaTextError, Source
from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.causal import declared_at, rounds
from modelica_like.netlist.modelica.instance import Instance, refused
from modelica_like.netlist.modelica.operators import arguments, demand_of, words_of
from modelica_like.netlist.modelica.parse import parse_expression
from modelica_like.netlist.modelica.resolve import Resolver
from modelica_like.netlist.modelica.tree import ClassText, Expr, Statement
from modelica_like.netlist.modelica.types import Basic, basic_type, misfit
from modelica_like.netlist.modelica.written import ASSERT, TERMINATE, Happening


@dataclass
class Whens:
    """What happens in one instance.

    Args:
        instance: with its members.

    Attributes:
        happenings: whens and assertions.
        assigned: names that only events change.
        reset: states that events change.
        in_branch: whether what is read stands in an `if` that only a run decides.
    """

    instance: Instance
    happenings: list[Happening] = field(default_factory=list, kw_only=True)
    assigned: set[str] = field(default_factory=set, kw_only=True)
    reset: set[str] = field(default_factory=set, kw_only=True)
    in_branch: bool = field(default=False, kw_only=True)

    def read_when(self, statement: Statement, text: ClassText, local: dict[str, Expr]) -> None:
        """Read a `when`."""
        resolver, source = Resolver(self.instance, text, local), text.place(statement.line)
        branches: list[tuple[tuple[Expr, ...], dict[str, Expr]]] = []
        never: set[str] = set()
        for condition, body in statement.parts:
            if condition is None:
                raise refused("'else' of a 'when'", text, statement.line)
            holds = resolver.condition(condition, "when", statement.line)
            every = holds.args if holds.kind == "array" else (holds,)
            conditions = tuple(each for each in every if each != Expr("boolean", (False,), each.line))
            if any(each.kind == "boolean" for each in conditions):
                raise ModelicaTextError("The condition of this 'when' never changes.", where=source)
            changes = self.changes(body, text, local)
            if conditions:
                branches.append((conditions, changes))
            else:
                never |= {name for name in changes if not is_ending(name) and name not in self.reset}
        if branches:
            self.happen(branches, source)
        self.stay(sorted(never - self.assigned), source)

    def stay(self, names: list[str], source: Source) -> None:
        """Take variables of a `when` that never happens: they stay what they are at the start."""
        raise NotImplementedError

    def happen(self, branches: list[tuple[tuple[Expr, ...], dict[str, Expr]]], source: Source) -> None:
        """Take a `when`: conditions and new values of its branches."""
        every = {name for _, values in branches for name in values if not is_ending(name)}
        assigned = every - self.reset
        for name in assigned & self.assigned:
            raise ModelicaTextError(f"Two whens determine {name}.", where=source)
        self.assigned |= assigned
        self.happenings.append(Happening(tuple(branches), source))

    def fitted(self, name: str, value: Expr, values: dict[str, Expr], text: ClassText, line: int) -> None:
        """Add the new value of a variable, of an array those of its elements, to others."""
        target = Resolver(self.instance, text)(Expr("name", ((name, ()),), line))
        for part, new in zip(fold.elements(target), fold.elements(value), strict=True):
            fitting = self.fitting(part, new, text, line)
            values[part.args[0][0]] = as_condition(new) if part.kind == "condition" else fitting

    def changes(self, body: list[Statement], text: ClassText, local: dict[str, Expr]) -> dict[str, Expr]:
        """Return the new values of a branch of a when."""
        resolver = Resolver(self.instance, text, local)
        values: dict[str, Expr] = {}
        for statement in body:
            call = statement.parts[0] if statement.kind == "call" else None
            if statement.kind == "=" and statement.parts[0].kind == "tuple":
                results = resolver(statement.parts[1])
                for part, result in zip(statement.parts[0].args, results.args, strict=False):
                    if part.kind != "all":
                        self.fitted(part.path, result, values, text, statement.line)
            elif statement.kind == "=":
                target, value = resolver(statement.parts[0]), resolver(statement.parts[1])
                if target.kind == "array" == value.kind and len(target.args) == len(value.args):
                    self.fitted(statement.parts[0].path, value, values, text, statement.line)
                    continue
                if target.kind not in ("name", "condition"):
                    raise refused("a 'when' with an equation that is not solved for a variable", text, statement.line)
                fitting = self.fitting(target, value, text, statement.line)
                values[target.args[0][0]] = as_condition(value) if target.kind == "condition" else fitting
            elif call is not None and call.args[0] == "reinit":
                targets, given = (fold.elements(resolver(side)) for side in arguments(resolver, call))
                if len(targets) != len(given) or any(target.kind != "name" for target in targets):
                    what = "reinit(…) needs states, and as many values."
                    raise ModelicaTextError(what, where=text.place(statement.line))
                values |= {target.args[0][0]: value for target, value in zip(targets, given, strict=True)}
                self.reset |= {target.args[0][0] for target in targets}
            elif call is not None and call.args[0] == "terminate":
                values[TERMINATE] = Expr("string", (words_of(arguments(resolver, call)[0]),), statement.line)
            elif call is not None and is_demand(call):
                demand = self.demanded(call, resolver, text)
                values |= {} if demand is None else {f"{ASSERT}{len(values)}": Expr("demand", demand, statement.line)}
            elif statement.kind == "if":
                _add(values, self._chosen(statement, text, local))
            elif statement.kind == "for":
                for known in rounds(resolver, statement.parts[0], statement.line):
                    _add(values, self.changes(statement.parts[1], text, known))
            else:
                raise refused(f"'{statement.kind}' in a 'when'", text, statement.line)
        return values

    def _chosen(self, statement: Statement, text: ClassText, local: dict[str, Expr]) -> dict[str, Expr]:
        """Return the new values of an `if`: each of its branches gives the same variables one, or keeps it."""
        resolver = Resolver(self.instance, text, local)
        branches: list[tuple[Expr, dict[str, Expr]]] = []
        for condition, body in statement.parts:
            true = Expr("boolean", (True,))
            holds = true if condition is None else resolver.condition(condition, "if", statement.line)
            if holds.kind != "boolean" or holds.args[0]:
                branches.append((holds, self.changes(body, text, local)))
            if holds.kind == "boolean" and holds.args[0]:
                break
        if len(branches) == 1 and branches[0][0].kind == "boolean":  # parameters decide
            return branches[0][1]
        names = dict.fromkeys(name for _, values in branches for name in values)
        if any(is_ending(name) or (name in self.reset and len(branches) > 1) for name in names):
            raise refused("reinit, terminate or assert in an 'if' of a 'when'", text, statement.line)
        return {name: self._by_branch(name, branches, statement.line) for name in names}

    def _by_branch(self, name: str, branches: list[tuple[Expr, dict[str, Expr]]], line: int) -> Expr:
        """Return the value that one of the branches gives a variable, else the one it has."""
        left = Resolver(self.instance, self.instance.text)(parse_expression(name))
        value = fold.call("pre", (left,), line)
        for holds, values in reversed(branches):
            new = values.get(name, fold.call("pre", (left,), line))
            value = new if holds.kind == "boolean" else fold.choice([holds, new], value, line)
        return as_condition(value) if left.kind == "condition" else value

    def demanded(
        self, call: Expr, resolver: Resolver, text: ClassText, *, certain: bool = True
    ) -> tuple[Expr, Expr] | None:
        """Return the condition of an assertion and its words; None of a warning and of what always holds.

        Args:
            call: the assertion.
            resolver: of its place.
            text: class it stands in.
            certain: whether it is demanded in any case.

        Raises:
            ModelicaTextError: it is certain, and broken.
        """
        demand = demand_of(resolver, call)
        if demand is None:
            return None
        condition, words = demand
        if condition.kind != "boolean" or ((self.in_branch or not certain) and not condition.args[0]):
            return condition, Expr("string", (words,), call.line)
        if not condition.args[0]:
            raise ModelicaTextError(f"An assertion is broken: {words}.", where=text.place(call.line))
        return None

    def check_type(self, left: Expr, right: Expr, text: ClassText, line: int) -> Basic | None:
        """Return the type of an own variable; refuse a value of another one."""
        name = left.args[0][0] if left.kind in ("name", "condition") and len(left.args) == 1 else ""
        place = declared_at(self.instance, name) if name and not name.startswith("^") else None
        basic = basic_type(*place) if place is not None else None
        wrong = misfit(right, basic) if basic is not None else ""
        if wrong:
            raise ModelicaTextError(f"{name} {wrong}.", where=text.place(line))
        return basic

    def fitting(self, left: Expr, right: Expr, text: ClassText, line: int) -> Expr:
        """Return a value that has the type of an own variable; those of an enumeration are numbers."""
        target = left.args[1][0] if left.kind == "call" and left.args[0] == "pre" else left
        basic = self.check_type(target, right, text, line)
        return fold.numbered(right) if basic is not None and basic.kind == "enumeration" else right


def if_taken(holds: Expr, before: list[Expr], assertion: Happening) -> Happening:
    """Return an assertion in a branch: it demands nothing where another one is taken."""
    ((conditions, new),) = assertion.branches
    taken = holds
    for other in before:
        taken = fold.operation("and", (fold.operation("not", (other,), other.line), taken), other.line)
    demand = fold.operation("or", (fold.operation("not", (taken,), holds.line), conditions[0]), holds.line)
    return Happening((((demand,), new),), assertion.source, assertion.text)


def _add(values: dict[str, Expr], more: dict[str, Expr]) -> None:
    """Add new values to others; assertions get numbers that are not in use."""
    for name, value in more.items():
        values[f"{ASSERT}{len(values)}" if name.startswith(ASSERT) else name] = value


def is_demand(call: Expr) -> bool:
    """Tell whether a call is an assertion or an error."""
    return call.args[0] == "assert" or call.args[0].endswith("Streams.error")


def is_ending(name: str) -> bool:
    """Tell whether one of the new values of a `when` is the end of the run."""
    return name.startswith((TERMINATE, ASSERT))


def as_condition(node: Expr) -> Expr:
    """Return a choice between conditions as one condition."""
    if node.kind != "if":
        return node
    condition, value, *rest = node.args
    other = as_condition(rest[0] if len(rest) == 1 else Expr("if", tuple(rest), node.line))
    taken = fold.operation("and", (condition, as_condition(value)), node.line)
    left = fold.operation("and", (fold.operation("not", (condition,), node.line), other), node.line)
    return fold.operation("or", (taken, left), node.line)
