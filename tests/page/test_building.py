"""Drives of the examples are built from an empty sheet with a mouse and the fields of the page."""

import tomllib
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hand import READY, Hand
from pages import serving

from modelica_like import load
from modelica_like.language import Assembly
from modelica_like.page import Session

EXAMPLES = Path(__file__).parents[2] / "examples"


def flat(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, dict):
            yield from flat(value, f"{before}{key}.")
        elif before + key != "is":
            yield before + key, value


def parts(hand: Hand, data: Mapping[str, Any], drive: Assembly) -> None:
    """Put the parts on the sheet, those of a series at the outlet of the one before."""
    before = {b: a for line in data.get("series", {}).values() for a, b in pairwise(line)}
    late = [name for line in data.get("series", {}).values() for name in line]
    for name in [*(name for name in data["parts"] if name not in late), *late]:
        table = dict(flat(data["parts"][name]))
        end = drive.find(before[name]).outlet_connector().path if name in before else ""
        hand.put(data["parts"][name]["is"], end=end)
        values = dict(table)
        if hand.page.locator("#inspector .kind", has_text="not yet on the sheet").count():
            draft = hand.page.inner_text("#inspector h2")
            for key in [key for key, value in table.items() if "." not in key]:
                hand.type(f"{draft}.{key}", values.pop(key))
            hand.page.get_by_role("button", name="Put it on the sheet").click()
            hand.wait()
        assert hand.said == "", name
        given = hand.page.input_value("#inspector .name")
        if given != name:
            hand.rename(name)
        for key, value in values.items():
            hand.type(f"{name}.{key}", value)


def build(hand: Hand, path: Path) -> None:
    data, drive = tomllib.loads(path.read_text()), load(path)
    for key in ("name", "description"):
        if key in data:
            hand.type(key, data[key])
    for name, value in data.get("parameters", {}).items():
        hand.parameter(name, value)
    parts(hand, data, drive)
    for line in data.get("connect", {}).values():
        for end in line[1:]:
            hand.drag(line[0], end)
            assert hand.said == "", (line[0], end)
    for place, value in data.get("start", {}).items():
        hand.select(place.rpartition(".")[0])
        hand.type(place, value)
    hand.select("")
    for key, value in data.get("simulate", {}).items():
        hand.type(f"simulate.{key}", value)


def meaning(text: str) -> dict[str, Any]:
    """What a netlist says, without the names of lines, and without units of display, which are written as text."""
    data = tomllib.loads(text)
    lines = {"connect": sorted(sorted(line) for line in data.get("connect", {}).values())}
    series = sorted(data.get("series", {}).values())
    kept = {key: value for key, value in data.items() if key not in ("display", "sizing")}
    return {**kept, **lines, "series": series}


@pytest.mark.browser
@pytest.mark.parametrize(
    "name", ["machine_table_direct", *(pytest.param(name, marks=pytest.mark.slow) for name in ("winch", "launch"))]
)
def test_a_drive_is_built_from_an_empty_sheet(browser: Any, tmp_path: Path, name: str) -> None:
    with serving(Session(tmp_path / "drive.toml")) as server:
        browser.open(server.address, 1500, 1000, ready=READY)
        hand = Hand(browser)
        build(hand, EXAMPLES / f"{name}.toml")
        assert meaning(hand.text) == meaning((EXAMPLES / f"{name}.toml").read_text())
        assert browser.run("page.valid && page.problems.every((one) => one.kind === 'note')")
        assert [one for one in browser.complaints if not one.startswith(server.address[:20])] == []
