"""Schematics of all examples, checked from their coordinates."""

import re
from collections.abc import Iterator
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from modelica_like import build
from modelica_like.errors import LanguageError, MissingExtra, NetlistError
from modelica_like.language import Component
from modelica_like.netlist import load, loads
from modelica_like.show.draw import layout, save_schematic, schematic
from modelica_like.show.draw.sheet import Line, Placed, Sheet, texts

EXAMPLES = Path(__file__).parents[2] / "examples"
NETLISTS = sorted(
    path.relative_to(EXAMPLES)
    for path in EXAMPLES.rglob("*.toml")
    if not {"cosim", "sizing"} & set(path.relative_to(EXAMPLES).parts)
)
Box = tuple[float, float, float, float]


def drive(path: Path | str) -> Component:
    return load(EXAMPLES / path)


def symbol(part: Placed, at: tuple[float, float]) -> Box:
    x, y = at[0] + part.at[0], at[1] + part.at[1]
    return x - part.half[0], y - part.half[1], x + part.half[0], y + part.half[1]


def boxes(part: Placed, at: tuple[float, float]) -> Iterator[Box]:
    """The symbol of a part, and what is written beside it."""
    yield symbol(part, at)
    for text in texts(part):
        west, north, east, south = text.box
        x, y = at[0] + part.at[0], at[1] + part.at[1]
        yield west + x, north + y, east + x, south + y


def overlap(a: Box, b: Box, least: float = 0.5) -> bool:
    return min(a[2], b[2]) - max(a[0], b[0]) > least and min(a[3], b[3]) - max(a[1], b[1]) > least


def parts(sheet: Sheet) -> list[tuple[tuple[float, float], Placed]]:
    return [(at, item) for at, item in sheet.everything() if isinstance(item, Placed) and not item.node.border]


def segments(line: Line, at: tuple[float, float]) -> Iterator[Box]:
    for path in line.paths:
        for (x0, y0), (x1, y1) in pairwise(path):
            assert x0 == pytest.approx(x1, abs=1e-6) or y0 == pytest.approx(y1, abs=1e-6), "lines run along the axes"
            yield min(x0, x1) + at[0], min(y0, y1) + at[1], max(x0, x1) + at[0], max(y0, y1) + at[1]


def crosses(segment: Box, box: Box) -> bool:
    """Whether a line runs through a box, deeper than along its edge."""
    depth = 1.0
    return (
        segment[0] < box[2] - depth and segment[2] > box[0] + depth
        and segment[1] < box[3] - depth and segment[3] > box[1] + depth
    )  # fmt: skip


@pytest.mark.parametrize("netlist", NETLISTS, ids=str)
def test_no_part_lies_on_another(netlist: Path) -> None:
    closed = [(at, part) for at, part in parts(layout(drive(netlist))) if not part.sheet]
    for (a, first), (b, second) in combinations(closed, 2):
        for one in boxes(first, a):
            for other in boxes(second, b):
                assert not overlap(one, other), (first.node.name, second.node.name)


@pytest.mark.parametrize("netlist", NETLISTS, ids=str)
def test_no_line_runs_through_a_part_or_what_is_written(netlist: Path) -> None:
    sheet = layout(drive(netlist))
    closed = [(part, list(boxes(part, at))) for at, part in parts(sheet) if not part.sheet]
    for at, line in sheet.everything():
        if isinstance(line, Line):
            for segment in segments(line, at):
                for part, rooms in closed:
                    assert not any(crosses(segment, room) for room in rooms), (line.stroke.name, part.node.name)


@pytest.mark.parametrize("netlist", NETLISTS, ids=str)
def test_no_line_lies_on_another(netlist: Path) -> None:
    sheet = layout(drive(netlist))
    lines = [list(segments(item, at)) for at, item in sheet.everything() if isinstance(item, Line)]
    for first, second in combinations(lines, 2):
        for a in first:
            for b in second:
                flat = a[1] == a[3] and b[1] == b[3] and abs(a[1] - b[1]) < 2.0
                steep = a[0] == a[2] and b[0] == b[2] and abs(a[0] - b[0]) < 2.0
                assert not (flat and min(a[2], b[2]) - max(a[0], b[0]) > 1.0), (a, b)
                assert not (steep and min(a[3], b[3]) - max(a[1], b[1]) > 1.0), (a, b)


def test_nearly_every_part_has_a_symbol() -> None:
    drawn = [part for netlist in NETLISTS for _, part in parts(layout(drive(netlist))) if not part.sheet]
    plain = [part.node.name for part in drawn if part.node.icon is None]
    assert len(drawn) > 500
    assert len(plain) <= 0.1 * len(drawn), plain


@pytest.mark.parametrize("netlist", ["lepelletier.toml", "components/cascade_control.toml"])
def test_the_same_netlist_gives_the_same_bytes(netlist: str) -> None:
    assert schematic(drive(netlist)) == schematic(drive(netlist))


def test_a_shaft_is_one_line_from_west_to_east() -> None:
    placed = {part.node.name: part.at for _, part in parts(layout(drive("dc_bench.toml")))}
    shaft = [
        "motor",
        "motor_bearing",
        "motor_belt",
        "clutch_pulley",
        "clutch",
        "flywheel",
        "generator_belt",
        "generator",
    ]
    assert len({placed[name][1] for name in shaft}) == 1
    assert sorted(shaft, key=lambda name: placed[name][0]) == shaft


def test_feedback_closes_over_signals() -> None:
    placed = {part.node.name: part.at[0] for _, part in parts(layout(drive("components/speed_control.toml")))}
    assert placed["converter"] < placed["motor"] < placed["tacho"] < placed["filter"] < placed["controller"]


def test_two_lines_that_meet_have_a_dot() -> None:
    sheet = layout(drive("dc_bench.toml"))
    dots = [dot for line in sheet.lines for dot in line.dots]
    assert len(dots) == 1, "the speed sensor hangs at the pulley of the clutch"


def test_grounds_are_drawn_where_they_are_used() -> None:
    names = {part.node.name for _, part in parts(layout(drive("components/h_bridge.toml")))}
    assert "battery" in names
    assert not any("ground" in name for name in names)


def test_an_assembly_opens_as_deep_as_asked() -> None:
    closed = {part.node.name for _, part in parts(layout(drive("lepelletier.toml"), depth=0))}
    opened = {part.node.name for _, part in parts(layout(drive("lepelletier.toml")))}
    assert "box" in closed
    assert "clutch_a" not in closed
    assert {"box", "clutch_a", "ravigneaux"} <= opened


def test_a_drive_written_backwards_is_drawn_forwards() -> None:
    text = """
        [parts]
        load = { is = "Inertia", J = "2 kg.m2" }
        motor = { is = "ConstantTorque", tau_constant = "5 N.m" }
        gear = { is = "IdealGear", ratio = 3 }
        [connect]
        a = ["load.flange_b", "gear.flange_a"]
        b = ["gear.flange_b", "motor.flange"]
        c = ["fixed.flange", "motor.support"]
        [parts.fixed]
        is = "Fixed"
    """
    placed = {part.node.name: part for _, part in parts(layout(loads(text)))}
    assert placed["motor"].at[0] < placed["gear"].at[0] < placed["load"].at[0]
    assert placed["gear"].node.turned


def test_a_part_without_a_symbol_is_a_box_with_its_connectors_named() -> None:
    from components import Flange
    from modelica_like.language import Assembly, Equations

    class Mystery(Component):
        flange_a = Flange("left")
        flange_b = Flange("right")

        def equations(self) -> Equations:
            yield self.flange_a.phi == self.flange_b.phi
            yield self.flange_a.tau == -self.flange_b.tau

    wires = {"a": ["left.flange_b", "right.flange_a"]}
    svg = schematic(Assembly("x", parts={"left": Mystery(), "right": Mystery()}, connect=wires))
    assert svg.count(">flange_a<") == svg.count(">flange_b<") == 1


@pytest.mark.parametrize("ending", ["svg", "png", "pdf"])
def test_files(tmp_path: Path, ending: str) -> None:
    file = tmp_path / f"bench.{ending}"
    save_schematic(drive("dc_bench.toml"), file)
    begin = {"svg": b"<svg", "png": b"\x89PNG", "pdf": b"%PDF"}[ending]
    assert file.read_bytes().startswith(begin)


def test_svg_is_well_formed_and_names_every_part() -> None:
    made = drive("machine_tool_startup.toml")
    root = ElementTree.fromstring(schematic(made))
    titles = {title.text for title in root.iter("{http://www.w3.org/2000/svg}title")}
    assert {f"{name}: {type(part).__name__}" for name, part in made.parts.items() if name != "ground"} <= titles


def test_a_drive_is_its_schematic_in_a_notebook() -> None:
    made = drive("two_mass.toml")
    assert made._repr_html_().startswith(schematic(made))


def test_what_cannot_be_written_is_told_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(NetlistError, match=r"a schematic can be pdf, png, svg"):
        save_schematic(drive("fan.toml"), tmp_path / "fan.bmp")
    monkeypatch.setattr("modelica_like.show.draw.find_spec", lambda name: None)
    with pytest.raises(MissingExtra, match="resvg_py is not installed"):
        save_schematic(drive("fan.toml"), tmp_path / "fan.png")
    assert not list(tmp_path.iterdir())


def test_a_netlist_is_drawn_by_its_path(tmp_path: Path) -> None:
    netlist = EXAMPLES / "two_mass.toml"
    save_schematic(netlist, tmp_path / "drive.svg")
    assert (tmp_path / "drive.svg").read_text() == schematic(load(netlist))


def test_a_compiled_drive_is_not_drawn() -> None:
    compiled: Any = build(EXAMPLES / "two_mass.toml")
    with pytest.raises(LanguageError) as caught:
        schematic(compiled)
    assert str(caught.value) == ("A compiled drive has no parts to draw.\nGive the component or the netlist.")


def test_control_characters_of_a_name_do_not_spoil_the_picture() -> None:
    text = (EXAMPLES / "two_mass.toml").read_text("utf-8")
    drive = loads(re.sub('name = ".*"', r'name = "a\\u0000b\\u001b"', text, count=1))
    assert ElementTree.fromstring(schematic(drive))[0].text == "a b "
