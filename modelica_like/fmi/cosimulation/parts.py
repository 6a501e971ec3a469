"""The groups of a cut drive: which side of a cut receives the motion and which the torque, and their netlists."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, Literal

from modelica_like.compile import compile
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import ModelicaLikeError, NetlistError, StructureError
from modelica_like.flatten import flatten
from modelica_like.fmi.cosimulation.cut import Cut, CutNetlist, as_name, part_of
from modelica_like.fmi.dependencies import Following
from modelica_like.fmi.terminals import adaptor_for, connector_at
from modelica_like.language import Assembly, Component, guess
from modelica_like.language.fields import Input, Output
from modelica_like.language.formula import Formula
from modelica_like.language.inside import declarations, inside
from modelica_like.netlist.convert import value_text
from modelica_like.structure import reduce

Takes = Literal["flow", "potential"]
_MOST = 8


@dataclass(frozen=True)
class End:
    """An open end of a group: its adaptor, its path, and the quantity received from the other side."""

    adaptor: str
    path: str
    takes: Takes


def ends_of(cut: Cut, near_takes: Takes) -> tuple[End, End]:
    """Return both ends of a cut; the names of their adaptors are those of the ends."""
    other: Takes = "flow" if near_takes == "potential" else "potential"
    near, far = cut.near, cut.far[0]
    return End(as_name(near), near, near_takes), End(as_name(far), far, other)


class Maker:
    """Makes the netlists of the groups of a cut netlist."""

    def __init__(self, assembly: Assembly, cut: CutNetlist) -> None:
        self.assembly, self.found = assembly, cut
        self._tried: dict[tuple[int, tuple[End, ...]], str] = {}

    def open_ends(self, group: int, chosen: Mapping[Cut, Takes]) -> list[End]:
        """Return the open shaft ends of a group."""
        ends = [end for cut, near_takes in chosen.items() for end in ends_of(cut, near_takes)]
        return [end for end in ends if self.found.group_of(end.path) == group]

    def objection(self, group: int, chosen: Mapping[Cut, Takes]) -> str:
        """Return why a group cannot have these ends, or an empty text; every case is tried once."""
        case = group, tuple(self.open_ends(group, chosen))
        if case not in self._tried:
            self._tried[case] = self._tell(*case)
        return self._tried[case]

    def _tell(self, group: int, ends: Sequence[End]) -> str:
        try:
            assembly = self.bare(group, ends)
            model = compile(reduce(flatten(assembly, open_inputs=True)))
        except StructureError as error:
            return error.what.rstrip(".")
        return next(filter(None, (_bad_end(model, assembly, end) for end in ends)), "")

    def bare(self, group: int, ends: Sequence[End]) -> Assembly:
        """Return a group with adaptors at its open ends, and the given start values of its parts."""
        names = self.found.groups[group]
        parts: dict[str, Any] = {name: inside(self.assembly).parts[name] for name in names}
        wires = {wire.name: wire.ends for wire in self.found.wires if part_of(wire.ends[0]) in names}
        for end in ends:
            parts[end.adaptor], inner = self.adaptor(end)
            wires[end.adaptor] = (end.path, f"{end.adaptor}.{inner}")
        free = [end for end in self.assembly.free_ends if part_of(end) in names]
        parameters = self._parameters(group, parts.values())
        part = Assembly(
            f"{self.assembly.label}_{names[0]}", parts=parts, connect=wires, free=free, parameters=parameters
        )
        # The part starts with numbers, whatever the kind of start of the drive.
        inside(part).simulate = {**inside(self.assembly).simulate, "start": "given"}
        return part

    def adaptor(self, end: End) -> tuple[Component, str]:
        """Return an adaptor for an end, without acceleration, and the name of its connector."""
        kind, inner = adaptor_for(connector_at(self.assembly, end.path), end.takes)
        return kind(**({"use_a": False} if "use_a" in declarations(kind).structural else {})), inner

    def members(self, end: End) -> tuple[str, ...]:
        """Return the signals that pass an end: the flow, the potential, and its rate."""
        outputs, inputs, second = signals_of(self.adaptor(end)[0])
        flow, motion = (outputs, inputs) if end.takes == "potential" else (inputs, outputs)
        return (*flow, *(name for name in motion if name not in second and name != "a"))

    def not_passed_on(self, ends: Sequence[End]) -> dict[str, float]:
        """Return the undriven inputs of ends: no torque depends on an acceleration."""
        takers = [end for end in ends if end.takes == "potential"]
        return {f"{end.adaptor}.{name}": 0.0 for end in takers for name in signals_of(self.adaptor(end)[0])[2]}

    def started(self, group: int, ends: Sequence[End], values: Mapping[str, float]) -> Assembly:
        """Return a group that starts like the whole drive; `values` are those of the drive, in SI units."""
        part = self.bare(group, ends)
        model = compile(reduce(flatten(part, open_inputs=True)))
        given, kept = set[int](), dict[str, float]()
        for entry in model.starts.entries:
            if entry.strength != "fixed":
                continue
            path = model.flat_variables[entry.node].path
            owner, _, name = path.rpartition(".")
            if entry.state is not None and entry.state[0] not in given:
                given.add(entry.state[0])
            elif entry.state is None and path in values and model.following:
                kept[path] = values[path]  # states that follow the motion have no start values of their own
            else:  # other variables follow, and two start values of one motion could contradict each other
                inside(part.find(owner)).starts.pop(name, None)
        for place, path in enumerate(model.states):
            if place not in given and path in values:
                part.set(path, values[path])
        moved = (path for some in model.following.values() for path in some if path in values)
        for path, value in ({path: guess(values[path]) for path in moved} | kept).items():
            part.set(path, value)
        return part

    def _parameters(self, group: int, parts: Iterable[Component | list[Component]]) -> dict[str, Any]:
        """Return the netlist's own parameters that the parts need."""
        needed: dict[str, None] = {}
        queue = [name for part in parts for name in _names(part)]
        for name in queue:
            if "." in name:
                if part_of(name) in inside(self.assembly).parts and part_of(name) not in self.found.groups[group]:
                    raise NetlistError(
                        f"A formula needs {name}, which the cut puts into another FMU.",
                        why=f"It is in one of {', '.join(self.found.groups[group])}.",
                        advice="Give both parts a parameter of the netlist: [parameters].",
                    )
            elif name in self.assembly.fields and name not in needed:
                needed[name] = None
                value = self.assembly.value(name)
                queue += value.formula.names() if value is not None and value.formula is not None else ()
        return {name: value_text(self.assembly, name) for name in self.assembly.fields if name in needed}


def _names(part: Component | list[Component]) -> list[str]:
    """Return the names in the formulas of a part."""
    components = [node for item in (part if isinstance(part, list) else [part]) for node in item.walk()]
    values = [
        value
        for component in components
        for value in (*inside(component).values.values(), *inside(component).starts.values())
    ]
    formulas: list[Formula] = [value.formula for value in values if value.formula is not None]
    return [name for formula in formulas for name in formula.names()]


def signals_of(adaptor: Component) -> tuple[list[str], list[str], list[str]]:
    """Return outputs, inputs, and those of the inputs that are second derivatives."""
    rates = adaptor.terminal.rates if adaptor.terminal else ()
    firsts = {rate for _, rate in rates}
    second = [rate for name, rate in rates if name in firsts]
    inputs = [name for name, field in adaptor.fields.items() if isinstance(field, Input)]
    return [name for name, field in adaptor.fields.items() if isinstance(field, Output)], inputs, second


# -- causality of the ends ---------------------------------------------------------------------------------------------


def orient(maker: Maker) -> dict[Cut, Takes]:
    """Decide what the near side of each cut shaft receives, or raise a NetlistError that says why neither works.

    The side with a spring or damper at the cut receives angle and speed and returns a torque that depends on
    no acceleration. The side with an inertia receives the torque; its angle and speed are states.
    """
    cuts = [cut for cut in maker.found.cuts if not cut.signal]
    if len(cuts) > _MOST:
        raise NetlistError(f"{len(cuts)} cuts at once are too many; {_MOST} are possible.")
    for chosen in _choices(cuts):
        if not any(maker.objection(k, chosen) for k in range(len(maker.found.groups))):
            return chosen
    raise _impossible(maker, cuts)


def _choices(cuts: Sequence[Cut]) -> Iterator[dict[Cut, Takes]]:
    sides: list[Takes] = ["potential", "flow"]
    for choice in product(sides, repeat=len(cuts)):
        yield dict(zip(cuts, choice, strict=True))


def _bad_end(model: CompiledDae, assembly: Assembly, end: End) -> str:
    """Return a forbidden dependence of an end's output."""
    outputs, inputs, second = signals_of(assembly.parts[end.adaptor])
    wrong = second if end.takes == "potential" else inputs
    depends = Following(model)
    names = [model.flat_variables[k].path for k in model.inputs]
    for name in outputs:
        follows = {names[k] for k in depends.inputs_of(model.position[f"{end.adaptor}.{name}"])}
        causes = follows & {f"{end.adaptor}.{w}" for w in wrong}
        if causes and end.takes == "potential":
            return f"{end.path} is rigid: its {outputs[0]} would depend on the acceleration"
        if causes:
            return f"{end.path} stores no energy: its {outputs[0]} would depend directly on {inputs[0]}"
    return ""


def _impossible(maker: Maker, cuts: Sequence[Cut]) -> ModelicaLikeError:
    """Return the error for the first cut that is impossible in both directions."""
    for cut in cuts:
        sides = [maker.found.group_of(cut.near), maker.found.group_of(cut.far[0])]
        others = [c for c in cuts if c is not cut]
        reasons: dict[str, None] = {}
        for chosen in _choices((cut, *others)):
            objections = [maker.objection(side, chosen) for side in sides]
            if not any(objections):
                break
            reasons.update(dict.fromkeys(filter(None, objections)))
        else:
            return NetlistError(
                f"{cut.name}: neither side of the cut can take the motion while the other takes the load.",
                where=cut.source, why=f"{'; '.join(reasons)}.",
                advice="Cut where a spring or damper on one side meets an inertia on the other.",
            )  # fmt: skip
    return NetlistError("The cuts exclude each other.", advice="Cut at fewer shafts, or at others.")
