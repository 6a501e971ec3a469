"""Arguments of public functions: their kinds are those of the annotations, and a wrong one is told in a sentence."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import lru_cache, wraps
from inspect import Parameter, signature
from numbers import Complex, Integral, Real
from types import NoneType, SimpleNamespace, UnionType
from typing import Any, Literal, ParamSpec, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from modelica_like.errors import NetlistError, UnknownName, ValueOutOfRange, did_you_mean

_P = ParamSpec("_P")
_R = TypeVar("_R")
_SHOWN = 40
"""Longest value that a message repeats."""
_WORDS: Mapping[str, tuple[str, str]] = {
    "float": ("number", "1.0"), "int": ("whole number", "1"), "complex": ("number", "1.0"), "bool": ("Boolean", "True"),
    "str": ("text", '"…"'), "Literal": ("text", '"…"'), "Path": ("path", 'Path("…")'), "tuple": ("pair", "(…, …)"),
    "Mapping": ("dictionary", '{"…": …}'), "Callable": ("function", "print"),
    "Trajectories": ("run", "simulate(…)"), "Solution": ("run", "simulate(…)"),
    "Component": ("component", 'load("…")'), "Assembly": ("assembly", 'load("…")'),
    "Dataset": ("result of a sweep", "sweep(…)"), "Modes": ("mode shapes", "linearize(…).modes()"),
    "LinearModel": ("linear model", "linearize(…)"), "OperatingPoint": ("operating point", "steady(…)"),
}  # fmt: skip
"""Word and example of a kind."""


def checked(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Let a public function refuse arguments that are not of the annotated kind, before it does anything.

    What a value means (a name, a range, a unit) is checked where it is used. So are drives that `build` takes, which
    it tells more about. Of what only type checkers know, the name of the class is looked at.
    """

    @wraps(function)
    def call(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        names, rest, kinds = _kinds(function)
        given = [*zip(names, args, strict=False), *((rest, value) for value in args[len(names) :]), *kwargs.items()]
        for name, value in given:
            if name in kinds and not fits(value, kinds[name]):
                raise wrong_kind(name, value, kinds[name], of=f"{function.__qualname__.removesuffix('.__init__')}: ")
        return function(*args, **kwargs)

    return call


def checked_fields(kind: type[_R]) -> type[_R]:
    """Let a public dataclass refuse fields that are not of the annotated kind, as `checked` does of functions."""
    cast(Any, kind).__init__ = checked(cast(Any, kind).__init__)
    return kind


def wrong_kind(name: str, value: object, kind: Any, of: str = "") -> ValueOutOfRange:
    """Return the error about a value of another kind.

    Args:
        name: of the argument.
        value: what was given.
        kind: what it is not, a type or a union of types.
        of: function, for the beginning of the message.
    """
    if isinstance(value, Mapping) and (
        inner := next((get_args(c) for c in _choices(kind) if get_origin(c) is Mapping), ())
    ):
        for key, part in cast("Mapping[Any, Any]", value).items():
            if not fits(key, inner[0]):
                return wrong_kind(f"a name in {name}", key, inner[0], of)
            if not fits(part, inner[1]):
                return wrong_kind(f"{name}[{key!r}]", part, inner[1], of)
    shown = repr(value)
    if len(shown) > _SHOWN or " at 0x" in shown:
        shown = f"something of type {type(value).__name__}"
    words, examples = zip(
        *dict.fromkeys(_word(choice) for choice in _choices(kind) if choice is not NoneType), strict=True
    )
    what = f"{of}{name} = {shown} is no {' or '.join(dict.fromkeys(words))}."
    return ValueOutOfRange(what, advice=f"Give one, such as {' or '.join(dict.fromkeys(examples))}.")


@lru_cache(maxsize=256)
def _kinds(function: Callable[..., Any]) -> tuple[tuple[str, ...], str, dict[str, Any]]:
    """Return the names of positional arguments, that of the others without a name, and what kinds are checked."""
    kinds: dict[str, Any] = {}
    parameters = signature(function).parameters
    for name, parameter in parameters.items():
        if parameter.kind is Parameter.VAR_KEYWORD or not isinstance(parameter.annotation, str):
            continue
        try:
            hints = SimpleNamespace(__annotations__={name: parameter.annotation})
            kind = get_type_hints(hints, cast(Any, function).__globals__)[name]
        except NameError:  # known to type checkers only
            kind = parameter.annotation
        if not {"Component", "CompiledDae"} <= {getattr(choice, "__name__", "") for choice in _choices(kind)}:
            kinds[name] = kind
    rest = next((name for name, p in parameters.items() if p.kind is Parameter.VAR_POSITIONAL), "")
    names = (n for n, p in parameters.items() if p.kind in (Parameter.POSITIONAL_ONLY, Parameter.POSITIONAL_OR_KEYWORD))
    return tuple(names), rest, kinds


def _choices(kind: Any) -> tuple[Any, ...]:
    if isinstance(kind, str):
        return tuple(NoneType if part == "None" else part for part in kind.split(" | "))
    return get_args(kind) if get_origin(kind) in (Union, UnionType) else (kind,)


def _word(kind: Any) -> tuple[str, str]:
    name = getattr(get_origin(kind) or kind, "__name__", str(kind)).rpartition(".")[2]
    if name in ("Sequence", "Iterable", "Collection", "list"):
        return ("list of texts", '["…"]') if get_args(kind) == (str,) else ("list", "[…]")
    return _WORDS.get(name, (name, f"{name}(…)"))


def fits(value: Any, kind: Any) -> bool:
    """Return whether a value is of a kind: a type, or one of the annotations of public functions."""
    if type(value) is kind:
        return True
    if len(choices := _choices(kind)) > 1:
        return any(fits(value, choice) for choice in choices)
    if isinstance(kind, str):
        return kind.rpartition(".")[2] in (base.__name__ for base in type(value).__mro__)
    origin, inner = get_origin(kind) or kind, get_args(kind)
    if origin in (float, complex, int):
        # Also arrays of one number, as those of NumPy and CasADi.
        numbers = Integral if origin is int else Real if origin is float else Complex
        return isinstance(value, numbers) or (origin is not int and hasattr(value, "__float__"))
    if origin is bool:
        return hasattr(value, "__bool__")
    if origin is Literal:
        return isinstance(value, str)
    if origin is tuple:
        return isinstance(value, tuple | list) and len(cast("list[Any]", value)) == len(inner)
    if origin is Any or not isinstance(origin, type) or getattr(origin, "_is_protocol", False):
        return True
    if origin is Mapping:
        of, to = inner or (Any, Any)
        return isinstance(value, Mapping) and all(
            fits(key, of) and fits(part, to) for key, part in cast("Mapping[Any, Any]", value).items()
        )
    if origin is not str and issubclass(origin, Iterable) and inner:
        return _is_list(value, inner[0])
    # What takes components only tells more about compiled ones.
    compiled = origin.__name__ == "Component" and type(value).__name__ == "CompiledDae"
    return callable(value) if origin is Callable else isinstance(value, origin) or compiled


def _is_list(value: Any, kind: Any) -> bool:
    """Return whether a value has elements of a kind; a text has texts, but is not meant so, and an iterator ends."""
    if isinstance(value, str | bytes):
        return False
    if getattr(kind, "__module__", "").startswith(__package__ or ""):
        return isinstance(value, Iterable)  # what takes a list of these tells more about one that is none
    try:
        return isinstance(value, Iterator) or all(fits(element, kind) for element in value)
    except TypeError:
        return False


def takes(function: Callable[..., Any]) -> dict[str, Parameter]:
    """Return the arguments of an operation that are given by name, without what it works on."""
    known = signature(function).parameters
    return {name: known[name] for name in known if name not in ("self", "sheet", "more")}


def check_names(what: str, function: Callable[..., Any], given: Iterable[str]) -> None:
    """Refuse arguments that an operation does not take, and missing ones.

    Args:
        what: name of the operation.
        function: does it; `more` takes any names.
        given: names of the arguments.

    Raises:
        UnknownName: it has no such argument.
        NetlistError: one is missing.
    """
    known, given = takes(function), list(given)
    listed = f"It takes {', '.join(known)}." if known else "It takes none."
    takes_more = "more" in signature(function).parameters
    for key in given:
        if key not in known and (not takes_more or key == "sheet"):
            raise UnknownName(f"{what} has no argument '{key}'{did_you_mean(key, known) or '.'} {listed}")
    missing = [key for key, argument in known.items() if argument.default is Parameter.empty and key not in given]
    if missing:
        raise NetlistError(f"{what} needs {' and '.join(missing)}.", advice=listed)
