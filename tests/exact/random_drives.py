"""Random drives for the exact solver, and the same drives in the language of the product.

All numbers have few binary digits, so that the product starts from exactly the same ones and ties are ties.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import frexp, log2

import numpy as np
from exact_drives import Drive, Element, Steps

from components import (
    Brake,
    Clutch,
    ConstantTorque,
    Fixed,
    Freewheel,
    IdealGear,
    Inertia,
    StepTable,
    Torque,
    TorqueStep,
)
from modelica_like import Assembly, Component

DIGITS = 10
"""Binary digits of a random number."""


def rounded(x: float) -> float:
    """Give the nearest number of few binary digits."""
    unit = 2.0 ** (frexp(x)[1] - DIGITS) if x else 1.0
    return round(x / unit) * unit


class Numbers:
    """Random numbers of one drive, of one of three tempers: of similar size, over six decades, of a few equal ones."""

    def __init__(self, r: np.random.Generator) -> None:
        self.r = r
        self.temper = str(r.choice(["similar", "decades", "equal"], p=[0.3, 0.4, 0.3]))

    def _positive(self, equal: list[float]) -> float:
        if self.temper == "equal":
            return float(self.r.choice(equal))
        decades = 3.0 if self.temper == "decades" else 0.5
        return rounded(10.0 ** self.r.uniform(-decades, decades))

    def inertia(self) -> float:
        return self._positive([1.0, 1.0, 2.0])

    def capacity(self) -> float:
        return self._positive([0.5, 1.0, 2.0, 4.0])

    def torque(self) -> float:
        if self.r.random() < 0.15:
            return 0.0
        return float(self.r.choice([-1, 1])) * 3 * self._positive([1.0, 1.0, 2.0])

    def speed(self) -> float:
        if self.r.random() < 0.3:
            return 0.0
        if self.temper == "equal":
            return float(self.r.choice([-2, -1, 1, 1, 2, 3]))
        return rounded(float(self.r.normal()) * 10.0 ** self.r.uniform(0, 2))

    def ratio(self) -> float:
        sizes = [1.0, 1.0, 2.0, 0.5] if self.temper == "equal" else [1.0, 2.0, 0.5, 3.0, 2.5, 0.625, 7.25, 40.0]
        return float(self.r.choice([-1, 1])) * float(self.r.choice(sizes))

    def steps(self, draw: Callable[[], float], until: float, most: int) -> Steps:
        """Give a signal with up to so many jumps, at sixty-fourths of the end time."""
        number = int(self.r.integers(0, most + 1))
        moments = sorted(self.r.choice(np.arange(1, 64), number, replace=False))
        return ((0.0, draw()), *((float(k) * until / 64, draw()) for k in moments))


def random_drive(number: int) -> Drive:
    """Give the drive of a number: a tree of shafts, loops, brakes, backstops and torques."""
    r = np.random.default_rng([number, 20])
    numbers = Numbers(r)
    size = int(r.integers(2, 9))
    J = tuple(numbers.inertia() for _ in range(size))
    w = tuple(numbers.speed() for _ in range(size))
    if r.random() < 0.1:
        w = (0.0,) * size
    loads = {int(k): numbers.torque() for k in r.choice(size, int(r.integers(1, min(size, 3) + 1)), replace=False)}
    until = _end(r, J, w, list(loads.values()))
    torques = tuple((k, numbers.steps(numbers.torque, until, 3)) for k in loads)
    joints = _tree(r, size) + _loops(r, size)
    elements = [_element(numbers, n, kind, a, b, until) for n, (kind, a, b) in enumerate(joints)]
    return Drive(J, w, tuple(_able_to_slip(elements, size)), torques, until)


def _end(r: np.random.Generator, J: tuple[float, ...], w: tuple[float, ...], torques: list[float]) -> float:
    """Give an end time, a power of two, by which typical torques stop typical inertias."""
    typical = float(np.median(J)) * (1.0 + max(abs(x) for x in w)) / (float(np.median(np.abs(torques))) or 1.0)
    return 2.0 ** round(log2(typical) + r.uniform(-1, 3))


def _tree(r: np.random.Generator, size: int) -> list[tuple[str, int | None, int]]:
    kinds, odds = ["clutch", "gear", "freewheel", "geared clutch", "geared freewheel"], [0.45, 0.15, 0.2, 0.12, 0.08]
    chain = r.random() < 0.5
    joints: list[tuple[str, int | None, int]] = []
    for k in range(1, size):
        ends = [k - 1 if chain else int(r.integers(0, k)), k]
        if r.random() < 0.3:
            ends.reverse()
        joints.append((str(r.choice(kinds, p=odds)), ends[0], ends[1]))
    return joints


def _loops(r: np.random.Generator, size: int) -> list[tuple[str, int | None, int]]:
    """Give elements beside those of the tree: parallel ones, loops, brakes and backstops."""
    joints: list[tuple[str, int | None, int]] = []
    for _ in range(int(r.choice([0, 0, 1, 2, 3]))):
        a, b = (int(k) for k in r.choice(size, 2, replace=False))
        joints.append((str(r.choice(["clutch", "geared clutch", "freewheel"], p=[0.5, 0.3, 0.2])), a, b))
    for _ in range(int(r.choice([0, 1, 1, 2, 3]))):
        kind = str(r.choice(["brake", "geared brake", "backstop"], p=[0.7, 0.15, 0.15]))
        joints.append((kind, None, int(r.integers(0, size))))
    return joints


def _element(numbers: Numbers, n: int, kind: str, a: int | None, b: int, until: float) -> Element:
    ratio = numbers.ratio() if kind.startswith("gear") else 1.0
    simple = "freewheel" if kind == "backstop" else kind.removeprefix("geared ")
    if simple in ("gear", "freewheel"):
        return Element(f"{simple}{n}", simple, a, b, ratio)
    # Some are actuated: pressed more or less, or not at all.
    actuated = numbers.r.random() < 0.2
    full = numbers.capacity()
    share = [0.0, 0.25, 0.5, 1.0]
    steps = numbers.steps(lambda: full * float(numbers.r.choice(share)), until, 3) if actuated else ((0.0, full),)
    return Element(f"{simple}{n}", simple, a, b, ratio, steps)


def _able_to_slip(elements: list[Element], size: int) -> list[Element]:
    """Leave out what joins shafts whose speeds are in the same ratio anyway."""
    ratios = {k: (k, 1.0) for k in range(size)}
    kept = []
    for e in sorted(elements, key=lambda e: e.kind != "gear"):
        if e.kind == "gear" and e.a is not None:
            (root_a, by_a), (root_b, by_b) = ratios[e.a], ratios[e.b]
            for k, (root, by) in list(ratios.items()):
                if root == root_b:
                    ratios[k] = (root_a, by * by_a / (e.ratio * by_b))
        elif e.a is not None:
            (root_a, by_a), (root_b, by_b) = ratios[e.a], ratios[e.b]
            if root_a == root_b and abs(e.ratio * by_b / by_a - 1) < 1e-9:
                continue
        kept.append(e)
    return [e for e in elements if e in kept]


def assembly(drive: Drive, given: bool = False) -> Assembly:
    """Give a drive as a component of the product: one node per shaft, named as its inertia.

    Speeds of zero are left to `start = "rest"`, if they are not to be given.
    """
    parts: dict[str, Component] = {}
    wires: dict[str, list[str]] = {f"shaft{k}": [f"J{k}.flange_b"] for k in range(len(drive.J))}
    follows = _followers(drive)
    for k, (J, w) in enumerate(zip(drive.J, drive.w, strict=True)):
        parts[f"J{k}"] = Inertia(J=J) if k in follows or not (w or given) else Inertia(J=J, w=w)
    for e in drive.elements:
        _add_element(e, parts, wires)
    for n, (inertia, steps) in enumerate(drive.torques):
        end = _add_torque(f"tau{n}", steps, parts, wires)
        wires[f"shaft{inertia}"].append(end)
    return Assembly("drive", parts=parts, connect={name: tuple(ends) for name, ends in wires.items() if len(ends) > 1})


def _followers(drive: Drive) -> set[int]:
    """Give the inertias whose speed follows from that of an earlier one through gears."""
    group = list(range(len(drive.J)))
    for e in drive.elements:
        if e.kind == "gear" and e.a is not None:
            low, high = sorted((group[e.a], group[e.b]))
            group = [low if g == high else g for g in group]
    return {k for k, g in enumerate(group) if g != k}


def _add_element(e: Element, parts: dict[str, Component], wires: dict[str, list[str]]) -> None:
    shaft_b = wires[f"shaft{e.b}"]
    if e.kind == "gear":
        parts[e.name] = IdealGear(ratio=e.ratio)
        wires[f"shaft{e.a}"].append(f"{e.name}.flange_a")
        shaft_b.append(f"{e.name}.flange_b")
        return
    parts[e.name], near, far = _coupling(e, parts, wires)
    if e.kind != "brake":
        if e.a is None:
            parts[f"{e.name}_ground"] = Fixed()
            wires[f"{e.name}_foot"] = [near, f"{e.name}_ground.flange"]
        else:
            wires[f"shaft{e.a}"].append(near)
    if e.ratio == 1.0:
        shaft_b.append(far)
    else:
        parts[f"{e.name}_gear"] = IdealGear(ratio=e.ratio)
        wires[f"{e.name}_shaft"] = [far, f"{e.name}_gear.flange_a"]
        shaft_b.append(f"{e.name}_gear.flange_b")


def _coupling(e: Element, parts: dict[str, Component], wires: dict[str, list[str]]) -> tuple[Component, str, str]:
    """Give a clutch, brake or freewheel, its near end (to inertia a) and its far one."""
    a, b = f"{e.name}.flange_a", f"{e.name}.flange_b"
    if e.kind == "freewheel":
        return Freewheel(), a, b
    full = max(value for _, value in e.capacity)
    if len(e.capacity) > 1:
        parts[f"{e.name}_press"] = StepTable(table=tuple((t, value / (full or 1.0)) for t, value in e.capacity))
        wires[f"{e.name}_pressed"] = [f"{e.name}_press.y", f"{e.name}.f_normalized"]
    return (Brake(capacity=full), "", a) if e.kind == "brake" else (Clutch(capacity=full), a, b)


def _add_torque(name: str, steps: Steps, parts: dict[str, Component], wires: dict[str, list[str]]) -> str:
    """Add a source and give its flange: constant, with one step, or from a table."""
    if len(steps) == 1:
        parts[name] = ConstantTorque(tau_constant=steps[0][1])
    elif len(steps) == 2:
        (_, before), (moment, after) = steps
        parts[name] = TorqueStep(offset_torque=before, step_torque=after - before, start_time=moment)
    else:
        parts[name] = Torque()
        parts[f"{name}_steps"] = StepTable(table=steps)
        wires[f"{name}_signal"] = [f"{name}_steps.y", f"{name}.tau"]
    assert all(t < later for (t, _), (later, _) in pairwise(steps))
    return f"{name}.flange"
