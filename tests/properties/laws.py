"""Random laws over all functions of the language, with a reference of their own: Python and small steps.

A law is a tree of tuples. It is read three times: as an expression of the language, as Python, and as nothing else the
framework has. The reference steps with Runge's and Kutta's method of order four; a step in which a branch changes is
halved until it is short, so that a jump costs its height times that.
"""

import math
from collections.abc import Callable
from random import Random
from typing import Any

from modelica_like.language import (
    Component,
    Equations,
    Events,
    Variable,
    absolute,
    all_of,
    any_of,
    clock,
    cos,
    der,
    discrete,
    exp,
    floor,
    interpolate,
    maximum,
    minimum,
    mod,
    negate,
    sign,
    sin,
    sqrt,
    tanh,
    var,
    when,
    where,
)

Node = tuple[Any, ...]
Asked = tuple[bool | None, ...]
EVENTFUL: Asked = (None, None, True)
END, STEP, TICK = 2.0, 1.0 / 256, 0.25
_DEEPEST = 7
"""Halvings of a step in which a branch changes: to 3e-5 s."""
_MOST = 60
"""Changes of branches after which a law counts as chattering."""
_SMOOTH: dict[str, tuple[Callable[..., Any], Callable[..., float]]] = {
    "sin": (sin, math.sin), "cos": (cos, math.cos), "tanh": (tanh, math.tanh),
    "exp": (lambda x: exp(-absolute(x)), lambda x: math.exp(-abs(x))),
    "sqrt": (lambda x: sqrt(1 + x * x), lambda x: math.sqrt(1 + x * x)),
    "absolute": (absolute, abs),
}  # fmt: skip
_PAIRS: dict[str, tuple[Callable[..., Any], Callable[..., float]]] = {
    "+": (lambda a, b: a + b, lambda a, b: a + b), "-": (lambda a, b: a - b, lambda a, b: a - b),
    "*": (lambda a, b: a * b, lambda a, b: a * b), "minimum": (minimum, min), "maximum": (maximum, max),
}  # fmt: skip


def random_law(chance: Random, names: str, depth: int = 4, tables: bool = True, asked: Asked = EVENTFUL) -> Node:
    """Return a tree over variables; its steps make no events, or all that jump do: an event cannot wait for a step."""
    kind = chance.choice(["leaf"] * 2 + ["smooth", "pair", "pair", "sign", "floor", "mod", "where", "where", "table"])
    if depth == 0 or kind == "leaf":
        return ("name", chance.choice(names)) if chance.random() < 0.7 else ("number", round(chance.uniform(-2, 2), 2))

    def inner() -> Node:
        return random_law(chance, names, depth - 1, tables, asked)

    events = chance.choice(asked)
    if kind == "smooth" or (kind == "table" and not tables):
        return "smooth", chance.choice([*_SMOOTH]), inner()
    if kind == "pair":
        return "pair", chance.choice([*_PAIRS]), inner(), inner()
    if kind == "table":
        xs = sorted(chance.sample(range(-8, 9), 4))
        ys = [round(chance.uniform(-2, 2), 2) for _ in xs]
        return "table", tuple(x / 4 for x in xs), tuple(ys), inner()
    if kind == "where":
        return "where", events, _condition(chance, names, depth - 1, tables, asked), inner(), inner()
    return kind, events, round(chance.uniform(0.3, 1.5), 2), inner()


def _condition(chance: Random, names: str, depth: int, tables: bool, asked: Asked) -> Node:
    join = chance.choice(["relation"] * 4 + ["all", "any", "not"])
    if join == "relation" or depth == 0:
        sides = (random_law(chance, names, max(depth - 1, 0), tables, asked) for _ in range(2))
        return "relation", chance.choice("<>"), *sides
    count = 1 if join == "not" else 2
    return join, *(_condition(chance, names, depth - 1, tables, asked) for _ in range(count))


def written(node: Node, names: dict[str, Any]) -> Any:
    """Return a law as an expression of the language."""
    kind, *rest = node
    if kind == "name":
        return names[rest[0]]
    if kind == "number":
        return rest[0]
    if kind in ("smooth", "pair"):
        table = _SMOOTH if kind == "smooth" else _PAIRS
        return table[rest[0]][0](*(written(one, names) for one in rest[1:]))
    if kind == "table":
        return interpolate(written(rest[2], names), rest[0], rest[1])
    if kind in ("relation", "all", "any", "not"):
        parts = [written(one, names) for one in rest[kind == "relation" :]]
        if kind == "relation":
            a, b = (one if not isinstance(one, float) else one + 0 * names["x"] for one in parts)
            return a < b if rest[0] == "<" else a > b
        return {"all": all_of, "any": any_of, "not": negate}[kind](*parts)
    events, *rest = rest
    if kind == "where":
        return where(*(written(one, names) for one in rest), events=events)
    size, inner = rest[0], written(rest[1], names)
    if kind == "sign":
        return size * sign(inner + size, events=events)
    return floor(inner / size, events=events) if kind == "floor" else mod(inner, size, events=events)


def value(node: Node, at: dict[str, float], branches: list[Any]) -> Any:
    """Return the value of a law, and add the branches that it takes."""
    kind, *rest = node
    if kind == "name":
        return at[rest[0]]
    if kind == "number":
        return rest[0]
    if kind in ("smooth", "pair"):
        table = _SMOOTH if kind == "smooth" else _PAIRS
        parts = [value(one, at, branches) for one in rest[1:]]
        if rest[0] in ("minimum", "maximum", "absolute"):
            branches.append(parts[0] < parts[-1] if kind == "pair" else parts[0] < 0)
        return table[rest[0]][1](*parts)
    if kind == "table":
        xs, ys, inner = *rest[:2], value(rest[2], at, branches)
        k = next((k for k in range(1, len(xs) - 1) if inner < xs[k]), len(xs) - 1)
        branches.append(k)
        return ys[k - 1] + (inner - xs[k - 1]) * (ys[k] - ys[k - 1]) / (xs[k] - xs[k - 1])
    if kind == "relation":
        first, second = (value(one, at, branches) for one in rest[1:])
        branches.append(first < second if rest[0] == "<" else first > second)
        return branches[-1]
    if kind in ("all", "any", "not"):
        parts = [value(one, at, branches) for one in rest]  # all of them: what is not needed has branches, too
        return not parts[0] if kind == "not" else (all if kind == "all" else any)(parts)
    _, *rest = rest
    if kind == "where":
        condition, *both = (value(one, at, branches) for one in rest)
        return both[0] if condition else both[1]
    size, inner = rest[0], value(rest[1], at, branches)
    if kind == "sign":
        inner += size  # a modulo touches zero where it jumps: one point with the sign zero, where a solver may rest
        branches.append((inner > 0) - (inner < 0))
        return size * branches[-1]
    branches.append(math.floor(inner / size))
    return branches[-1] if kind == "floor" else inner - size * branches[-1]


class Chatters(Exception):
    """Branches change again and again: a small step has no right result."""


def reference(laws: dict[str, Node], start: dict[str, float], held: bool, deepest: int) -> dict[str, float]:
    """Return the end of der(x) = tanh(f(x, y, z, h, t)), der(y) = tanh(g(…)), z = e(x, y, h, t).

    At every tick h becomes 0.9 x + 0.05, and not x itself, with which no law can tell one side of x < h from the other.
    """
    at = {**start, "h": 0.0, "t": 0.0}
    changes = 0

    def rates(point: dict[str, float]) -> tuple[list[float], list[Any]]:
        branches: list[Any] = []
        point["z"] = value(laws["z"], point, branches)
        return [math.tanh(value(laws[name], point, branches)) for name in "xy"], branches

    def moved(point: dict[str, float], slopes: list[float], step: float) -> dict[str, float]:
        new = {name: point[name] + step * slope for name, slope in zip("xy", slopes, strict=True)}
        return {**point, **new, "t": point["t"] + step}

    def advance(point: dict[str, float], step: float, depth: int) -> dict[str, float]:
        nonlocal changes
        first, branches = rates(point)
        second, seen = rates(moved(point, first, step / 2))
        third, also = rates(moved(point, second, step / 2))
        fourth, last = rates(moved(point, third, step))
        if depth < deepest and not branches == seen == also == last:
            return advance(advance(point, step / 2, depth + 1), step / 2, depth + 1)
        changes += branches != last
        if changes > _MOST:
            raise Chatters
        mean = [(a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(first, second, third, fourth, strict=True)]
        return moved(point, mean, step)

    for number in range(round(END / STEP)):
        if held and number % round(TICK / STEP) == 0:
            at["h"] = 0.9 * at["x"] + 0.05
        at = {**advance(at, STEP, 0), "t": (number + 1) * STEP}
    rates(at)
    return at


def component(laws: dict[str, Node], start: dict[str, float], held: bool) -> Component:
    """Return the same as a component."""

    class Random(Component):
        units_checked = False
        x: Variable = var("1", "a state", default=start["x"])
        y: Variable = var("1", "another state", default=start["y"])
        z: Variable = var("1", "an algebraic variable")
        if held:
            h = discrete("1", "taken at the last tick")

        def equations(self) -> Equations:
            names = {"x": self.x, "y": self.y, "z": self.z, "t": self.time, "h": self.h if held else 0.0}
            yield der(self.x) == tanh(written(laws["x"], names))
            yield der(self.y) == tanh(written(laws["y"], names))
            yield self.z - written(laws["z"], names) == 0

        def events(self) -> Events:
            if held:
                yield when(clock(TICK), {self.h: 0.9 * self.x + 0.05})

    return Random()


def random_case(number: int, held: bool = True, tables: bool = True) -> tuple[dict[str, Node], dict[str, float]]:
    """Return laws and start values."""
    chance = Random(number)
    more = "h" * held
    laws: dict[str, Node] = {}
    for name, over, depth in (("x", "xyzt", 4), ("y", "xyzt", 4), ("z", "xyt", 3)):
        asked = EVENTFUL if chance.random() < 0.75 else (False,)
        laws[name] = random_law(chance, over + more, depth, tables, asked)
    return laws, {name: round(chance.uniform(-1.5, 1.5), 3) for name in "xy"}


def clear(number: int, held: bool = True, tables: bool = True) -> tuple[Component, dict[str, float]] | None:
    """Return a component and its end, or None where it has no clear one: it chatters, or hangs on its sixth digit.

    Or on a step: a law whose rate vanishes behind its jump rests there; small steps pass it, and leave it by how far
    they came.
    """
    laws, start = random_case(number, held, tables)
    near = {name: one + 1e-6 for name, one in start.items()}
    try:
        end = reference(laws, start, held, _DEEPEST)
        other = reference(laws, near, held, _DEEPEST + 1)
    except Chatters:
        return None
    same = all(abs(end[name] - other[name]) < 3e-5 for name in "xy")
    return (component(laws, start, held), end) if same else None
