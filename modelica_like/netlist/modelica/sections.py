"""Algorithm sections of models: each variable that they give a value gets one equation."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from modelica_like.errors import Source
from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.algorithms import Algorithm, targets_in, targets_of
from modelica_like.netlist.modelica.demands import guarded
from modelica_like.netlist.modelica.elements import named_array
from modelica_like.netlist.modelica.instance import refused
from modelica_like.netlist.modelica.members import sizes, value_of
from modelica_like.netlist.modelica.resolve import Resolver
from modelica_like.netlist.modelica.tree import ClassText, Expr, Statement
from modelica_like.netlist.modelica.types import Basic, basic_type
from modelica_like.netlist.modelica.whens import is_ending
from modelica_like.netlist.modelica.written import ASSERT, Happening

if TYPE_CHECKING:
    from modelica_like.netlist.modelica.statements import Statements

When = list[tuple[tuple[Expr, ...], dict[str, Expr]]]
_CALLS = ("terminate", "reinit", "assert")


class Section(Algorithm):
    """One algorithm section.

    Args:
        statements: of the instance; they take the equations and the events.
        text: class it stands in.
        place: of the section.
        initial: whether it is an initial one.
    """

    def __init__(self, statements: Statements, text: ClassText, place: Source, *, initial: bool = False) -> None:
        super().__init__(statements.instance.classes, text)
        self.statements, self.instance, self.place_of_section = statements, statements.instance, place
        self.initial = initial
        self.declared = {name: member.declaration for name, member in self.instance.members.items()}
        self.changed: list[str] = []
        self.demands: list[Expr] | None = None  # of the `when` that is read
        self.whens: list[tuple[When, Source]] = []

    def here(self, text: ClassText | None = None) -> Resolver:
        """Return what resolves expressions with the values so far."""
        return Resolver(self.instance, text or self.text, self.local)

    def equations(self, body: list[Statement]) -> None:
        """Give the variables of a section their equations.

        Raises:
            ModelicaTextError: something in it is not supported.
        """
        in_whens = {name for statement in _whens(body) for name in targets_in(statement.parts)}
        for name in targets_of(body):
            if name not in self.declared:
                raise refused(f"an assignment to {name}", self.text, body[0].line)
            self.local[name] = self._before(name, discrete=name in in_whens or self.initial)
        self.run(body)
        self._happen()
        for name in dict.fromkeys(self.changed):
            variable = Resolver(self.instance, self.text)(Expr("name", ((name, ()),)))
            self.statements.equate(variable, self.local[name], self.text, self.place_of_section.line)

    def _happen(self) -> None:
        """Take the whens; of several that give a variable a value, the last one that happens does."""
        names = [
            {name for _, values in branches for name in values if not is_ending(name)} for branches, _ in self.whens
        ]
        several = {name for k, mine in enumerate(names) for other in names[:k] for name in mine & other}
        for branches, source in self.whens:
            left = [(c, {name: new for name, new in values.items() if name not in several}) for c, values in branches]
            if any(values for _, values in left):
                self.statements.happen(left, source)
        for name in sorted(several):
            joined: When = []
            for branches, source in reversed(self.whens):
                mine = [(conditions, {name: values[name]}) for conditions, values in branches if name in values]
                if mine and len(mine) < len(branches):
                    what = f"{name}, which another 'when' and some branches of this one give a value"
                    raise refused(what, self.text, source.line or 0)
                joined += mine
            self.statements.happen(joined, self.whens[0][1])

    def assigned(self, name: str) -> None:
        """Note that a variable gets a value."""
        self.changed.append(name)

    def other(self, statement: Statement) -> None:
        """Read an event."""
        if statement.kind == "when":
            self._when(statement)
        elif statement.kind == "call" and statement.parts[0].args[0] == "assert":
            self._demand(statement)
        else:
            super().other(statement)

    def _demand(self, statement: Statement) -> None:
        """Take an assertion where the branches it stands in are taken; in a `when` it demands when that happens."""
        demand = self.statements.demanded(statement.parts[0], self.here(), self.text, certain=not self.guards)
        if demand is None:
            return
        holds, words = guarded(demand[0], self.guards), demand[1]
        if self.demands is not None:
            self.demands.append(Expr("demand", (holds, words), statement.line))
            return
        place = self.text.place(statement.line)
        self.statements.happenings.append(Happening((((holds,), {}),), place, words.args[0]))

    def _when(self, statement: Statement) -> None:
        branches: list[tuple[tuple[Expr, ...], dict[str, Expr]]] = []
        for name in targets_in(statement.parts):
            if name not in self.local:  # another 'when' has given it a value
                self.local[name] = self._before(name, discrete=True)
        for condition, body in statement.parts:
            holds = self.here().condition(condition, "when", statement.line)
            before, names = dict(self.local), self.changed
            self.changed, self.demands = [], list[Expr]()
            calls = [s for s in body if s.kind == "call" and s.parts[0].args[0] in _CALLS]
            self.run([s for s in body if s not in calls])
            values: dict[str, Expr] = {}
            for name in dict.fromkeys(self.changed):
                self.statements.fitted(name, self.local[name], values, self.text, statement.line)
            values |= self.statements.changes(calls, self.text, self.local)
            values |= {f"{ASSERT}{len(values) + k}": demand for k, demand in enumerate(self.demands)}
            self.demands = None
            inside, self.changed, self.local = self.changed, names, before
            if set(inside) & set(names):
                what = f"{inside[0]}, which a 'when' and other statements give a value,"
                raise refused(what, self.text, statement.line)
            branches.append((holds.args if holds.kind == "array" else (holds,), values))
        self.whens.append((branches, self.text.place(statement.line)))
        for name in {name for _, values in branches for name in values}:
            self.local.pop(name.partition("[")[0], None)  # from here on, it is what it is

    def _before(self, name: str, *, discrete: bool) -> Expr:
        """Return what a variable is when the section begins: its value before an event, or its start value."""
        member = self.instance.members[name]
        basic = basic_type(self.instance, member)
        if basic is None:
            raise refused(f"an assignment to {name}, which is no number,", self.text, member.declaration.line)
        shape = sizes(self.instance, member)
        if basic.kind != "Real" or discrete or "discrete" in basic.prefixes:
            return _before_event(named_array(name, shape, basic.kind)) if not self.initial else _start(basic, shape)
        if "start" in member.given.inner and member.given.value is None and not shape:
            return value_of(self.instance, name, self.text, member.declaration.line)
        return _start(basic, shape)


def _start(basic: Basic, shape: tuple[int, ...]) -> Expr:
    return fold.filled(Expr("boolean", (False,)) if basic.kind == "Boolean" else fold.number(0), shape)


def _before_event(variable: Expr) -> Expr:
    if variable.kind == "array":
        return Expr("array", tuple(map(_before_event, variable.args)))
    return fold.call("pre", (variable,), 0)


def _whens(body: list[Statement]) -> Iterator[Statement]:
    """Yield the whens of a section."""
    for statement in body:
        if statement.kind == "when":
            yield statement
        elif statement.kind == "if":
            for _, inner in statement.parts:
                yield from _whens(inner)
        elif statement.kind in ("for", "while"):
            yield from _whens(statement.parts[1])
