"""Which side of a cut is told the motion, and which the torque."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Literal

from modelica_like.compile import compile
from modelica_like.compile.compiled import CompiledDae
from modelica_like.cosimulation.cut import Cut, CutNetlist, as_name
from modelica_like.errors import ModelicaLikeError, NetlistError, StructureError
from modelica_like.flatten import flatten
from modelica_like.fmi.dependencies import Following
from modelica_like.language import Assembly, Component
from modelica_like.language.fields import Input, Output
from modelica_like.structure import reduce

Takes = Literal["flow", "potential"]
_MOST = 8


@dataclass(frozen=True)
class End:
    """An open end of a group of parts.

    Attributes:
        adaptor: name of the adaptor that is added for it.
        path: of a connector at the cut.
        takes: what comes from the other side.
    """

    adaptor: str
    path: str
    takes: Takes


Make = Callable[[int, Sequence[End]], Assembly]
"""Makes the netlist of a group with adaptors at its open ends."""
Objection = Callable[[int, Mapping[Cut, Takes]], str]
"""Tells what speaks against a choice in a group, or an empty text."""


def ends_of(cut: Cut, near_takes: Takes) -> tuple[End, End]:
    """Return both ends of a cut; the names of their adaptors are those of the ends."""
    other: Takes = "flow" if near_takes == "potential" else "potential"
    near, far = cut.near, cut.far[0]
    return End(as_name(near), near, near_takes), End(as_name(far), far, other)


def orient(found: CutNetlist, make: Make) -> dict[Cut, Takes]:
    """Decide for each cut shaft what its near side takes.

    The side with a spring or damper at the cut is told angle and speed, and gives a torque that depends on no
    acceleration; the side with an inertia is told the torque, and its angle and speed are states.

    Raises:
        NetlistError: there is no such choice.
    """
    cuts = [cut for cut in found.cuts if not cut.signal]
    if len(cuts) > _MOST:
        raise NetlistError(f"{len(cuts)} cuts at once are too many; {_MOST} are possible.")
    objection = _trial(found, make)
    for chosen in _choices(cuts):
        if all(not objection(k, chosen) for k in range(len(found.groups))):
            return chosen
    raise _impossible(found, objection, cuts)


def _choices(cuts: Sequence[Cut]) -> Iterator[dict[Cut, Takes]]:
    sides: list[Takes] = ["potential", "flow"]
    for choice in product(sides, repeat=len(cuts)):
        yield dict(zip(cuts, choice, strict=True))


def _trial(found: CutNetlist, make: Make) -> Objection:
    """Return what tells why a group of parts cannot have its ends so; every case is tried once."""

    @cache
    def tried(group: int, ends: tuple[End, ...]) -> str:
        try:
            assembly = make(group, ends)
            model = compile(reduce(flatten(assembly, open_inputs=True)))
        except StructureError as error:
            return error.what.rstrip(".")
        return next(filter(None, (_bad_end(model, assembly, end) for end in ends)), "")

    return lambda group, chosen: tried(group, tuple(open_ends(found, group, chosen)))


def open_ends(found: CutNetlist, group: int, chosen: Mapping[Cut, Takes]) -> list[End]:
    """Return the open shaft ends of a group."""
    return [
        end
        for cut, near_takes in chosen.items()
        for end in ends_of(cut, near_takes)
        if found.group_of(end.path) == group
    ]


def signals_of(adaptor: Component) -> tuple[list[str], list[str], list[str]]:
    """Return outputs, inputs, and those of the inputs that are second derivatives."""
    rates = adaptor.terminal.rates if adaptor.terminal else ()
    firsts = {rate for _, rate in rates}
    second = [rate for name, rate in rates if name in firsts]
    inputs = [name for name, field in adaptor.fields.items() if isinstance(field, Input)]
    return [name for name, field in adaptor.fields.items() if isinstance(field, Output)], inputs, second


def _bad_end(model: CompiledDae, assembly: Assembly, end: End) -> str:
    """Return what the answer of an end must not depend on, but does."""
    outputs, inputs, second = signals_of(assembly.parts[end.adaptor])
    wrong = second if end.takes == "potential" else inputs
    depends = Following(model)
    names = [model.flat_variables[k].path for k in model.inputs]
    for name in outputs:
        follows = {names[k] for k in depends.inputs_of(model.position[f"{end.adaptor}.{name}"])}
        found = follows & {f"{end.adaptor}.{one}" for one in wrong}
        if found and end.takes == "potential":
            return f"{end.path} is rigid: its {outputs[0]} would depend on the acceleration"
        if found:
            return f"{end.path} stores nothing: its {outputs[0]} would follow {inputs[0]} at once"
    return ""


def _impossible(found: CutNetlist, objection: Objection, cuts: Sequence[Cut]) -> ModelicaLikeError:
    """Tell for the first cut that cannot be made in either way why."""
    for cut in cuts:
        sides = [found.group_of(cut.near), found.group_of(cut.far[0])]
        others = [one for one in cuts if one is not cut]
        reasons: dict[str, None] = {}
        for chosen in _choices((cut, *others)):
            objections = [objection(side, chosen) for side in sides]
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
