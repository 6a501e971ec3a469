"""Drives of inertias, rigid gears, clutches, brakes and freewheels, solved exactly: in fractions, without any rounding.

Torques and capacities are piecewise constant, so that between events all accelerations are constant and all speeds are
straight lines. Nothing here uses the product.

Kinematics: the speeds of geared inertias follow from those of the free ones, w = T·q. The slip of an element is a
linear form g·q. M = TᵀJT is the inertia of the free speeds.

At any instant the accelerations minimise ½aᵀMa - aᵀf + Σ capacity·|g·a| over the friction elements whose slip is zero,
where no freewheel whose slip is zero may fall behind, g·a ≥ 0. Friction elements that slip act on f. The problem is
strictly convex in a, so the accelerations are unique, whether or not the torques are. It is solved in its dual: the
torques λ minimise ½λᵀHλ - λᵀr, H = G M⁻¹ Gᵀ, r = G M⁻¹ f, in a box, |λ| ≤ capacity of friction, λ ≤ 0 of freewheels
(λ acts against the slip). The slip accelerations are y = r - Hλ.

A freewheel that lags at the start is an impact: the speeds v after it minimise ½(v - w)ᵀM(v - w) where no freewheel
falls behind. This is the same dual problem, without friction.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

Vector = list[Fraction]
Matrix = list[Vector]
Steps = tuple[tuple[float, float], ...]
"""Times and values: a value holds until the next time; before the first time the first value does."""

ZERO = Fraction(0)
MOST_EVENTS = 2000
MOST_PIVOTS = 5000


@dataclass(frozen=True)
class Element:
    """What joins inertia `a` (None: the housing) and inertia `b`: its slip is ratio·w[b] - w[a].

    Attributes:
        kind: `gear` (no slip), `clutch`, `brake` (a clutch to the housing) or `freewheel` (slip ≥ 0).
        capacity: friction torque over time, of clutches and brakes.
    """

    name: str
    kind: str
    a: int | None
    b: int
    ratio: float = 1.0
    capacity: Steps = ()


@dataclass(frozen=True)
class Drive:
    """Inertias, kg.m2, with start speeds, rad/s (of geared ones that of the first counts), elements, and torques.

    Attributes:
        torques: torque over time, on an inertia.
    """

    J: tuple[float, ...]
    w: tuple[float, ...]
    elements: tuple[Element, ...]
    torques: tuple[tuple[int, Steps], ...]
    until: float


@dataclass
class Run:
    """What happened: speeds of all inertias at the corners of their straight lines, and energies in J.

    Attributes:
        times: start, events and end; the speeds at the start are those after the impact.
        events: time, element (empty: a torque jumps) and what it does.
        impact: energy lost in the impact at the start.
        friction: energy lost by friction.
        work: energy that the torques brought in.
        stored: kinetic energy, before the impact and at the end.
    """

    times: Vector = field(default_factory=list)
    speeds: list[Vector] = field(default_factory=list)
    events: list[tuple[Fraction, str, str]] = field(default_factory=list)
    impact: Fraction = ZERO
    friction: Fraction = ZERO
    work: Fraction = ZERO
    stored: tuple[Fraction, Fraction] = (ZERO, ZERO)

    @property
    def final(self) -> list[float]:
        return [float(w) for w in self.speeds[-1]]

    @property
    def largest(self) -> list[float]:
        """Largest speed that every inertia had."""
        return [float(max(abs(w) for w in of_one)) for of_one in zip(*self.speeds, strict=True)]

    @property
    def residual(self) -> Fraction:
        """Energy that is missing: zero."""
        return self.stored[0] + self.work - self.friction - self.impact - self.stored[1]


def dot(a: Sequence[Fraction], b: Sequence[Fraction]) -> Fraction:
    return sum((x * y for x, y in zip(a, b, strict=True) if x and y), ZERO)


def solve(A: Matrix, b: Vector) -> Vector:
    """Solve A·x = b by elimination; A is not singular."""
    rows = [[*row, rhs] for row, rhs in zip(A, b, strict=True)]
    n = len(rows)
    for k in range(n):
        pivot = next(i for i in range(k, n) if rows[i][k])
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for i in range(k + 1, n):
            factor = rows[i][k] / rows[k][k]
            if factor:
                rows[i] = [ZERO] * (k + 1) + [
                    x - factor * y for x, y in zip(rows[i][k + 1 :], rows[k][k + 1 :], strict=True)
                ]
    x: Vector = [ZERO] * n
    for k in reversed(range(n)):
        x[k] = (rows[k][n] - dot(rows[k][k + 1 : n], x[k + 1 :])) / rows[k][k]
    return x


def boxed(H: Matrix, r: Vector, low: Sequence[Fraction | None], high: Sequence[Fraction]) -> tuple[Vector, Vector]:
    """Minimise ½λᵀHλ - λᵀr in the box low ≤ λ ≤ high (None: unbounded), H positive semidefinite.

    Active set method with the rule of the least index (no cycles): `free` are the elements between their bounds, all
    others are at one. Give λ and y = r - Hλ, which is zero in the free ones, ≥ 0 at the upper, ≤ 0 at the lower bound.
    """
    m = len(r)
    lam = [high[k] if low[k] is None or r[k] >= 0 else low[k] for k in range(m)]
    free: list[int] = []
    for _ in range(MOST_PIVOTS):
        y = [r[k] - dot(H[k], lam) for k in range(m)]
        if any(y[k] for k in free):
            step = solve([[H[i][j] for j in free] for i in free], [y[k] for k in free])
            share, stopped = _room(free, lam, step, low, high)
            for k, d in zip(free, step, strict=True):
                lam[k] += share * d
            if stopped is not None:
                free.remove(stopped)
            continue
        entering = [k for k in range(m) if k not in free and low[k] != high[k] and not _rests(k, lam, y, low, high)]
        if not entering:
            return lam, y
        free = sorted([*free, entering[0]])
    raise ArithmeticError("The active set method does not end.")


def _room(
    free: list[int], lam: Vector, step: Vector, low: Sequence[Fraction | None], high: Sequence[Fraction]
) -> tuple[Fraction, int | None]:
    """Give the largest part of a step that stays in the box, and which element stops it."""
    share, stopped = Fraction(1), None
    for k, d in zip(free, step, strict=True):
        bound = high[k] if d > 0 else low[k]
        if d and bound is not None and (bound - lam[k]) / d < share:
            share, stopped = (bound - lam[k]) / d, k
    return share, stopped


def _rests(k: int, lam: Vector, y: Vector, low: Sequence[Fraction | None], high: Sequence[Fraction]) -> bool:
    """Whether an element at a bound may stay there."""
    if lam[k] == high[k]:
        return y[k] >= 0
    return lam[k] == low[k] and y[k] <= 0


def value(steps: Steps, t: Fraction) -> Fraction:
    """Give the value of a stepped signal just after a time."""
    return Fraction([v for moment, v in steps if moment <= t or moment == steps[0][0]][-1])


def rigid(drive: Drive) -> tuple[Matrix, list[int]]:
    """Give T (w = T·q) and which inertias are free, those without a gear to an inertia before them."""
    ratios: dict[int, tuple[int, Fraction]] = {k: (k, Fraction(1)) for k in range(len(drive.J))}
    for gear in (e for e in drive.elements if e.kind == "gear"):
        assert gear.a is not None
        (root_a, by_a), (root_b, by_b) = ratios[gear.a], ratios[gear.b]
        assert root_a != root_b, f"{gear.name} closes a loop of gears"
        # by_a·q_a = ratio·by_b·q_b; the later root follows the earlier one.
        factor = by_a / (Fraction(gear.ratio) * by_b)
        gone, stays, factor = (root_b, root_a, factor) if root_a < root_b else (root_a, root_b, 1 / factor)
        for k, (root, by) in ratios.items():
            if root == gone:
                ratios[k] = (stays, by * factor)
    free = sorted({root for root, _ in ratios.values()})
    return [[by if root == f else ZERO for f in free] for root, by in ratios.values()], free


class ExactDrive:
    """A drive in its free speeds q."""

    def __init__(self, drive: Drive) -> None:
        self.drive = drive
        self.T, self.free = rigid(drive)
        n = len(self.free)
        columns = list(zip(*self.T, strict=True))
        J = [Fraction(j) for j in drive.J]
        self.M = [[sum((j * x * y for j, x, y in zip(J, columns[i], columns[k], strict=True)), ZERO) for k in range(n)]
                  for i in range(n)]  # fmt: skip
        self.J = J
        # An element that cannot slip at all, e.g. a clutch between shafts of equal speed in one gear train, does
        # nothing.
        every = [(e, self._slip(e)) for e in drive.elements if e.kind != "gear"]
        self.elements = [e for e, g in every if any(g)]
        self.G = [g for _, g in every if any(g)]
        self.MinvG = [solve(self.M, g) for g in self.G]
        self.H = [[dot(g, v) for v in self.MinvG] for g in self.G]

    def _slip(self, e: Element) -> Vector:
        behind = self.T[e.a] if e.a is not None else [ZERO] * len(self.free)
        return [Fraction(e.ratio) * b - a for a, b in zip(behind, self.T[e.b], strict=True)]

    def _part(self, which: list[int]) -> Matrix:
        return [[self.H[i][j] for j in which] for i in which]

    def impact(self, q: Vector) -> Vector:
        """Give the speeds after freewheels that lag have locked."""
        which = [k for k, e in enumerate(self.elements) if e.kind == "freewheel"]
        slips = [dot(self.G[k], q) for k in which]
        if all(s >= 0 for s in slips):
            return q
        lam, _ = boxed(self._part(which), slips, [None] * len(which), [ZERO] * len(which))
        for k, impulse in zip(which, lam, strict=True):
            q = [x - impulse * v for x, v in zip(q, self.MinvG[k], strict=True)]
        return q

    def accelerations(self, t: Fraction, slips: Vector) -> Vector:
        """Give the accelerations of the free speeds just after a time."""
        f = self.torque(t)
        resting, low, high = [], [], []
        for k, (e, s) in enumerate(zip(self.elements, slips, strict=True)):
            capacity = value(e.capacity, t) if e.kind != "freewheel" else ZERO
            if s and capacity:
                f = [x - capacity * g if s > 0 else x + capacity * g for x, g in zip(f, self.G[k], strict=True)]
            elif not s and (capacity or e.kind == "freewheel"):
                resting.append(k)
                low.append(None if e.kind == "freewheel" else -capacity)
                high.append(capacity)
        a = solve(self.M, f)
        lam, y = boxed(self._part(resting), [dot(self.G[k], a) for k in resting], low, high)
        for k, torque in zip(resting, lam, strict=True):
            a = [x - torque * v for x, v in zip(a, self.MinvG[k], strict=True)]
        assert all(dot(self.G[k], a) == slope for k, slope in zip(resting, y, strict=True))
        return a

    def torque(self, t: Fraction) -> Vector:
        """Give the outer torques on the free speeds."""
        f = [ZERO] * len(self.free)
        for inertia, steps in self.drive.torques:
            f = [x + value(steps, t) * by for x, by in zip(f, self.T[inertia], strict=True)]
        return f

    def energy(self, q: Vector) -> Fraction:
        return dot(q, [dot(row, q) for row in self.M]) / 2

    def slips(self, q: Vector) -> Vector:
        return [dot(g, q) for g in self.G]

    def speeds(self, q: Vector) -> Vector:
        return [dot(row, q) for row in self.T]


def moments(drive: Drive) -> Iterable[Fraction]:
    """Give the times at which a torque or a capacity jumps."""
    for steps in [steps for _, steps in drive.torques] + [e.capacity for e in drive.elements]:
        for moment, _ in steps[1:]:
            yield Fraction(moment)


def run_exactly(drive: Drive) -> Run:
    """Follow a drive from zero to its end time."""
    model = ExactDrive(drive)
    before = [Fraction(drive.w[k]) for k in model.free]
    t, q, end = ZERO, model.impact(before), Fraction(drive.until)
    run = Run(times=[t], speeds=[model.speeds(q)], impact=model.energy(before) - model.energy(q))
    jumps = sorted({moment for moment in moments(drive) if 0 < moment < end})
    slips = model.slips(q)
    for _ in range(MOST_EVENTS):
        a = model.accelerations(t, slips)
        rates = model.slips(a)
        following = next((moment for moment in jumps if moment > t), end)
        ends = [(-s / r, k) for k, (s, r) in enumerate(zip(slips, rates, strict=True)) if s * r < 0]
        dt = min([following - t, *(d for d, _ in ends)])
        _tell(run, model, t, slips, rates)
        after = [x + dt * slope for x, slope in zip(q, a, strict=True)]
        half = dt / 2
        run.work += half * dot(model.torque(t), [x + y for x, y in zip(q, after, strict=True)])
        for e, s, later in zip(model.elements, slips, model.slips(after), strict=True):
            if e.kind != "freewheel":
                run.friction += half * value(e.capacity, t) * abs(s + later)
        t, q, slips = t + dt, after, model.slips(after)
        run.times.append(t)
        run.speeds.append(model.speeds(q))
        if t == end:
            run.stored = (model.energy(before), model.energy(q))
            return run
    raise ArithmeticError(f"More than {MOST_EVENTS} events.")


def _tell(run: Run, model: ExactDrive, t: Fraction, slips: Vector, rates: Vector) -> None:
    """Add what changes at a time to the events of a run."""
    told = {name: what for _, name, what in run.events}
    for e, s, r in zip(model.elements, slips, rates, strict=True):
        what = "holds" if not s and not r else "slips"
        if told.get(e.name) != what:
            run.events.append((t, e.name, what))
