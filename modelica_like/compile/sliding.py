"""Sliding along the border between two modes that both lead back to it (A. F. Filippov), as further modes of a model.

On the border s = 0 both modes are mixed: f = (1 - a)·f1 + a·f2, with the share a for which s stays zero. The mix is a
mode of its own with a number behind the others, so events, FMUs and results know nothing of it.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import casadi as ca
import numpy as np

from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae, CompiledTransition
from modelica_like.compile.groups import with_functions
from modelica_like.compile.soon import ahead, guards_soon, joined
from modelica_like.flatten.generic import spread
from modelica_like.structure.motion import Motion

SLIDES = " ⇄ "
"""Between the names of two modes: the name of sliding along their border."""
_MIXED = ("ode", "variables", "moments", "resets", "hold_terms", "delays")
_PLAIN = ("alg", "alg_jacobian", "start_conditions", "start_values", "discrete_starts", "determinants")
_NEAR = 10.0
"""Distance from the border that a mode may jump and still slide, in changes within the time resolution."""
_FAR = 1e4
"""The same distance, at which it no longer slides: errors of the integrator are smaller."""
_RETURN = 0.1
"""Time constant in s with which these errors vanish."""
_MORE = 6
"""Further guards of a pair."""
_SAMPLES, _ROUNDING, _LARGE = 5, 1e-12, 1e300
_ALONG = "both modes lead back to this border, so it slides"
_AWAY = "one mode leads away from the border, so it slides no longer"


@dataclass(frozen=True)
class Pair:
    """Two values of a mode that change into each other under opposite conditions.

    Attributes:
        mode: position of the mode in d.
        first: number of the one value.
        second: number of the other.
        there: position of the transition to the second; its guard is s.
        back: position of the transition back; its guard is -s.
        number: number of the mode of sliding.
    """

    mode: int
    first: int
    second: int
    there: int
    back: int
    number: int


Border = list[Pair]
"""Pairs with the same guards, which switch and slide together."""


def as_asked(model: CompiledDae) -> CompiledDae:
    """Return the model with modes of sliding if its settings ask for them."""
    return sliding(model) if model.settings.get("on_chattering") == "slide" else model


def sliding(model: CompiledDae) -> CompiledDae:
    """Return a model in which modes can slide along the border between two of their values.

    This is possible where two values change into each other under opposite conditions, without resets, and decide on
    the rate of what the condition compares. Without such modes it is the model itself.
    """
    slid = model.once(Cached.SLIDING, lambda: _sliding(model))
    return slid.twin(p=model.p, u=model.u, settings=model.settings) if slid is not model else model


def _sliding(model: CompiledDae) -> CompiledDae:
    borders = _borders(model)
    if not borders:
        return model
    slid = _Mix(model, borders).model()
    slid.once(Cached.SLIDING, lambda: slid)
    return slid


# -- which modes -----------------------------------------------------------------------------------------------------


def _borders(model: CompiledDae) -> list[Border]:
    samples, borders = _samples(model), list[tuple[Any, Border]]()
    for pair in _pairs(model, samples):
        guard = samples[:, model.events.transitions[pair.there].index]
        turned = replace(pair, first=pair.second, second=pair.first, there=pair.back, back=pair.there)
        ways = (pair, guard), (turned, -guard)
        alike = [(border, turn) for values, border in borders for turn, signed in ways if _same(signed, values)]
        for border, turn in alike:
            border.append(turn)
        if not alike:
            borders.append((guard, [pair]))
    return [border for _, border in borders]


def _same(values: Any, others: Any) -> bool:
    """Whether samples are equal but for rounding; false where one is no number."""
    return np.allclose(values, others, rtol=_ROUNDING, atol=0)


def _pairs(model: CompiledDae, samples: Any) -> Iterator[Pair]:
    held = {(hold.mode, hold.number) for hold in model.held.motions}
    numbers = {k: len(discrete.names) for k, discrete in enumerate(model.flat_discretes)}
    plain = [
        k
        for k, transition in enumerate(model.events.transitions)
        if not (transition.timed or transition.resets or transition.fails or transition.notice)
    ]
    for there, back in combinations(plain, 2):
        forth, other = model.events.transitions[there], model.events.transitions[back]
        mode, first, second = forth.mode, other.target, forth.target
        if mode != other.mode or first not in forth.sources or second not in other.sources or first == second:
            continue
        opposite = _same(samples[:, forth.index], -samples[:, other.index])
        if opposite and held.isdisjoint(((mode, first), (mode, second))) and _decides(model, mode, forth.index):
            yield Pair(mode, first, second, there, back, numbers[mode])
            numbers[mode] += 1


def _samples(model: CompiledDae) -> Any:
    """Values of the guards at arbitrary points, shape (points, guards)."""
    sizes = [model.events.guards.size1_in(k) for k in range(model.events.guards.n_in())]
    t, x, z, p, u, d = np.split(spread(0.0, 1.0, (sum(sizes), _SAMPLES)), np.cumsum(sizes)[:-1])
    return model.events.guards.map(_SAMPLES)(t, 4 * x - 2, 4 * z - 2, p, u, np.floor(2 * d)).full().T


def _decides(model: CompiledDae, mode: int, guard: int) -> bool:
    """Whether a mode has an effect on the rate of a guard, but none on the guard itself, and resets nothing."""
    follow = _followers(model, mode)
    if any(model.events.update_rows[row].reset.kind != "discrete" for row in follow):
        return False
    modes = {mode, *(model.events.update_rows[row].reset.index for row in follow)}
    implicitly = any(column in modes for _, column in _uses(model.equations.alg, "d"))
    if implicitly and _uses(model.equations.alg_jacobian, "z"):
        return False
    value, rate = (
        any(row == guard and column in modes for row, column in _uses(function, "d"))
        or (implicitly and any(row == guard for row, _ in _uses(function, "z")))
        for function in (model.events.guards, model.events.guard_rates)
    )
    return rate and not value


def _followers(model: CompiledDae, mode: int) -> list[int]:
    """Rows of the discrete equations on which a mode has an effect."""
    return sorted({row for row, column in _uses(model.events.updates, "d") if column == mode})


def _uses(function: ca.Function, argument: str) -> set[tuple[int, int]]:
    """Pairs of a result and the entry of an argument that has an effect on it."""
    return set(zip(*function.jac_sparsity(0, function.name_in().index(argument)).get_triplet(), strict=True))


# -- the mix ---------------------------------------------------------------------------------------------------------


class _Mix:
    """Writes the functions and tables of a model with modes of sliding.

    Args:
        model: without them.
        borders: at least one.
    """

    def __init__(self, model: CompiledDae, borders: list[Border]) -> None:
        self.base = model
        self.pairs = [(pair, k) for k, border in enumerate(borders) for pair in border]
        self.arguments = list(model.arguments.values())
        self.t, self.x, self.z, *_, self.d = self.arguments
        self.slides = [functools.reduce(ca.logic_or, [self._slides(pair) for pair in border]) for border in borders]
        modes = ca.SX(self.d)
        for pair, _ in self.pairs:
            modes[pair.mode] = ca.if_else(self._slides(pair), pair.first, modes[pair.mode])
        slides = functools.reduce(ca.logic_or, self.slides)
        for mode, value in self._following([*self.arguments[:-1], modes], [pair.mode for pair, _ in self.pairs]):
            modes[mode] = ca.if_else(slides, value, modes[mode])
        self.first = [*self.arguments[:-1], modes]
        # Only where it slides: a branch that is not taken may be undefined.
        self.seconds = [
            self._with({pair.mode: ca.if_else(self._slides(pair), pair.second, modes[pair.mode]) for pair in border})
            for border in borders
        ]
        self.alg = model.equations.alg(*self.first)
        ode = model.equations.ode(*self.first)
        guards = ca.vertsplit(model.events.guards(*self.first))
        self.borders = [guards[model.events.transitions[border[0].there].index] for border in borders]
        self.rates = self._motion(ode).rate(ca.vertcat(*self.borders))
        self.shares = self._shares()
        self.motion = self._motion(self._mixed(model.equations.ode))
        others = [self._with({pair.mode: self._other(pair) for pair in border}) for border in borders]
        self.across = [
            (self._motion(self.motion.ode + model.equations.ode(*other) - ode)).rate(border)
            for other, border in zip(others, self.borders, strict=True)
        ]

    def _motion(self, ode: Any) -> Motion:
        return Motion(self.t, self.x, self.z, ode, self.alg)

    def _slides(self, pair: Pair) -> Any:
        return self.d[pair.mode] == pair.number

    def _other(self, pair: Pair) -> Any:
        mode = self.first[-1][pair.mode]
        return ca.if_else(mode == pair.first, pair.second, ca.if_else(mode == pair.second, pair.first, mode))

    def _following(self, arguments: list[Any], modes: Iterable[int]) -> list[tuple[int, Any]]:
        """Return positions in d and values of the discrete variables on which modes have an effect."""
        values, rows = self.base.events.updates(*arguments), self.base.events.update_rows
        return [(rows[row].reset.index, values[row]) for mode in modes for row in _followers(self.base, mode)]

    def _with(self, modes: dict[int, Any]) -> list[Any]:
        """Return the arguments in other modes; discrete equations and implicit unknowns follow."""
        t, x, z, p, u, d = (ca.SX(argument) for argument in self.first)
        for mode, number in modes.items():
            d[mode] = number
        following = self._following([t, x, z, p, u, d], modes)
        for mode, value in following:
            d[mode] = value
        changed = {*modes, *(mode for mode, _ in following)}
        if any(column in changed for _, column in _uses(self.base.equations.alg, "d")):
            residual, jacobian = (
                function(t, x, z, p, u, d) for function in (self.base.equations.alg, self.base.equations.alg_jacobian)
            )
            z = z - ca.solve(ca.densify(jacobian), residual)
        return [t, x, z, p, u, d]

    def _shares(self) -> list[Any]:
        """Shares of the second modes for which the borders that slide stay where they are; zero for the others."""
        columns = [
            self._motion(self.base.equations.ode(*second)).rate(ca.vertcat(*self.borders)) for second in self.seconds
        ]
        change = ca.horzcat(*columns) - ca.repmat(self.rates, 1, len(columns))
        rows = [ca.if_else(slides, change[k, :], ca.SX.eye(len(columns))[k, :]) for k, slides in enumerate(self.slides)]
        # The border is approached, so that errors of the integrator do not add up.
        back = [rate + border / _RETURN for rate, border in zip(ca.vertsplit(self.rates), self.borders, strict=True)]
        wanted = ca.vertcat(*(ca.if_else(slides, -rate, 0) for rate, slides in zip(back, self.slides, strict=True)))
        return ca.vertsplit(ca.solve(ca.densify(ca.vertcat(*rows)), wanted))

    def _mixed(self, function: ca.Function) -> Any:
        first = function(*self.first)
        changes = [function(*second) - first for second in self.seconds]
        return first + sum(share * change for share, change in zip(self.shares, changes, strict=True))

    # -- guards --

    def _guards(self) -> tuple[Any, Any]:
        """Return all guards, and what they are one time resolution later."""
        # What depends on discrete values alone is true or false, and not in between.
        moving = {row for name in ("t", "x", "z") for row, _ in _uses(self.base.events.guards, name)}
        plain, mixed = self.base.events.guards(*self.first), self._joined()
        values = ca.vertcat(*((mixed if row in moving else plain)[row] for row in range(plain.numel())))
        now, soon = (ca.vertsplit(column) for column in (values, guards_soon(self.t, self.motion.rate, values)))
        return self._crossing(now, soon)

    def _joined(self) -> Any:
        first, *others = (self._relations(arguments) for arguments in (self.first, *self.seconds))
        mixed = iter(
            relation + sum(share * (other - relation) for share, other in zip(self.shares, those, strict=True))
            for relation, *those in zip(first, *others, strict=True)
        )
        return joined(self.base.events.guards(*self.first), lambda _: next(mixed))

    def _relations(self, arguments: list[Any]) -> list[Any]:
        relations: list[Any] = []
        joined(self.base.events.guards(*arguments), lambda relation: relations.append(relation) or relation)
        return relations

    def _crossing(self, now: list[Any], soon: list[Any]) -> tuple[Any, Any]:
        """Replace the guards of the pairs, and add those of sliding."""
        later, rates = ahead(self.t), self.motion.rate
        for pair, k in self.pairs:
            border, rate, across, share = self.borders[k], rates(self.borders[k]), self.across[k], self.shares[k]
            size = ca.fabs(across)
            near = _NEAR * later * (ca.fabs(rate) + ca.if_else(size < _LARGE, size, 0))
            there, back = (self.base.events.transitions[number].index for number in (pair.there, pair.back))
            for guards, follow in ((now, lambda e: e), (soon, lambda e: e + later * rates(e))):
                s, v, w, a = (follow(e) for e in (border, rate, across, share))
                if guards is soon:
                    s = guards[there]
                guards[there], guards[back] = _leaves(s, v, near), _leaves(-s, -v, near)
                far = ca.if_else(self.slides[k], _FAR / _NEAR, 1) * near
                guards += [s - far, -s - far, _enters(s, v, w), _enters(-s, -v, -w), -a, a - 1]
        return ca.vertcat(*now), ca.vertcat(*soon)

    def _updates(self) -> Any:
        """Booleans and counts that follow a sliding mode have the values of the first one; samples are mixed."""
        plain, mixed, rows = self.base.events.updates(*self.first), self._mixed(self.base.events.updates), list[Any]()
        for row, update in enumerate(self.base.events.update_rows):
            discrete = self.base.flat_discretes[update.reset.index] if update.reset.kind == "discrete" else None
            whole = discrete is not None and (discrete.hidden or discrete.kind != "number")
            rows.append((plain if whole else mixed)[row])
        return ca.vertcat(*rows)

    # -- the model --

    def model(self) -> CompiledDae:
        """Return the model with modes of sliding."""
        base, rate = self.base, self.motion.rate
        transitions = self._transitions()
        # Guards are in the order of their transitions.
        order = [transition.index for transition in transitions if not transition.timed]
        places = {index: place for place, index in enumerate(order)}
        transitions = tuple(t if t.timed else replace(t, index=places[t.index]) for t in transitions)
        guards, soon = (guards[order] for guards in self._guards())
        written = {name: self._mixed(base.functions[name]) for name in _MIXED} | {"updates": self._updates()}
        written |= {name: base.functions[name](*self.first) for name in _PLAIN}
        written |= {"guards": guards, "guard_rates": rate(guards), "guards_soon": soon}
        functions = {name: self._function(name, expression) for name, expression in written.items()}
        return replace(
            base, equations=with_functions(base.equations, functions), held=with_functions(base.held, functions),
            events=with_functions(base.events, functions, transitions=transitions),
            starts=with_functions(base.starts, functions), flat_discretes=self._discretes(), _cache={},
            _make_energy=lambda: self._function("energy", self._mixed(base.energy)),
            _make_start=lambda rest: base.rest_system if rest else base.start_system,
        )  # fmt: skip

    def _function(self, name: str, expression: Any) -> ca.Function:
        result = expression if name == "alg_jacobian" else ca.densify(expression)
        return ca.Function(name, self.arguments, [ca.cse(result)], list(self.base.arguments), [name])

    def _discretes(self) -> Any:
        discretes = list(self.base.flat_discretes)
        for pair, _ in self.pairs:
            names = discretes[pair.mode].names
            both = f"{names[pair.first]}{SLIDES}{names[pair.second]}"
            discretes[pair.mode] = replace(discretes[pair.mode], names=(*names, both))
        return tuple(discretes)

    def _transitions(self) -> tuple[CompiledTransition, ...]:
        """First comes what has jumped across a border, then what begins to slide, then what passes the border."""
        begin, end, count = list[CompiledTransition](), list[CompiledTransition](), self.base.events.guards.size1_out(0)
        others = list(self.base.events.transitions)
        for k, (pair, _) in enumerate(self.pairs):
            there, back = others[pair.there], others[pair.back]
            both, at = {pair.first, pair.second}, count + _MORE * k
            begin += [replace(there, sources=(pair.first, pair.number), index=at)]
            begin += [replace(back, sources=(pair.second, pair.number), index=at + 1)]
            for side, (source, way) in enumerate(((pair.first, there), (pair.second, back))):
                why = ": ".join(filter(None, (way.because, _ALONG)))
                begin.append(replace(way, sources=(source,), target=pair.number, index=at + 2 + side, because=why))
            end += [replace(back, sources=(pair.number,), index=at + 4, because=_AWAY)]
            end += [replace(there, sources=(pair.number,), index=at + 5, because=_AWAY)]
            for number, other in enumerate(others):
                if other.mode == pair.mode and number not in (pair.there, pair.back) and both & {*other.sources}:
                    others[number] = replace(other, sources=(*other.sources, pair.number))
        return *begin, *others, *end


def _leaves(border: Any, rate: Any, near: Any) -> Any:
    """Guard of the transition across the border: where it slid before, what is left of s is rounding."""
    return ca.fmin(border, ca.fmax(rate, border - near))


def _enters(border: Any, rate: Any, across: Any) -> Any:
    """Guard of the transition from one side into sliding: it goes there, and is led back on the other side."""
    return ca.fmin(border, ca.fmin(rate, -across))
