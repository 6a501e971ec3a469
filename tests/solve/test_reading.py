"""Blocks in which variables are read along a run."""

import numpy as np
import pytest

from modelica_like.solve.reading import blocks
from modelica_like.solve.recorder import Segment

MOST = 65_536


def segment(number: int, size: int) -> Segment:
    times = np.linspace(number, number + 1, size)
    return Segment(times, np.array([times, -times]), np.array([2 * times]), np.array([float(number)]))


@pytest.mark.parametrize(
    "sizes", [[3], [2, 2, 2], [MOST], [MOST - 1, 1, 1], [30_000] * 5, [200_000, 5, 70_000], [10, MOST, 10, 20]]
)
def test_blocks_are_full_and_lose_nothing(sizes: list[int]) -> None:
    segments = [segment(number, size) for number, size in enumerate(sizes)]
    found = list(blocks(segments))
    counts = [len(times) for times, *_ in found]
    assert max(counts) <= MOST
    assert [t for times, *_ in found for t in times] == [t for one in segments for t in one.times]
    for times, x, z, d in found:
        assert np.array_equal(x, [times, -times])
        assert np.array_equal(z, [2 * times])
        assert d.shape == (1, len(times))
    assert [int(one) for *_, d in found for one in d[0]] == [k for k, size in enumerate(sizes) for _ in range(size)]
    # As few as possible, where segments are whole.
    if max(sizes) < MOST // 2:
        assert len(found) == -(-len(sizes) // (MOST // max(sizes)))
