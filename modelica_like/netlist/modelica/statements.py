"""From the equations of a text to scalar equations, connections, relations and events of one component."""

from __future__ import annotations

from dataclasses import dataclass, field

from modelica_like.errors import ModelicaTextError, Source
from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.instance import Instance, Member, refused
from modelica_like.netlist.modelica.library import Known
from modelica_like.netlist.modelica.members import element, exists, part_of, sizes
from modelica_like.netlist.modelica.resolve import Resolver
from modelica_like.netlist.modelica.tree import ClassText, Expr, Statement, calls_in
from modelica_like.netlist.modelica.types import Basic, basic_type, is_bound_outside, misfit
from modelica_like.netlist.modelica.written import ASSERT, MEMORY, TERMINATE, Happening

_INSTANTS = ("sample", "edge", "change", "initial", "terminal")


@dataclass(frozen=True)
class Bound:
    """An input of a part that has an equation in the part's modification: its path, type and place."""

    end: str
    basic: Basic
    source: Source


@dataclass
class Statements:
    """What the text of one instance says.

    Args:
        instance: with its members.

    Attributes:
        equations: sides and place.
        initial: the same, of the start.
        connections: two ends each, with the place.
        happenings: whens and assertions.
        assigned: names that only events change.
        memory: values of discrete variables before the start, from initial equations of `pre(…)`.
        outputs: Boolean signals with an equation, and whether they are true for instants only.
        bound: inputs of parts with an equation in the part's modification, by the names of signals that drive them.
    """

    instance: Instance
    equations: list[tuple[Expr, Expr, Source]] = field(default_factory=list)
    initial: list[tuple[Expr, Expr, Source]] = field(default_factory=list)
    connections: list[tuple[Expr, Expr, Source]] = field(default_factory=list)
    happenings: list[Happening] = field(default_factory=list)
    assigned: set[str] = field(default_factory=set)
    memory: dict[str, Expr] = field(default_factory=dict)
    outputs: dict[str, bool] = field(default_factory=dict)
    bound: dict[str, Bound] = field(default_factory=dict[str, "Bound"])

    def read(self) -> None:
        """Go through declarations with values, then all equations.

        Raises:
            ModelicaTextError: something is not supported.
        """
        self._bindings()
        for happening, text in self.instance.equations:
            self._statement(happening, text, {})
        start = Statements(self.instance)
        for happening, text in self.instance.initial_equations:
            start._statement(happening, text, {})
        if start.connections or any(not h.text for h in start.happenings):
            happening, text = self.instance.initial_equations[0]
            raise refused("a connection or a 'when' among initial equations", text, happening.line)
        for left, right, source in start.equations:
            if left.kind == "call" and left.args[0] == "pre":
                self.memory[left.args[1][0].args[0][0]] = right
            else:
                self.initial.append((left, right, source))
        for left, right, source in self.equations:
            for call in (*calls_in(left), *calls_in(right)):
                self._check_memory(call, source)
        values = [side for left, right, _ in (*self.equations, *self.initial) for side in (left, right)]
        sources = [source for _, _, source in (*self.equations, *self.initial) for _ in (0, 1)]
        for happening in self.happenings:
            for conditions, new in happening.branches:
                demanded = (value.args[0] for name, value in new.items() if name.startswith(ASSERT))
                numbers = [*conditions, *demanded, *(value for name, value in new.items() if not _is_ending(name))]
                values += numbers
                sources += [happening.source] * len(numbers)
        for value, source in zip(values, sources, strict=True):
            if not _is_numeric(value):
                raise ModelicaTextError("A text, an array or a choice stands where a number belongs.", where=source)

    def _check_memory(self, call: Expr, source: Source) -> None:
        """Refuse `pre` and `change` of a variable that changes all the time."""
        argument = call.args[1][0] if call.args[0] in ("pre", "change") else None
        name = argument.args[0][0] if argument is not None and argument.kind == "name" else ""
        member = self.instance.members.get(name)
        basic = basic_type(self.instance, member) if member is not None else None
        continuous = basic is not None and basic.kind == "Real" and "discrete" not in basic.prefixes
        if continuous and name not in self.assigned:
            raise ModelicaTextError(
                f"{call.args[0]}({name}): only what changes at events has a value before them.", where=source
            )

    @property
    def states(self) -> set[str]:
        """Names whose derivatives are in the equations."""
        sides = [side for left, right, _ in self.equations for side in (left, right)]
        calls = [call for side in sides for call in calls_in(side) if call.args[0] == "der"]
        return {call.args[1][0].args[0][0] for call in calls if call.args[1][0].kind == "name"}

    def _bindings(self) -> None:
        """Collect declarations `Real x = …`."""
        for name, member in self.instance.members.items():
            declared, basic = member.declaration, basic_type(self.instance, member)
            if {"parameter", "constant"} & declared.prefixes:
                continue
            if basic is None:
                self._part_bindings(name, member)
            elif is_bound_outside(self.instance, member, basic):
                continue  # an equation of the part's owner
            elif member.given.value is not None and member.given.scope is not None:
                scope, text = member.given.scope
                if scope is not self.instance:
                    raise refused(f"an equation for {name} in the modification of its component", text, declared.line)
                left = Resolver(self.instance, text)(Expr("name", ((name, ()),), declared.line))
                self._equate(left, Resolver(scope, text)(member.given.value), text, declared.line)

    def _part_bindings(self, name: str, member: Member) -> None:
        """Collect `Flange_a flange(tau = …)` and `Own part(input = …)`: such values are equations."""
        shape = sizes(self.instance, member) if member.given.inner and exists(self.instance, member) else (0,)
        for k in range(1, shape[0] + 1) if shape else (0,):
            part = part_of(self.instance, member, k)
            if isinstance(part, Instance) and part.text.kind != "connector":
                self._input_bindings(f"{name}[{k}]" if k else name, part)
            if isinstance(part, Known) or (isinstance(part, Instance) and part.text.kind != "connector"):
                continue
            for last, entry in (element(member.given, k) if k else member.given).inner.items():
                if entry.value is None or entry.scope is None:
                    continue
                if entry.scope[0] is not self.instance:
                    what = f"an equation for {name}.{last} in the modification of its component"
                    raise refused(what, entry.scope[1], entry.line)
                path = Expr("name", ((f"{name}[{k}].{last}" if k else f"{name}.{last}", ()),), entry.line)
                self._equate(path, Resolver(*entry.scope)(entry.value), entry.scope[1], entry.line)

    def _input_bindings(self, path: str, part: Instance) -> None:
        """Collect `Own part(input = …)`: a signal of this class has the value, and drives the input."""
        for name, member in part.members.items():
            basic, (given, scope) = basic_type(part, member), (member.given.value, member.given.scope)
            if given is None or scope is None or not is_bound_outside(part, member, basic):
                continue
            assert basic is not None
            signal = f"{path}_{name}"
            while signal in self.instance.members or signal in self.bound:
                signal += "_"
            self.bound[signal] = Bound(f"{path}.{name}", basic, scope[1].place(given.line))
            self._equate(Expr("name", ((signal, ()),), given.line), Resolver(*scope)(given), scope[1], given.line)

    def _statement(self, statement: Statement, text: ClassText, local: dict[str, Expr]) -> None:
        resolver = Resolver(self.instance, text, local)
        self.instance.classes.spend(10, text, statement.line)
        if statement.kind == "=":
            self._equate(resolver(statement.parts[0]), resolver(statement.parts[1]), text, statement.line)
        elif statement.kind == "connect":
            left, right = (self._end(side, resolver) for side in statement.parts)
            self.connections.append((left, right, text.place(statement.line)))
        elif statement.kind == "for":
            self._loop(list(statement.parts[0]), statement.parts[1], text, local)
        elif statement.kind == "if":
            self._branches(statement, text, local)
        elif statement.kind == "when":
            self._when(statement, text, local)
        elif statement.kind == "call":
            if statement.parts[0].args[0] != "assert":
                raise refused(f"{statement.parts[0].args[0]}(…) among equations", text, statement.parts[0].line)
            demand = self._demanded(statement.parts[0], resolver, text)
            if demand is not None:
                condition, words = demand
                self.happenings.append(
                    Happening((((condition,), {}),), text.place(statement.parts[0].line), words.args[0])
                )
        else:
            raise refused(f"'{statement.kind}' among equations", text, statement.line)

    def _end(self, end: Expr, resolver: Resolver) -> Expr:
        """Resolve the subscripts of an end of a connection, and keep its names."""
        if end.kind != "name":
            raise refused("this end of a connection", resolver.text, end.line)
        parts: list[tuple[str, tuple[Expr, ...]]] = []
        for k, (name, subs) in enumerate(end.args):
            inside = resolver.known()
            member = self.instance.members.get(name) if subs and not k else None
            if member is not None:
                inside.local |= {"end": fold.number(([*sizes(self.instance, member), 0])[0])}
            parts.append((name, tuple(inside(index) for index in subs)))
        return Expr("name", tuple(parts), end.line)

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
                for statement in body:
                    self._statement(statement, text, inner)

    def _branches(self, statement: Statement, text: ClassText, local: dict[str, Expr]) -> None:
        """Take the branch that parameters decide; else make one equation of those at the same place in all branches."""
        resolver = Resolver(self.instance, text, local)
        open_branches: list[tuple[Expr | None, Statements]] = []
        for condition, body in statement.parts:
            holds = (
                Expr("boolean", (True,)) if condition is None else resolver.condition(condition, "if", statement.line)
            )
            if holds.kind == "boolean" and not holds.args[0]:
                continue
            target = Statements(self.instance) if open_branches or holds.kind != "boolean" else self
            for inner in body:
                target._statement(inner, text, local)
            if target is self:
                return
            if target.connections or target.happenings:
                raise refused("a connection or an event in a branch that changes during a run", text, statement.line)
            open_branches.append((None if holds.kind == "boolean" else holds, target))
            if holds.kind == "boolean":
                break
        if not open_branches:
            return
        self._joined(open_branches, text, statement.line)

    def _joined(self, branches: list[tuple[Expr | None, Statements]], text: ClassText, line: int) -> None:
        counts = {len(branch.equations) for _, branch in branches}
        if len(counts) > 1 or branches[-1][0] is not None:
            raise refused("an 'if' whose branches have different numbers of equations", text, line)
        for k in range(counts.pop()):
            rows = [(condition, *branch.equations[k]) for condition, branch in branches]
            left = rows[0][1]
            if all(row[1].kind == "name" and _text(row[1]) == _text(left) for row in rows):
                self.equations.append((left, _choice([(row[0], row[2]) for row in rows], line), rows[0][3]))
                continue
            zero = [(row[0], fold.operation("-", (row[1], row[2]), line)) for row in rows]
            self.equations.append((_choice(zero, line), fold.number(0, line), text.place(line)))

    def _equate(self, left: Expr, right: Expr, text: ClassText, line: int) -> None:
        if left.kind == "array" or right.kind == "array":
            if left.kind != right.kind or len(left.args) != len(right.args):
                raise ModelicaTextError("The sizes of both sides differ.", where=text.place(line))
            for argument, other in zip(left.args, right.args, strict=True):
                self._equate(argument, other, text, line)
        elif left.kind == "condition":
            self._check_type(left, right, text, line)
            right = _condition(right)
            member = self.instance.members.get(left.args[0][0].partition("[")[0])
            if member is None:
                raise refused(
                    f"An equation for {left.args[0][0]}, a Boolean of a part", text, line, "Connect a signal."
                )
            basic = basic_type(self.instance, member)
            if basic is not None and basic.prefixes & {"input", "output"}:
                path = left.args[0][0]
                self.outputs[path] = any(call.args[0] in _INSTANTS for call in calls_in(right))
                signal = Expr("if", (left, fold.number(1), fold.number(0)), line)
                self.equations.append((Expr("name", left.args, line), signal, text.place(line)))
                left = Expr("name", ((f"{path}{MEMORY}", ()),), line)
            self.equations.append((left, right, text.place(line)))
        else:
            if left.kind == "number" and right.kind == "name":
                left, right = right, left
            fitting = self._fitting(left, right, text, line)
            if fold.is_condition(left) is not fold.is_condition(right):
                what = "A condition is no number: write `if … then 1 else 0`."
                raise ModelicaTextError(what, where=text.place(line))
            self.equations.append((left, fitting, text.place(line)))

    def _check_type(self, left: Expr, right: Expr, text: ClassText, line: int) -> Basic | None:
        """Return the type of an own variable; refuse a value of another one."""
        name = left.args[0][0] if left.kind in ("name", "condition") and len(left.args) == 1 else ""
        member = self.instance.members.get(name.partition("[")[0])
        basic = basic_type(self.instance, member) if member is not None else None
        wrong = misfit(right, basic) if basic is not None else ""
        if wrong:
            raise ModelicaTextError(f"{name} {wrong}.", where=text.place(line))
        return basic

    def _fitting(self, left: Expr, right: Expr, text: ClassText, line: int) -> Expr:
        """Return a value that has the type of an own variable; those of an enumeration are numbers."""
        target = left.args[1][0] if left.kind == "call" and left.args[0] == "pre" else left
        basic = self._check_type(target, right, text, line)
        return fold.numbered(right) if basic is not None and basic.kind == "enumeration" else right

    # -- events ------------------------------------------------------------------------------------------------------

    def _when(self, statement: Statement, text: ClassText, local: dict[str, Expr]) -> None:
        resolver, source = Resolver(self.instance, text, local), text.place(statement.line)
        branches: list[tuple[tuple[Expr, ...], dict[str, Expr]]] = []
        assigned: set[str] = set()
        for condition, body in statement.parts:
            if condition is None:
                raise refused("'else' of a 'when'", text, statement.line)
            holds = resolver.condition(condition, "when", statement.line)
            conditions = holds.args if holds.kind == "array" else (holds,)
            if any(each.kind == "boolean" for each in conditions):
                raise ModelicaTextError("The condition of this 'when' never changes.", where=source)
            values = self._changes(body, text, local)
            calls = (s.parts[0] for s in body if s.kind == "call" and s.parts[0].args[0] == "reinit")
            states = {state.args[0][0] for call in calls for state in fold.elements(resolver(call.args[1][0]))}
            assigned |= {name for name in values if name not in states and not _is_ending(name)}
            branches.append((conditions, values))
        for name in assigned & self.assigned:
            raise ModelicaTextError(f"Two whens determine {name}.", where=source)
        self.assigned |= assigned
        self.happenings.append(Happening(tuple(branches), source))

    def _changes(self, body: list[Statement], text: ClassText, local: dict[str, Expr]) -> dict[str, Expr]:
        """Return the new values of a branch of a when."""
        resolver = Resolver(self.instance, text, local)
        values: dict[str, Expr] = {}
        for statement in body:
            call = statement.parts[0] if statement.kind == "call" else None
            if statement.kind == "=":
                target, value = resolver(statement.parts[0]), resolver(statement.parts[1])
                if target.kind not in ("name", "condition"):
                    raise refused("a 'when' with an equation that is not solved for a variable", text, statement.line)
                fitting = self._fitting(target, value, text, statement.line)
                values[target.args[0][0]] = _condition(value) if target.kind == "condition" else fitting
            elif call is not None and call.args[0] == "reinit" and len(call.args[1]) == 2:
                targets, given = (fold.elements(resolver(side)) for side in call.args[1])
                if len(targets) != len(given) or any(target.kind != "name" for target in targets):
                    what = "reinit(…) needs states, and as many values."
                    raise ModelicaTextError(what, where=text.place(statement.line))
                values |= {target.args[0][0]: value for target, value in zip(targets, given, strict=True)}
            elif call is not None and call.args[0] == "terminate":
                values[TERMINATE] = Expr("string", (_words(call.args[1][0]),), statement.line)
            elif call is not None and call.args[0] == "assert":
                demand = self._demanded(call, resolver, text)
                values |= {} if demand is None else {f"{ASSERT}{len(values)}": Expr("demand", demand, statement.line)}
            else:
                raise refused(f"'{statement.kind}' in a 'when'", text, statement.line)
        return values

    def _demanded(self, call: Expr, resolver: Resolver, text: ClassText) -> tuple[Expr, Expr] | None:
        """Return the condition of an assertion and its words; None of a warning and of what always holds."""
        _, given, named = call.args
        level = given[2] if len(given) > 2 else dict(named).get("level")
        if level is not None and not (level.kind == "name" and level.args[-1][0] == "error"):
            return None
        condition = resolver.condition(given[0], "assert", call.line)
        words = _words(given[1]) if len(given) > 1 else "an assertion is broken"
        if condition.kind != "boolean":
            return condition, Expr("string", (words,), call.line)
        if not condition.args[0]:
            raise ModelicaTextError(f"An assertion is broken: {words}.", where=text.place(call.line))
        return None


def _is_ending(name: str) -> bool:
    return name.startswith((TERMINATE, ASSERT))


def _condition(node: Expr) -> Expr:
    """Return a choice between conditions as one condition."""
    if node.kind != "if":
        return node
    condition, value, *rest = node.args
    other = _condition(rest[0] if len(rest) == 1 else Expr("if", tuple(rest), node.line))
    taken = fold.operation("and", (condition, _condition(value)), node.line)
    left = fold.operation("and", (fold.operation("not", (condition,), node.line), other), node.line)
    return fold.operation("or", (taken, left), node.line)


def _is_numeric(node: Expr) -> bool:
    inner = node.args[1] if node.kind == "call" else [argument for argument in node.args if isinstance(argument, Expr)]
    return node.kind not in ("string", "array", "literal") and all(map(_is_numeric, inner))


def _choice(branches: list[tuple[Expr | None, Expr]], line: int) -> Expr:
    args: list[Expr] = []
    for condition, value in branches:
        args += [value] if condition is None else [condition, value]
    return Expr("if", tuple(args), line)


def _text(node: Expr) -> str:
    inner = (f"({_text(argument)})" if isinstance(argument, Expr) else str(argument) for argument in node.args)
    if node.kind == "call":
        inner = (node.args[0], *(_text(argument) for argument in node.args[1]))
    return f"{node.kind}:{','.join(inner)}"


def _words(node: Expr) -> str:
    """Return the text of a message; numbers in it are left out."""
    if node.kind == "string":
        return node.args[0].replace("{", "(").replace("}", ")")
    return "".join(_words(argument) for argument in node.args if isinstance(argument, Expr)) or "…"
