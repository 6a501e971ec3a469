"""Random drives of the whole library: types with the values of the examples, changed at random, joined end to end.

Each end of a part goes to a random wire of its domain. A wire stores energy: it has an inertia, a mass, a capacitor
or a body that takes heat, with a random start value. Inputs get random signals, or signals behind random blocks.
"""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import components
from components import Capacitor, Ground, Inertia, Mass, ThermalMass
from modelica_like import Assembly, Component, build, load
from modelica_like.errors import ModelicaLikeError
from modelica_like.language.fields import Input, Output, Parameter
from modelica_like.language.inside import declarations, inside
from modelica_like.native.start import initialize

EXAMPLES = Path(__file__).parents[2] / "examples"
END = 0.3
STORES = {"Flange": "flange_a", "LinearFlange": "flange_a", "Pin": "p", "HeatPort": "port"}
_ALONE = (
    "Ground",
    "RelativeStates",
    "TranslationalRelativeStates",
    "InitializeFlange",
    "Lepelletier",
    "TranslationalInitializeFlange",
)
"""Types that belong to certain others, or need values for parts of theirs."""

Kind = tuple[type[Component], dict[str, Any], tuple[tuple[str, str], ...]]
"""A type, values for it, and its ends with their domains."""


@cache
def kinds() -> dict[str, list[Kind]]:
    """Return the types of the library with the values that the examples give them, and the ends that these use."""
    known: dict[str, list[Kind]] = {}
    for path in sorted(EXAMPLES.rglob("*.toml")):
        if {"sizing", "cosim", "calibration"} & set(path.parts):
            continue
        drive = load(path)
        numbers = {name: value.number for name, value in inside(drive).values.items()}
        for part in drive.parts.values():
            if type(part).__name__ in components.__all__ and type(part).__name__ not in _ALONE:
                kind = _kind(part, numbers)
                known.setdefault(type(part).__name__, []).extend([] if kind is None else [kind])
    return {name: some for name, some in known.items() if some}


def _kind(part: Component, numbers: dict[str, Any]) -> Kind | None:
    values = {name: getattr(part, name) for name in {*declarations(part).structural, *declarations(part).tables}}
    for name, value in inside(part).values.items():
        if not isinstance(part.fields.get(name), Parameter | Input):
            continue  # start values are drawn anew
        number = value.number
        if number is None and value.formula is None:
            continue
        if number is None and value.formula is not None:
            try:
                number = float(value.formula.evaluate(lambda one: numbers[one]))
            except (KeyError, TypeError, RuntimeError, ModelicaLikeError):
                return None
        values[name] = (
            f"{number:.17g} {value.unit}" if number is not None and str(value.unit) not in ("1", "*") else number
        )
    ends = [(name, type(end).__name__) for name, end in part.connectors.items() if end.used]
    return None if any(domain not in STORES for _, domain in ends) else (type(part), values, tuple(ends))


class _Builder:
    def __init__(self, seed: int, free: frozenset[str]) -> None:
        """Draw a drive.

        Args:
            seed: of its numbers.
            free: start values that are left out.
        """
        self.chance, self.free = random.Random(seed), free
        self.parts: dict[str, Component] = {}
        self.wires: dict[str, list[str]] = {}
        self.of: dict[str, list[str]] = {}
        known = kinds()
        self.powered = [name for name, some in known.items() if any(one[2] for one in some)]
        self.blocks = [name for name, some in known.items() if _is_block(some[0])]
        for one in range(self.chance.randint(2, 5)):
            self.power(one)

    def near(self, value: Any) -> Any:
        """Change a number a little, which leaves its order and its sign."""
        factor = self.chance.uniform(0.8, 1.25)
        if isinstance(value, str) and value and value[0] in "-0123456789":
            number, _, unit = value.partition(" ")
            return f"{float(number) * factor:.17g} {unit}"
        return value * factor if isinstance(value, float) else value

    def make(self, name: str) -> tuple[Component, tuple[tuple[str, str], ...]]:
        """Return a part of a type, where its changed values are within their limits."""
        kind, values, ends = self.chance.choice(kinds()[name])
        changed = {key: self.near(value) for key, value in values.items()}
        try:
            return kind(**changed), ends
        except ModelicaLikeError:
            return kind(**values), ends

    def add(self, kind: str, part: Component) -> str:
        name = f"{kind.lower()}_{len(self.parts)}"
        self.parts[name] = part
        return name

    def wire(self, domain: str) -> str:
        """Return a wire that stores energy, a new one or an older one."""
        old = self.of.setdefault(domain, [])
        if old and self.chance.random() < 0.5:
            return self.chance.choice(old)
        size, start = 10 ** self.chance.uniform(-1.5, 0.5), self.chance.uniform(-20, 20)
        store: type[Component]
        store, values, starts = {
            "Flange": (Inertia, {"J": size}, {"phi": 0.0, "w": start}),
            "LinearFlange": (Mass, {"m": 10 * size}, {"s": 0.0, "v": 0.05 * start}),
            "Pin": (Capacitor, {"C": 0.1 * size}, {"v": start}),
            "HeatPort": (ThermalMass, {"C": 1000 * size}, {"T": 320 + start}),
        }[domain]
        wire, name = f"{domain.lower()}{len(old)}", f"store_{len(self.parts)}"
        chosen = {key: value for key, value in starts.items() if f"{name}.{key}" not in self.free}
        self.parts[name] = store(**values, **chosen)
        self.wires[wire] = [f"{name}.{STORES[domain]}"]
        if domain == "Pin":
            self.wires.setdefault("ground", []).append(f"{name}.n")
            if "earth" not in self.parts:
                self.parts["earth"] = Ground()
                self.wires["ground"].append("earth.p")
        old.append(wire)
        return wire

    def power(self, number: int) -> None:
        """Add a part with ends."""
        part, ends = self.make(self.chance.choice(self.powered))
        name, taken = self.add(type(part).__name__, part), set[str]()
        for end, domain in ends:
            wire = self.wire(domain)
            while wire in taken:
                wire = self.wire(domain)
            taken.add(wire)
            self.wires[wire].append(f"{name}.{end}")
        self.feed(name, part, 1)

    def feed(self, name: str, part: Component, depth: int) -> None:
        """Give signals to the inputs of a part."""
        for field, declared in part.fields.items():
            if not isinstance(declared, Input) or field in inside(part).values:
                continue
            if declared.default is None or self.chance.random() < 0.4:
                self.wires[f"{name}_{field}"] = [self.source(str(declared.unit), depth), f"{name}.{field}"]

    def source(self, unit: str, depth: int) -> str:
        """Return the output of a signal that may have a unit."""
        size, moment = self.chance.uniform(0.1, 1.0), self.chance.uniform(0.05, 0.2)
        value = size if unit in ("1", "*") else f"{size} {unit}"
        if depth and unit in ("1", "*") and self.chance.random() < 0.4:
            part, _ = self.make(self.chance.choice(self.blocks))
            name = self.add("block", part)
            self.feed(name, part, depth - 1)
            outputs = [key for key, one in part.fields.items() if isinstance(one, Output)]
            return f"{name}.{outputs[0]}"
        zero = 0.0 if unit in ("1", "*") else f"0 {unit}"
        rows = ((0.0, 0.0), (moment, size), (2 * moment, 0.3 * size))
        part = self.chance.choice([
            lambda: components.Constant(k=value),
            lambda: components.Sine(amplitude=value, f=self.chance.uniform(0.5, 10)),
            lambda: components.Step(height=value, start_time=moment),
            lambda: components.Ramp(height=value, duration=moment),
            lambda: components.Pulse(amplitude=value, period=moment, width=0.4),
            lambda: components.Trapezoid(
                amplitude=value, period=4 * moment, rising=moment, width=moment, falling=moment
            ),
            lambda: components.SawTooth(amplitude=value, period=moment, offset=zero),
            lambda: components.Table(table=rows, scale=value),
            lambda: components.Cosine(amplitude=value, f=self.chance.uniform(0.5, 10)),
        ])()  # fmt: skip
        return f"{self.add('signal', part)}.y"


def _is_block(kind: Kind) -> bool:
    made = kind[0](**kind[1])
    return not made.connectors and {Input, Output} <= {type(one) for one in made.fields.values()}


def drive(seed: int) -> Assembly:
    """Return the drive of a seed; start values that contradict each other are left out, one after the other."""
    free = frozenset[str]()
    while True:
        made = _Builder(seed, free)
        wires = {name: ends for name, ends in made.wires.items() if len(ends) > 1}
        result = Assembly(f"drive{seed}", parts=made.parts, connect=wires)
        result.simulate.update(start="rest", until=END)
        try:
            initialize(build(result), start="rest")
        except ModelicaLikeError as error:
            named = re.findall(r"(store_\d+\.\w+) = ", str(error).partition("\n")[0])
            if named and not set(named) <= free:
                free |= {named[-1]}
                continue
        return result


def stored(made: Assembly) -> Iterator[str]:
    """Yield the variables that are compared: speeds, voltages and temperatures of what stores energy."""
    for name, part in made.parts.items():
        if name.startswith("store_"):
            yield f"{name}.{ {'Inertia': 'w', 'Mass': 'v', 'Capacitor': 'v', 'ThermalMass': 'T'}[type(part).__name__] }"
