"""No example becomes larger, starts from something else, or runs dearer without being asked."""

import tomllib

import pytest
from work import STEADY, TABLE, netlists, work

EXPECTED = tomllib.loads(TABLE.read_text(encoding="utf-8"))
RENEW = "if this is meant, `python tests/work/work.py` renews the table"


def test_every_example_is_in_the_table() -> None:
    assert sorted(EXPECTED) == netlists()


@pytest.mark.slow
@pytest.mark.parametrize("name", netlists())
def test_example_costs_what_the_table_says(name: str) -> None:
    found, expected = work(name), EXPECTED[name]
    for key in ("states", "implicit", "operations", "start"):
        assert found[key] == expected[key], RENEW
    run = expected["run"]
    assert found["run"]["events"] == run.get("events", found["run"]["events"]), RENEW
    assert found["run"]["steps"] == pytest.approx(run.get("steps", found["run"]["steps"]), rel=STEADY, abs=2), RENEW
