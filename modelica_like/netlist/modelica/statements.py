"""From the equations of a text to scalar equations, connections, relations and events of one component."""

from __future__ import annotations

from dataclasses import dataclass, field

from modelica_like.errors import ModelicaTextError, Source
from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.before import Before, begin_late, begun
from modelica_like.netlist.modelica.buses import bus_equations
from modelica_like.netlist.modelica.causal import Joints, connections, declared_at, rounds, variable_at
from modelica_like.netlist.modelica.demands import demanded_elements
from modelica_like.netlist.modelica.elements import elements_of
from modelica_like.netlist.modelica.instance import Instance, Member, refused
from modelica_like.netlist.modelica.library import Known
from modelica_like.netlist.modelica.lifting import above, height, levels_between, outside, owner_above, renamed
from modelica_like.netlist.modelica.members import element, exists, part_of, sizes
from modelica_like.netlist.modelica.resolve import Resolver
from modelica_like.netlist.modelica.sections import Section
from modelica_like.netlist.modelica.signals import Memories, inner_signals, whole_numbers
from modelica_like.netlist.modelica.tree import ClassText, Expr, Statement, calls_in
from modelica_like.netlist.modelica.types import Basic, basic_type, is_bound_outside, is_signal
from modelica_like.netlist.modelica.units import check_units
from modelica_like.netlist.modelica.whens import Whens, as_condition, if_taken, is_demand, is_ending
from modelica_like.netlist.modelica.wiring import Wire, groups
from modelica_like.netlist.modelica.written import ASSERT, MEMORY, Happening


@dataclass(frozen=True)
class Bound:
    """An input of a part that has an equation in the part's modification: its path, type and place."""

    end: str
    basic: Basic
    source: Source


@dataclass
class Statements(Whens):
    """What the text of one instance says.

    Args:
        instance: with its members.
        initially: whether the statements are those of the start.

    Attributes:
        equations: sides and place.
        initial: the same, of the start.
        memory: values of discrete variables before the start, from initial equations of `pre(…)`.
        wires: connections, gathered.
        outputs: types of the signals that change at events, and whether they are true for instants only.
        bound: inputs of parts with an equation in the part's modification, by the names of signals that drive them.
    """

    initially: bool = False
    connects: bool = field(default=False, init=False)
    equations: list[tuple[Expr, Expr, Source]] = field(default_factory=list)
    initial: list[tuple[Expr, Expr, Source]] = field(default_factory=list)
    memory: dict[str, Expr] = field(default_factory=dict)
    wires: list[Wire] = field(default_factory=list[Wire])
    outputs: dict[str, tuple[Basic, bool]] = field(default_factory=dict)
    bound: dict[str, Bound] = field(default_factory=dict[str, "Bound"])

    def read(self) -> None:
        """Go through declarations with values, then all equations.

        Raises:
            ModelicaTextError: something is not supported.
        """
        self._bindings()
        for happening, text in self.instance.equations:
            self.statement(happening, text, {})
        self._join()
        self._read_start()
        self.happenings = demanded_elements(self.equations, self.initial, self.happenings)
        inside, discrete = self.instance, self._is_discrete
        self.equations = [(a, whole_numbers(inside, b) if discrete(a) else b, at) for a, b, at in self.equations]
        memories = Memories(self.instance, self.assigned)
        others = [v for h in self.happenings for conditions, new in h.branches for v in (*conditions, *new.values())]
        memories.read(self.equations, others, self.instance.text.place(self.instance.text.line))
        self.equations, self.outputs = memories.equations, memories.of
        self._lift()
        for left, right, source in self.equations:
            for call in (*calls_in(left), *calls_in(right)):
                self._check_memory(call, source)
        self._check_numbers()

    def _join(self) -> None:
        """Make equations of connections within the instance."""
        joints = Joints(self.instance)
        check_units(self.instance, connections(self.instance))
        inner = inner_signals(self.instance, groups(joints.others))
        self.wires = inner.wires + [Wire([*ends], source) for ends, source in self.instance.bus_wires]
        resolver = Resolver(self.instance, self.instance.text)
        for path, terms, source in joints.equations():
            items = [variable_at(self.instance, name) for _, name in terms]
            items = [
                fold.operation("neg", (v,), 0) if sign < 0 else v for (sign, _), v in zip(terms, items, strict=True)
            ]
            self.equations.append((variable_at(self.instance, path), fold.total(items, 0), source))
        self.instance.balance -= joints.taken()
        self.equations += bus_equations(self.instance)
        for left, right, source in inner.equal:
            before = len(self.equations)
            self.equate(resolver(left), resolver(right), self.instance.text, 0)
            self.equations[before:] = [(one, other, source) for one, other, _ in self.equations[before:]]

    def _read_start(self) -> None:
        """Go through the initial equations."""
        start = Statements(self.instance, initially=True)
        for happening, text in self.instance.initial_equations:
            start.statement(happening, text, {})
        if any(not h.text for h in start.happenings):
            happening, text = self.instance.initial_equations[0]
            raise refused("a connection or a 'when' among initial equations", text, happening.line)
        self._orient()
        before = Before(
            self.equations, start.equations, self._is_discrete, self._changes_at_events,
            Resolver(self.instance, self.instance.text).known(),
        )  # fmt: skip
        self.memory, self.initial = before.memory, before.others
        self.instance.late = before.late
        if before.late:
            staying = [
                e for e in self.equations if e[1] == fold.call("pre", (e[0],), 0) and e[0].args[0][0] in before.late
            ]
            self.happenings += [Happening((((), {left.args[0][0]: right}),), at) for left, right, at in staying]
            others = (e for e in self.equations if e not in staying)
            self.equations = [(left, begun(right, before.late), source) for left, right, source in others]
            self.happenings = [begin_late(happening, before.late) for happening in self.happenings]

    def _check_numbers(self) -> None:
        """Refuse texts and the like where numbers belong."""
        values = [side for left, right, _ in (*self.equations, *self.initial) for side in (left, right)]
        sources = [source for _, _, source in (*self.equations, *self.initial) for _ in (0, 1)]
        for happening in self.happenings:
            for conditions, new in happening.branches:
                demanded = (value.args[0] for name, value in new.items() if name.startswith(ASSERT))
                numbers = [*conditions, *demanded, *(value for name, value in new.items() if not is_ending(name))]
                values += numbers
                sources += [happening.source] * len(numbers)
        for value, source in zip(values, sources, strict=True):
            if not _is_numeric(value):
                raise ModelicaTextError("A text, an array or a choice stands where a number belongs.", where=source)

    def stay(self, names: list[str], source: Source) -> None:
        """Take variables of a `when` that never happens: they stay what they are at the start."""
        self.assigned |= {*names}
        for name in names:
            variable = variable_at(self.instance, name)
            self.equations.append((variable, fold.call("pre", (variable,), 0), source))

    def _orient(self) -> None:
        """Turn `a = b` of discrete variables where another equation gives `a` its value, and none `b`."""
        names = [left.args[0][0] if self._is_discrete(left) else "" for left, _, _ in self.equations]
        for k, (left, right, source) in enumerate(self.equations):
            if names[k] and names.count(names[k]) > 1 and self._is_discrete(right) and right.args[0][0] not in names:
                self.equations[k], names[k] = (right, left, source), right.args[0][0]

    def _lift(self) -> None:
        """Give equations that use what is outside to the instance that has it all."""
        kept: list[tuple[Expr, Expr, Source]] = []
        for left, right, source in self.equations:
            levels = max(height(left), height(right))
            if not levels:
                kept.append((left, right, source))
                continue
            target, path_there = owner_above(self.instance, levels), above(self.instance, levels)
            target.adopted.append((renamed(left, path_there), renamed(right, path_there), source))
            if self._is_discrete(left):
                self.instance.lent |= {left.args[0][0]} if "." not in left.args[0][0] else set()
            else:
                self.instance.balance += 1
                target.balance -= 1
        self.equations = kept

    def _is_discrete(self, left: Expr) -> bool:
        """Tell whether a side of an equation is a variable that changes at events only."""
        if left.kind not in ("name", "condition"):
            return False
        path = left.args[0][0]
        place = declared_at(self.instance, path.removesuffix(MEMORY))
        basic = basic_type(*place) if place is not None else None
        if basic is None or place is None:
            return False
        if path.endswith(MEMORY) or path in self.assigned or "discrete" in basic.prefixes:
            return True
        return basic.kind != "Real" and not is_signal(*place, basic)

    def _changes_at_events(self, variable: Expr) -> bool:
        """Tell whether a variable, possibly a signal, changes at events only."""
        place = declared_at(self.instance, variable.args[0][0])
        basic = basic_type(*place) if place is not None else None
        return self._is_discrete(variable) or (basic is not None and basic.kind != "Real")

    def _check_memory(self, call: Expr, source: Source) -> None:
        """Refuse `pre` and `change` of a variable that changes all the time."""
        argument = call.args[1][0] if call.args[0] in ("pre", "change") else None
        name = argument.args[0][0] if argument is not None and argument.kind == "name" else ""
        member = self.instance.members.get(name)
        basic = basic_type(self.instance, member) if member is not None else None
        continuous = basic is not None and basic.kind == "Real" and "discrete" not in basic.prefixes
        if name == "time" or (continuous and name not in self.assigned):
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
            declared = member.declaration
            if {"parameter", "constant"} & declared.prefixes or declared.is_outer or not exists(self.instance, member):
                continue
            basic = basic_type(self.instance, member)
            if basic is not None and basic.kind == "object":
                continue  # a value from the beginning
            if basic is None:
                self._part_bindings(name, member)
            elif is_bound_outside(self.instance, member, basic):
                continue  # an equation of the part's owner
            elif member.given.value is not None and member.given.scope is not None:
                scope, text = member.given.scope
                left = Resolver(self.instance, member.text)(Expr("name", ((name, ()),), declared.line))
                self.equate(left, self._seen(member.given.value, scope, text), text, member.given.value.line)

    def _part_bindings(self, name: str, member: Member) -> None:
        """Collect `Flange_a flange(tau = …)` and `Own part(input = …)`: such values are equations."""
        shape = sizes(self.instance, member) if member.given.inner and exists(self.instance, member) else (0,)
        for head, place in elements_of(name, shape):
            part = part_of(self.instance, member, place)
            if isinstance(part, Instance) and part.text.kind != "connector":
                self._input_bindings(head, part)
            if isinstance(part, Known) or (isinstance(part, Instance) and part.text.kind != "connector"):
                continue
            for last, entry in element(member.given, place).inner.items():
                below = part.members.get(last) if isinstance(part, Instance) else None
                fixed = below is not None and bool({"parameter", "constant"} & below.declaration.prefixes)
                if entry.value is None or entry.scope is None or fixed:
                    continue
                path = Expr("name", ((f"{head}.{last}", ()),), entry.line)
                self.equate(path, self._seen(entry.value, *entry.scope), entry.scope[1], entry.line)

    def _seen(self, value: Expr, scope: Instance, text: ClassText) -> Expr:
        """Return a value of a modification that an instance around this one gives, by names from here."""
        levels = levels_between(self.instance, scope)
        if levels is None:
            raise refused("a value from an instance that is not around this one", text, value.line)
        return outside(Resolver(scope, text)(value), levels)

    def _input_bindings(self, path: str, part: Instance) -> None:
        """Collect `Own part(input = …)`: a signal of this class has the value, and drives the input."""
        for name, member in part.members.items():
            given, scope = member.given.value, member.given.scope
            basic = basic_type(part, member) if given is not None and scope is not None else None
            if given is None or scope is None or not is_bound_outside(part, member, basic):
                continue
            assert basic is not None
            signal = f"{path}_{name}"
            while signal in self.instance.members or signal in self.bound:
                signal += "_"
            self.bound[signal] = Bound(f"{path}.{name}", basic, scope[1].place(given.line))
            self.equate(Expr("name", ((signal, ()),), given.line), Resolver(*scope)(given), scope[1], given.line)

    def statement(self, statement: Statement, text: ClassText, local: dict[str, Expr]) -> None:
        """Read one equation."""
        resolver = Resolver(self.instance, text, local)
        self.instance.classes.spend(10, text, statement.line)
        if statement.kind == "=":
            self.equate(resolver(statement.parts[0]), resolver(statement.parts[1]), text, statement.line)
        elif statement.kind == "connect":  # gathered for all of the instance
            self.connects = True
            if self.initially:
                raise refused("a connection or a 'when' among initial equations", text, statement.line)
        elif statement.kind == "for":
            for known in rounds(resolver, statement.parts[0], statement.line):
                for inner in statement.parts[1]:
                    self.statement(inner, text, known)
        elif statement.kind == "if":
            self._branches(statement, text, local)
        elif statement.kind == "when":
            self.read_when(statement, text, local)
        elif statement.kind == "algorithm":
            place = text.place(statement.line)
            Section(self, text, place, initial=self.initially).equations(statement.parts[0])
        elif statement.kind == "call":
            if not is_demand(statement.parts[0]):
                raise refused(f"{statement.parts[0].args[0]}(…) among equations", text, statement.parts[0].line)
            demand = self.demanded(statement.parts[0], resolver, text)
            if demand is not None:
                condition, words = demand
                self.happenings.append(
                    Happening((((condition,), {}),), text.place(statement.parts[0].line), words.args[0])
                )
        else:
            raise refused(f"'{statement.kind}' among equations", text, statement.line)

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
            is_open = bool(open_branches) or holds.kind != "boolean"
            target = Statements(self.instance, in_branch=True) if is_open else self
            for inner in body:
                target.statement(inner, text, local)
            if target is self:
                return
            if target.connects or any(not happening.text for happening in target.happenings):
                raise refused("a connection or an event in a branch that changes during a run", text, statement.line)
            before = [other for other, _ in open_branches if other is not None]
            self.happenings += [if_taken(holds, before, happening) for happening in target.happenings]
            open_branches.append((None if holds.kind == "boolean" else holds, target))
            if holds.kind == "boolean":
                break
        if not open_branches:
            return
        self._joined(open_branches, text, statement.line)

    def _joined(self, branches: list[tuple[Expr | None, Statements]], text: ClassText, line: int) -> None:
        counts = {len(branch.equations) for _, branch in branches}
        if counts == {0}:
            return
        if len(counts) > 1 or branches[-1][0] is not None:
            raise refused("an 'if' whose branches have different numbers of equations", text, line)
        for k in range(counts.pop()):
            rows = [(condition, *branch.equations[k]) for condition, branch in branches]
            left = rows[0][1]
            if left.kind in ("name", "condition") and all(row[1].args == left.args for row in rows):
                value = _choice([(row[0], row[2]) for row in rows], line)
                self.equations.append((left, as_condition(value) if left.kind == "condition" else value, rows[0][3]))
                continue
            zero = [(row[0], fold.operation("-", (row[1], row[2]), line)) for row in rows]
            self.equations.append((_choice(zero, line), fold.number(0, line), text.place(line)))

    def equate(self, left: Expr, right: Expr, text: ClassText, line: int) -> None:
        """Add an equation; of arrays and of several results element by element."""
        right = right.args[0] if right.kind == "tuple" and left.kind != "tuple" else right
        if left.kind == "tuple" == right.kind:
            for part, result in zip(left.args, right.args, strict=False):
                if part.kind != "all":
                    self.equate(part, result, text, line)
        elif left.kind == "array" or right.kind == "array":
            if left.kind != right.kind or len(left.args) != len(right.args):
                raise ModelicaTextError("The sizes of both sides differ.", where=text.place(line))
            for argument, other in zip(left.args, right.args, strict=True):
                self.equate(argument, other, text, line)
        elif left.kind == "condition":
            self.check_type(left, right, text, line)
            right = as_condition(right)
            if declared_at(self.instance, left.args[0][0]) is None:
                raise refused(
                    f"An equation for {left.args[0][0]}, a Boolean of a part", text, line, "Connect a signal."
                )
            self.equations.append((left, right, text.place(line)))
        else:
            if left.kind == "number" and right.kind == "name":
                left, right = right, left
            fitting = self.fitting(left, right, text, line)
            if fold.is_condition(left) is not fold.is_condition(right):
                what = "A condition is no number: write `if … then 1 else 0`."
                raise ModelicaTextError(what, where=text.place(line))
            self.equations.append((left, fitting, text.place(line)))


def _is_numeric(node: Expr) -> bool:
    inner = node.args[1] if node.kind == "call" else [argument for argument in node.args if isinstance(argument, Expr)]
    return node.kind not in ("string", "array", "literal", "record") and all(map(_is_numeric, inner))


def _choice(branches: list[tuple[Expr | None, Expr]], line: int) -> Expr:
    args: list[Expr] = []
    for condition, value in branches:
        args += [value] if condition is None else [condition, value]
    return Expr("if", tuple(args), line)
