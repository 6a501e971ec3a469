"""Components: declarations, parts and values."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from itertools import chain
from types import MappingProxyType
from typing import Any, ClassVar, Self, TypeVar, cast, dataclass_transform

from modelica_like import upper
from modelica_like.errors import DuplicateName, LanguageError, ModelicaLikeError, NetlistError, Source
from modelica_like.language.declared import Connector, Declared, Terminal, annotated, refuse_collection, unknown
from modelica_like.language.equation import Equations
from modelica_like.language.expr import TIME, Expr
from modelica_like.language.fields import Discrete, Field, Input, Output, Parameter, Value, param, require_identifier
from modelica_like.language.icon import Icon
from modelica_like.language.inside import Declarations, Inside, InsideComponent, declarations, inside, of_kind
from modelica_like.language.mode import Mode
from modelica_like.language.places import NOWHERE, caller
from modelica_like.language.tables import REQUIRED, Rows, both_given, frozen_rows, keep_as_read, rows
from modelica_like.language.transition import Events


@dataclass_transform(kw_only_default=True, field_specifiers=(param, rows))
class Component(Declared):
    """A machine element: declared fields, connectors and parts, with equations between them.

    Args:
        values: of parameters and inputs, start values of variables, structural fields and replaceable parts, by name.
    """

    inlet: ClassVar[str] = "flange_a flange"
    outlet: ClassVar[str] = "flange_b flange"
    terminal: ClassVar[Terminal | None] = None
    icon: ClassVar[Icon | None] = None
    parts_are_attributes: ClassVar[bool] = True
    units_checked: ClassVar[bool] = True
    """Whether the units of its equations, of its connections and of the values it gives to parts must fit."""
    _kept: ClassVar[type[Inside]] = InsideComponent
    _inside: InsideComponent  # pyright: ignore[reportIncompatibleVariableOverride]

    def __init_subclass__(cls, partial: bool = False, **options: Any) -> None:
        super().__init_subclass__(**options)
        body = {name: value for name, value in vars(cls).items() if not name.startswith("_")}
        hints = {name: str(text) for name, text in annotated(cls).items() if not name.startswith("_")}
        annotations = [name for name, text in hints.items() if not text.startswith(("ClassVar", "typing.ClassVar"))]
        # A class may extend several bases, as in Modelica: declarations are collected along all ancestors.
        above = [declarations(base) for base in reversed(cls.__mro__[1:]) if issubclass(base, Component)]
        parts = {name: value for name, value in body.items() if _is_part(value)}
        symbolic = (Field, Connector, Mode)
        for name, value in body.items():
            if type(value) is list and name not in parts and (name in annotations or name not in hints):
                refuse_collection(f"{cls.__name__}.{name}", cast(object, value))
        plain = {
            n: body.get(n, REQUIRED) for n in annotations if not isinstance(body.get(n), symbolic) and n not in parts
        }
        tables = {name: value for name, value in plain.items() if isinstance(value, Rows)}
        plain |= {name: table.default for name, table in tables.items()}
        cls._declared = declared = Declarations(
            fields=cls._declared.fields,
            connectors=of_kind(cls, Connector),
            modes=of_kind(cls, Mode),
            parts=_joined(*(base.parts for base in above), parts),
            replaceable=frozenset(parts.keys() & {*annotations}).union(*(base.replaceable for base in above)),
            structural=_joined(*(base.structural for base in above), plain),
            tables=_joined(*(base.tables for base in above), tables),
            partial=partial,
        )
        for name in chain(declared.fields, declared.connectors, declared.modes, declared.parts, declared.structural):
            require_identifier(name, cls.__name__)
            if hasattr(Component, name):
                what = f"{cls.__name__} declares '{name}', which every component has already."
                raise DuplicateName(what, where=caller(), advice="Choose another name.")
        for mode in declared.modes.values():
            mode.check()

    def __init__(self, **values: Any) -> None:
        if self._declared.partial:
            what = f"{type(self).__name__} is partial: it is only a base class."
            raise LanguageError(what, where=caller())
        for name, connector in self._declared.connectors.items():
            self._adopt_connector(name, connector)
        for name, part in self._declared.parts.items():
            setattr(self, name, values.pop(name) if name in values and name in self._declared.replaceable else part)
        for name, default in self._declared.structural.items():
            self._set_structural(name, values.pop(name, default))
        for name, value in values.items():
            self.give(name, value)
        self.build()

    # -- what authors write ------------------------------------------------------------------------------------------

    def build(self) -> None:
        """Assign parts whose number or type depends on structural fields."""

    def equations(self) -> Equations:
        """Yield the equations and connections."""
        return iter(())

    def initial_equations(self) -> Equations:
        """Yield equations that hold at the start only: they take the place of start values."""
        return iter(())

    def events(self) -> Events:
        """Yield the transitions of the modes."""
        return iter(())

    def stored_energy(self) -> Expr | float:
        """Energy in J that the component stores."""
        return 0.0

    def loss_power(self) -> Expr | float:
        """Power in W that the component dissipates."""
        return 0.0

    def source_power(self) -> Expr | float:
        """Power in W that the component brings into the model from outside."""
        return 0.0

    @property
    def time(self) -> Expr:
        """Time in s."""
        return TIME

    def given(self, name: str) -> bool:
        """Return whether a parameter or input has a value (its own or a default)."""
        return name in self._inside.values or self.fields[name].default is not None

    # -- values ------------------------------------------------------------------------------------------------------

    def give(self, name: str, value: Any) -> None:
        """Set a parameter, input, start value, start mode, structural field or replaceable part by name.

        Raises:
            UnknownName: there is no such declaration.
            UnitError, ValueOutOfRange, NetlistError: the value is invalid.
        """
        if name in self.fields:
            self.set_value(self.fields[name], value)
        elif name in self._declared.modes:
            self._declared.modes[name].__set__(self, value)
        elif name in self._declared.structural:
            self._set_structural(name, value)
            self.build()
        elif name in self._inside.parts and name in self._declared.replaceable and _is_part(value):
            setattr(self, name, value)
        elif name in self._inside.parts:
            raise LanguageError(
                f"{self.label}.{name} cannot be replaced.", where=caller(),
                advice=f"Annotate the part in {type(self).__name__} to make it replaceable, or set its values by path.",
            )  # fmt: skip
        else:
            refuse_collection(f"{(kind := type(self).__name__)}.{name}", value, caller)
            names = [*self.fields, *self._declared.modes, *self._declared.structural, *self._declared.replaceable]
            given = (field for field in self.fields.values() if isinstance(field, Parameter | Input))
            raise unknown("parameter or variable", kind, name, names, self.renamed, given, caller())

    def set_value(self, field: Field, value: Any) -> None:
        """Store the value of a declared field; called by the fields themselves."""
        try:
            understood = field.read(value)
        except ModelicaLikeError as error:
            error.where = error.where or (caller(),)
            raise
        if field.name in self._inside.measured:
            raise both_given(self._inside.measured[field.name], field.name)
        if field.name in self._inside.frozen:
            keep_as_read(self.label, field.name, self.value(field.name), understood)
        store = self._inside.values if isinstance(field, Parameter | Input) else self._inside.starts
        store[field.name] = understood

    @classmethod
    def check_structural(cls, name: str, value: Any) -> None:
        """Check that the value for a structural field has the type of its default.

        Raises:
            NetlistError: it has another type.
            UnitError, ValueOutOfRange: a cell of a table has another dimension or is not finite.
        """
        if name in cls._declared.tables:
            cls._declared.tables[name].read(f"{cls.__name__}.{name}", cls._declared.fields, frozen_rows(value))
            return
        if type(value) is int and abs(value) > _MOST:  # it may be a number of parts to create
            raise NetlistError(f"{cls.__name__}.{name} is larger than {_MOST}; no drive has that many parts.")
        default, hint = cls._declared.structural[name], cls._hint(name)
        if (choices := cls.choices(name)) and value not in choices:
            raise NetlistError(f"{cls.__name__}.{name} = {value!r} must be {' or '.join(choices)}.")
        wanted: Any = next((k for k in _PLAIN if hint == k.__name__), object) if default is REQUIRED else type(default)
        fits = isinstance(value, wanted) and isinstance(value, bool) == (wanted is bool)
        if wanted in _PLAIN and not fits and not (wanted is float and type(value) is int):
            raise NetlistError(f"{cls.__name__}.{name} = {value!r} must be {_PLAIN[wanted]}.")

    def _set_structural(self, name: str, value: Any) -> None:
        if value is REQUIRED:
            raise LanguageError(f"{type(self).__name__} needs a value for {name}.", where=caller())
        frozen, table = frozen_rows(value), self._declared.tables.get(name)
        if table is None:
            self.check_structural(name, value)
        self.__dict__[name] = frozen if table is None else table.store(self, name, frozen)

    def value(self, name: str) -> Value | None:
        """Return the value of a parameter or input: given, default, or None."""
        if name in self._inside.values:
            return self._inside.values[name]
        field = self.fields[name]
        return None if field.default is None else field.read(field.default)

    def start(self, name: str) -> Value | None:
        """Return the start value of a variable or discrete value: given, default of a discrete value, or None."""
        if name in self._inside.starts:
            return self._inside.starts[name]
        field = self.fields[name]
        return field.read(field.default) if isinstance(field, Discrete) else None

    def start_mode(self, name: str) -> str:
        """Return the name of the mode at the start."""
        return self._inside.start_modes.get(name, self._declared.modes[name].start)

    # -- the tree ----------------------------------------------------------------------------------------------------

    @property
    def connectors(self) -> dict[str, Connector]:
        """Connectors by name."""
        return self._inside.connectors

    @property
    def modes(self) -> dict[str, Mode]:
        """Declared modes by name."""
        return self._declared.modes

    @property
    def parts(self) -> Mapping[str, Component]:
        """Parts by name; parts of arrays as `name[1]`, `name[2]` and so on."""
        named = self._inside.elements
        if named is None:
            named = dict[str, Component]()
            for name, part in self._inside.parts.items():
                listed = isinstance(part, list)
                named |= {f"{name}[{k}]": element for k, element in enumerate(part, 1)} if listed else {name: part}
            named = self._inside.elements = MappingProxyType(named)
        return named

    def walk(self) -> Iterator[Component]:
        """Yield this component and all parts below it, owners first."""
        pending: list[Component] = [self]
        while pending:
            component = pending.pop()
            yield component
            pending += reversed([*component.parts.values()] if component._inside.parts else [])

    def find(self, path: str) -> Component:
        """Return the part at a dotted path.

        Raises:
            UnknownName: there is no such part.
        """
        component = self
        for name in path.split(".") if path else ():
            if name not in component.parts:
                raise unknown("part", component.label, name, component.parts, component.renamed)
            component = component.parts[name]
        return component

    def set(self, path: str, value: Any) -> None:
        """Set a value by its path, `drive.set("clutch.mu", 0.3)`; names in a formula are parameters of this component.

        Raises:
            UnknownName: there is no such part, parameter or variable.
        """
        from modelica_like.language.scopes import give_by_path

        give_by_path(self, path, value)

    def source_of(self, key: str) -> Source:
        """Return the place of an entry in the netlist of this component; an `Assembly` has it."""
        return NOWHERE

    def place_of(self, name: str = "") -> Source:
        """Return the place of this part in a netlist, of a parameter of the netlist, or of a value given later."""
        from modelica_like.language.scopes import given_above

        root, path = self.root, f"{self.path}.{name}".lstrip(".")
        source = root.source_of(f"set.{path}") if isinstance(root, Component) else NOWHERE
        source = source if source.file else given_above(self, name)
        source = source if source.file else self.source_of(f"parameters.{name}")
        if source.file or not isinstance(self._inside.owner, Component):
            return source  # and all elements of an array are in one line
        return self._inside.owner.source_of(f"parts.{self._inside.name.partition('[')[0]}")

    @contextmanager
    def at_its_place(self, name: str = "") -> Generator[None]:
        """Add the place of this part, or of a parameter, to an error without a place."""
        try:
            yield
        except ModelicaLikeError as error:
            if not error.where and (place := self.place_of(name)).file:
                error.where = (place,)
            raise

    def inlet_connector(self) -> Connector:
        """Return the connector that `series` joins to the part before."""
        return self._end("inlet")

    def outlet_connector(self) -> Connector:
        """Return the connector that `series` joins to the part after."""
        return self._end("outlet")

    def terminal_members(self) -> tuple[str, ...]:
        """Return the names of the signals that form the terminal of an adaptor."""
        return tuple(name for name, field in self.fields.items() if isinstance(field, Input | Output))

    def _repr_html_(self) -> str:
        """Return the schematic and the given parameters, for notebooks."""
        return upper.html(self)

    def _end(self, which: str) -> Connector:
        names = getattr(type(self), which).split()
        connector = next((self._inside.connectors[name] for name in names if name in self._inside.connectors), None)
        if connector is None:
            label = f"{self.label} ({type(self).__name__})"
            error = unknown(which, label, " or ".join(names), list(self._inside.connectors))
            ends = [*self._inside.connectors, *self.terminal_members()]
            example = f': joint = ["{self.label}.{min(ends)}", …]' if ends else "."
            error.advice = f"Join it in [connect], not in a series{example}"
            raise error
        return connector

    def __setattr__(self, name: str, value: Any) -> None:
        if _is_part(value):
            self._adopt(name, value)
        elif isinstance(value, Connector):
            self._adopt_connector(name, value)
        elif name in self._declared.structural:
            self.give(name, value)
        elif name.startswith("_") or isinstance(getattr(type(self), name, None), Field | Mode):
            super().__setattr__(name, value)
        elif isinstance(value, list) and not value and name not in self.fields:
            self._adopt(name, [])  # an array with zero elements
        else:
            self.give(name, value)

    def _adopt(self, name: str, value: Component | list[Component]) -> None:
        record = self._inside
        reserved = hasattr(Component, name) and self.parts_are_attributes
        if reserved or name in {*self.fields, *record.connectors, *self._declared.structural, *self._declared.modes}:
            hint = ": every component has something of this name" * reserved
            raise DuplicateName(f"{self.label}: '{name}' is already in use{hint}.", where=caller())
        require_identifier(name, type(self).__name__, element=True)
        if isinstance(value, list):
            adopted: Any = [self._owned(f"{name}[{k}]", part) for k, part in enumerate(value, 1)]
        else:
            adopted = self._owned(name, value)
        record.parts[name] = adopted
        if not hasattr(Component, name):
            self.__dict__[name] = adopted
        record.elements = None

    def _owned(self, name: str, part: Component) -> Component:
        twin = part.copy()
        record = twin._inside
        record.owner, record.name = self, name
        return twin

    def _adopt_connector(self, name: str, connector: Connector) -> None:
        twin = connector._detached_copy()
        record = inside(twin)
        record.owner, record.name = self, name
        self._inside.connectors[name] = twin
        self.__dict__[name] = twin

    def copy(self) -> Self:
        """Return an independent copy of this component and its parts, without an owner."""
        twin = self._detached_copy()
        record = twin._inside
        record.values, record.starts = record.values.copy(), record.starts.copy()
        record.start_modes, record.parts, record.connectors = record.start_modes.copy(), {}, {}
        for name, connector in self._inside.connectors.items():
            twin._adopt_connector(name, connector)
        for name, part in self._inside.parts.items():
            twin._adopt(name, part)
        return twin

    def __repr__(self) -> str:
        given = {**self._inside.values, **self._inside.starts}.items()
        return f"{type(self).__name__}({', '.join(f'{name}={value.given!r}' for name, value in given)})"


_MOST = 100_000
_PLAIN: dict[type, str] = {bool: "true or false", int: "a whole number", float: "a number", str: "a text"}
_Kind = TypeVar("_Kind")


def _is_part(value: object) -> bool:
    elements = cast("list[object]", value) if isinstance(value, list) else [value]
    return bool(elements) and all(isinstance(element, Component) for element in elements)


def _joined(*named: Mapping[str, _Kind]) -> dict[str, _Kind]:
    return {name: value for some in named for name, value in some.items()}
