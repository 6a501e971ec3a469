"""Random trees of inertias, gears, planetary sets, springs, clutches, brakes, bearings, freewheels and backlash."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from hypothesis import strategies as st

from components import (
    BearingFriction,
    Brake,
    Clutch,
    ConstantTorque,
    Damper,
    ElastoBacklash,
    Freewheel,
    IdealGear,
    IdealPlanetary,
    Inertia,
    Spring,
    SpringDamper,
)
from modelica_like import Assembly, Component

RIGID = ("gear", "planet")
SOFT = ("spring", "elastic", "damper", "clutch", "freewheel", "backlash")


@dataclass(frozen=True)
class Joint:
    """What joins two shafts, or three (planetary sets: sun, ring, carrier).

    Attributes:
        number: its own: ratio, natural frequency in rad/s, or part of the typical torque.
        more: a second one: damping ratio, or backlash in rad.
        turned: flange_a and flange_b have changed places.
    """

    name: str
    kind: str
    ends: tuple[int, ...]
    number: float
    more: float
    turned: bool = False


@dataclass(frozen=True)
class Tree:
    """A drive.

    Attributes:
        J: inertias in kg.m2.
        w: their speeds at the start in rad/s; those that follow from others through gears do not count.
        torques: constant torques in N.m, by shaft.
        brakes: friction torques to the housing, by shaft: of brakes and bearings.
        parts: each inertia is made of two, of which the first has this part.
    """

    J: tuple[float, ...]
    w: tuple[float, ...]
    joints: tuple[Joint, ...]
    torques: tuple[tuple[int, float], ...]
    brakes: tuple[tuple[int, str, float], ...]
    parts: float = 1.0
    in_series: float = 1.0

    @property
    def mirrored(self) -> Tree:
        """Everything turns the other way round."""
        joints = tuple(replace(one, turned=not one.turned) if one.kind == "freewheel" else one for one in self.joints)
        w, torques = tuple(-one for one in self.w), tuple((shaft, -tau) for shaft, tau in self.torques)
        return replace(self, w=w, torques=torques, joints=joints)

    @property
    def swapped(self) -> Tree:
        """What joins two shafts stands the other way round; the ratio of a gear is inverted."""
        joints = tuple(
            one if one.kind in ("planet", "freewheel")
            else replace(one, ends=one.ends[::-1], number=1 / one.number if one.kind == "gear" else one.number)
            for one in self.joints
        )  # fmt: skip
        return replace(self, joints=joints)

    def groups(self) -> list[int]:
        """For every shaft the first one whose speed decides its own, through gears; planetary sets have two."""
        group = list(range(len(self.J)))
        for one in self.joints:
            if one.kind == "gear":
                low, high = sorted(group[end] for end in one.ends)
                group = [low if number == high else number for number in group]
        return group

    def free(self) -> set[int]:
        """Shafts whose speeds are given: one for each motion that is free."""
        group = self.groups()
        carriers = {group[one.ends[2]] for one in self.joints if one.kind == "planet"}
        return {number for number, first in enumerate(group) if number == first and first not in carriers}

    def motions(self) -> np.ndarray:
        """Speeds of all shafts by those of the free ones, in their order; shape (shafts, free ones)."""
        free = sorted(self.free())
        rows = dict(zip(free, np.eye(len(free)), strict=True))
        while len(rows) < len(self.J):
            for one in self.joints:
                known = [end in rows for end in one.ends]
                if one.kind == "gear" and any(known):
                    a, b = one.ends
                    rows.setdefault(b, rows[a] / one.number if known[0] else rows.get(b))
                    rows.setdefault(a, rows[b] * one.number)
                elif one.kind == "planet" and all(known[:2]):
                    sun, ring, carrier = one.ends
                    rows[carrier] = (rows[sun] + one.number * rows[ring]) / (1 + one.number)
        return np.array([rows[k] for k in range(len(self.J))])

    def start(self) -> np.ndarray:
        """Speeds before the run, in rad/s; freewheels that lag take some of them away."""
        return self.motions() @ [self.w[k] for k in sorted(self.free())]


def decade(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers whose logarithm is spread evenly, with digits that make no ties."""
    return st.floats(low, high).map(lambda x: 10.0**x)


signs = st.sampled_from([-1.0, 1.0])


@st.composite
def trees(draw: st.DrawFn, kinds: tuple[str, ...] = RIGID + SOFT, most: int = 6) -> Tree:
    """Draw a tree of joints over six decades."""
    size, joints = 1, []
    for number in range(draw(st.integers(1, most))):
        kind = draw(st.sampled_from(kinds))
        start = draw(st.integers(0, size - 1))
        more = draw(decade(-3, 0))
        if kind == "planet":
            joints.append(Joint(f"planet{number}", kind, (start, size, size + 1), draw(st.floats(1.2, 5)), more))
            size += 2
            continue
        value = draw(signs) * draw(decade(-1, 1)) if kind == "gear" else draw(decade(-1, 2))
        ends = (start, size) if draw(st.booleans()) else (size, start)
        joints.append(Joint(f"{kind}{number}", kind, ends, value, more))
        size += 1
    shafts = st.integers(0, size - 1)
    torque = draw(decade(-3, 3))
    return Tree(
        J=tuple(draw(decade(-3, 3)) for _ in range(size)),
        w=tuple(draw(signs) * draw(decade(-2, 2)) for _ in range(size)),
        joints=tuple(joints),
        torques=tuple(
            (draw(shafts), draw(signs) * torque * draw(decade(-1, 1))) for _ in range(draw(st.integers(0, 2)))
        ),
        brakes=tuple(
            (draw(shafts), draw(st.sampled_from(["brake", "bearing"])), torque * draw(decade(-1, 1)))
            for _ in range(draw(st.integers(0, 2)) if "clutch" in kinds else 0)
        ),
    )


@dataclass
class _Wiring:
    """Parts and what meets at each shaft."""

    rename: Callable[[str], str]
    parts: dict[str, Component] = field(default_factory=dict)
    wires: dict[str, list[str]] = field(default_factory=dict)

    def add(self, name: str, part: Component, **ends: str) -> None:
        """Add a part; each flange goes to a wire."""
        self.parts[self.rename(name)] = part
        for flange, wire in ends.items():
            self.wires.setdefault(wire, []).append(f"{self.rename(name)}.{flange}")


def assembly(tree: Tree, *, shuffle: int = 0, rename: Callable[[str], str] = str, **simulate: Any) -> Assembly:
    """Give the drive in the language of the product.

    Args:
        tree: the drive.
        shuffle: order of parts, wires and ends; 0 leaves them.
        rename: gives other names.
        simulate: how it is run.
    """
    made, free = _Wiring(rename), tree.free()
    groups = set(tree.groups())
    for k, J in enumerate(tree.J):
        values = {"w": tree.w[k]} if k in free else {}
        values |= {"phi": 0.0} if k in groups & free else {}
        made.add(f"J{k}", Inertia(J=J * tree.parts, **values), flange_b=f"shaft{k}")
        if tree.parts < 1:
            made.add(f"rest{k}", Inertia(J=J * (1 - tree.parts)), flange_a=f"shaft{k}")
    for one in tree.joints:
        _join(made, tree, one)
    for n, (shaft, tau) in enumerate(tree.torques):
        made.add(f"torque{n}", ConstantTorque(tau_constant=tau), flange=f"shaft{shaft}")
    for n, (shaft, kind, tau) in enumerate(tree.brakes):
        part = Brake(capacity=tau) if kind == "brake" else BearingFriction(tau_pos=((0, tau), (100, 2 * tau)))
        made.add(f"{kind}{n}", part, flange_a=f"shaft{shaft}")
    chance, order = random.Random(shuffle), list(made.parts)
    wires = {made.rename(name): ends for name, ends in made.wires.items() if len(ends) > 1}
    if shuffle:
        chance.shuffle(order)
        for ends in wires.values():
            chance.shuffle(ends)
        wires = dict(chance.sample(list(wires.items()), len(wires)))
    drive = Assembly("tree", parts={name: made.parts[name] for name in order}, connect=wires)
    drive.simulate.update(simulate)
    return drive


def _join(made: _Wiring, tree: Tree, one: Joint) -> None:
    shafts = [f"shaft{end}" for end in one.ends]
    if one.kind == "planet":
        made.add(one.name, IdealPlanetary(ratio=one.number), sun=shafts[0], ring=shafts[1], carrier=shafts[2])
        return
    near, far = shafts[::-1] if one.turned else shafts
    lighter = min(tree.J[end] for end in one.ends)
    c, d = lighter * one.number**2, 2 * one.more * lighter * one.number
    if one.kind == "elastic" and tree.in_series < 1:
        for name, share, a, b in (("", tree.in_series, near, one.name), ("_rest", 1 - tree.in_series, one.name, far)):
            part = SpringDamper(c=c / share, d=d / share, **({"phi_rel": 0.0} if not name else {}))
            made.add(f"{one.name}{name}", part, flange_a=a, flange_b=b)
        return
    parts: dict[str, Callable[[], Component]] = {
        "gear": lambda: IdealGear(ratio=one.number),
        "spring": lambda: Spring(c=c),
        "elastic": lambda: SpringDamper(c=c, d=d),
        "damper": lambda: Damper(d=d),
        "clutch": lambda: Clutch(capacity=lighter * one.number**2),
        "freewheel": Freewheel,
        "backlash": lambda: ElastoBacklash(c=c, d=d, b=one.more),
    }
    made.add(one.name, parts[one.kind](), flange_a=near, flange_b=far)
