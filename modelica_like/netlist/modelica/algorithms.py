"""Algorithms: their statements are run on expressions, so that a result is one expression."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from modelica_like.errors import ModelicaTextError
from modelica_like.netlist.modelica import fold, laws, subscripts
from modelica_like.netlist.modelica.instance import refused
from modelica_like.netlist.modelica.tree import ClassText, Declaration, Expr, Statement, names_in

if TYPE_CHECKING:
    from modelica_like.netlist.modelica.classes import Classes
    from modelica_like.netlist.modelica.resolve import Resolver

Branches = list[tuple[Expr | None, list[Statement]]]


class OpenLoop(ModelicaTextError):
    """How often a loop runs is not known when the text is read."""


def _open(what: str, text: ClassText, line: int) -> OpenLoop:
    return OpenLoop(refused(what, text, line).what, where=text.place(line))


class Algorithm:
    """Statements and what they know.

    Args:
        classes: finds classes.
        text: class whose names the statements use.

    Attributes:
        declared: declarations by name.
        local: values so far.
        loops: how deep in loops the statements are.
        guards: conditions of the branches they stand in, which only a run knows.
        silences: whether relations make no events.
    """

    silences = False

    def __init__(self, classes: Classes, text: ClassText) -> None:
        self.classes, self.text = classes, text
        self.declared: dict[str, Declaration] = {}
        self.local: dict[str, Expr] = {}
        self.loops = 0
        self.guards: tuple[Expr, ...] = ()

    def here(self, text: ClassText | None = None) -> Resolver:
        """Return what resolves expressions with the values so far."""
        raise NotImplementedError

    def assigned(self, name: str) -> None:
        """Note that a variable gets a value."""

    def run(self, statements: list[Statement]) -> str:
        """Run statements; what follows an `if` that may return goes on in its branches.

        Returns:
            `return` or `break` where one of these has ended them.
        """
        for k, statement in enumerate(statements):
            self.classes.spend(5, self.text, statement.line)
            if statement.kind == ":=":
                self.assign(statement.parts[0], self.here()(statement.parts[1]))
            elif statement.kind == "if":
                if any(_leaves(body) for _, body in statement.parts):
                    return self.branch(_followed(list(statement.parts), statements[k + 1 :]), statement.line)
                self.branch(list(statement.parts), statement.line)
            elif statement.kind == "for" and _returns(statement.parts[1]):
                return self.run([*self.unrolled(*statement.parts), *statements[k + 1 :]])
            elif statement.kind == "iterate":
                self.local[statement.parts[0]] = statement.parts[1]
            elif statement.kind in ("for", "while"):
                self.loops += 1
                loop = self.loop(*statement.parts) if statement.kind == "for" else self.repeat(statement)
                self.loops -= 1
                if loop == "return":
                    return loop
            elif statement.kind in ("return", "break"):
                return statement.kind
            else:
                self.other(statement)
        return ""

    def repeat(self, statement: Statement) -> str:
        """Run a `while`."""
        while True:
            holds = self.here()(statement.parts[0])
            if holds.kind != "boolean":
                self._rounds(statement)
                return ""
            if not holds.args[0]:
                return ""
            self.classes.spend(5, self.text, statement.line)
            if end := self.run(statement.parts[1]):
                return end

    def _rounds(self, loop: Statement) -> None:
        """Run a `while` that goes along an array: its condition has an element of it, so as many rounds are enough."""
        condition, body = loop.parts
        arrays = [self.local.get(name) for each in names_in(condition) for name, at in each.args if at]
        rounds = max((len(array.args) for array in arrays if array is not None), default=0)
        if not rounds or _leaves(body):
            raise _open("a 'while' whose end only a run knows", self.text, loop.line)
        changed = [name for name in dict.fromkeys(targets_of(body)) if name in self.local]
        for _ in range(rounds):
            arguments, before = list[Expr](), dict(self.local)
            slots = {name: laws.opened(value, arguments) for name, value in before.items()}
            self.local = dict(slots)
            holds, guards = self.here().condition(condition, "while", loop.line), self.guards
            self.guards = (*guards, holds)
            self.run(body)
            after, self.local, self.guards = self.local, before, guards
            for name in changed:
                law = fold.choice([holds, after[name]], slots[name], loop.line)
                law = fold.quiet(law) if self.silences else law
                self.local[name] = laws.closed(law, arguments, loop.line)
        ends = fold.operation("not", (self.here()(condition),), loop.line)
        for name in changed:
            words = f"has a 'while' that does not end after {rounds} rounds"
            self.local[name] = subscripts.demanding(self.local[name], ends, words, loop.line)

    def other(self, statement: Statement) -> None:
        """Run an assertion; what is only printed is left out."""
        name = statement.parts[0].args[0] if statement.kind == "call" else ""
        if name == "assert":
            self.insist(statement)
        elif name and not name.endswith("Streams.print"):
            self.here()(statement.parts[0])  # a function of assertions
        elif not name:
            raise refused(f"'{statement.kind}' in an algorithm", self.text, statement.line)

    def insist(self, statement: Statement) -> None:
        """Refuse what an assertion excludes; what only a run knows is not checked, nor whether it comes to it."""
        from modelica_like.netlist.modelica import operators

        if self.guards:
            return
        demand = operators.demand_of(self.here(), statement.parts[0])
        if demand is not None and demand[0].kind == "boolean" and not demand[0].args[0]:
            raise fold.Unfit(f"{self.text.name} refuses its arguments: {demand[1]}")

    def assign(self, target: Expr, value: Expr) -> None:
        """Give a variable, an element of an array or several results of a function their values."""
        if target.kind == "tuple":
            values = value.args if value.kind == "tuple" else (value,)
            for part, result in zip(target.args, values, strict=False):
                if part.kind != "all":
                    self.assign(part, result)
            return
        value = value.args[0] if value.kind == "tuple" else value
        if target.kind == "name" and len(target.args) == 2 and self._into_record(target, value):
            return
        if target.kind != "name" or len(target.args) != 1 or target.args[0][0] not in self.declared:
            raise refused("this target of an assignment", self.text, target.line)
        name, subscripts = target.args[0]
        self.assigned(name)
        if "input" in self.declared[name].prefixes:
            raise ModelicaTextError(f"{name} is an input and cannot be assigned.", where=self.text.place(target.line))
        places, whole = list[int](), self.local[name]
        if any(self._only_in_a_run(subscript) for subscript in subscripts):
            self.local[name] = self._into(whole, subscripts, value)
            return
        for dimension, subscript in enumerate(subscripts):
            chosen = self._several(subscript, whole)
            if chosen is not None:
                self._assign_each(target, dimension, chosen, value)
                return
            open_size = [size.kind for size in self.declared[name].dimensions[dimension : dimension + 1]] == ["all"]
            places.append(self.place(whole, subscript, open_size=open_size))
            whole = whole.args[places[-1]] if places[-1] < len(whole.args) else fold.number(0)
        self.local[name] = _replaced(self.local[name], places, value)

    def _only_in_a_run(self, subscript: Expr) -> bool:
        """Whether only a run knows a subscript."""
        if subscript.kind in ("all", "range", "array") or any(name.path == "end" for name in names_in(subscript)):
            return False
        return self.here().known()(subscript).kind not in ("number", "literal", "array")

    def _into(self, whole: Expr, places: tuple[Expr, ...], value: Expr) -> Expr:
        """Return an array with a new element at subscripts of which only a run knows some."""
        if not places:
            return value
        if whole.kind != "array":
            raise ModelicaTextError("What is no array has no subscript.", where=self.text.place(places[0].line))
        chosen, items = self.here().index(places[0], len(whole.args)), list(whole.args)
        if isinstance(chosen, int):
            items[chosen - 1] = self._into(items[chosen - 1], places[1:], value)
            return Expr("array", tuple(items), whole.line)
        if chosen.kind == "array":
            raise refused("a slice beside a subscript that only a run knows", self.text, places[0].line)
        new = tuple(self._into(item, places[1:], value) for item in items)
        return subscripts.placed(chosen, tuple(items), new, places[0].line)

    def _into_record(self, target: Expr, value: Expr) -> bool:
        """Give an element of a record its value; tell whether the target is one."""
        (name, at), (key, inner) = target.args
        record = self.local.get(name)
        if record is None or record.kind != "record" or at or inner or key not in record.args[0]:
            return False
        self.assigned(name)
        values = (value if each == key else old for each, old in zip(record.args[0], record.args[1:], strict=True))
        self.local[name] = Expr("record", (record.args[0], *values), target.line)
        return True

    def _several(self, subscript: Expr, whole: Expr) -> tuple[Expr, ...] | None:
        """Return the subscripts of a slice, None if it is a single element."""
        if subscript.kind == "all":
            return tuple(fold.number(k) for k in range(1, len(whole.args) + 1))
        chosen = self.here().index(subscript, len(whole.args)) if subscript.kind in ("range", "array") else 0
        return chosen.args if isinstance(chosen, Expr) else None

    def _assign_each(self, target: Expr, dimension: int, chosen: tuple[Expr, ...], value: Expr) -> None:
        (name, subscripts), items = target.args[0], value.args
        if value.kind != "array" or len(items) != len(chosen):
            raise fold.Unfit(f"{name} is given {len(items)} elements for {len(chosen)}")
        for one, item in zip(chosen, items, strict=True):
            at = (*subscripts[:dimension], one, *subscripts[dimension + 1 :])
            self.assign(Expr("name", ((name, at),), target.line), item)

    def place(self, whole: Expr, subscript: Expr, *, open_size: bool) -> int:
        """Return the place of an element, from 0; an array of open size may grow."""
        if whole.kind != "array":
            raise ModelicaTextError("What is no array has no subscript.", where=self.text.place(subscript.line))
        position, size = self.here().number(subscript), len(whole.args)
        if position != int(position) or position < 1 or (position > size and not open_size):
            raise ModelicaTextError(
                f"The index {position:g} is not one of 1 to {size}.", where=self.text.place(subscript.line)
            )
        return int(position) - 1

    def branch(self, branches: Branches, line: int) -> str:
        """Run the branch that is taken; where that is not known, all of them."""
        if not branches:
            return ""
        condition, statements = branches[0]
        holds = Expr("boolean", (True,)) if condition is None else self.here().condition(condition, "if", line)
        if holds.kind == "boolean":
            return self.run(statements) if holds.args[0] else self.branch(branches[1:], line)
        if self.loops and any(_leaves(body) for _, body in branches):
            raise _open("a loop that ends where only a run knows", self.text, line)
        before, guards = dict(self.local), self.guards
        self.guards = (*guards, holds)
        self.run(statements)
        taken, self.local = self.local, before
        self.guards = (*guards, fold.operation("not", (holds,), line))
        self.branch(branches[1:], line)
        self.guards = guards
        for name, other in self.local.items():
            if name in taken and taken[name] != other:
                self.local[name] = fold.choice([holds, taken[name]], other, line)
        return ""

    def unrolled(
        self, iterators: tuple[tuple[str, Expr | None], ...], statements: list[Statement]
    ) -> Iterator[Statement]:
        """Yield the statements of a loop one after the other, because one of them may end the algorithm."""
        (name, over), rest = iterators[0], iterators[1:]
        if over is None or rest:
            raise refused("a loop over several indices that ends the algorithm", self.text, self.text.line)
        for value in self.here().array(over):
            yield Statement("iterate", (name, value), value.line)
            yield from statements

    def loop(self, iterators: tuple[tuple[str, Expr | None], ...], statements: list[Statement]) -> str:
        """Run a `for`."""
        (name, over), rest = iterators[0], iterators[1:]
        if over is None:
            raise refused("an iterator without a range", self.text, self.text.line)
        hidden, end = self.local.get(name), ""
        for value in self.here().array(over):
            self.local[name] = value
            end = self.loop(rest, statements) if rest else self.run(statements)
            if end:
                break
        self.local.pop(name, None)
        if hidden is not None:  # a variable of the same name
            self.local[name] = hidden
        return end


def _leaves(statements: list[Statement]) -> bool:
    """Tell whether statements end the algorithm, or may."""
    return any(
        statement.kind in ("return", "break")
        or (statement.kind == "if" and any(_leaves(body) for _, body in statement.parts))
        for statement in statements
    )


def _followed(branches: Branches, rest: list[Statement]) -> Branches:
    """Return branches that go on with the rest, but those that end the algorithm."""
    if branches[-1][0] is not None:
        branches = [*branches, (None, [])]
    return [(condition, body if _ends(body) else [*body, *rest]) for condition, body in branches]


def _returns(statements: list[Statement]) -> bool:
    return any(
        statement.kind == "return" or (statement.kind == "if" and any(_returns(body) for _, body in statement.parts))
        for statement in statements
    )


def _ends(body: list[Statement]) -> bool:
    return bool(body) and body[-1].kind in ("return", "break")


def _replaced(whole: Expr, places: list[int], value: Expr) -> Expr:
    if not places:
        return value
    items = list(whole.args)
    while len(items) <= places[0]:  # an output of open size grows
        items.append(fold.number(0))
    items[places[0]] = _replaced(items[places[0]], places[1:], value)
    return Expr("array", tuple(items), whole.line)


def targets_of(body: list[Statement]) -> Iterator[str]:
    """Yield the names that get values."""
    yield from targets_in([(None, body)])


def targets_in(branches: Iterable[tuple[Expr | None, list[Statement]]]) -> Iterator[str]:
    """Yield the names that get values in branches."""
    for _, body in branches:
        for statement in body:
            if statement.kind == ":=":
                left = statement.parts[0]
                yield from (part.args[0][0] for part in (left.args if left.kind == "tuple" else (left,)) if part.args)
            elif statement.kind in ("if", "when"):
                yield from targets_in(statement.parts)
            elif statement.kind in ("for", "while"):
                yield from targets_of(statement.parts[1])
