"""The compiled model: CasADi functions of the reduced system, and tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from threading import get_ident
from typing import Any, TypeVar

import casadi as ca

from modelica_like import upper
from modelica_like.compile.buffers import Along, BufferedFunction
from modelica_like.compile.buffers import Vector as Vector
from modelica_like.compile.cached import Cached, Key
from modelica_like.compile.edges import Edges, find_edges
from modelica_like.compile.groups import CompiledTransition as CompiledTransition
from modelica_like.compile.groups import CompiledUpdate as CompiledUpdate
from modelica_like.compile.groups import Equations, EventTables, Held, Starts, functions_of
from modelica_like.compile.groups import Reset as Reset
from modelica_like.compile.groups import StartEntry as StartEntry
from modelica_like.compile.start_system import StartSystem as StartSystem
from modelica_like.compile.symbolic import Symbolic, symbolic
from modelica_like.errors import LanguageError, ModelicaLikeError, Source, UnknownName, ValueOutOfRange, did_you_mean
from modelica_like.flatten.model import FlatDiscrete, FlatParameter, FlatVariable
from modelica_like.language.units import Unit, parse_unit, to_si
from modelica_like.structure.holds import Circuit as Circuit
from modelica_like.structure.holds import HeldMotion as HeldMotion
from modelica_like.structure.motion import Motion

Made = TypeVar("Made")
TERMINAL, HOMOTOPY = "terminal()", "homotopy()"
"""Discrete values of the model: 1 at the end of a run; the share of the actual expressions at a start."""


@dataclass(frozen=True)
class CompiledTerminal:
    """An open end of the model: the path of its adaptor, its kind, and pairs of a member and the variable behind it."""

    name: str
    kind: str
    members: tuple[tuple[str, str], ...]


@dataclass(eq=False)
class CompiledDae:
    """Functions of the reduced system, all of (t, x, z, p, u, d), in four groups, and what they are about.

    Attributes:
        equations: what holds at every moment.
        events: what may happen at an instant.
        held: what modes hold.
        starts: what is known at the start.
        inputs: positions of the open inputs among the variables.
        p: parameter values.
        u: values of the inputs.
        components: paths of the components of the energy balance.
        places: source places of the parts of netlists and of their start values, by path.
        renamed: what to write instead of paths of earlier versions.
        terminals: open ends with an adaptor.
        motion_sources: paths of the components that prescribe a motion, whatever torque or force it takes.
    """

    name: str
    states: tuple[str, ...]
    implicit: tuple[str, ...]
    flat_variables: tuple[FlatVariable, ...]
    flat_parameters: tuple[FlatParameter, ...]
    flat_derived: tuple[FlatParameter, ...]
    flat_discretes: tuple[FlatDiscrete, ...]
    inputs: tuple[int, ...]
    equations: Equations
    events: EventTables
    held: Held
    starts: Starts
    p: Vector
    u: Vector
    components: tuple[str, ...]
    places: dict[str, Source]
    renamed: dict[str, str]
    summary: str
    terminals: tuple[CompiledTerminal, ...] = ()
    motion_sources: tuple[str, ...] = ()
    settings: dict[str, Any] = field(default_factory=dict)
    _make_energy: Callable[[], ca.Function] | None = None
    _make_start: Callable[[bool], StartSystem] | None = None
    _cache: dict[Key, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        return self.summary.replace("ReducedDae", "CompiledDae", 1)

    def __repr__(self) -> str:
        return f"<{self}>"

    @cached_property
    def functions(self) -> dict[str, ca.Function]:
        """Functions of the groups by their names, such as `start_values`."""
        return functions_of(self.equations, self.events, self.held, self.starts)

    @cached_property
    def discrete_size(self) -> int:
        """Length of d: modes and discrete values, then what follows them, see `structure.discretes`."""
        return self.equations.ode.size1_in("d")

    @cached_property
    def position(self) -> dict[str, int]:
        """Position of every variable by its path."""
        return {variable.path: k for k, variable in enumerate(self.flat_variables)}

    @cached_property
    def parameter_position(self) -> dict[str, int]:
        """Position of every independent parameter by its path."""
        return {parameter.path: k for k, parameter in enumerate(self.flat_parameters)}

    @cached_property
    def fixed_position(self) -> dict[str, int]:
        """Position in (p, u) of every independent parameter and input by its path."""
        inputs = {self.flat_variables[k].path: len(self.p) + n for n, k in enumerate(self.inputs)}
        return {**self.parameter_position, **inputs}

    @cached_property
    def units(self) -> dict[str, Unit]:
        """Coherent SI unit of every variable, parameter, mode and discrete value by its path."""
        named = (*self.flat_discretes, *self.flat_variables, *self.flat_derived, *self.flat_parameters)
        return {item.path: item.unit for item in named}

    @cached_property
    def derived_position(self) -> dict[str, int]:
        """Position of every parameter that follows from others by its path."""
        return {parameter.path: k for k, parameter in enumerate(self.flat_derived)}

    @cached_property
    def discrete_position(self) -> dict[str, int]:
        """Position of every mode and discrete value by its path."""
        return {discrete.path: k for k, discrete in enumerate(self.flat_discretes)}

    @property
    def edges(self) -> Edges:
        """Where slopes change without an event, and what repeats in guards."""
        return self.once(
            Cached.EDGES, lambda: find_edges(self.arguments, self.equations.ode, self.equations.alg, self.events.guards)
        )

    @cached_property
    def energy(self) -> ca.Function:
        """Energy terms, one row per component.

        Columns: stored energy, loss, source power, power in, rate of the stored energy, sum of the magnitudes of the
        powers through its connectors.
        """
        if self._make_energy is None:
            raise LanguageError("The energy terms of this model were not kept.")
        return self._make_energy()

    @cached_property
    def start_system(self) -> StartSystem:
        """Equations between start values and states."""
        return self._start_system(rest=False)

    @cached_property
    def rest_system(self) -> StartSystem:
        """The same with variables that may be at rest."""
        return self._start_system(rest=True)

    def _start_system(self, rest: bool) -> StartSystem:
        if self._make_start is None:
            raise LanguageError("The start system of this model was not kept.")
        return self._make_start(rest)

    def places_of(self, paths: Iterable[str]) -> list[Source]:
        """Return the places of start values and parts, each once; otherwise that of the part that has them."""
        found: dict[Source, None] = {}
        for path in paths:
            while path and path not in self.places:
                path = path.rpartition(".")[0]
            if path:
                found[self.places[path]] = None
        return list(found)

    @property
    def arguments(self) -> dict[str, Any]:
        """Symbols for the arguments of the functions, the same for all twins: what is cached has them."""
        return self.once(
            Cached.ARGUMENTS,
            lambda: {
                name: ca.SX.sym(name, self.equations.ode.size1_in(k))
                for k, name in enumerate(self.equations.ode.name_in())
            },
        )

    @property
    def symbol_places(self) -> dict[int, tuple[int, int]]:
        """Number of the argument and row of each of its symbols, by hash."""
        return self.once(
            Cached.SYMBOL_PLACES,
            lambda: {
                symbol.element_hash(): (number, row)
                for number, argument in enumerate(self.arguments.values())
                for row, symbol in enumerate(ca.vertsplit(argument))
            },
        )

    @property
    def motion(self) -> Motion:
        """How expressions of `arguments` change along the solution."""
        given = self.arguments
        ode, alg = (function(*given.values()) for function in (self.equations.ode, self.equations.alg))
        return Motion(given["t"], given["x"], given["z"], ode, alg)

    @property
    def begin(self) -> float:
        """Time in s at which runs begin, unless they are told another one."""
        return to_si(self.settings.get("from", 0.0), parse_unit("s"), "from")

    def demand_begin_at_zero(self, error: type[ModelicaLikeError], what: str) -> None:
        """Raise an error where something begins at 0 s, and the runs of this model do not."""
        if self.begin != 0.0:
            advice = "Leave `from` out, or shift the time in the drive."
            raise error(f"{what} begins at 0 s, and this drive at {self.begin:g} s.", advice=advice)

    def refuse_delays(self, error: type[ModelicaLikeError], what: str) -> None:
        """Raise an error where something is not possible with delays, because they need the past of a run."""
        if self.events.delay_parts:
            (first, *_), *_ = self.events.delay_parts
            owner, *_ = self.flat_discretes[first].path.rpartition(".")
            raise error(
                f"{what}: {owner or 'it'} has a delay(…), which needs the past of a run.",
                advice="Approximate the delay there, by a lag or a Padé approximation.",
            )

    @cached_property
    def following(self) -> dict[str, tuple[str, ...]]:
        """Variables of every state that follows the motion, by its name."""
        weights = [discrete.path for discrete in self.flat_discretes if discrete.hidden and not discrete.names]
        names = [name for name in self.states if not name.startswith("der(") and name not in self.position]
        return {name: tuple(w[len(name) + 1 :] for w in weights if w.startswith(f"{name}.")) for name in names}

    @cached_property
    def rising(self) -> tuple[tuple[int, int], ...]:
        """Positions of pairs of parameters of which the second must exceed the first: columns of tables that rise."""
        return tuple((k - parameter.above, k) for k, parameter in enumerate(self.flat_parameters) if parameter.above)

    def with_parameters(self, values: dict[str, Any]) -> CompiledDae:
        """Return the same model with other parameter values, without compiling it again.

        Args:
            values: by path, numbers in SI units or quantities with a unit.

        Raises:
            UnknownName: there is no such parameter.
            LanguageError: it follows from others, or is not tunable.
            UnitError, ValueOutOfRange: the value has the wrong unit or is out of range.
        """
        p, u = self.p.copy(), self.u.copy()
        inputs = {self.flat_variables[k].path: n for n, k in enumerate(self.inputs)}
        for path, value in values.items():
            if path in self.parameter_position:
                parameter = self.flat_parameters[self.parameter_position[path]]
                if not parameter.tunable:
                    raise LanguageError(
                        f"{path} cannot change after compilation.",
                        advice="Set it in the model and build the model again.",
                    )
                p[self.parameter_position[path]] = parameter.checked(to_si(value, parameter.unit, path), value)
            elif path in inputs:
                unit = self.flat_variables[self.inputs[inputs[path]]].unit
                u[inputs[path]] = to_si(value, unit, path)
            elif path in self.derived_position:
                raise LanguageError(f"{path} follows from other parameters.", advice="Set those.")
            else:
                paths = [*self.parameter_position, *inputs]
                advice = f"Write {self.renamed[path]}." if path in self.renamed else ""
                near = "." if advice else did_you_mean(path, paths) or "."
                raise UnknownName(f"{self.name} has no parameter '{path}'{near}", advice=advice)
        for below, above in self.rising:
            if not p[below] < p[above]:
                names = [f"{self.flat_parameters[k].path} = {p[k]:g}" for k in (above, below)]
                raise ValueOutOfRange(f"{' is not above '.join(names)}: this column of the table must rise.")
        for parameter, number in zip(self.flat_derived, self.equations.derived(p).full().ravel(), strict=True):
            parameter.checked(float(number), f"{number:g}")
        return self.twin(p=p, u=u)

    def twin(self, **changes: Any) -> CompiledDae:
        """Return the same model with other attributes and the same cache."""
        twin = object.__new__(type(self))
        twin.__dict__.update(self.__dict__, **changes)
        return twin

    def once(self, key: Key, make: Callable[[], Made]) -> Made:
        """Return the result of `make`: computed on first use, cached with the model and its twins."""
        if key not in self._cache:
            self._cache[key] = make()
        return self._cache[key]

    def fast(
        self, key: Key, make: Callable[[], ca.Function], results: tuple[int, ...] | None = None
    ) -> BufferedFunction:
        """Return this thread's buffered function for a key, from the cache.

        Args:
            key: in the cache.
            make: makes the function on first use.
            results: which results to compute; all by default.
        """
        place = Cached.BUFFERED, get_ident(), key
        if place not in self._cache:
            self._cache[place] = BufferedFunction(make(), results)
        return self._cache[place]

    def along(self, key: Key, make: Callable[[], ca.Function]) -> Along:
        """Return this thread's function at many points for a key, from the cache."""
        return self.once((Cached.ALONG, get_ident(), key), lambda: Along(make()))

    def function(self, inputs: Sequence[str], outputs: Sequence[str], **run: Any) -> ca.Function:
        """Return the whole simulation as a differentiable CasADi function of parameters.

        Args:
            inputs: parameters and inputs.
            outputs: numbers read off the run.
            run: further arguments of `modelica_like.simulation_function`.
        """
        return upper.simulation_function(self, inputs, outputs, **run)

    def symbolic(self) -> Symbolic:
        """Return the equations as named CasADi symbols: rates, residuals, guards, any variable."""
        return symbolic(self)

    def native(self, inputs: Sequence[str] = (), outputs: Sequence[str] = (), **how: Any) -> Any:
        """Return a handle for control loops: an instance that steps at the speed of C.

        Args:
            inputs: inputs and tunable parameters that its steps set.
            outputs: variables and modes that its steps read.
            how: further arguments of `modelica_like.Native`.
        """
        return upper.Native(self, inputs, outputs, **how)

    def __getstate__(self) -> dict[str, Any]:
        if self._make_energy is not None:
            _ = self.energy, self.start_system, self.rest_system  # symbols do not pickle, functions do
        return {**self.__dict__, "_make_energy": None, "_make_start": None, "_cache": {}}
