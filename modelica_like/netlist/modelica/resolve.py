"""Expressions with their names resolved: constants become values, the rest names of the component."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from modelica_like.errors import ModelicaTextError, did_you_mean
from modelica_like.language.inside import declarations
from modelica_like.netlist.modelica import constants, fold, members
from modelica_like.netlist.modelica.classes import Classes
from modelica_like.netlist.modelica.elements import named_array, named_at
from modelica_like.netlist.modelica.instance import Instance, Member, refused
from modelica_like.netlist.modelica.library import Known, table
from modelica_like.netlist.modelica.lifting import levels_between, renamed, way
from modelica_like.netlist.modelica.parse import parse_expression
from modelica_like.netlist.modelica.subscripts import elements_at, subscript_of
from modelica_like.netlist.modelica.tree import ClassText, Expr
from modelica_like.netlist.modelica.types import Basic, basic_type

_Made = TypeVar("_Made")
_STATE_SELECT = ("never", "avoid", "default", "prefer", "always")


class Resolver:
    """Resolves expressions of one class text in one instance.

    Args:
        instance: whose members the names mean; None in a function.
        text: class whose names the expressions use.
        local: values of iterators, and of a function's variables.
        numeric: whether parameters become their values.
    """

    def __init__(
        self, instance: Instance | None, text: ClassText, local: Mapping[str, Expr] | None = None, *,
        numeric: bool = False, classes: Classes | None = None, depth: int = 0,
    ) -> None:  # fmt: skip
        self.instance, self.text, self.numeric, self.depth = instance, text, numeric, depth
        self.local = dict(local or {})
        lookup = classes or (instance.classes if instance else None)
        assert lookup is not None
        self.classes = lookup

    def __call__(self, expression: Expr) -> Expr:
        """Return the resolved expression.

        Raises:
            ModelicaTextError: it uses what is not supported, or a name that does not exist.
        """
        kind, args, line = expression.kind, expression.args, expression.line
        if kind in ("number", "string", "boolean", "literal", "all", "object"):
            return expression
        if kind in ("name", "condition"):
            return self._name(Expr("name", args, line))
        if kind == "call":
            from modelica_like.netlist.modelica.operators import called

            return called(self, expression)
        if kind == "native":
            return fold.native(args[0], tuple(map(self, args[1:])), line)
        if kind == "shared":
            values = tuple(map(self, args[1:]))
            known = all(value.kind in fold.KNOWN for value in values)
            return self(args[0].of(values)) if known else Expr("shared", (args[0], *values), line)
        if kind == "part":  # of a record that an expression gives
            whole = self(args[0])
            if whole.kind != "record" or args[1] not in whole.args[0]:
                raise refused(f"a value without '{args[1]}' for a record", self.text, line)
            return whole.args[1 + whole.args[0].index(args[1])]
        if kind == "for":
            return self._built(args[0], list(args[1]))
        if kind == "if":
            return self._choice(args, line)
        if kind == "range":
            numbers = [self.number(argument) for argument in args]
            start, step, stop = (numbers[0], 1.0, numbers[1]) if len(numbers) == 2 else numbers
            return self.told(lambda: fold.row(start, step, stop, line), line)
        if kind in ("and", "or"):
            left = self(args[0])
            if left.kind == "boolean" and left.args[0] is (kind == "or"):  # the other side may have no value
                return left
            values = left, self(args[1])
        else:
            values = tuple(map(self, args))
        if kind == "tuple":
            return Expr(kind, values, line)
        values = tuple(value.args[0] if value.kind == "tuple" else value for value in values)
        return self.told(lambda: fold.operation(kind, values, line), line)

    def _choice(self, args: tuple[Expr, ...], line: int) -> Expr:
        """Resolve an `if`: only the branches that may be taken."""
        kept, otherwise = list[Expr](), args[-1]
        for condition, value in zip(args[:-1:2], args[1::2], strict=True):
            choice = self.condition(condition, "if", line)
            if choice.kind != "boolean":
                kept += [choice, self(value)]
            elif choice.args[0]:
                otherwise = value
                break
        last = self(otherwise)
        return self.told(lambda: fold.choice(kept, last, line), line) if kept else last

    def condition(self, expression: Expr, word: str, line: int) -> Expr:
        """Return the resolved condition of an `if` and the like.

        Raises:
            ModelicaTextError: it is none.
        """
        resolved = self(expression)
        if not all(map(fold.is_condition, resolved.args if resolved.kind == "array" else (resolved,))):
            raise ModelicaTextError(f"The condition of this '{word}' is a number.", where=self.text.place(line))
        return resolved

    def told(self, make: Callable[[], _Made], line: int) -> _Made:
        """Return what is made; errors have the line."""
        try:
            return make()
        except fold.Unfit as error:
            sentence = f"{error}".removesuffix("?")
            end = "." if sentence == f"{error}" else "?"
            raise ModelicaTextError(f"{sentence}{end}", where=self.text.place(line)) from None
        except ModelicaTextError as error:
            error.where = error.where or (self.text.place(line),)
            raise

    def _built(self, element: Expr, iterators: list[tuple[str, Expr | None]]) -> Expr:
        """Resolve an array built by iterators, the last one innermost."""
        (name, over), rest = iterators[-1], iterators[:-1]
        if over is None:
            raise refused("an iterator without a range", self.text, element.line)
        items = []
        for value in self.array(over):
            inner = self.like(numeric=self.numeric)
            inner.local[name] = value
            items.append(inner._built(element, rest) if rest else inner(element))
        return Expr("array", tuple(items), element.line)

    def array(self, expression: Expr) -> tuple[Expr, ...]:
        """Return the elements of an array."""
        result = self(expression)
        if result.kind != "array":
            raise refused("a loop over something that is not an array", self.text, expression.line)
        return result.args

    def number(self, expression: Expr) -> float:
        """Return the value of an expression of constants and parameters.

        Raises:
            ModelicaTextError: it has none.
        """
        resolved = self if self.numeric else self.known()
        value = resolved(expression)
        if value.kind != "number":
            raise ModelicaTextError(
                "A number is needed here that constants and parameters determine.",
                where=self.text.place(expression.line),
            )
        return value.args[0]

    def count(self, expression: Expr) -> int:
        """Return the value of an expression that is the size of an array.

        Raises:
            ModelicaTextError: it has none, or is no size.
        """
        resolved = self(expression) if expression.kind == "name" else expression
        if resolved.kind == "array" and all(item.kind == "literal" for item in resolved.args):
            return len(resolved.args)
        size = self.number(expression)
        self.told(lambda: fold.number(fold.count(size)), expression.line)
        return int(size)

    def known(self) -> Resolver:
        """Return the same resolver with parameters as values."""
        return self.like(numeric=True)

    def like(self, *, numeric: bool) -> Resolver:
        """Return a resolver of the same place, with local values of its own."""
        return Resolver(self.instance, self.text, self.local, numeric=numeric, classes=self.classes, depth=self.depth)

    # -- names -------------------------------------------------------------------------------------------------------

    def _name(self, expression: Expr) -> Expr:
        head, subscripts = expression.args[0]
        if "." in head:  # of an element of an array, which has been resolved with the others
            return self._name(parse_expression(head))
        if head in self.local:
            value = self.indexed(self.local[head], subscripts, expression.line)
            for name, subs in expression.args[1:]:
                if value.kind != "record" or name not in value.args[0]:
                    raise members.unknown_name(f"{head} has no '{name}'.", self.text, expression.line)
                value = self.indexed(value.args[1 + value.args[0].index(name)], subs, expression.line)
            return value
        if head == "time" and len(expression.args) == 1:
            return Expr("name", (("time", ()),), expression.line)
        if self.instance is not None and head in self.instance.members:
            return self._member(self.instance, "", expression.args, expression.line)
        return self._constant(expression)

    def indexed(self, value: Expr, subscripts: tuple[Expr, ...], line: int) -> Expr:
        """Return an element of an array."""
        return self.told(lambda: elements_at(self, value, subscripts, line), line)

    def index(self, expression: Expr, size: int, *, known: bool = False) -> int | Expr:
        """Return a subscript; see `subscript_of`."""
        return subscript_of(self, expression, size, known=known)

    def _member(
        self, owner: Instance, before: str, parts: tuple[Any, ...], line: int, *, inner: bool = False
    ) -> Expr:  # fmt: skip
        """Resolve a path that begins with a member of an instance, of `inner outer` what is outside or `inner`."""
        (name, subscripts), rest = parts[0], parts[1:]
        member = owner.members.get(name)
        if member is not None and "outer" in member.declaration.prefixes and not inner:
            holder = owner.inner(name)
            if holder is None:
                raise members.unknown_name(f"outer {name} has no inner {name} above it.", self.text, line)
            return self._member(holder, way(self.instance, holder), parts, line, inner=True)
        if member is None:
            hint = did_you_mean(name, owner.members) or "."
            raise members.unknown_name(f"{owner.path or owner.text.name} has no '{name}'{hint}", self.text, line)
        basic = basic_type(owner, member)
        if basic is not None:
            if rest:
                raise members.unknown_name(f"{name} is a number and has no '{rest[0][0]}'.", self.text, line)
            return self._scalar(owner, member, basic, before + name, subscripts, line)
        shape = members.sizes(owner, member)
        if len(subscripts) > len(shape):
            raise ModelicaTextError(f"{name} is no array and has no subscript.", where=self.text.place(line))
        whole = Expr("range", (fold.number(1), Expr("name", (("end", ()),), line)), line)
        place: tuple[int, ...] = ()
        for dimension, size in enumerate(shape):
            after = subscripts[dimension:]
            chosen = self.index(after[0] if after and after[0].kind != "all" else whole, size, known=True)
            if isinstance(chosen, Expr):
                before_it = tuple(map(fold.number, place))
                items = (((name, (*before_it, one, *after[1:])), *rest) for one in chosen.args)
                return Expr("array", tuple(self._member(owner, before, item, line) for item in items), line)
            place = (*place, chosen)
        part = members.part_of(owner, member, place)
        path = before + named_at(name, place)
        if not rest and isinstance(part, Instance) and part.text.kind == "record":
            values = (self._member(part, f"{path}.", ((key, ()),), line) for key in part.members)
            return Expr("record", (tuple(part.members), *values), line)
        if not rest:
            raise refused(f"{name}, a component, as a value", self.text, line)
        if isinstance(part, Instance):
            return self._member(part, f"{path}.", rest, line)
        below = ".".join(head + "".join(f"[{int(self.number(index))}]" for index in subs) for head, subs in rest)
        if isinstance(part, Known):
            if self.numeric:
                return members.value_of_known(owner, member, part, place, part.here(below), self.text, line)
            return self._of_component(owner, name, part, path, part.here(below), line)
        return Expr("name", ((f"{path}.{below}", ()),), line)

    def _of_component(self, owner: Instance, part_name: str, part: Known, path: str, below: str, line: int) -> Expr:
        """Return a variable of a component of the table, or the derivative that it is."""
        fields = declarations(part.type).fields
        if not part.has(below):
            owner.classes.lack(f"{owner.path}.{part_name}", part.path)
            if owner.classes.text_of(part.path) is not None:
                raise members.unknown_name(f"{part.path} has no '{below}' here.", self.text, line)
        for name in table()["rates"].get(below, "").split() if below not in fields else ():
            if name in fields:
                return Expr("call", ("der", (Expr("name", ((f"{path}.{name}", ()),), line),), ()), line)
        return Expr("name", ((f"{path}.{below}", ()),), line)

    def _scalar(
        self, owner: Instance, member: Member, basic: Basic, path: str, subscripts: tuple[Expr, ...], line: int
    ) -> Expr:
        declared = member.declaration
        fixed = {"parameter", "constant"} & declared.prefixes or {"object"} & {basic.kind}
        if fixed and (self.numeric or basic.kind != "Real" or declared.dimensions or "constant" in fixed):
            if self.numeric:
                owner.freeze(declared.name)
            elif (formulas := self._formulas(owner, member, basic)) is not None:
                return self.indexed(formulas, subscripts, line)
            return self.indexed(members.value_of(owner, declared.name, self.text, line), subscripts, line)
        if not declared.dimensions:
            if subscripts:
                raise ModelicaTextError(f"{path} is no array and has no subscript.", where=self.text.place(line))
            return Expr("name" if basic.kind != "Boolean" else "condition", ((path, ()),), line)
        return self.indexed(named_array(path, members.sizes(owner, member), basic.kind), subscripts, line)

    def _formulas(self, owner: Instance, member: Member, basic: Basic) -> Expr | None:
        """Return an array of parameters that follow from others, by their names from here; None of one of numbers."""
        scope = member.given.scope
        if basic.kind != "Real" or "constant" in member.declaration.prefixes or scope is None or self.instance is None:
            return None
        value = members.formulas_of(owner, member) if levels_between(scope[0], self.instance) is not None else None
        if value is None or all(item.kind == "number" for item in fold.elements(value)):
            return None
        here = way(self.instance, scope[0]) if scope[0] is not self.instance else ""
        key = member.declaration.name, here
        if key not in owner.seen_from or key[0] not in owner.formulas:
            members.check_value(owner, member, value)
            owner.seen_from[key] = renamed(value, lambda path: path if path == "time" else f"{here}{path}")
        return owner.seen_from[key]

    def _constant(self, expression: Expr) -> Expr:
        """Resolve a constant of a class, or a literal of an enumeration."""
        path, line = expression.path, expression.line
        package, _, name = path.rpartition(".")
        class_text = self.find(package) if package else None
        if package.endswith("StateSelect"):
            if name not in _STATE_SELECT:
                raise members.unknown_name(
                    f"{package} has no '{name}'{did_you_mean(name, _STATE_SELECT) or '.'}", self.text, line
                )
            return Expr("literal", (name,), line)
        if isinstance(class_text, ClassText) and class_text.literals:
            if name not in class_text.literals:
                raise members.unknown_name(
                    f"{package} has no '{name}'{did_you_mean(name, class_text.literals) or '.'}", self.text, line
                )
            return Expr("literal", (f"{class_text.name}.{name}", class_text.literals.index(name) + 1), line)
        holder = class_text if isinstance(class_text, ClassText) else None
        if holder is None and not package:
            holder = constants.around(self.classes, self.text, name, itself=self.instance is None)
        if holder is None:
            holder = constants.imported(self.classes, self.text, path)
            name = path.rpartition(".")[2]
        if isinstance(holder, ClassText):
            inside = constants.holder_of(self.classes, holder)
            if name in inside.members:
                self._demand_constant(inside.members[name], holder, expression)
                return self.indexed(members.value_of(inside, name, self.text, line), expression.args[-1][1], line)
        every = self.find(path)
        if isinstance(every, ClassText) and every.literals:  # the indices of an array, the values of a loop
            literals = enumerate(every.literals, 1)
            return Expr(
                "array", tuple(Expr("literal", (f"{every.name}.{each}", k), line) for k, each in literals), line
            )
        names = [*self.local, *(self.instance.members if self.instance else ())]
        raise members.unknown_name(f"There is no '{path}'{did_you_mean(path, names) or '.'}", self.text, line)

    def _demand_constant(self, member: Member, holder: ClassText, expression: Expr) -> None:
        """Refuse what differs from part to part, because a class does not know in which part it is used."""
        declared = member.declaration
        if "constant" in declared.prefixes or holder.kind == "package":
            return
        kind = "parameter" if "parameter" in declared.prefixes else "variable"
        needed = "a parameter" if kind == "parameter" and self.text.kind != "function" else "an input"
        raise ModelicaTextError(
            f"{expression.path} is a {kind} of {holder.name}: other classes, those in it too, see its constants only.",
            where=self.text.place(expression.line),
            advice=f"Give {self.text.name} {needed} for it{', or declare it as a constant' * (kind == 'parameter')}.",
        )

    def find(self, name: str) -> Any:
        """Return the class that a name means."""
        return self.instance.find(name, self.text) if self.instance else self.classes.find(name, self.text)
