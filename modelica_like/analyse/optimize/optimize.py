"""The design that is best: least or largest outputs of a run, within bounds and limits, by exact gradients."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from modelica_like.analyse.optimize.chance import Chances
from modelica_like.analyse.optimize.choices import ENUMERATED, Choice, options_of, together, with_choice
from modelica_like.analyse.optimize.designs import FEASIBLE, Outcome, Progress, better, counted
from modelica_like.analyse.optimize.problem import Question, make_problem
from modelica_like.analyse.optimize.promising import FINISHED, TRIALS, promising
from modelica_like.analyse.optimize.result import Chosen, Front, Measured, Optimum
from modelica_like.analyse.optimize.runs import Runs
from modelica_like.analyse.optimize.solve import MOST_STEPS, Search
from modelica_like.analyse.optimize.starts import promising_starts
from modelica_like.analyse.optimize.team import Chain, Team
from modelica_like.analyse.optimize.terms import Row
from modelica_like.analyse.tolerance.tolerance import scatter_of
from modelica_like.arguments import checked
from modelica_like.compile.buffers import Vector
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import LanguageError, ModelicaLikeError, ValueOutOfRange
from modelica_like.language import Assembly, Component
from modelica_like.language.inside import inside
from modelica_like.simulation import Model, loaded, simulate
from modelica_like.solve.initialize import StartKind

_POINTS = 20
_SAME = 1e-5
"""Relative gain in an objective below which two designs are one: ten times as much as limits may be exceeded."""
_AIMS = {"minimize", "maximize"}
_GAIN = 1e-9
"""Of an objective, relative: less is rounding."""
_DIFFERENCE = 1e-3
"""Of an output of the design in a run by IDAS, relative: more is told."""


@checked
def optimize(
    drive: Model, *, minimize: str | Sequence[str] = (), maximize: str | Sequence[str] = (),
    free: Mapping[str, Any] | None = None, subject_to: str | Sequence[str] = (),
    choose: Mapping[str, Any] | None = None, cases: Sequence[Mapping[str, Any]] = (),
    until: float | str | None = None, parameters: Mapping[str, Any] | None = None, start: StartKind | None = None,
    starts: int | None = None, points: int | None = None, seed: int = 0, processes: int = 1,
    tolerances: Mapping[str, Any] | None = None, correlated: Sequence[Mapping[str, Any]] | None = None,
    progress: Progress | None = None,
) -> Optimum | Front:  # fmt: skip
    """Find the best design of a drive.

    What is not given is taken from the section [optimize] of the netlist, where `cases` is called `for`.

    Args:
        drive: a component, a netlist file or a compiled model.
        minimize: an output of a run that is to be small, named as for `sensitivities`; of two, the Pareto front.
            `max(peak(a.tau), peak(b.tau))` is the largest of several.
        maximize: an output that is to be large.
        free: lower and upper bound by path, numbers in SI units or quantities; of a table with two columns
            `{"points": 12, "from": "0 N", "to": "9 kN", "rising": True}` (or `falling`) for its values, or `rows` for
            some of those it has.
        subject_to: limits of outputs, `clutch.lock_time <= 0.4 s`, with <=, >= or ==.
        choose: values by path, `{"clutch.plates": [2, 4, 6]}`, or for a part a CSV table beside the netlist: a row for
            each kind, a column for each parameter, and `name`. Up to 200 combinations are tried; of more Optuna finds
            promising ones. Then nothing need be free.
        cases: load cases, tables of other parameter values with a `name`: limits hold in each, and the worst counts.
        until: end time, as in `simulate`.
        parameters: other values of parameters, in all cases.
        start: kind of start, as in `simulate`.
        starts: number of searches, all but the first from the best of the square of as many native runs, of a Latin
            hypercube between the bounds.
        points: number of designs on a Pareto front; 20 by default.
        seed: of the Latin hypercube.
        processes: how many searches there may be at the same time, from several starts or along a front; more than
            one need `if __name__ == "__main__":` in a script.
        tolerances: how parameters scatter, as in `tolerance`, for limits that must hold with a probability, as
            `P(clutch.lock_time <= 0.4 s) >= 99.9 %`; by default [tolerances] of the netlist.
        correlated: which of them scatter together, as in `tolerance`.
        progress: called after each design with the number of those tried, and about the most that there can be.

    Raises:
        UnknownName, UnitError, ValueOutOfRange: something does not fit the drive; netlists tell file and line.
        NoGradient, ModelicaLikeError: the drive as it is has no derivative, or cannot be run.
        KeyboardInterrupt: the search was interrupted; the note has the best design until then.
    """
    for name, value in (("starts", starts), ("points", points), ("processes", processes)):
        if value is not None and value < 1:
            raise ValueOutOfRange(f"{name} must be at least 1, not {value}.")
    given = {"minimize": _listed(minimize), "maximize": _listed(maximize), "subject_to": _listed(subject_to)}
    given |= {"free": free, "choose": choose, "for": tuple(cases), "starts": starts, "points": points}
    drive, run = loaded(drive), {"parameters": parameters, "until": until, "start": start}
    how = _How(seed, processes)
    return _answer(drive, *_asked(drive, given, run, tolerances, correlated), how, progress)


@dataclass(frozen=True)
class _How:
    """How it is searched: the seed of the starts, and how many searches there may be at the same time."""

    seed: int
    processes: int


def _asked(
    drive: Component | CompiledDae, given: dict[str, Any], run: dict[str, Any], *scattered: Any
) -> tuple[Question, Mapping[str, Any]]:
    """Return the question, and all that is asked for: what is given, and else what the netlist says."""
    written = dict(inside(drive).optimize) if isinstance(drive, Assembly) else {}
    scatter, pairs, folder = scatter_of(drive, *scattered)
    told = {key for key, value in given.items() if value not in (None, ())}
    told |= _AIMS if told & _AIMS else set()
    asked = {**written, **{key: given[key] for key in told}}
    question = Question(
        tuple(asked.get("minimize", ())), tuple(asked.get("maximize", ())), free=asked.get("free"),
        subject_to=tuple(asked.get("subject_to", ())), cases=tuple(asked.get("for", ())), **run, tolerances=scatter,
        correlated=pairs, folder=folder, chosen=bool(asked.get("choose")), written=frozenset(written) - told,
    )  # fmt: skip
    return question, asked


def _answer(
    drive: Component | CompiledDae, question: Question, asked: Mapping[str, Any], how: _How, progress: Progress | None
) -> Optimum | Front:
    """Search for one design, a front, or the best choice."""
    choices, number, points = asked.get("choose"), asked.get("starts", 1), asked.get("points", _POINTS)
    aims = (*question.minimize, *question.maximize)
    if len(aims) > 2:
        raise ValueOutOfRange(
            "There may be one objective, or two for a front.", advice="Limit the others by subject_to."
        )
    if len(aims) == 2 and aims[0] == aims[1]:
        raise ValueOutOfRange(f"Both objectives of the front are {aims[0]}.", advice="Leave one out.")
    if not choices:
        return _Study(drive, question, how, counted(progress, MOST_STEPS * number)).best(number, points)
    if len(aims) > 1:
        raise ValueOutOfRange("A choice needs one objective.", advice="Limit the other one by subject_to.")
    if not isinstance(drive, Component):
        raise LanguageError(
            "A compiled model has nothing to choose.", advice="Give the netlist or the component itself."
        )
    with question.at(drive, "choose"):
        options = options_of(drive, choices)
        for choice in itertools.chain(*options):
            with_choice(drive, choice)  # says what cannot be, before anything runs
    count = math.prod(map(len, options))
    if count <= ENUMERATED:
        every = [together(several) for several in itertools.product(*options)]
        return _best_choice(drive, question, every, number, how, counted(progress, MOST_STEPS * number * count))
    told = counted(progress, MOST_STEPS * number * FINISHED + TRIALS)
    some, note = promising(drive, question, options, how.seed, told)
    best = _best_choice(drive, question, some, number, how, told)
    return replace(best, runs=best.runs + note.runs, notes=(*best.notes, str(note)))


def _listed(texts: str | Sequence[str]) -> tuple[str, ...]:
    return (texts,) if isinstance(texts, str) else tuple(texts)


class _Study:
    """One optimisation of one drive."""

    def __init__(
        self, drive: Component | CompiledDae, question: Question, how: _How, told: Callable[[], None] = lambda: None
    ) -> None:
        self.drive, self.how = drive, how
        self.problem = make_problem(drive, question)
        self.runs = Runs(self.problem, told)

    def best(self, starts: int, points: int) -> Optimum | Front:
        """Return the optimum, or with two objectives their front."""
        with Team(self.runs, self.how.processes) as team:
            if len(self.problem.aims) == 1:
                return self._optimum(team, starts)
            if any(limit.probability < 1.0 for limit in self.problem.limits):
                raise ValueOutOfRange("A front has no limits with a probability.", advice="Give plain limits.")
            return self._front(team, starts, points)

    def _optimum(self, team: Team, starts: int) -> Optimum:
        if all(limit.probability == 1.0 for limit in self.problem.limits):
            search = Search(self.problem, self.runs)
            return self.optimum(search, self._search(team, [search], starts)[0])
        chances = Chances(self.problem)
        problem, outcome = chances.search(lambda moved: self._search(team, [Search(moved, self.runs)], starts)[0])
        result = self.optimum(Search(problem, self.runs), outcome)
        return replace(result, notes=(*result.notes, *map(str, chances.results)))

    def _search(self, team: Team, searches: Sequence[Search], starts: int) -> list[Outcome]:
        """Return the best end of each search, all of which begin at several starts."""
        begins = [self._begins(search, starts) for search in searches]
        begin, limits = self.runs.at(self.problem.begin), searches[0].problem.limits
        chains = [Chain(x, limits, aim) for aim, some in enumerate(begins) for x in some]
        with self.runs.interruptible(searches[0].measures, searches[0].aim_scale):
            ends = iter(team.run(chains))
        outcomes: list[Outcome] = []
        for search, some in zip(searches, begins, strict=True):
            ended = [outcome for _ in some for outcome in next(ends)]
            if not ended:
                raise self.runs.refusals[0][1]
            outcome = better(ended)
            if begin is not None:
                objective, excess = search.measures(begin.values)
                gained = objective - outcome.objective > _GAIN * (abs(objective) + abs(outcome.objective))
                if not gained and excess <= FEASIBLE:  # what changes nothing is not changed
                    outcome = replace(outcome, x=begin.x, objective=objective)
            outcomes.append(outcome)
        return outcomes

    def _begins(self, search: Search, starts: int) -> list[Vector]:
        if not self.problem.free:
            return [self.problem.begin]
        return promising_starts(self.runs, search, starts, self.how.seed)

    def _front(self, team: Team, starts: int, points: int) -> Front:
        if points < 2:
            raise ValueOutOfRange(f"A front needs at least 2 points, not {points}.")
        limits, searches = self.problem.limits, [Search(self.problem, self.runs, aim) for aim in (0, 1)]
        ends = self._search(team, searches, starts)
        # What is best in one objective may lead to what is better in the other one.
        others = team.run([Chain(ends[1].x, limits, 0), Chain(ends[0].x, limits, 1)])
        ends = [better([end, *other]) for end, other in zip(ends, others, strict=True)]
        results = [self.optimum(search, end) for search, end in zip(searches, ends, strict=True)]
        places, signs, _ = searches[1].aim
        designs = [design for end in ends if (design := self.runs.at(end.x)) is not None]
        values = [float((signs * design.values[:, places]).max()) for design in designs]
        inner = np.linspace(values[0], values[-1], points)[1:-1].tolist()
        rows = [tuple(Row(row.output, row.sign, most) for row in self.problem.aims[1].rows) for most in inner]
        halves = [half for half in (rows[: len(rows) // 2], rows[len(rows) // 2 :]) if half]
        chains = [Chain(self._best_within(ends[0].x, half[0]), limits, 0, tuple(half)) for half in halves]
        for chain, outcomes in zip(chains, team.run(chains), strict=True):
            for more, outcome in zip(chain.more, outcomes, strict=True):
                if outcome.excess <= FEASIBLE:
                    results.append(self.optimum(Search(self.problem, self.runs, 0, more), outcome))
        front = self._undominated(results)
        notes = () if len(front) > 1 else ("This design is the best in both objectives.",)
        return Front(front, self.runs.count, notes)

    def _best_within(self, x: Vector, more: tuple[Row, ...]) -> Vector:
        """Return the best design that was tried within further limits; else x."""
        search = Search(self.problem, self.runs, 0, more)
        tried = [(*search.measures(design.values), design.x) for design in self.runs.designs]
        within = [(objective, k) for k, (objective, excess, _) in enumerate(tried) if excess <= FEASIBLE]
        return tried[min(within)[1]][2] if within else x

    def _undominated(self, results: Sequence[Optimum]) -> tuple[Optimum, ...]:
        """Return designs from the best in one objective to that in the other, without what others are as good as."""
        signs, shape = np.array([[aim.sign] for aim in self.problem.aims]), (2, len(self.problem.cases))
        signed = [signs * np.reshape([o.value for o in result.objectives], shape) for result in results]
        values = [numbers.max(axis=1).tolist() for numbers in signed]
        kept: list[int] = []
        usable = [k for k, result in enumerate(results) if result.feasible] or range(len(results))
        for k in sorted(usable, key=lambda k: values[k]):
            before = values[kept[-1]][1] if kept else np.inf
            if before - values[k][1] > _SAME * abs(values[k][1]):
                kept.append(k)
        return tuple(results[k] for k in kept)

    def optimum(self, search: Search, outcome: Outcome) -> Optimum:
        """Return a result with its names, checked by IDAS."""
        problem, x = self.problem, outcome.x
        values = problem.named(x)
        before = self.runs.at(problem.begin)
        after, notes = self._checked(values, self.runs.at(x))
        first = before.values if before is not None else np.full(after.shape, np.nan)
        objectives, question = self._objectives(first, after), problem.question
        worst = next(case for case in problem.cases if case.name == objectives[0].case)
        run = {"until": question.until, "start": question.start, "parameters": dict(worst.values)}
        return Optimum(
            problem.model.with_parameters(dict(values)),
            tuple(
                Chosen(p.name, p.unit, p.low, p.high, p.value, value)
                for p, value in zip(problem.free, values.values(), strict=True)
            ),
            {}, objectives, self._limits(search, outcome, first, after),
            outcome.excess <= FEASIBLE, outcome.optimal, self.runs.count,
            np.array([search.measures(design.values) for design in self.runs.designs]) * [search.aim_scale, 1.0],
            notes=(*notes, *self._remarks(outcome, after)),
            drive=self.drive if isinstance(self.drive, Component) else None, run=run,
        )  # fmt: skip

    def _checked(self, values: Mapping[str, float], design: Any) -> tuple[Vector, list[str]]:
        """Return the outputs of a design in runs of their own, by IDAS, and what differs."""
        problem = self.problem
        rows, by_idas = list[Vector](), partial(simulate, solver="idas")
        for case in problem.cases:
            rows.append(self.runs.alone.at({**case.values, **values}, by_idas))
        after = np.array(rows)
        if design is None:
            return after, []
        apart = np.abs(after - design.values) > _DIFFERENCE * (np.abs(after) + np.abs(design.values))
        return after, [
            f"IDAS has {problem.outputs[k]} = {after[c, k]:.6g} for this design, the search {design.values[c, k]:.6g}."
            for c, k in np.argwhere(apart)
        ]

    def _objectives(self, first: Vector, after: Vector) -> tuple[Measured, ...]:
        problem, measured = self.problem, list[Measured]()
        for aim in problem.aims:
            places, _, _ = problem.numbers(aim.rows)
            before, values = ([aim.value(row) for row in numbers[:, places]] for numbers in (first, after))
            worst_first = sorted(range(len(values)), key=lambda c: -aim.sign * values[c])
            measured += [
                Measured(aim.text, aim.text, aim.unit, problem.cases[c].name, before[c], values[c]) for c in worst_first
            ]
        return tuple(measured)

    def _limits(self, search: Search, outcome: Outcome, first: Vector, after: Vector) -> tuple[Measured, ...]:
        problem, measured, row = self.problem, list[Measured](), 0
        for limit in problem.limits:
            count, k = len(limit.rows()), problem.outputs.index(limit.name)
            for c, case in enumerate(problem.cases):
                price = float(outcome.prices[c, row : row + count].sum()) if outcome.optimal else 0.0
                size = search.sizes[k]
                weight = abs(price) * size / search.aim_size
                excess = float(limit.excess(after[c, k]))
                measured.append(
                    Measured(
                        limit.text, limit.name, limit.unit, case.name, first[c, k], after[c, k], limit.value,
                        excess, bool(excess > 10 * FEASIBLE * size), price if weight > 1e-4 else 0.0,
                    )
                )  # fmt: skip
            row += count
        return tuple(measured)

    def _remarks(self, outcome: Outcome, after: Vector) -> Iterator[str]:
        if outcome.excess > FEASIBLE:
            yield "The limits cannot all be met: this design exceeds them least, relative to their sizes."
        elif not outcome.optimal:
            yield f"The search stopped before an optimum was certain ({outcome.status}); this is the best design tried."
        if outcome.excess <= FEASIBLE and self.problem.free and np.array_equal(outcome.x, self.problem.begin):
            yield "No design that was tried is better than the drive as it is."
        for row in self.problem.within:
            if after[:, self.problem.outputs.index(row.output)].max() < row.most * (1.0 - FEASIBLE):
                continue
            yield f"{row.output} is at the end of the run: a longer run may have a better design."
        yield from self.runs.remarks()


def _best_choice(
    drive: Component, question: Question, options: Sequence[Choice], starts: int, how: _How, told: Callable[[], None]
) -> Optimum:  # fmt: skip
    results: list[tuple[Choice, Optimum]] = []
    failures: list[tuple[Choice, ModelicaLikeError]] = []
    for choice in options:
        with question.at(drive, "choose"):
            variant = with_choice(drive, choice)
        try:
            study = _Study(variant, question, how, told)
            result = study.best(starts, _POINTS)
        except ModelicaLikeError as error:
            failures.append((choice, error))
            continue
        if isinstance(result, Optimum):
            results.append((choice, result))
    if not results:
        raise failures[0][1]
    sign = 1.0 if question.minimize else -1.0
    best = min(results, key=lambda pair: (not pair[1].feasible, sign * pair[1].objectives[0].value))
    tried = [(c.labels, r.objectives[0].value if r.feasible else np.nan) for c, r in results]
    tried += [(choice.labels, np.nan) for choice, _ in failures]
    notes = [f"{_label(choice)} was left out: {error.what}" for choice, error in failures]
    return replace(
        best[1], chosen=best[0].labels, runs=sum(result.runs for _, result in results),
        combinations=tuple(tried), notes=(*best[1].notes, *notes),
    )  # fmt: skip


def _label(choice: Choice) -> str:
    return ", ".join(f"{path} = {label}" for path, label in choice.labels.items())
