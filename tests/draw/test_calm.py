"""After an edit, parts that it does not concern keep their order in the picture."""

from itertools import combinations
from pathlib import Path

import pytest

from modelica_like.edit import apply
from modelica_like.netlist import loads
from modelica_like.show.draw.diagram import diagram
from modelica_like.show.draw.sheet import Sheet, sheet

EXAMPLES = Path(__file__).parents[2] / "examples"


def places(drawn: Sheet) -> dict[str, tuple[float, float]]:
    return {part.node.name: part.at for part in drawn.parts}


def heights(drawn: Sheet) -> dict[str, float]:
    return {name: at[1] for name, at in places(drawn).items()}


def exchanged(before: Sheet, after: Sheet) -> tuple[int, int]:
    """Pairs of parts above one another, in one column of both pictures, and how many have exchanged their places."""
    old, new = places(before), places(after)
    pairs = [
        (old[a][1] - old[b][1], new[a][1] - new[b][1])
        for a, b in combinations(old.keys() & new.keys(), 2)
        if abs(old[a][0] - old[b][0]) < 1.0 and abs(new[a][0] - new[b][0]) < 1.0
    ]
    return len(pairs), sum(was * now < 0 for was, now in pairs)


def edits(text: str, file: Path) -> list[str]:
    """The drive with one part doubled, or one removed, in turn."""
    names = [*loads(text, str(file)).parts]
    requests = [{"op": "duplicate", "name": name, "new": "another"} for name in names]
    requests += [{"op": "remove", "name": name} for name in names]
    return [apply(text, request, file=file).text for request in requests if "[" not in str(request.get("name"))]


@pytest.mark.parametrize("name", ["winch", "launch", "dc_bench_speed_control", "machine_tool_startup"])
def test_no_pair_exchanges_its_places(name: str) -> None:
    file = EXAMPLES / f"{name}.toml"
    text = file.read_text()
    before = sheet(diagram(loads(text, str(file)), 0, open_ends=True))
    pairs = moved = 0
    for new in edits(text, file):
        after = sheet(diagram(loads(new, str(file)), 0, open_ends=True), heights(before))
        here, exchanges = exchanged(before, after)
        pairs, moved = pairs + here, moved + exchanges
    assert moved <= 0.01 * pairs
