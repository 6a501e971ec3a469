"""Cut a netlist: separate connections, and divide the parts into groups."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from modelica_like.errors import ModelicaLikeError, NetlistError, Source, UnknownName, did_you_mean
from modelica_like.language import Assembly, Connector
from modelica_like.language.equation import Connection
from modelica_like.language.expr import Symbol
from modelica_like.language.inside import inside
from modelica_like.language.places import located

_TRIED, _SHOWN = 40, 8
"""Parts that are tried and named for a list of possible cuts."""


@dataclass(frozen=True)
class Wire:
    """Paths of connectors that are joined, or of an output and the inputs that take its value (`signal`)."""

    name: str
    ends: tuple[str, ...]
    signal: bool
    source: Source


@dataclass(frozen=True)
class Cut:
    """A separated connection: the named end, or the output of a signal, and all other ends."""

    name: str
    near: str
    far: tuple[str, ...]
    signal: bool
    source: Source


@dataclass(frozen=True)
class CutNetlist:
    """A netlist in groups of parts, by their names: `wires` lie inside the groups, `cuts` between them."""

    groups: tuple[tuple[str, ...], ...]
    wires: tuple[Wire, ...]
    cuts: tuple[Cut, ...]

    def group_of(self, path: str) -> int:
        """Return the number of the group in which an end lies."""
        return next(k for k, group in enumerate(self.groups) if part_of(path) in group)


def part_of(path: str) -> str:
    """Return the name of the part (or of the array of parts) to which a path belongs."""
    return path.partition(".")[0].partition("[")[0]


def cut_netlist(assembly: Assembly, at: Sequence[str]) -> CutNetlist:
    """Cut a netlist behind parts, at ends (`shaft.flange_a`), or at entries of `[connect]`.

    Raises:
        UnknownName: there is no such shaft.
        NetlistError: the place cannot be cut, or the cut does not separate the netlist.
    """
    if not at:
        raise NetlistError(f"{assembly.label}: it is not said where to cut.", advice=_places(assembly))
    wires = _joined(_wires(assembly))
    cuts: dict[Wire, Cut] = {}
    for name in at:
        wire, cut = _find(assembly, wires, name)
        cuts.setdefault(wire, cut)
    kept = [wire for wire in wires if wire not in cuts]
    kept += [replace(wire, ends=cut.far) for wire, cut in cuts.items() if len(cut.far) > 1 and not cut.signal]
    result = CutNetlist(_groups(assembly, kept), tuple(kept), tuple(cuts.values()))
    for cut in result.cuts:
        _check_apart(assembly, result, cut)
    return result


def _places(assembly: Assembly) -> str:
    """Return a sentence with the parts behind which one cut separates the netlist."""
    places: list[str] = []
    for name in [*assembly.parts][:_TRIED]:
        with suppress(ModelicaLikeError):
            cut_netlist(assembly, [name])
            places.append(name)
    if not places:
        return "No single cut behind a part separates it; --at can be given several times, also for ends of parts."
    more = ", …" if len(places) > _SHOWN else ""
    return f"It can be cut at {', '.join(places[:_SHOWN])}{more}, as in --at {places[0]}."


def _wires(assembly: Assembly) -> list[Wire]:
    """Return all connections of the netlist itself, those of series named after their parts."""
    names = {ends: name for name, ends in assembly.wires.items()}
    wires: list[Wire] = []
    for statement, _ in located(assembly.equations()):
        if not isinstance(statement, Connection):
            continue
        ends = tuple(_path(end) for end in statement.ends)
        if any("." not in end for end in ends):  # the netlist's own outer connector
            continue
        named = names.get(ends, "_".join(part.replace(".", "_") for part in map(_owner, ends)))
        wires.append(Wire(named, ends, not isinstance(statement.ends[0], Connector), statement.source))
    return wires


def _path(end: Connector | Symbol) -> str:
    return end.path if isinstance(end, Connector) else ".".join(filter(None, (end.owner.path, end.name)))


def _owner(path: str) -> str:
    return path.rpartition(".")[0].replace("[", "_").replace("]", "")


def _joined(wires: Iterable[Wire]) -> list[Wire]:
    """Join wires that share an end."""
    joined: list[Wire] = []
    for wire in wires:
        touching = [*(other for other in joined if set(other.ends) & set(wire.ends)), wire]
        ends = tuple(dict.fromkeys(end for other in touching for end in other.ends))
        joined = [*(other for other in joined if other not in touching), replace(touching[0], ends=ends)]
    return joined


# -- what is meant by a name -------------------------------------------------------------------------------------------


def _find(assembly: Assembly, wires: Sequence[Wire], name: str) -> tuple[Wire, Cut]:
    near = _near_end(assembly, wires, name)
    wire = next((w for w in wires if near in w.ends), None)
    if wire is None:
        raise NetlistError(f"{near} is connected to nothing, so there is nothing to cut.")
    if wire.signal:  # a value goes from an output to inputs
        near = next((end for end in wire.ends if _is_output(assembly, end)), near)
    far = tuple(end for end in wire.ends if end != near)
    if wire.signal:
        for opened in far:
            owner, _, input_name = opened.rpartition(".")
            if assembly.find(owner).value(input_name) is not None:
                raise NetlistError(
                    f"{opened} has a default value, so it does not become an input of an FMU.",
                    advice="Cut at a shaft, or at a signal whose inputs have no default.",
                )
    return wire, Cut(as_name(name), near, far, wire.signal, wire.source)


def _near_end(assembly: Assembly, wires: Sequence[Wire], name: str) -> str:
    """Return the end that a name means."""
    if name in assembly.wires:
        ends = assembly.wires[name]
        first, *others = ends
        if len(others) > 1 and any(wire.ends == ends and not wire.signal for wire in wires):
            raise NetlistError(
                f"{name} joins {len(ends)} ends: {', '.join(ends)}.", where=assembly.source_of(f"connect.{name}"),
                advice="Name the end to cut off.",
            )  # fmt: skip
        return first
    connected = [end for wire in wires for end in wire.ends]
    if name in connected:
        return name
    part = assembly.parts.get(name)
    if part is None:
        raise _nowhere(assembly, name, connected)
    ends = [f"{name}.{end}" for end in part.connectors if f"{name}.{end}" in connected]
    if len(part.connectors) < 2 and len(ends) == 1:
        return ends[0]
    try:
        behind = f"{name}.{part.outlet_connector().path.rpartition('.')[2]}"
        before = f"{name}.{part.inlet_connector().path.rpartition('.')[2]}"
    except UnknownName:
        listing = ", ".join(ends) or "none that is connected"
        raise NetlistError(f"It is not clear where to cut {name}.", advice=f"Name an end: {listing}.") from None
    return behind if behind in connected else before


def _nowhere(assembly: Assembly, name: str, connected: Sequence[str]) -> Exception:
    if name in assembly.chains:
        chain = ", ".join(assembly.chains[name])
        return NetlistError(
            f"{name} is a whole series: {chain}.", where=assembly.source_of(f"series.{name}"),
            advice="Name the part behind which to cut.",
        )  # fmt: skip
    if part_of(name) in inside(assembly).parts and name.count(".") > 1:
        return NetlistError(
            f"{name} is inside {part_of(name)}; only connections of the netlist itself can be cut.",
            advice=f"Split {part_of(name)}'s own netlist, or cut at one of its ends.",
        )
    paths = [*assembly.parts, *assembly.wires, *connected]
    return UnknownName(
        f"{assembly.label} has no shaft '{name}'{did_you_mean(name, paths) or '.'}",
        why="A name is a part (it is cut behind it), one of its ends (shaft.flange_a), or an entry of [connect].",
        advice=_places(assembly),
    )


def _is_output(assembly: Assembly, path: str) -> bool:
    owner, _, name = path.rpartition(".")
    return type(assembly.find(owner).fields[name]).__name__ == "Output"


def as_name(text: str) -> str:
    """Return the path of an end as a name: of a cut, or of the adaptor there."""
    return text.replace(".", "_").replace("[", "_").replace("]", "")


# -- groups ------------------------------------------------------------------------------------------------------------


def _groups(assembly: Assembly, wires: Iterable[Wire]) -> tuple[tuple[str, ...], ...]:
    names = list(inside(assembly).parts)
    groups = [{name} for name in names]
    for wire in wires:
        parts = {part_of(end) for end in wire.ends}
        groups = [group for group in groups if not group & parts] + [
            parts.union(*(group for group in groups if group & parts))
        ]
    return tuple(
        sorted((tuple(sorted(group, key=names.index)) for group in groups), key=lambda group: names.index(group[0]))
    )


def _check_apart(assembly: Assembly, netlist: CutNetlist, cut: Cut) -> None:
    inside = [end for end in cut.far if netlist.group_of(end) == netlist.group_of(cut.near)]
    if not inside or (cut.signal and len(inside) < len(cut.far)):
        return
    near, far = part_of(cut.near), part_of(inside[0])
    if near == far:
        raise NetlistError(f"{cut.near} is inside the array {near}, which cannot be cut.", where=cut.source)
    ways = {near: [near]}
    for part in (queue := [near]):
        for wire in netlist.wires:
            parts = [part_of(e) for e in wire.ends]
            for other in parts if part in parts else ():
                if other not in ways:
                    ways[other] = [*ways[part], other]
                    queue.append(other)
    raise NetlistError(
        f"{assembly.label} does not separate between {cut.near} and {inside[0]}.", where=cut.source,
        why=f"{near} and {far} are also joined by {' – '.join(ways[far])}.",
        advice="Cut there as well: --at can be given several times.",
    )  # fmt: skip
