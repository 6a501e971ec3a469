"""Errors of the run-time in C, written from its codes as the errors of the same name in Python are written."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from modelica_like.compile.compiled import CompiledDae, CompiledTransition, Vector
from modelica_like.errors import (
    Chattering,
    ContradictingValue,
    InitializationError,
    LimitPassed,
    ModelicaLikeError,
    NoGradient,
    SolveError,
    Source,
)
from modelica_like.language.fields import out_of_range
from modelica_like.language.transition import NAME_IN_NOTICE
from modelica_like.native.codes import WORDED, Code
from modelica_like.native.endless import SWITCHING, chattering, not_settled, stays_true
from modelica_like.options import Options
from modelica_like.solve.idas import Integrator
from modelica_like.solve.initialize import (
    Point,
    StartKind,
    call,
    contradiction,
    implicit_singular,
    memory_not_steady,
    mode_not_steady,
    no_valid_modes,
    not_found,
    not_met,
    not_solved,
    not_steady,
    rate_not_finite,
    same_motion,
    singular_block,
    unsettled,
)
from modelica_like.solve.recorder import Event


@dataclass(frozen=True)
class Failure:
    """What has failed, and where.

    Attributes:
        model: with the present parameters and inputs.
        start: kind of start of the run.
        code: what.
        place: number of the transition, state, …, by the letter in the sentence of codes.h; -1: none.
        name: of the variable, if the place is its value reference.
        numbers: of the sentence.
        point: where the run stands.
        before: d before the last change.
        sentence: as C tells it.
        events: of the run so far.
        options: of the run.
    """

    model: CompiledDae
    start: StartKind
    code: Code
    place: int
    name: str
    numbers: tuple[float, float]
    point: Point
    before: Vector
    sentence: str
    events: Sequence[Event]
    options: Options

    @property
    def transition(self) -> CompiledTransition:
        """The one at `place`."""
        return self.model.events.transitions[self.place]

    @property
    def what(self) -> str:
        """The sentence without its advice."""
        return f"{self.sentence.partition('. ')[0].removesuffix('.')}."


def error_of(failure: Failure) -> ModelicaLikeError:
    """Return the error to be raised."""
    if failure.code in WRITTEN:
        return WRITTEN[failure.code](failure)
    return WORDED[failure.code](failure.what, advice=failure.sentence.partition(". ")[2])


def _starts_contradict(failure: Failure) -> ModelicaLikeError:
    starts = failure.model.starts.entries
    position, factor = starts[failure.place].state or (0, 1.0)
    others = ((k, entry.state) for k, entry in enumerate(starts) if entry.strength == "fixed" and entry.state)
    earlier, of_earlier = next((k, state[1]) for k, state in others if state[0] == position)
    values = failure.numbers[0] * of_earlier, failure.numbers[1] * factor
    return same_motion(failure.model, (earlier, values[0]), (failure.place, values[1]))


def _start_not_met(failure: Failure) -> ModelicaLikeError:
    model = failure.model
    values = call(model, model.equations.variables, failure.point)
    return not_met(model, values, failure.place, failure.numbers[0])


def _start_not_found(failure: Failure) -> ModelicaLikeError:
    try:
        return not_found(failure.model, failure.start, failure.point)
    except (SolveError, InitializationError) as error:  # singular equations are the reason
        return error


def _step_too_small(failure: Failure) -> ModelicaLikeError:
    return Integrator(failure.model, failure.options).failure(failure.what, failure.point)


def _ever_faster(failure: Failure) -> ModelicaLikeError:
    return _endless(failure, "Events follow each other ever faster")


def _still_switching(failure: Failure) -> ModelicaLikeError:
    return _endless(failure, SWITCHING.format(int(failure.numbers[0])))


def _endless(failure: Failure, why: str) -> Chattering:
    if failure.events:
        return chattering(failure.model, failure.events, why, failure.options.on_chattering)
    where = [failure.transition.source] if failure.place >= 0 else ()
    return Chattering(failure.what, where=where, advice=failure.sentence.partition(". ")[2])


def _not_settled(failure: Failure) -> ModelicaLikeError:
    rounds = int(failure.numbers[1])
    return not_settled(failure.model, failure.point, rounds) or _endless(failure, SWITCHING.format(rounds))


def _out_of_range(failure: Failure) -> ModelicaLikeError:
    parameter = failure.model.flat_parameters[failure.model.parameter_position[failure.name]]
    most = "least" if failure.code is Code.BELOW_LEAST else "most"
    return out_of_range(f"{failure.numbers[0]:g}", failure.name, str(parameter.unit), most, failure.numbers[1])


def _new_value_contradicts(failure: Failure) -> ModelicaLikeError:
    variable, (time, value) = failure.model.flat_variables[failure.place], failure.numbers
    return ContradictingValue(
        f"At {time:.9g} s {variable.path} cannot become {value:g} {variable.unit}: something else determines it, what "
        "prescribes its motion or another new value.",
        where=_of_resets(failure.model, "value", failure.place),
        advice="Give a new value to what is free to take it only, and to one of those that follow from each other.",
    )


def _two_new_values(failure: Failure) -> ModelicaLikeError:
    return ContradictingValue(
        f"At {failure.numbers[0]:.9g} s {failure.model.states[failure.place]} gets two new values.",
        where=_of_resets(failure.model, "state", failure.place),
        advice="Give one to each motion only: what is coupled rigidly follows.",
    )


def _of_resets(model: CompiledDae, kind: str, place: int) -> list[Source]:
    """Source lines that give a state, or a variable by its number, a new value."""
    events = model.events
    resets = [(reset, transition.source) for transition in events.transitions for reset in transition.resets]
    resets += [(row.reset, row.source) for row in events.update_rows]
    given = ((reset, source) for reset, source in resets if reset.kind == kind and reset.factor)
    places = ((events.reset_nodes[reset.target] if kind == "value" else reset.index, of) for reset, of in given)
    return list(dict.fromkeys(source for number, source in places if number == place))


def _no_real(failure: Failure) -> ModelicaLikeError:
    what = "an array" if failure.code is Code.OF_ARRAY else "no real number"
    return NoGradient(f"{failure.name} is {what}: it has no derivatives.")


def _not_asked(_: Failure) -> ModelicaLikeError:
    return NoGradient("No derivatives were asked for.", advice='Name parameters, inputs or start values: by=["J.J"].')


def limit_passed(model: CompiledDae, now: Point, transition: CompiledTransition) -> LimitPassed:
    """Return the error of a transition that ends the run; its notice tells values of the present point."""
    owner, dot, _ = model.flat_discretes[transition.mode].path.rpartition(".")
    notice = NAME_IN_NOTICE.sub(lambda name: _told(model, now, owner + dot + name[1]), transition.notice)
    return LimitPassed(f"At {now.t:.9g} s {owner or model.name} {notice}.")


def _told(model: CompiledDae, now: Point, path: str) -> str:
    """Return a parameter, variable or discrete value as a number."""
    if path in model.position:
        return f"{call(model, model.equations.variables, now)[model.position[path]]:g}"
    if path in model.discrete_position:
        return f"{now.d[model.discrete_position[path]]:g}"
    if path in model.derived_position:
        return f"{float(model.equations.derived(model.p)[model.derived_position[path]]):g}"
    return f"{model.p[model.parameter_position[path]]:g}"


WRITTEN: dict[Code, Callable[[Failure], ModelicaLikeError]] = {
    Code.STARTS_CONTRADICT: _starts_contradict,
    Code.START_NOT_MET: _start_not_met,
    Code.START_NOT_FOUND: _start_not_found,
    Code.START_NOT_SETTLED: lambda f: unsettled(f.model, f.before, f.point.d),
    Code.NOT_STEADY: lambda f: not_steady(f.model, f.point),
    Code.MODE_NOT_STEADY: lambda f: mode_not_steady(f.model, f.point, f.transition),
    Code.MEMORY_NOT_STEADY: lambda f: memory_not_steady(f.model, f.point, f.before),
    Code.UNKNOWN_SINGULAR: lambda f: implicit_singular(f.model, f.point),
    Code.BLOCK_SINGULAR: lambda f: singular_block(f.model, f.point, f.place),
    Code.IMPLICIT_SINGULAR: lambda f: implicit_singular(f.model, f.point),
    Code.NOT_SOLVED: lambda f: not_solved(f.model, f.point),
    Code.RATE_NOT_FINITE: lambda f: rate_not_finite(f.model, f.point, f.place),
    Code.STEP_TOO_SMALL: _step_too_small,
    Code.LIMIT_PASSED: lambda f: limit_passed(f.model, f.point, f.transition),
    Code.EVER_FASTER: _ever_faster,
    Code.NOT_SETTLED: _not_settled,
    Code.STILL_SWITCHING: _still_switching,
    Code.STAYS_TRUE: lambda f: stays_true(f.model, f.point, f.transition),
    Code.TWO_NEW_VALUES: _two_new_values,
    Code.NEW_VALUE_CONTRADICTS: _new_value_contradicts,
    Code.NO_VALID_MODES: lambda f: no_valid_modes(f.model, f.point, f.place),
    Code.CONTRADICTS: lambda f: contradiction(f.model, f.point, f.place),
    Code.BELOW_LEAST: _out_of_range,
    Code.ABOVE_MOST: _out_of_range,
    Code.OF_ARRAY: _no_real,
    Code.NOT_REAL: _no_real,
    Code.NOT_ASKED: _not_asked,
}
