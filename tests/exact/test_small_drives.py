"""The smallest drives of every kind that was once refused or wrong, in the product and exactly."""

import pytest
from drive_runs import judge
from exact_drives import Drive, Element, Steps, run_exactly


def steady(value: float) -> Steps:
    return ((0.0, value),)


def clutch(name: str, a: int, b: int, capacity: float = 1.0, ratio: float = 1.0) -> Element:
    return Element(name, "clutch", a, b, ratio, steady(capacity))


def brake(name: str, b: int, capacity: float = 1.0) -> Element:
    return Element(name, "brake", None, b, 1.0, steady(capacity))


def freewheel(name: str, a: int | None, b: int, ratio: float = 1.0) -> Element:
    return Element(name, "freewheel", a, b, ratio)


def drive(
    J: tuple[float, ...], w: tuple[float, ...], *elements: Element, until: float = 4.0, **torques: float
) -> Drive:
    """Give a drive with constant torques, `t0=3.0` on inertia 0."""
    on = tuple((int(name[1:]), steady(value)) for name, value in torques.items())
    return Drive(J, w, elements, on, until)


SMALL = {
    # What is not given is at rest, whichever way round the clutch is.
    "rest behind a clutch": drive((1, 1), (1, 0), clutch("c", 1, 0)),
    "rest before a clutch": drive((1, 1), (1, 0), clutch("c", 0, 1)),
    "rest behind a clutch, braked": drive((1, 1), (0, 1), clutch("c", 0, 1), brake("b", 1)),
    # The same motion is held more than once.
    "parallel clutches": drive((1, 1), (1, 0), clutch("c", 0, 1), clutch("d", 0, 1)),
    "parallel clutches at rest": drive((1, 1), (0, 0), clutch("c", 0, 1), clutch("d", 0, 1), t0=1.0),
    "parallel clutches that break away": drive((1, 1), (0, 0), clutch("c", 0, 1), clutch("d", 0, 1, 2), t0=7.0),
    "clutch between braked shafts": drive((1, 1), (0, 0), clutch("c", 0, 1), brake("b", 0), brake("d", 1)),
    "clutch between braked shafts, driven": drive(
        (1, 1), (0, 0), clutch("c", 0, 1), brake("b", 0), brake("d", 1), t0=1.5
    ),
    "the first brake of three breaks away": drive(
        (1, 1), (0, 0), clutch("c", 0, 1, 0.25), brake("b", 0), brake("d", 1, 4), t0=2.0
    ),
    # The second impact of the instant meets what the first one stopped, from the speeds before both.
    "opposed freewheels, and one more": drive(
        (1, 1, 1), (0, -55.375, -2.25), freewheel("c", 0, 1), freewheel("d", 2, 0), freewheel("e", 1, 0), until=1.0
    ),
    # The least torques in measure of the capacities would be 1.06 and 0.07 N.m: too much for the brake of 1 N.m.
    "held, although the least split exceeds a capacity": drive(
        (1, 1), (0, 0), clutch("c", 0, 1, 0.25), brake("b", 0), brake("d", 1, 4), t0=1.125
    ),
    "parallel clutches beside a freewheel at rest": drive(
        (1, 1, 1, 1), (0, 0, 0, 0), clutch("c", 0, 1), clutch("d", 2, 1), clutch("e", 2, 1), freewheel("f", 0, 3)
    ),
    "two brakes on one shaft": drive((1,), (1,), brake("b", 0), brake("d", 0, 2), t0=2.5),
    "ring of three clutches": drive(
        (1, 1, 1), (3, 0, -1), clutch("c", 0, 1), clutch("d", 1, 2), clutch("e", 2, 0), until=8.0
    ),
    "ring with a gear that blocks it": drive(
        (1, 1), (0, 0), clutch("c", 0, 1), clutch("d", 0, 1, 2, ratio=-1.0), t0=2.0
    ),
    "ring with a gear comes to rest": drive((1, 1), (4, 0), clutch("c", 0, 1), clutch("d", 0, 1, 2, -1.0), until=16.0),
    "geared shafts with three brakes": drive(
        (1, 1, 1), (0, 1, 0), Element("g", "gear", 2, 0, 1.0), clutch("c", 1, 0), brake("b", 0), brake("d", 1),
        brake("e", 2),
    ),
    "clutch beside a freewheel": drive((1, 1), (0, 0), freewheel("f", 0, 1), clutch("c", 1, 0), t0=1.0),
    "clutch beside a freewheel, overrunning": drive((1, 1), (0, 3), freewheel("f", 0, 1), clutch("c", 1, 0), until=8.0),
    "two freewheels, one each way": drive((1, 1), (0, 0), freewheel("f", 0, 1), freewheel("g", 1, 0), t0=1.0),
    # Impacts.
    "backstop against the motion": drive((1,), (-3,), freewheel("f", None, 0)),
    "lagging freewheel": drive((1, 2), (5, 0), freewheel("f", 0, 1)),
    "lagging freewheel with a load": drive((1, 2), (5, 0), freewheel("f", 0, 1), t1=-1.0),
    "lagging freewheel behind a gear": drive((1, 1), (6, 1), freewheel("f", 0, 1, 2.0)),
    "impact does not go through a clutch": drive((1, 1, 2), (8, 0, 0), freewheel("f", 0, 1), clutch("c", 1, 2)),
    "impact does not go through a brake": drive((1, 1), (8, 0), freewheel("f", 0, 1), brake("b", 1)),
    "impact goes through a locked freewheel": drive((1, 1, 2), (8, 0, 0), freewheel("f", 0, 1), freewheel("g", 1, 2)),
    "impact makes the next freewheel lag": drive((1, 1, 2), (8, 0, 1), freewheel("f", 0, 1), freewheel("g", 1, 2)),
    "impact releases a freewheel": drive((1, 1, 1), (8, 0, 0), freewheel("f", 0, 1), freewheel("g", 2, 1)),
    "both lag, the faster one drives alone": drive((1, 1, 1), (10, 0, 1), freewheel("f", 0, 1), freewheel("g", 2, 1)),
    "freewheels each way meet at once": drive((1, 3), (4, 0), freewheel("f", 0, 1), freewheel("g", 1, 0)),
    # Freewheels in series.
    "freewheels in series, driven": drive((1, 2, 1), (0, 0, 0), freewheel("f", 0, 1), freewheel("g", 1, 2), t0=3.0),
    "freewheels in series, released": drive((1, 2, 1), (1, 1, 1), freewheel("f", 0, 1), freewheel("g", 1, 2), t0=-3.0),
    "freewheels in series, pulled": drive((1, 2, 1), (1, 1, 1), freewheel("f", 0, 1), freewheel("g", 1, 2), t2=3.0),
    "freewheels in series meet one by one": drive(
        (1, 2, 1), (0, 3, 4), freewheel("f", 0, 1), freewheel("g", 1, 2), t0=2.0, until=16.0
    ),
    "a freewheel between slipping clutches": drive(
        (1, 1, 1, 283), (0, 0, 0, 0), clutch("c", 1, 0), freewheel("f", 1, 2), clutch("d", 2, 3, 0.001953125), t0=262.5
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SMALL)
def test_small_drive(name):
    outcome = judge(SMALL[name])
    assert not outcome.category, str(outcome)


def test_freewheels_do_not_pull_in_an_impact():
    """Equal inertias: 10 and 0 rad/s meet at 5; the third one, at 1 rad/s, is overrun and keeps its speed."""
    assert run_exactly(SMALL["both lag, the faster one drives alone"]).final == [5.0, 5.0, 1.0]
    assert run_exactly(SMALL["impact releases a freewheel"]).final == [4.0, 4.0, 0.0]
