"""No example becomes larger, starts from something else, or runs dearer without being asked."""

import tomllib

import pytest
from work import TABLE, netlists, work

EXPECTED = tomllib.loads(TABLE.read_text(encoding="utf-8"))
NEAR = 0.04
"""Accepted change of counts that rounding changes: other processors may cost some integrator steps."""


def test_every_example_is_in_the_table() -> None:
    assert sorted(EXPECTED) == netlists()


@pytest.mark.parametrize("name", netlists())
def test_example_costs_what_the_table_says(name: str) -> None:
    found, expected = work(name), EXPECTED[name]
    for key in ("states", "implicit", "operations", "start"):
        assert found[key] == expected[key], RENEW
    for key in ("run", "energy"):
        assert {one: found[key].get(one, 0) for one in expected[key]} == expected[key], RENEW
        pairs = {one: (found[key].get(one, 0), count) for one, count in expected.get(f"nearly {key}", {}).items()}
        assert not {one: pair for one, pair in pairs.items() if abs(pair[0] - pair[1]) > NEAR * max(pair)}, RENEW


RENEW = "if this is meant, `python tests/work/work.py` renews the table"
