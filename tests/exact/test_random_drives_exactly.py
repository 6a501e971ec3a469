"""Random trees and loops of inertias, gears, clutches, brakes and freewheels: the product is right in every one.

`RANDOM_DRIVES=2000 pytest -m slow tests/exact` does more; the slow suite has 500, and some that were hard. A
drive that fails runs alone with `python tests/exact/drive_runs.py --drive NUMBER`, and `--shrink` makes it small.
"""

import pytest
from drive_runs import DRIVES, judge, judged, summary
from random_drives import random_drive

ORDINARY = 75
BLOCK = 50
HARD = (450, 475, 1546, 1862, 1883, 1991)
"""Drives that were the last to be right: loops at rest, ties between torque and capacity, slips held for minutes."""


@pytest.mark.parametrize("number", [*range(ORDINARY), *HARD])
def test_drive(number):
    outcome = judge(random_drive(number), number)
    assert not outcome.category, str(outcome)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(ORDINARY, DRIVES, BLOCK))
def test_block_of_drives(first):
    outcomes = list(judged(range(first, min(first + BLOCK, DRIVES))))
    wrong = [outcome.number for outcome in outcomes if outcome.category]
    assert not wrong, summary(outcomes)
