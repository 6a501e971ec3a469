"""Notes about probable mistakes, never errors."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

import numpy as np

from modelica_like.compile.compiled import Vector
from modelica_like.errors import MissingValue, ModelicaLikeError
from modelica_like.flatten.template import template_of
from modelica_like.language.assembly import Assembly
from modelica_like.language.component import Component
from modelica_like.language.fields import Input, Output, Parameter
from modelica_like.language.inside import inside
from modelica_like.language.units import parse_unit
from modelica_like.runs.solution import Solution
from modelica_like.runs.trajectories import Trajectories
from modelica_like.show.draw.diagram import Diagram, Node, diagram
from modelica_like.show.report.driven import driven_notes
from modelica_like.structure.holds import HeldMotion

_FAR = 1e4
"""Ratio between neighbours above which one of them probably has the wrong unit."""
_NEAR, _DAMPED = 0.1, 0.1
"""Distance of an eigenfrequency from an excitation, and damping above which it does not matter."""
_ROUNDING = 1e-6
_COMPARED = {
    "kg.m2": ("inertia", "kg.cm2 for kg.m2"), "kg": ("mass", "g for kg"),
    "N.m/rad": ("stiffness", "N.m/rad for kN.m/rad"), "N/m": ("stiffness", "N/m for kN/m"),
}  # fmt: skip
_PASSED = (*_COMPARED, "N.m.s/rad", "N.s/m")
_HERTZ = parse_unit("Hz")


def drive_notes(drive: Component) -> list[str]:
    """Return notes about probable mistakes in a drive, before a run.

    What its reader took that the file does not say, neighbours whose inertias, masses or stiffnesses are four decades
    apart, unused signals, and values without effect.

    Args:
        drive: the drive.
    """
    drawn = diagram(drive, 0)
    remarks = inside(drive).remarks if isinstance(drive, Assembly) else ()
    return [*remarks, *_neighbours(drawn), *_unread(drawn), *_without_effect(drive)]


def run_notes(drive: Component, run: Solution, *, energy: bool = True) -> list[str]:
    """Return notes about probable mistakes in a run.

    Clutches that never engage, brakes that are never opened, weights and loads that drive, variables beyond their
    declared range, and excitations near a natural frequency.

    Args:
        drive: the drive.
        run: its run.
        energy: also what energies tell, which takes time.
    """
    idle = [*dict.fromkeys(hold.component for hold in run.model.held.motions if _idle(drive, run, hold))]
    names = " and ".join(filter(None, [", ".join(idle[:-1]), *idle[-1:]]))
    held = dict.fromkeys(note for hold in run.model.held.motions for note in _unopened(drive, run, hold))
    verb = "engages: its input is" if len(idle) == 1 else "engage: their inputs are"
    return [
        *([f"{names} never {verb} 0 during the whole run."] if idle else []),
        *held,
        *(driven_notes(diagram(drive, 0), run) if energy else ()),
        *_beyond(run),
        *_resonances(drive, run),
    ]


def notes(drive: Component, run: Trajectories, *, energy: bool = True) -> list[str]:
    """Return all notes about a drive and its run; see `drive_notes` and `run_notes`."""
    return [*drive_notes(drive), *(run_notes(drive, run, energy=energy) if isinstance(run, Solution) else [])]


def _neighbours(drawn: Diagram) -> Iterator[str]:
    joined: dict[Node, set[Node]] = {node: set() for node in drawn.nodes}
    for net in drawn.nets:
        others = {port.node for port in net.ports if not port.signal}
        for node in {port.node for port in net.ports} & joined.keys():
            joined[node] |= others
    for unit, (what, slip) in _COMPARED.items():
        sized = {node: amount for node in joined if (part := node.component) and (amount := _size(part, unit))}
        pairs = set[frozenset[str]]()
        for node, (name, value) in sized.items():
            reached, pending = {node}, deque([node])
            while pending:
                for other in joined[pending.popleft()] - reached:
                    reached.add(other)
                    if other not in sized:
                        # What else is in between, such as a gear or an assembly, may have a ratio.
                        if other.component and any(_size(other.component, kind) for kind in _PASSED):
                            pending.append(other)
                        continue
                    near, size = sized[other]
                    pair = frozenset((name, near))
                    if value > _FAR * size and pair not in pairs:
                        pairs.add(pair)
                        yield (
                            f"{name} is {value / size:.2g} times {near}: is the {what} of one of them in the wrong "
                            f"unit ({slip})?"
                        )


def _size(part: Component, unit: str) -> tuple[str, float] | None:
    """Return name and value of a part's parameter of a unit, if it has one that is not zero."""
    wanted = parse_unit(unit)
    if part.parts:
        return None
    for name, field in part.fields.items():
        if not isinstance(field, Parameter) or field.unit != wanted:
            continue
        value = part.value(name)
        if value is not None and value.number is not None and value.number > 0:
            return f"{inside(part).name}.{name}", value.number
    return None


def _unread(drawn: Diagram) -> Iterator[str]:
    """Blocks whose signals go nowhere; sensors have connectors, and are read in the results."""
    for node in drawn.nodes:
        part = node.component
        if part is None or part.connectors or part.parts:
            continue
        outputs = [name for name, field in part.fields.items() if isinstance(field, Output)]
        if outputs and not any(name in node.ports for name in outputs):
            yield f"Nothing reads {node.name}.{outputs[0]}: connect it, or leave {node.name} out."


def _without_effect(drive: Component) -> Iterator[str]:
    """Values that somebody gave to a part, and that no equation, event, energy or formula reads."""
    parts = [part for part in drive.walk() if part is not drive and _wired_here(part, drive)]
    unread = [(part, name) for part in parts for name in _not_in_equations(part)]
    if unread:
        named = {path.rpartition(".")[2] for part in drive.walk() for path in _named_in_formulas(part)}
        for part, name in unread:
            if name not in named:
                yield f"{part.path}.{name} has no effect: with what else is given nothing reads it."


def _wired_here(part: Component, drive: Component) -> bool:
    owner = inside(part).owner
    return owner is drive or isinstance(owner, Assembly)


def _not_in_equations(part: Component) -> Iterator[str]:
    values = inside(part).values
    # A zero has no effect on purpose.
    given = [name for name in values if isinstance(part.fields.get(name), Parameter) and values[name].number != 0]
    if given:
        read = template_of(part).parameters
        yield from (name for name in given if name not in read)


def _named_in_formulas(part: Component) -> Iterator[str]:
    record = inside(part)
    own = record.values.keys() | record.starts.keys()
    defaults = (f.read(f.default) for name, f in part.fields.items() if isinstance(f.default, str) and name not in own)
    for value in (*record.values.values(), *record.starts.values(), *defaults):
        if value.formula is not None:
            yield from value.formula.names()


def _input(drive: Component, hold: HeldMotion) -> str | None:
    """Return the path of the input of a component that holds, if it has one."""
    fields = _part(drive, hold.component).fields
    inputs = (name for name, field in fields.items() if isinstance(field, Input))
    return next((f"{hold.component}.{name}".lstrip(".") for name in inputs), None)


def _holding(run: Solution, hold: HeldMotion) -> Vector:
    return run[run.model.flat_discretes[hold.mode].path] == hold.number


def _idle(drive: Component, run: Solution, hold: HeldMotion) -> bool:
    path = _input(drive, hold)
    return path is not None and not _holding(run, hold).any() and not run[path].any()


def _unopened(drive: Component, run: Solution, hold: HeldMotion) -> Iterator[str]:
    path, free = _input(drive, hold), {parameter.path for parameter in run.model.flat_parameters}
    if path in free and _holding(run, hold).all():
        value = f"{run[path][0]:g}"
        yield f"{hold.component} holds during the whole run: nothing drives {path}, which is {value} by default."


def _beyond(run: Solution) -> Iterator[str]:
    bounds = [
        (variable, bound, kind)
        for variable in run.model.flat_variables
        for bound, kind in ((variable.max, "max"), (variable.min, "min"))
        if bound is not None
    ]
    try:
        worst = [(float(number), number.time) for number in run.read(*(f"{k}({b.path})" for b, _, k in bounds))]
    except MissingValue:  # what lies beyond a bound among the results is told at least
        places = [(run[b.path], int(getattr(np, f"arg{kind}")(run[b.path]))) for b, _, kind in bounds]
        worst = [(float(values[k]), float(run.time[k])) for values, k in places]
    for (variable, bound, kind), (value, time) in zip(bounds, worst, strict=True):
        beyond, verb = (value - bound, "exceeds") if kind == "max" else (bound - value, "falls below")
        if beyond > _ROUNDING * max(abs(bound), variable.nominal):
            extreme = f"{value:.6g} {variable.unit} at {time:.6g} s"
            yield f"{variable.path} {verb} its declared bound {bound:g} {variable.unit}: it is {extreme}."


def _is_source(part: Component) -> bool:
    """Whether it gives a signal and takes none."""
    kinds = [type(field) for field in part.fields.values()]
    return Output in kinds and Input not in kinds


def _part(drive: Component, path: str) -> Component:
    for name in filter(None, path.split(".")):
        drive = drive.parts[name]
    return drive


def _resonances(drive: Component, run: Solution) -> Iterator[str]:
    excited = {
        parameter.path: value
        for parameter, value in zip(run.model.flat_parameters, run.model.p, strict=True)
        if parameter.unit == _HERTZ and value > 0.0 and _is_source(_part(drive, parameter.path.rpartition(".")[0]))
    }
    if not excited:
        return
    # Few drives are excited; the others need not wait for the analysis to be loaded.
    from modelica_like.analyse.linear.linearize import linearize

    try:
        modes = [mode for mode in linearize(run).modes() if mode.oscillates and mode.damping < _DAMPED]
    except ModelicaLikeError:  # there is no linear model at the end: then there is no note either
        return
    for path, frequency in excited.items():
        near = min(modes, key=lambda mode: abs(mode.frequency - frequency), default=None)
        if near and abs(near.frequency / frequency - 1.0) < _NEAR:
            damping = f"{abs(near.damping):.2g}"
            yield (
                f"{path} = {frequency:.4g} Hz is near the natural frequency {near.frequency:.4g} Hz, whose damping is "
                f"{damping}: expect resonance."
            )
