"""Calls in expressions: what built-in functions and operators mean, and which user's function is meant."""

from __future__ import annotations

from modelica_like.errors import ModelicaTextError
from modelica_like.netlist.modelica import fold, functions
from modelica_like.netlist.modelica.algorithms import OpenLoop
from modelica_like.netlist.modelica.calls import ARGUMENTS, ELEMENTARY, KEPT, OF_BEFORE, REFUSED, STATEMENTS, positional
from modelica_like.netlist.modelica.causal import cardinality
from modelica_like.netlist.modelica.elements import named_array
from modelica_like.netlist.modelica.instance import refused
from modelica_like.netlist.modelica.members import sizes
from modelica_like.netlist.modelica.resolve import Resolver
from modelica_like.netlist.modelica.subscripts import is_whole
from modelica_like.netlist.modelica.tree import Expr
from modelica_like.netlist.modelica.types import basic_type


def called(resolver: Resolver, call: Expr) -> Expr:
    """Return what a call means.

    Raises:
        ModelicaTextError: there is no such function, it has other arguments, or it is not supported.
    """
    name, given, named = call.args
    line, short = call.line, name.removeprefix("Modelica.Math.").removeprefix("Math.")
    if short in REFUSED:
        raise refused(REFUSED[short], resolver.text, line)
    if short in STATEMENTS:
        raise ModelicaTextError(f"{short}(…) is a statement, and no value.", where=resolver.text.place(line))
    if short in {*ARGUMENTS, *KEPT, *functions.OF_ARRAYS, *ELEMENTARY}:
        given, named = tuple(arguments(resolver, Expr("call", (short, given, named), line))), ()
    if short == "cardinality":
        return cardinality(resolver, given[0])
    if short in (fold.SILENT, fold.ARGUMENT, fold.CREEP):
        inner = tuple(map(resolver, given))
        return inner[0] if short != fold.CREEP and inner[0].kind in fold.KNOWN else fold.call(short, inner, line)
    if short == "getInstanceName" and resolver.instance is not None:
        return Expr("string", (resolver.instance.full_name,), line)
    if short == "homotopy":
        return resolver.told(lambda: fold.kept(short, tuple(map(resolver, given)), line), line)
    if short in ("smooth", "noEvent"):
        value = resolver(given[-1])
        return fold.kept("noEvent", (value,), line)
    if short == "Integer":
        return resolver.told(lambda: _literal_number(resolver, given[0]), line)
    if short in OF_BEFORE:
        return resolver.told(lambda: _of_before(resolver, short, given[0]), line)
    if short in KEPT:
        return _kept(resolver, short, given, line)
    if short == "size":
        items = _sized(resolver, given[0])
        dimension = resolver.number(given[1]) if len(given) > 1 else None
        return resolver.told(lambda: functions.size(items, dimension, line), line)
    values = tuple(map(resolver, given))
    if short in functions.OF_ARRAYS:
        return resolver.told(lambda: functions.of_arrays(short, values, line), line)
    if short in ELEMENTARY:
        return resolver.told(lambda: fold.function(short, values, line), line)
    others = {key: resolver(argument) for key, argument in named}
    try:
        return resolver.told(lambda: functions.called(resolver, call, values, others), line)
    except OpenLoop as error:
        if resolver.instance is None:
            raise
        if resolver.numeric:
            raise ModelicaTextError(error.what, where=error.where) from None
        return resolver.known()(call)  # parameters are numbers then, and cannot change afterwards


def arguments(resolver: Resolver, call: Expr) -> list[Expr]:
    """Return the arguments of a call of a built-in function as they are written, in the order of their places.

    Raises:
        ModelicaTextError: one is missing, or has a name that there is not.
    """
    name, given, named = call.args
    built_in = "Streams.error" if name.endswith("Streams.error") else name
    return resolver.told(lambda: positional(built_in, given, named), call.line)


def demand_of(resolver: Resolver, call: Expr) -> tuple[Expr, str] | None:
    """Return the condition of an assertion or of an error, and its words; None of what only warns.

    Raises:
        ModelicaTextError: it has other arguments.
    """
    given = arguments(resolver, call)
    if call.args[0] != "assert":
        return Expr("boolean", (False,), call.line), words_of(given[0])
    level = resolver.known()(given[2]) if len(given) > 2 else None
    if level is not None and level.args[0] == "AssertionLevel.warning":
        return None
    return resolver.condition(given[0], "assert", call.line), words_of(given[1])


def words_of(node: Expr) -> str:
    """Return the text of a message; numbers in it are left out."""
    if node.kind == "string":
        return node.args[0].replace("{", "(").replace("}", ")")
    return "".join(words_of(argument) for argument in node.args if isinstance(argument, Expr)) or "…"


def _kept(resolver: Resolver, short: str, given: tuple[Expr, ...], line: int) -> Expr:
    """Resolve a call that only a run has a value of."""
    values = tuple(map(resolver, given))
    if short == "der" and any(map(fold.is_condition, fold.elements(values[0]))):
        raise ModelicaTextError("der(…) needs a number, and a condition is none.", where=resolver.text.place(line))
    interval = values[-1] if (short, len(values)) in (("sample", 2), ("Clock", 1)) else fold.number(1)
    if interval.kind == "number" and not interval.args[0] > 0:
        what = f"{short}(…) needs an interval above 0, not {interval.args[0]:g}."
        raise ModelicaTextError(what, where=resolver.text.place(line))
    return resolver.told(lambda: fold.each(short, values, line, lambda items: fold.call(short, items, line)), line)


def _of_before(resolver: Resolver, word: str, argument: Expr) -> Expr:
    """Resolve a call of the value before an event: that of the variable, whatever an algorithm has given it."""
    own = resolver.like(numeric=resolver.numeric)
    head = argument.args[0][0] if argument.kind == "name" else ""
    if resolver.instance is not None and head in resolver.instance.members:
        own.local.pop(head, None)
    variable, value, line = own(argument), resolver(argument), argument.line
    if variable == value:
        return _before(word, variable)
    before = _before("pre", variable)
    if word == "edge":
        return _risen(value, before, line)
    return before if word == "pre" else fold.operation("<>", (value, before), line)


def _before(word: str, variable: Expr) -> Expr:
    """Return `pre(x)`, `edge(x)` or `change(x)` of a variable; of a choice between variables that of each.

    Raises:
        Unfit: it is no variable.
    """
    if variable.kind == "array":
        return Expr("array", tuple(_before(word, item) for item in variable.args), variable.line)
    if variable.kind == fold.OUTSIDE:
        return Expr(fold.OUTSIDE, (_before(word, variable.args[0]), *variable.args[1:]), variable.line)
    if variable.kind == "if":
        *choices, last = variable.args
        pairs = zip(choices[::2], choices[1::2], strict=True)
        kept = [part for condition, value in pairs for part in (condition, _before(word, value))]
        return fold.choice(kept, _before(word, last), variable.line)
    if word == "pre" and variable.kind in fold.KNOWN:
        return variable
    if word == "edge" and not fold.is_condition(variable):
        raise fold.Unfit("edge(…) needs a Boolean variable")
    if variable.kind not in ("name", "condition") and word != "edge":
        raise fold.Unfit(f"{word}(…) needs a variable: a formula has no value before an event")
    return fold.call(word, (variable,), variable.line)


def _risen(condition: Expr, before: Expr, line: int) -> Expr:
    """Return whether a condition has become true."""
    if condition.kind == "array":
        return Expr("array", tuple(_risen(*pair, line) for pair in zip(condition.args, before.args, strict=True)), line)
    return fold.operation("and", (condition, fold.operation("not", (before,), line)), line)


def _literal_number(resolver: Resolver, argument: Expr) -> Expr:
    """Return the number of a value of an enumeration."""
    value = resolver(argument)
    if value.kind != "literal" and not is_whole(resolver, value):
        raise fold.Unfit("Integer(…) needs a value of an enumeration: integer(…) takes whole numbers of others")
    return fold.numbered(value)


def _sized(resolver: Resolver, expression: Expr) -> Expr:
    """Resolve an array for its size; one of components counts, too."""
    simple = expression.kind == "name" and len(expression.args) == 1 and not expression.args[0][1]
    member = resolver.instance.members.get(expression.path) if simple and resolver.instance is not None else None
    if resolver.instance is None or member is None or basic_type(resolver.instance, member) is not None:
        return resolver(expression)
    return named_array(expression.path, sizes(resolver.instance, member), "")
