"""Common base of connectors and components: declared fields, and a place in the tree."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from copy import copy
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, Self, cast

from modelica_like.errors import LanguageError, Source, UnknownName, nearest, question
from modelica_like.language.expr import Expr, Symbol, symbol_of
from modelica_like.language.fields import Field, Variable
from modelica_like.language.icon import Stroke
from modelica_like.language.inside import Declarations, Inside, InsideConnector, of_kind


def annotated(cls: type) -> Mapping[str, Any]:
    """Return the annotations in the body of a class."""
    return vars(cls).get("__annotations__", {})


class Declared:
    """An object with declared fields, an owner and a name there."""

    renamed: ClassVar[Mapping[str, str]] = {}
    """What to write instead of names of earlier versions, by them: `{"pulses": "n"}`; bases add theirs."""
    _declared: ClassVar[Declarations] = Declarations()
    _kept: ClassVar[type[Inside]] = Inside
    _inside: Inside

    def __new__(cls, *_: Any, **__: Any) -> Self:
        """Make the record of the framework; `__init__` of a user's class may call the one here late."""
        component = super().__new__(cls)
        component.__dict__["_inside"] = cls._kept()
        return component

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        cls._declared = Declarations(fields=of_kind(cls, Field))
        for entry in cls._declared.fields.values():
            entry.check()
        former = (vars(base).get("renamed", {}) for base in reversed(cls.__mro__))
        cls.renamed = {name: instead for names in former for name, instead in names.items()}

    @classmethod
    def _hint(cls, name: str) -> str:
        return next(str(annotated(base)[name]) for base in cls.__mro__ if name in annotated(base))

    @classmethod
    def choices(cls, name: str) -> list[str]:
        """Return the texts that a structural field can be; empty if it can be any."""
        return hint[9:-2].split("', '") if (hint := cls._hint(name)).startswith("Literal[") else []

    @property
    def fields(self) -> dict[str, Field]:
        """Declared parameters, variables, signals and discrete values, and those that this one alone has, by name."""
        within = self._inside
        further = within.own_fields
        if not further:
            return self._declared.fields
        # Every change makes a new dictionary; a netlist of thousands of parameters asks for each of them.
        if within.joined is None or within.joined[0] is not further:
            within.joined = further, {**self._declared.fields, **further}
        return within.joined[1]

    def declare_array(self, name: str, size: int, field: Field) -> None:
        """Declare variables or signals `name[1]` to `name[size]`, in `build`: structural fields say how many.

        Args:
            name: of all of them.
            size: how many; what was declared under this name before is gone.
            field: of each, such as `var("N.m", "torque")`.
        """
        kept = {key: f for key, f in self._inside.own_fields.items() if not key.startswith(f"{name}[")}
        for key in (f"{name}[{k}]" for k in range(1, size + 1)):
            kept[key] = copy(field)
            kept[key].owner, kept[key].name = type(self).__name__, key
            kept[key].check()
        self._inside.own_fields = kept

    def array(self, name: str) -> list[Symbol]:
        """Return the variables or signals of an array."""
        return [symbol_of(self, key) for key in self._inside.own_fields if key.startswith(f"{name}[")]

    def is_constant(self, name: str) -> bool:
        """Return whether a field keeps its value between events."""
        return not isinstance(self.fields.get(name), Variable)

    @property
    def path(self) -> str:
        """Dotted name from the root of the tree; empty for the root itself."""
        names: list[str] = []
        node: Declared = self
        while node._inside.owner is not None:
            names.append(node._inside.name)
            node = node._inside.owner
        return ".".join(reversed(names))

    @property
    def root(self) -> Declared:
        """The whole tree."""
        node: Declared = self
        while node._inside.owner is not None:
            node = node._inside.owner
        return node

    @property
    def label(self) -> str:
        """Name for messages: the path, or the type for the root."""
        return self.path or self._inside.name or type(self).__name__

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_inside": self._inside.detached()}

    def _detached_copy(self) -> Self:
        twin = object.__new__(type(self))
        twin.__dict__.update(self.__dict__)
        twin.__dict__["_inside"] = record = self._inside.detached()
        record.owner = None
        return twin


@dataclass(frozen=True)
class Domain:
    """Words of a physical domain, for messages about its connectors.

    Attributes:
        flow: quantity that connectors carry, such as `torque`.
        potential: quantity that is equal in a connection, such as `voltage`.
        separator: part to put between two parts that fix the same potential.
        reference: component type that every network of such connectors needs, such as `Ground`.
        converters: part that connects to another connector type, by the name of that type.
        spring: component type that lets two parts differ that fix the same potential.
    """

    flow: str = "flow"
    potential: str = "potential"
    separator: str = "a compliant part"
    reference: str = ""
    converters: Mapping[str, str] = field(default_factory=dict[str, str])
    spring: str = ""


class Connector(Declared):
    """Where components are joined: potentials (`var`) become equal, flows (`flow`) sum to zero.

    A connector type declares its `domain`.

    Args:
        description: end of the component.
        free: whether it may stay unconnected (its flows are then zero).
        optional: whether it exists only if something is connected to it.
    """

    domain: ClassVar[Domain] = Domain()
    stroke: ClassVar[Stroke | None] = None
    """Line style of its connections."""
    _kept: ClassVar[type[Inside]] = InsideConnector
    _inside: InsideConnector  # pyright: ignore[reportIncompatibleVariableOverride]

    def __init__(self, description: str = "", *, free: bool = False, optional: bool = False) -> None:
        self.description = description
        self.may_be_free = free or optional
        self.optional = optional
        self._inside.used = not optional

    @property
    def used(self) -> bool:
        """Whether an optional connector is connected."""
        return self._inside.used

    @property
    def quantities(self) -> dict[str, Variable]:
        """Its potentials and flows by name."""
        return {name: f for name, f in self.fields.items() if isinstance(f, Variable)}

    def power(self) -> Expr | float:
        """Power in W that flows into the component."""
        return 0.0

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.label}>"


def unknown(
    kind: str, label: str, name: str, existing: Iterable[str], renamed: Mapping[str, str] | None = None,
    described: Iterable[Field] = (), where: Source | tuple[()] = (),
) -> UnknownName:  # fmt: skip
    """Return the error about a name that does not exist.

    Args:
        kind: kind of name, such as `part`.
        label: owner of the names.
        name: the name.
        existing: the names that exist.
        renamed: what to write instead of names of earlier versions.
        described: fields that are meant by a word that is in the description of one of them only.
        where: place of the wrong name.
    """
    if renamed and renamed.get(name):
        now = renamed[name] if renamed[name].isidentifier() else ""  # others are formulas and sentences
        what = f"{label} has no {kind} '{name}' any more."
        return UnknownName(what, where=where, advice=f"Write {renamed[name]}.", word=name, instead=now)
    names = list(existing)
    listing = f" It has {', '.join(names)}." if names else " It has none."
    meant = [field.name for field in described if name.lower() in field.description.lower().split()]
    what, near = f"{label} has no {kind} '{name}'", nearest(name, names) or (meant[0] if len(meant) == 1 else "")
    return UnknownName(f"{what}{question(near) or '.'}{listing}", where=where, word=name, instead=near)


def refuse_collection(label: str, value: object, where: Callable[[], Source] | None = None) -> None:
    """Refuse a list, tuple, set or dictionary with parts or connectors that is no list of parts.

    Raises:
        LanguageError: it is one.
    """
    if not isinstance(value, list | tuple | set | dict):
        return
    elements = list(cast("Iterable[Any]", value.values() if isinstance(value, dict) else value))
    inner = [part for e in elements for part in cast("Iterable[Any]", e if isinstance(e, list | tuple) else (e,))]
    if any(isinstance(element, Connector) for element in inner):
        advice = "Give each a name of its own: flange_1 and flange_2; where their number varies, by setattr in `build`."
    elif any(isinstance(element, Declared) for element in inner):
        advice = "An array is a list of parts only: [Inertia(J=1), Inertia(J=2)]; other parts have names of their own."
    else:
        return
    kind = type(cast(object, value)).__name__
    kinds = ", ".join(dict.fromkeys(type(element).__name__ for element in elements))
    raise LanguageError(
        f"{label} is a {kind} that is no array of parts: it has {kinds}.", where=where() if where else (), advice=advice
    )


@dataclass(frozen=True, slots=True)
class Terminal:
    """The terminal formed by the signals of an adaptor.

    Attributes:
        kind: kind of the terminal; ends of one kind can be connected.
        takes: quantity from outside: the `flow` (torque, force, current, heat flow) or the `potential` (angle,
            position, voltage, temperature).
        rates: pairs of an input and the input that is its time derivative.
        power: the flow and the signal whose product is the power through it, such as torque and speed.
    """

    kind: str
    takes: Literal["flow", "potential"]
    rates: tuple[tuple[str, str], ...] = ()
    power: tuple[str, str] | None = None
