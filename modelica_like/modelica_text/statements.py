"""From the equations of a text to scalar equations, connections, relations and events of one component."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from modelica_like.errors import ModelicaTextError, Source
from modelica_like.language import Mode
from modelica_like.modelica_text import fold
from modelica_like.modelica_text.instance import Instance, refused
from modelica_like.modelica_text.resolve import Resolver
from modelica_like.modelica_text.tree import ClassText, Expr, Statement
from modelica_like.modelica_text.types import basic_type
from modelica_like.modelica_text.written import NO, YES, Happening

_RELATIONS = ("<", "<=", ">", ">=")
_STEPPED = ("floor", "ceil", "integer", "mod", "div", "rem")


@dataclass
class Statements:
    """What the text of one instance says.

    Args:
        instance: with its members.

    Attributes:
        equations: sides and place.
        connections: two ends each, with the place.
        happenings: relations, whens, assertions.
        assigned: names that only events change.
        starts: start values from initial equations.
        conditions: definitions of Boolean variables.
    """

    instance: Instance
    equations: list[tuple[Expr, Expr, Source]] = field(default_factory=list)
    connections: list[tuple[Expr, Expr, Source]] = field(default_factory=list)
    happenings: list[Happening] = field(default_factory=list)
    assigned: set[str] = field(default_factory=set)
    starts: dict[str, Expr] = field(default_factory=dict)
    conditions: dict[str, Expr] = field(default_factory=dict)
    parameters: set[str] = field(default_factory=set)
    _relations: dict[str, str] = field(default_factory=dict)
    _whens: list[tuple[Statement, ClassText, dict[str, Expr]]] = field(default_factory=list)

    def read(self) -> None:
        """Go through declarations with values, then all equations.

        Raises:
            ModelicaTextError: something is not supported.
        """
        self._bindings()
        for one, text in self.instance.equations:
            self._statement(one, text, {})
        for when, text, local in self._whens:
            self._when(when, text, local)
        self.equations = [self._eventful_equation(*one) for one in (*self.equations, *self._outputs())]
        for one, text in self.instance.initial_equations:
            self._initial(one, text, {})

    def _outputs(self) -> Iterator[tuple[Expr, Expr, Source]]:
        """Yield the equations of Boolean outputs, which are 1 or 0."""
        for name, node in self.conditions.items():
            member = self.instance.members.get(name)
            basic = basic_type(self.instance, member) if member is not None else None
            if member is not None and basic is not None and basic.prefixes & {"input", "output"}:
                chosen = Expr("if", (node, fold.number(1), fold.number(0)), member.declaration.line)
                yield Expr("name", ((name, ()),)), chosen, member.text.place(member.declaration.line)

    @property
    def modes(self) -> dict[str, Mode]:
        """The modes of all happenings."""
        return {one.mode: Mode(NO, YES, description=one.source.text) for one in self.happenings}

    def _bindings(self) -> None:
        """Collect declarations `Real x = …`, and the names of parameters."""
        for name, member in self.instance.members.items():
            declared, basic = member.declaration, basic_type(self.instance, member)
            if {"parameter", "constant"} & declared.prefixes:
                self.parameters.add(name)
            elif basic is not None and member.given.value is not None and member.given.scope is not None:
                scope, text = member.given.scope
                if scope is not self.instance:
                    raise refused(f"an equation for {name} in the modification of its component", text, declared.line)
                left = Resolver(self.instance, text)(Expr("name", ((name, ()),), declared.line))
                self._equate(left, Resolver(scope, text)(member.given.value), text, declared.line)

    def _statement(self, one: Statement, text: ClassText, local: dict[str, Expr]) -> None:
        resolver = Resolver(self.instance, text, local)
        if one.kind == "=":
            self._equate(resolver(one.parts[0]), resolver(one.parts[1]), text, one.line)
        elif one.kind == "connect":
            left, right = (self._end(side, resolver) for side in one.parts)
            self.connections.append((left, right, text.place(one.line)))
        elif one.kind == "for":
            self._loop(list(one.parts[0]), one.parts[1], text, local)
        elif one.kind == "if":
            self._branches(one, text, local)
        elif one.kind == "when":
            self._whens.append((one, text, local))
            made = set[str]().union(*(self._targets(body, text, local) for _, body in one.parts))
            for name in made & self.assigned:
                raise ModelicaTextError(f"Two whens determine {name}.", where=text.place(one.line))
            self.assigned |= made
        elif one.kind == "call":
            self._demand(one.parts[0], resolver, text)
        else:
            raise refused(f"'{one.kind}' among equations", text, one.line)

    def _end(self, end: Expr, resolver: Resolver) -> Expr:
        """Resolve the subscripts of an end of a connection, and keep its names."""
        if end.kind != "name":
            raise refused("this end of a connection", resolver.text, end.line)
        parts = tuple((name, tuple(resolver.known()(index) for index in subs)) for name, subs in end.args)
        return Expr("name", parts, end.line)

    def _loop(
        self, iterators: list[tuple[str, Expr | None]], body: list[Statement], text: ClassText, local: dict[str, Expr]
    ) -> None:
        (name, over), rest = iterators[0], iterators[1:]
        if over is None:
            raise refused("an iterator without a range", text, body[0].line if body else text.line)
        for value in Resolver(self.instance, text, local, numeric=True).array(over):
            inner = {**local, name: value}
            if rest:
                self._loop(rest, body, text, inner)
            else:
                for one in body:
                    self._statement(one, text, inner)

    def _branches(self, one: Statement, text: ClassText, local: dict[str, Expr]) -> None:
        """Take the branch that parameters decide; else make one equation of those at the same place in all branches."""
        resolver = Resolver(self.instance, text, local)
        open_branches: list[tuple[Expr | None, Statements]] = []
        for condition, body in one.parts:
            known = Expr("boolean", (True,)) if condition is None else resolver(condition)
            if known.kind == "boolean" and not known.args[0]:
                continue
            target = Statements(self.instance) if open_branches or known.kind != "boolean" else self
            target.parameters = self.parameters
            for inner in body:
                target._statement(inner, text, local)
            if target is self:
                return
            if target.connections or target._whens or target.happenings:
                raise refused("a connection or an event in a branch that changes during a run", text, one.line)
            open_branches.append((None if known.kind == "boolean" else known, target))
            if known.kind == "boolean":
                break
        if not open_branches:
            return
        self._joined(open_branches, text, one.line)

    def _joined(self, branches: list[tuple[Expr | None, Statements]], text: ClassText, line: int) -> None:
        counts = {len(one.equations) for _, one in branches}
        if len(counts) > 1 or branches[-1][0] is not None:
            raise refused("an 'if' whose branches have different numbers of equations", text, line)
        for name in branches[0][1].conditions:
            self.conditions[name] = _choice([(c, one.conditions[name]) for c, one in branches], line)
        for k in range(counts.pop()):
            rows = [(condition, *one.equations[k]) for condition, one in branches]
            left = rows[0][1]
            if all(_same(row[1], left) for row in rows):
                self.equations.append((left, _choice([(row[0], row[2]) for row in rows], line), rows[0][3]))
                continue
            zero = [(row[0], fold.operation("-", (row[1], row[2]), line)) for row in rows]
            self.equations.append((_choice(zero, line), fold.number(0, line), text.place(line)))

    def _equate(self, left: Expr, right: Expr, text: ClassText, line: int) -> None:
        if left.kind == "array" or right.kind == "array":
            if left.kind != right.kind or len(left.args) != len(right.args):
                raise ModelicaTextError("The sizes of both sides differ.", where=text.place(line))
            for one, other in zip(left.args, right.args, strict=True):
                self._equate(one, other, text, line)
        elif left.kind == "condition":
            self.conditions[left.args[0][0]] = right
        else:
            if left.kind == "number" and right.kind == "name":
                left, right = right, left
            self.equations.append((left, right, text.place(line)))

    # -- events ------------------------------------------------------------------------------------------------------

    def _eventful_equation(self, left: Expr, right: Expr, source: Source) -> tuple[Expr, Expr, Source]:
        return self.eventful(left, source), self.eventful(right, source), source

    def eventful(self, node: Expr, source: Source, silent: bool = False) -> Expr:
        """Return an expression in which relations are modes that change at events.

        Args:
            node: resolved expression.
            source: its place.
            silent: whether relations make no events here.
        """
        if node.kind == "condition" and node.args[0][0] in self.conditions:
            return self.eventful(self._definition(node, source), source, silent)
        if node.kind == "call":
            name, given, named = node.args
            if name in ("initial", "terminal", "edge", "change", "sample") or (name == "pre" and not silent):
                raise ModelicaTextError(f"{name}(…) outside a 'when': that is not supported here.", where=source)
            if name in _STEPPED and not silent:
                raise ModelicaTextError(
                    f"{name}(…) makes events of its own: that is not supported here.", where=source,
                    advice="Write noEvent(…) around it, or compute it in a 'when'.",
                )  # fmt: skip
            if name == "sign" and not silent:
                zero = fold.number(0, node.line)
                relations = [Expr(sign, (given[0], zero), node.line) for sign in (">", "<")]
                parts = (relations[0], fold.number(1), relations[1], fold.number(-1), zero)
                return self.eventful(Expr("if", parts, node.line), source)
            given = tuple(self.eventful(one, source, silent or name == "noEvent") for one in given)
            return Expr("call", (name, given, named), node.line)
        if node.kind == "name":
            return node
        args = tuple(self.eventful(one, source, silent) if isinstance(one, Expr) else one for one in node.args)
        made = Expr(node.kind, args, node.line)
        if node.kind in _RELATIONS and not silent and not self._is_constant(made):
            return Expr("mode", (self._relation(made, source),), node.line)
        return made

    def _definition(self, node: Expr, source: Source) -> Expr:
        name = node.args[0][0]
        made = self.conditions.pop(name)
        try:
            # Its own definition is out of sight: a Boolean that depends on itself remains as a condition.
            inner = self.eventful(made, source, silent=True)
            if name in _conditions(inner):
                raise ModelicaTextError(
                    f"The Boolean {name} depends on itself: that is not supported here.", where=source
                )
        finally:
            self.conditions[name] = made
        return made

    def _is_constant(self, node: Expr) -> bool:
        if node.kind in ("name", "condition"):
            return node.args[0][0].partition("[")[0] in self.parameters or node.args[0][0] in self.assigned
        if node.kind == "call":
            return all(map(self._is_constant, node.args[1]))
        return all(self._is_constant(one) for one in node.args if isinstance(one, Expr))

    def _relation(self, node: Expr, source: Source) -> str:
        key = _text(node)
        if key not in self._relations:
            self._relations[key] = f"relation_{len(self._relations) + 1}"
            self.happenings.append(Happening(self._relations[key], node, source))
        return self._relations[key]

    def _targets(self, body: list[Statement], text: ClassText, local: dict[str, Expr]) -> set[str]:
        """Return the names that a branch of a when determines."""
        made: set[str] = set()
        for one in body:
            if one.kind == "=":
                target = Resolver(self.instance, text, local)(one.parts[0])
                if target.kind not in ("name", "condition"):
                    raise refused("a 'when' with an equation that is not solved for a variable", text, one.line)
                made.add(target.args[0][0])
            elif one.kind == "for":
                raise refused("'for' in a 'when'", text, one.line)
        return made

    def _when(self, one: Statement, text: ClassText, local: dict[str, Expr]) -> None:
        for condition, body in one.parts:
            if condition is None:
                raise refused("'else' of a 'when'", text, one.line)
            notice, resets = self._changes(body, text, local)
            each = condition.args if condition.kind == "array" else (condition,)
            for single in each:
                known = Resolver(self.instance, text, local)(single)
                name, source = (
                    f"when_{sum(h.mode.startswith('when') for h in self.happenings) + 1}",
                    text.place(one.line),
                )
                if known.kind == "call" and known.args[0] == "sample":
                    self.happenings.append(Happening(name, None, source, known.args[1], resets, notice))
                    continue
                if known.kind == "call" and known.args[0] == "edge":
                    known = known.args[1][0]
                if known.kind in ("boolean", "number"):
                    raise ModelicaTextError("The condition of this 'when' never changes.", where=source)
                self.happenings.append(
                    Happening(name, self.eventful(known, source, silent=True), source, None, resets, notice)
                )

    def _changes(self, body: list[Statement], text: ClassText, local: dict[str, Expr]) -> tuple[str, dict[str, Expr]]:
        """Return what a when changes; its equations may use each other's new values."""
        resolver, notice = Resolver(self.instance, text, local), ""
        new: dict[str, Expr] = {}
        states: dict[str, Expr] = {}
        for one in body:
            if one.kind == "=":
                new[resolver(one.parts[0]).args[0][0]] = resolver(one.parts[1])
            elif one.kind == "call" and one.parts[0].args[0] == "reinit" and len(one.parts[0].args[1]) == 2:
                target, value = one.parts[0].args[1]
                states[resolver(target).args[0][0]] = resolver(value)
            elif one.kind == "call" and one.parts[0].args[0] in ("terminate", "assert"):
                notice = _words(one.parts[0].args[1][-1 if one.parts[0].args[0] == "terminate" else 1])
            else:
                raise refused(f"'{one.kind}' in a 'when'", text, one.line)
        source = text.place(body[0].line if body else text.line)
        made = {name: self.eventful(_ordered(one, new, (name,)), source, silent=True) for name, one in new.items()}
        return notice, made | {
            name: self.eventful(_ordered(one, new, ()), source, silent=True) for name, one in states.items()
        }

    def _demand(self, call: Expr, resolver: Resolver, text: ClassText) -> None:
        """Read an assertion: it ends the run where it is broken."""
        name, given, named = call.args
        if name != "assert":
            raise refused(f"{name}(…) among equations", text, call.line)
        if "level" in dict(named) or len(given) > 2:
            return  # a warning
        condition = resolver(given[0])
        words = _words(given[1]) if len(given) > 1 else "an assertion is broken"
        if condition.kind == "boolean":
            if not condition.args[0]:
                raise ModelicaTextError(f"An assertion is broken: {words}.", where=text.place(call.line))
            return
        broken = self.eventful(fold.operation("not", (condition,), call.line), text.place(call.line), silent=True)
        number = sum(one.mode.startswith("assertion") for one in self.happenings) + 1
        self.happenings.append(Happening(f"assertion_{number}", broken, text.place(call.line), notice=words))

    def _initial(self, one: Statement, text: ClassText, local: dict[str, Expr]) -> None:
        resolver = Resolver(self.instance, text, local)
        if one.kind == "if":
            for condition, body in one.parts:
                known = Expr("boolean", (True,)) if condition is None else resolver.known()(condition)
                if known.kind != "boolean":
                    raise refused("an initial equation under a condition that is not known", text, one.line)
                if known.args[0]:
                    for inner in body:
                        self._initial(inner, text, local)
                    return
            return
        if one.kind == "call":
            self._demand(one.parts[0], resolver, text)
            return
        left, right = (resolver(side) for side in one.parts) if one.kind == "=" else (None, None)
        if left is None or right is None or left.kind != "name" or not self._is_constant(right):
            raise refused(
                "an initial equation other than 'variable = expression of parameters'", text, one.line,
                "Give start values with start = … and fixed = true.",
            )  # fmt: skip
        self.starts[left.args[0][0]] = right


def _choice(branches: list[tuple[Expr | None, Expr]], line: int) -> Expr:
    args: list[Expr] = []
    for condition, value in branches:
        args += [value] if condition is None else [condition, value]
    return Expr("if", tuple(args), line)


def _text(node: Expr) -> str:
    inner = (f"({_text(one)})" if isinstance(one, Expr) else str(one) for one in node.args)
    if node.kind == "call":
        inner = (node.args[0], *(_text(one) for one in node.args[1]))
    return f"{node.kind}:{','.join(inner)}"


def _same(one: Expr, other: Expr) -> bool:
    return one.kind == "name" and _text(one) == _text(other)


def _conditions(node: Expr) -> set[str]:
    if node.kind == "condition":
        return {node.args[0][0]}
    inner = node.args[1] if node.kind == "call" else [one for one in node.args if isinstance(one, Expr)]
    return set[str]().union(*map(_conditions, inner)) if node.kind != "name" else set()


def _ordered(node: Expr, new: dict[str, Expr], open_names: tuple[str, ...]) -> Expr:
    """Replace variables of a when by their new values; `pre` keeps the old one."""
    if node.kind in ("name", "condition"):
        name = node.args[0][0]
        if name not in new or name in open_names:
            return node
        return _ordered(new[name], new, (*open_names, name))
    if node.kind == "call":
        name, given, named = node.args
        return (
            node
            if name == "pre"
            else Expr("call", (name, tuple(_ordered(one, new, open_names) for one in given), named))
        )
    args = tuple(_ordered(one, new, open_names) if isinstance(one, Expr) else one for one in node.args)
    return Expr(node.kind, args, node.line)


def _words(node: Expr) -> str:
    """Return the text of a message; numbers in it are left out."""
    if node.kind == "string":
        return node.args[0].replace("{", "(").replace("}", ")")
    return "".join(_words(one) for one in node.args if isinstance(one, Expr)) or "…"
