"""The netlists of the groups into which a drive is cut: their parts and wires, with adaptors at the open ends."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from modelica_like.compile import compile
from modelica_like.cosimulation.causality import End, signals_of
from modelica_like.cosimulation.cut import CutNetlist, part_of
from modelica_like.errors import NetlistError
from modelica_like.flatten import flatten
from modelica_like.fmi.terminals import adaptor_for, connector_at
from modelica_like.language import Assembly, Component
from modelica_like.language.formula import Formula
from modelica_like.netlist.convert import value_text
from modelica_like.structure import reduce


class Maker:
    """Makes the netlists of the groups into which a whole netlist is cut."""

    def __init__(self, assembly: Assembly, found: CutNetlist) -> None:
        self.assembly, self.found = assembly, found

    def bare(self, group: int, ends: Sequence[End]) -> Assembly:
        """Return a group with adaptors at its open ends, with the start values that its parts were given."""
        names = self.found.groups[group]
        parts: dict[str, Any] = {name: self.assembly._parts[name] for name in names}
        wires = {wire.name: wire.ends for wire in self.found.wires if part_of(wire.ends[0]) in names}
        for end in ends:
            parts[end.adaptor], inner = self.adaptor(end)
            wires[end.adaptor] = (end.path, f"{end.adaptor}.{inner}")
        free = [end for end in self.assembly.free_ends if part_of(end) in names]
        parameters = self._parameters(group, parts.values())
        made = Assembly(
            f"{self.assembly.label}_{names[0]}", parts=parts, connect=wires, free=free, parameters=parameters
        )
        # The part starts with numbers, whatever the whole starts from.
        made.__dict__["_simulate"] = {**self.assembly.__dict__["_simulate"], "start": "given"}
        return made

    def adaptor(self, end: End) -> tuple[Component, str]:
        """Return an adaptor for an end, which tells no acceleration, and the name of its connector."""
        kind, inner = adaptor_for(connector_at(self.assembly, end.path), end.takes)
        return kind(**({"use_a": False} if "use_a" in kind._structural else {})), inner

    def members(self, end: End) -> tuple[str, ...]:
        """Return the signals that pass an end: the flow, the potential, and its rate."""
        outputs, inputs, second = signals_of(self.adaptor(end)[0])
        flow, motion = (outputs, inputs) if end.takes == "potential" else (inputs, outputs)
        return (*flow, *(name for name in motion if name not in second and name != "a"))

    def not_passed_on(self, ends: Sequence[End]) -> dict[str, float]:
        """Return the inputs of ends that no signal drives: no torque depends on an acceleration."""
        takers = [end for end in ends if end.takes == "potential"]
        return {f"{end.adaptor}.{name}": 0.0 for end in takers for name in signals_of(self.adaptor(end)[0])[2]}

    def started(self, group: int, ends: Sequence[End], values: Mapping[str, float]) -> Assembly:
        """Return a group that starts where the whole drive does; `values` are those of the drive, in SI units."""
        made = self.bare(group, ends)
        model = compile(reduce(flatten(made, open_inputs=True)))
        given: set[int] = set()
        for entry in model.starts:
            if entry.strength != "fixed":
                continue
            owner, _, name = model.flat_variables[entry.node].path.rpartition(".")
            if entry.state is not None and entry.state[0] not in given:
                given.add(entry.state[0])
            else:  # what is no state follows, and two start values of one motion could contradict each other
                made.find(owner)._starts.pop(name, None)
        for place, path in enumerate(model.states):
            if place not in given and path in values:
                made.set(path, values[path])
        return made

    def _parameters(self, group: int, parts: Iterable[Component | list[Component]]) -> dict[str, Any]:
        """Return the netlist's own parameters that the parts need."""
        needed: dict[str, None] = {}
        queue = [name for part in parts for name in _names(part)]
        for name in queue:
            if "." in name:
                self._check_inside(group, name)
            elif name in self.assembly.fields and name not in needed:
                needed[name] = None
                value = self.assembly.value(name)
                queue += value.formula.names() if value is not None and value.formula is not None else ()
        return {name: value_text(self.assembly, name) for name in self.assembly.fields if name in needed}

    def _check_inside(self, group: int, path: str) -> None:
        if part_of(path) in self.assembly._parts and part_of(path) not in self.found.groups[group]:
            raise NetlistError(
                f"A formula needs {path}, which the cut puts into another FMU.",
                why=f"It stands in one of {', '.join(self.found.groups[group])}.",
                advice="Give both parts a parameter of the netlist: [parameters].",
            )


def _names(part: Component | list[Component]) -> list[str]:
    """Return the names in the formulas of a part."""
    components = [one for item in (part if isinstance(part, list) else [part]) for one in item.walk()]
    values = [value for one in components for value in (*one._values.values(), *one._starts.values())]
    formulas: list[Formula] = [value.formula for value in values if value.formula is not None]
    return [name for formula in formulas for name in formula.names()]
