"""What the framework keeps of components and connectors, apart from the names that their users choose.

A component's attributes are its fields, parts and whatever its author puts there. So everything else stands in two
records: `declarations` of a class, and what is `inside` of each of its instances.
"""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol, Self, TypeVar

from modelica_like.errors import Source
from modelica_like.language.places import NOWHERE

if TYPE_CHECKING:
    from modelica_like.language.component import Component
    from modelica_like.language.declared import Connector, Declared
    from modelica_like.language.discrete import Marker
    from modelica_like.language.expr import Symbol
    from modelica_like.language.fields import Field, Value
    from modelica_like.language.mode import Mode
    from modelica_like.language.tables import Rows

_Inside = TypeVar("_Inside", covariant=True)
_Kind = TypeVar("_Kind")


def _empty() -> dict[Any, Any]:
    return {}


@dataclass(frozen=True, eq=False)
class Declarations:
    """What a class and its bases declare, by name; connectors declare fields only.

    Attributes:
        fields: parameters, variables, signals and discrete values.
        connectors: where its instances are joined.
        modes: discrete states.
        parts: a component or a list of them.
        replaceable: names of the parts that can be replaced.
        structural: fields that decide on parts and equations, with their defaults.
        tables: the structural fields that are tables.
        partial: whether it is only a base class.
        templates: of `flatten`, by what they depend on.
    """

    fields: dict[str, Field] = field(default_factory=_empty)
    connectors: dict[str, Connector] = field(default_factory=_empty)
    modes: dict[str, Mode] = field(default_factory=_empty)
    parts: dict[str, Component | list[Component]] = field(default_factory=_empty)
    replaceable: frozenset[str] = frozenset()
    structural: dict[str, Any] = field(default_factory=_empty)
    tables: dict[str, Rows] = field(default_factory=_empty)
    partial: bool = True
    templates: dict[Any, Any] = field(default_factory=_empty)


@dataclass(eq=False)
class Inside:
    """Of a component or connector.

    Attributes:
        owner: the component it belongs to.
        name: there.
        own_fields: fields that this one alone has, by name.
        joined: these, and together with those of the class; made on first use.
    """

    owner: Declared | None = None
    name: str = ""
    own_fields: dict[str, Field] = field(default_factory=_empty)
    joined: tuple[dict[str, Field], dict[str, Field]] | None = None

    @cached_property
    def symbols(self) -> dict[tuple[str, int], Symbol]:
        """Of its fields, by name and order of the derivative."""
        return {}

    @cached_property
    def markers(self) -> list[Marker]:
        """Of expressions of these symbols."""
        return []

    def detached(self) -> Self:
        """Return a copy without what is valid in one process, and for one instance, only."""
        twin = object.__new__(type(self))  # `copy` takes three times as long
        twin.__dict__.update(self.__dict__)
        twin.__dict__.pop("symbols", None)
        twin.__dict__.pop("markers", None)
        return twin


@dataclass(eq=False)
class InsideConnector(Inside):
    """Of a connector.

    Attributes:
        used: whether it is connected, if it is optional.
    """

    used: bool = True


@dataclass(eq=False)
class InsideComponent(Inside):
    """Of a component.

    Attributes:
        values: given parameters and inputs.
        starts: given start values.
        start_modes: given modes at the start.
        parts: a component or a list of them.
        connectors: where it is joined.
        given_tables: tables as they were written.
        measured: scale parameters that must have no value, by name: the table with quantities that forbids it.
        elements: parts, with those of lists one by one; made on first use.
        elsewhere: own discrete variables that an owner's equations determine.
        frozen: parameters of whose values others were made when a text was read.
        lent: equations of own variables that stand in an owner, less those of parts that stand here.
        creeps: whether its locked frictions yield to what holds them, because others hold the same shaft.
    """

    values: dict[str, Value] = field(default_factory=_empty)
    starts: dict[str, Value] = field(default_factory=_empty)
    start_modes: dict[str, str] = field(default_factory=_empty)
    parts: dict[str, Component | list[Component]] = field(default_factory=_empty)
    connectors: dict[str, Connector] = field(default_factory=_empty)
    given_tables: dict[str, Any] = field(default_factory=_empty)
    measured: dict[str, str] = field(default_factory=_empty)
    elements: Mapping[str, Component] | None = None
    elsewhere: frozenset[str] = frozenset()
    frozen: Set[str] = frozenset()
    lent: int = 0
    creeps: bool = False

    def detached(self) -> Self:
        """Return a copy without what is valid in one process, and for one instance, only."""
        twin = super().detached()
        twin.elements = None
        return twin


@dataclass(eq=False)
class InsideAssembly(InsideComponent):
    """Of an assembly.

    Attributes:
        description: one phrase.
        wires: paths of the ends of each connection, by its name.
        chains: names of the parts of each series, by its name.
        free: paths of connectors that stay unconnected on purpose.
        exposed: outer connectors and signals, and the inner ones they stand for.
        simulate: arguments of a run.
        display: units of pictures and tables.
        origin: path of its file.
        text: of this file, as it was read.
        sizing: path of its sizing file.
        optimize: what is optimised, as written in the netlist.
        tolerances: how parameters scatter, as written there.
        libraries: of Modelica text, as written there.
        remarks: what its reader took that the file does not say.
        places: in the netlist, by section and name.
        made: the call that created it.
    """

    description: str = ""
    wires: dict[str, tuple[str, ...]] = field(default_factory=_empty)
    chains: dict[str, tuple[str, ...]] = field(default_factory=_empty)
    free: tuple[str, ...] = ()
    exposed: tuple[tuple[str, str], ...] = ()
    simulate: dict[str, Any] = field(default_factory=_empty)
    display: dict[str, str] = field(default_factory=_empty)
    origin: str = ""
    text: str = ""
    sizing: str = ""
    optimize: dict[str, Any] = field(default_factory=_empty)
    tolerances: dict[str, Any] = field(default_factory=_empty)
    libraries: dict[str, list[str]] = field(default_factory=_empty)
    remarks: tuple[str, ...] = ()
    places: dict[str, Source] = field(default_factory=_empty)
    made: Source = NOWHERE


def of_kind(cls: type, kind: type[_Kind]) -> dict[str, _Kind]:
    """Return the declarations of one kind in the bodies of a class and its bases."""
    lineage = reversed(cls.__mro__)
    return {name: value for base in lineage for name, value in vars(base).items() if isinstance(value, kind)}


class _Instance(Protocol[_Inside]):
    @property
    def _inside(self) -> _Inside: ...


def inside(of: _Instance[_Inside]) -> _Inside:
    """Return what the framework keeps of a component or connector."""
    return of._inside  # pyright: ignore[reportPrivateUsage]


def declarations(of: Declared | type[Declared]) -> Declarations:
    """Return what a class declares; of an instance, what its class does."""
    return of._declared  # pyright: ignore[reportPrivateUsage]
