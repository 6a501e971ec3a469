"""Connections are gathered to sets: the same as by going through all of them, and for long chains as fast."""

import random
import time

import pytest

from modelica_like.errors import Source
from modelica_like.netlist.modelica.wiring import groups

Pairs = list[tuple[str, str, Source]]


def by_hand(pairs: Pairs) -> list[tuple[list[str], Source]]:
    sets: list[tuple[list[str], Source]] = []
    for *pair, source in pairs:
        touched = [entry for entry in sets if {*pair} & {*entry[0]}]
        sets = [entry for entry in sets if entry not in touched]
        ends = dict.fromkeys([*(end for ends, _ in touched for end in ends), *pair])
        sets.append(([*ends], touched[0][1] if touched else source))
    return sets


@pytest.mark.parametrize("seed", range(50))
def test_sets_are_those_of_all_pairs(seed: int) -> None:
    chance = random.Random(seed)
    count = chance.randint(1, 14)
    pairs = [(str(chance.randint(0, 12)), str(chance.randint(0, 12)), Source("a.mo", line)) for line in range(count)]
    assert [(wire.ends, wire.source) for wire in groups(pairs)] == by_hand(pairs)


@pytest.mark.parametrize("star", [False, True])
def test_many_connections_take_no_longer_each(star: bool) -> None:
    # Going through all sets for each of 20,000 pairs takes minutes.
    pairs = [("0" if star else f"{k}.b", f"{k + 1}.a", Source("a.mo", k)) for k in range(20_000)]
    before = time.process_time()
    assert len(groups(pairs)) == (1 if star else 20_000)
    assert time.process_time() - before < 2.0
