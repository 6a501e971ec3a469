"""Members of instances: the values of parameters, the sizes of arrays, the instances of parts."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

from modelica_like.errors import ModelicaTextError, UnknownName
from modelica_like.language.inside import declarations
from modelica_like.netlist.modelica import at_start, fold, resolve
from modelica_like.netlist.modelica.elements import Place, elements_of, named_at, place_of
from modelica_like.netlist.modelica.instance import DEEPEST, Given, Instance, Member, given, refused, unknown_class
from modelica_like.netlist.modelica.library import Known
from modelica_like.netlist.modelica.tree import ClassText, Expr, names_in
from modelica_like.netlist.modelica.types import basic_type, misfit

_LARGE = 1000
"""Numbers, names and operations of an array of formulas; a larger one is made of numbers."""


def unknown_name(what: str, text: ClassText, line: int) -> UnknownName:
    """Return the error about a name."""
    return UnknownName(what, where=text.place(line))


def sizes(owner: Instance, member: Member) -> tuple[int, ...]:
    """Return the dimensions of a declared array; a colon takes the size of the value."""
    resolver = resolve.Resolver(owner, member.text, numeric=True)
    shape: list[int] = []
    for k, dimension in enumerate(member.declaration.dimensions):
        if dimension.kind != "all":
            shape.append(resolver.count(dimension))
            continue
        value = formulas_of(owner, member) or value_of(owner, member.declaration.name, member.text, dimension.line)
        for _ in range(k):
            value = value.args[0] if value.args and isinstance(value.args[0], Expr) else value
        if value.kind != "array":
            raise refused(f"the size of {member.declaration.name} from this value", member.text, dimension.line)
        shape.append(len(value.args))
    if math.prod(shape) > fold.LONGEST:
        what = f"{member.declaration.name}, an array of {math.prod(shape)} elements (at most {fold.LONGEST})"
        raise refused(what, member.text, member.declaration.line)
    return tuple(shape)


def exists(owner: Instance, member: Member) -> bool:
    """Return whether a conditional component is there.

    Raises:
        ModelicaTextError: constants and parameters do not determine it.
    """
    declared = member.declaration
    if declared.condition is None:
        return True
    condition = resolve.Resolver(owner, member.text, numeric=True)(declared.condition)
    if condition.kind != "boolean":
        raise refused("a condition of a component that is not known before the run", member.text, declared.line)
    return condition.args[0]


def value_of(owner: Instance, name: str, text: ClassText, line: int) -> Expr:
    """Return the value of a parameter or constant.

    Args:
        owner: instance that declares it.
        name: of the member.
        text: of the place that asks.
        line: of the place that asks.

    Raises:
        ModelicaTextError: it has none, or depends on itself.
    """
    member = owner.members[name]
    given = member.given
    free = member.declaration.dimensions and known_false(given.inner.get("fixed"))
    if given.value is None and "start" in given.inner and not free:
        given = given.inner["start"]
    if given.value is None or given.scope is None:
        basic = basic_type(owner, member)
        decides = bool(member.declaration.dimensions) or (basic is not None and basic.kind != "Real")
        value = at_start.value_from_start(owner, name) if decides and name not in owner.folded else None
        if value is not None:
            owner.values[name] = value
            return value
        if member.declaration.dimensions and 0 in sizes(owner, member):
            return Expr("array", ())
        raise ModelicaTextError(
            f"{name} has no value.", where=[text.place(line), member.text.place(member.declaration.line)]
        )
    if name in owner.values:
        return owner.values[name]
    if name in owner.folded:
        raise ModelicaTextError(f"{name} depends on itself.", where=member.text.place(member.declaration.line))
    owner.folded.add(name)
    try:
        value = resolve.Resolver(*given.scope, numeric=True)(given.value)
    finally:
        owner.folded.remove(name)
    owner.values[name] = value  # its size may be that of the value
    check_value(owner, member, value)
    if owner.classes.only_said:  # one that is read later keeps what it depends on
        del owner.values[name]
    return value


def formulas_of(owner: Instance, member: Member) -> Expr | None:
    """Return an array of parameters by names of the place that gives it; None where numbers of it are needed.

    Numbers are needed where it is given as a function of many numbers, and where its elements cannot be told apart.
    """
    given, name = member.given, member.declaration.name
    if name in owner.formulas:
        return owner.formulas[name]
    if given.value is None or given.scope is None or name in owner.folded:
        return None
    owner.folded.add(name)
    value = None
    try:
        with suppress(ModelicaTextError):  # told, if it is no array of numbers either
            value = resolve.Resolver(*given.scope)(given.value)
    finally:
        owner.folded.remove(name)
    value = value if value is not None and value.kind == "array" and value.size <= _LARGE else None
    if not owner.classes.only_said:  # one that is read later keeps what it depends on
        owner.formulas[name] = value
    return value


def check_value(owner: Instance, member: Member, value: Expr) -> None:
    """Refuse a value that is not of the declared type, or an array of another size.

    Raises:
        ModelicaTextError: it does not fit.
    """
    declared, basic = member.declaration, basic_type(owner, member)
    wrong = "" if basic is None else misfit(value, basic) or _other_size(owner, member, value)
    if wrong:
        place = member.text.place(declared.line)
        given = member.given.text.place(member.given.line) if member.given.text is not None else place
        raise ModelicaTextError(f"{declared.name} {wrong}.", where=[place] if place == given else [given, place])


def _other_size(owner: Instance, member: Member, value: Expr) -> str:
    """Return in which size a value differs from a declaration, in words; empty if it does not."""
    dimensions = member.declaration.dimensions
    if value.kind not in ("array", *fold.KNOWN) or (not dimensions and value.kind != "array"):
        return ""
    if not dimensions:
        return "is no array, and its value is one"
    shape = fold.shape(value)
    if shape is None:
        return "has a value whose rows are of different lengths"
    resolver = resolve.Resolver(owner, member.text, numeric=True)
    # A colon takes the size of the value.
    open_sizes = [*shape, *(0 for _ in dimensions)]
    wanted = tuple(
        size if dimension.kind == "all" else resolver.count(dimension)
        for dimension, size in zip(dimensions, open_sizes, strict=False)
    )
    if 0 in wanted and shape == wanted[: wanted.index(0) + 1]:  # nothing is in it, so further sizes are not known
        return ""
    if shape == wanted:
        return ""
    size, other = (", ".join(map(str, sizes)) for sizes in (wanted, shape))
    return f"has the size {size}, and its value {f'the size {other}' if shape else 'is no array'}"


def known_false(given: Given | None) -> bool:
    """Tell whether an attribute is given the value false."""
    if given is None or given.value is None or given.scope is None:
        return False
    return resolve.Resolver(*given.scope, numeric=True)(given.value).args == (False,)


def undetermined(owner: Instance, formula: Expr) -> str:
    """Return the first parameter with `fixed = false` that a formula of an instance depends on, empty if none."""
    for name in names_in(formula):
        member = owner.members.get(name.args[0][0])
        if member is None or "parameter" not in member.declaration.prefixes:
            continue
        key = member.declaration.name
        if key not in owner.free:
            owner.free[key] = ""  # one that depends on itself is told elsewhere
            owner.free[key] = _undetermined(owner, member)
        if owner.free[key]:
            return owner.free[key]
    return ""


def _undetermined(owner: Instance, member: Member) -> str:
    basic, value = basic_type(owner, member), member.given
    fixed = basic.given.inner.get("fixed") if basic is not None else None
    if fixed is not None and fixed.value is not None and fixed.scope is not None:
        state = resolve.Resolver(*fixed.scope, numeric=True)(fixed.value)
        if state.kind == "boolean" and not state.args[0]:
            return member.declaration.name
    if basic is None or value.value is None or value.scope is None or value.scope[0] is not owner:
        return ""
    with suppress(ModelicaTextError):  # what cannot be read is told at the parameter
        return undetermined(owner, resolve.Resolver(*value.scope)(value.value))
    return ""


def demand_determined(what: str, given: Given) -> None:
    """Refuse a value that depends on what the initial equations of another class determine.

    Raises:
        ModelicaTextError: it does.
    """
    if given.value is None or given.scope is None:
        return
    free = undetermined(given.scope[0], resolve.Resolver(*given.scope)(given.value))
    if free:
        raise ModelicaTextError(
            f"{what} depends on {free}, which has fixed = false: only parameters of its own class may do that.",
            where=given.scope[1].place(given.value.line),
            advice="Leave it out, and write an initial equation for it; a parameter needs fixed = false, too.",
        )


def part_of(owner: Instance, member: Member, place: Place = ()) -> Instance | Known | str:
    """Return what a member is: an instance, a component of the standard library, or the name of a connector.

    Args:
        owner: instance that declares it.
        member: the declaration.
        place: of an array's element.

    Raises:
        ModelicaTextError: its class does not exist.
    """
    declared = member.declaration
    owner.classes.spend(1, member.text, declared.line)
    inner = owner.find(declared.type, member.text)
    if inner is None:
        raise unknown_class(declared.type, member.text, declared.line)
    constraint = Given() if member.constraint else owner.constraint(declared.type, member.text)
    member.constraint = True
    where, steps = owner, 0
    while isinstance(inner, ClassText) and inner.short is not None and not inner.prefixes:
        # `model A = B(k = 1)`: the part is a B, and the modification one of the part.
        scope = inner.owner or inner
        where, steps = where.scope_of(inner), steps + 1
        if steps > DEEPEST:
            raise ModelicaTextError(f"{inner.path} extends itself.", where=inner.place(inner.line))
        base = where.find(inner.short.base, scope)
        if base is None:
            raise unknown_class(inner.short.base, scope, inner.line)
        short = given(inner.short.modification, (where, scope), inner.line)
        member.given = member.given.over(short, declared.name)
        member.declaration = declared = replace(declared, type=inner.short.base)
        member.text, inner = scope, base
    member.given = member.given.over(constraint, declared.name)
    if isinstance(inner, Known) and owner.classes.reads(f"{owner.path}.{declared.name}"):
        inner = owner.classes.text_of(inner.path) or inner
    if not isinstance(inner, ClassText):
        return inner
    if member.parts is None:
        shape = sizes(owner, member)
        member.parts = {
            at: _instance(owner, member, inner, name, element(member.given, at, shape))
            for name, at in elements_of(declared.name, shape)
        }
    if place not in member.parts:
        raise refused(f"{declared.name}, an array of components, without an index", member.text, declared.line)
    return member.parts[place]


def part_at(instance: Instance, path: str) -> Instance | Known | str | None:
    """Return what the part at a path is, None if there is none, or if it is a variable."""
    part: Instance | Known | str | None = instance
    for head in path.split("."):
        name, place = head.partition("[")[0], place_of(head)
        member = part.members.get(name) if isinstance(part, Instance) else None
        if member is None or not isinstance(part, Instance) or not exists(part, member):
            return None
        if basic_type(part, member) is not None:
            return None
        if len(place) != len(sizes(part, member)):
            return None
        part = part_of(part, member, place)
    return part


def parts_in(owner: Instance) -> Iterator[tuple[str, Instance | Known | str]]:
    """Yield the parts of an instance, elements of arrays one by one, by their paths."""
    for name, member in owner.members.items():
        if not member.declaration.is_outer and exists(owner, member) and basic_type(owner, member) is None:
            for path, place in elements_of(name, sizes(owner, member)):
                yield path, part_of(owner, member, place)


def _instance(owner: Instance, member: Member, text: ClassText, name: str, given: Given) -> Instance:
    """Create the instance of a part; a record may be given as a whole."""
    owner.classes.spend(50, member.text, member.declaration.line)
    depth, level = 0, owner
    while level.owner is not None:
        depth, level = depth + 1, level.owner
    if depth > 30:
        raise ModelicaTextError(f"{text.path} contains itself.", where=member.text.place(member.declaration.line))
    value = given.value
    if text.kind == "record" and value is not None and given.scope is not None and given.scope[0] is not None:
        scope, inside = given.scope
        if value.kind == "call":
            called = scope.find(value.args[0], inside)
            if isinstance(called, ClassText) and called.kind == "function":
                parts = {
                    key: Expr("part", (value, key), value.line)
                    for key in Instance(owner.classes, text, Given()).members
                }
                arguments = {key: Given(part, given.scope, line=value.line, text=inside) for key, part in parts.items()}
                return Instance(owner.classes, text, Given(inner=given.inner).over(Given(inner=arguments)), owner, name)
            if not isinstance(called, ClassText) or called.kind != "record":
                raise refused(f"{value.args[0]}(…) as the value of a record", inside, value.line)
            text = called  # it may extend the declared one, with values of its own
            names = list(Instance(owner.classes, text, Given(), owner, name).members) if value.args[1] else []
            if len(value.args[1]) > len(names):
                raise refused(f"{value.args[0]}(…) with more than {len(names)} values", inside, value.line)
            values = {**dict(zip(names, value.args[1], strict=False)), **dict(value.args[2])}
            arguments = {key: Given(item, given.scope, line=value.line, text=inside) for key, item in values.items()}
            given = Given(inner=given.inner).over(Given(inner=arguments))
        elif value.kind == "name":
            instance = record_of(scope, value)
            if instance is None:
                raise unknown_name(f"{value.path} is not a record.", inside, value.line)
            return instance
        else:
            raise refused(f"this value for {name}, a record,", inside, value.line)
    return Instance(owner.classes, text, given, owner, name)


def record_of(scope: Instance, name: Expr) -> Instance | None:
    """Return the record that a name means in an instance, None if it is none."""
    record = scope
    for step, _ in name.args:
        member = record.members.get(step)
        inner = part_of(record, member) if member is not None and basic_type(record, member) is None else None
        if not isinstance(inner, Instance):
            return None
        record = inner
    return record if record.text.kind == "record" else None


def element(given: Given, place: Place, shape: tuple[int, ...] = ()) -> Given:
    """Return the modification of one element of an array: arrays without `each` are taken apart.

    Args:
        given: of the array.
        place: of the element.
        shape: of the array; empty if it has been compared with the values before.

    Raises:
        ModelicaTextError: the values are fewer or more than the elements.
    """
    if given.each or not place:
        return replace(given, each=False)  # for this array; another one in its elements takes it apart
    entry = replace(given, inner={name: element(modifier, place, shape) for name, modifier in given.inner.items()})
    if given.value is None or given.scope is None:
        return entry
    value = resolve.Resolver(*given.scope, numeric=False)(given.value)
    written, sizes_given = given.value, fold.shape(value)
    if sizes_given and shape and sizes_given[: len(shape)] != shape:
        count, elements = (math.prod(each) for each in (sizes_given[: len(shape)], shape))
        several = f"{' by '.join(map(str, shape))} elements" if len(shape) > 1 else f"{elements} elements"
        what = f"An array of {several} is given {count} value{'s' if count != 1 else ''}."
        advice = "Write 'each' where all elements take the same."
        raise ModelicaTextError(what, where=given.scope[1].place(given.line), advice=advice)
    for index in place:
        if value.kind != "array" or index > len(value.args):
            return entry
        value = value.args[index - 1]
        written = written.args[index - 1] if written.kind == "array" else value
    # A record is given as it is written, with names of the place it is given at.
    entry.value = written if value.kind == "record" else value
    return entry


def value_of_known(
    owner: Instance, member: Member, part: Known, place: Place, name: str, text: ClassText, line: int
) -> Expr:
    """Return the value of a parameter of a component of the standard library; of an array that of an element."""
    owner.freeze(name, named_at(member.declaration.name, place))
    given = element(member.given, place).inner.get(part.names.get(name, name))
    if given is not None and given.value is not None and given.scope is not None:
        return resolve.Resolver(*given.scope, numeric=True)(given.value)
    field = declarations(part.type).fields.get(name)
    if field is not None and isinstance(field.default, int | float):
        return Expr("number", (float(field.default),), line)
    owner.classes.lack(f"{owner.path}.{member.declaration.name}", part.path)
    raise ModelicaTextError(
        f"{member.declaration.name}.{name} has no value that is known here.", where=text.place(line)
    )
