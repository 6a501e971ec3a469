"""Symbols of Modelica classes, from their annotations: against places computed by hand."""

import re
from pathlib import Path
from typing import Any

import pytest

from modelica_like import load, schematic
from modelica_like.language import Component, Icon
from modelica_like.lsp.names import owner_of
from modelica_like.page.palette import described
from modelica_like.show.draw import layout
from modelica_like.show.draw.sheet import Placed

CLASS = """
model A
  partial model Base
    Modelica.Mechanics.Rotational.Interfaces.Flange_a a
      annotation(Placement(transformation(extent = {{-110, -10}, {-90, 10}})));
    Modelica.Mechanics.Rotational.Interfaces.Flange_b b
      annotation(Placement(transformation(extent = {{-10, -10}, {10, 10}}, origin = {0, 100}, rotation = 90)));
    annotation(Icon(graphics = {Rectangle(extent = {{-100, -20}, {-60, 20}}, lineColor = {64, 64, 64},
      fillColor = {192, 192, 192}, fillPattern = FillPattern.HorizontalCylinder)}));
  end Base;
  model Part "of own equations"
    extends Base;
    parameter Boolean marked = false;
    parameter Real c(unit = "N.m/rad") = 5;
  equation
    a.tau = c*(a.phi - b.phi);
    a.tau + b.tau = 0;
    annotation(Documentation(info = "<html>Icon(graphics = {})</html>"), Icon(GRAPHICS));
  end Part;
  Part one;
  Part two(marked = true, c = 7);
  Modelica.Mechanics.Rotational.Components.Inertia J(J = 1, phi(fixed = true), w(fixed = true));
  Modelica.Mechanics.Rotational.Components.Inertia K(J = 1, phi(fixed = true), w(fixed = true));
  Modelica.Mechanics.Rotational.Components.Fixed wall;
equation
  connect(wall.flange, one.a);
  connect(one.b, J.flange_a);
  connect(J.flange_b, two.a);
  connect(two.b, K.flange_a);
end A;
"""


def drive(folder: Path, graphics: str, before: str = "") -> Component:
    text = CLASS.replace("Icon(GRAPHICS)", f"Icon({before}graphics = {{{graphics}}})" if graphics else "Icon()")
    (folder / "a.mo").write_text(text)
    return load(folder / "a.mo")


def icon(folder: Path, graphics: str, name: str = "one", before: str = "") -> Icon:
    icon = drive(folder, graphics, before).parts[name].icon
    assert icon is not None
    return icon


def strokes(component: Component, name: str) -> list[int]:
    symbol = component.parts[name].icon
    return [figure.data.count("L") for figure in symbol.figures] if symbol else []


def numbers(data: str) -> list[float]:
    return [float(number) for number in re.findall(r"-?\d+\.?\d*", data)]


# A unit of the annotation is 56/200 = 0.28, and y points downwards.
SHAPES = {
    "Line(points = {{-50, 0}, {50, 100}}, color = {255, 0, 0}, thickness = 0.5)": "M-14 0 L14 -28",
    "Line(points = {{10, 0}, {20, 0}}, origin = {0, 50}, rotation = 90)": "M0 -16.8 L0 -19.6",
    "Line(points = {{0, 0}, {100, 0}, {100, 100}}, smooth = Smooth.Bezier)": "M0 0 L14 0 Q28 0 28 -14 L28 -28",
    "Polygon(points = {{0, 0}, {50, 0}, {0, 50}, {0, 0}})": "M0 0 L14 0 L0 -14 Z",
    "Polygon(points = {{0, 0}, {100, 0}, {0, 100}}, smooth = Smooth.Bezier)": "M14 0 Q28 0 14 -14 Q0 -28 0 -14 "
    "Q0 0 14 0 Z",
    "Rectangle(extent = {{-50, -25}, {50, 25}})": "M-14 -7 L14 -7 L14 7 L-14 7 Z",
    "Rectangle(extent = {{0, 0}, {100, 50}}, radius = 25)": "M7 -14 L21 -14 A7 7 0 0 1 28 -7 L28 -7 A7 7 0 0 1 21 0 "
    "L7 0 A7 7 0 0 1 0 -7 L0 -7 A7 7 0 0 1 7 -14 Z",
    "Ellipse(extent = {{-100, -50}, {100, 50}})": "M28 0 A28 14 0 0 0 -28 0 A28 14 0 0 0 28 0 Z",
    "Ellipse(extent = {{-100, -100}, {100, 100}}, endAngle = 90)": "M28 0 A28 28 0 0 0 19.8 -19.8 "
    "A28 28 0 0 0 0 -28 L0 0 Z",
}  # fmt: skip


@pytest.mark.parametrize("graphics", SHAPES)
def test_shapes_stand_where_their_annotation_says(graphics: str, tmp_path: Path) -> None:
    base, own = icon(tmp_path, graphics).figures
    assert base.data == "M-28 -5.6 L-16.8 -5.6 L-16.8 5.6 L-28 5.6 Z"
    assert (base.line, base.fill, base.shade) == ("#404040", "#c0c0c0", "across")
    expected = SHAPES[graphics]
    assert re.sub(r"-?[\d.]+", "#", own.data.replace(" -0 ", " 0 ")) == re.sub(r"-?[\d.]+", "#", expected)
    assert numbers(own.data) == pytest.approx(numbers(expected), abs=0.01)  # they are written with two digits
    assert own.fill == ""


def test_an_arrow_stands_at_the_end_of_its_line(tmp_path: Path) -> None:
    line = "Line(points = {{0, 0}, {50, 0}}, arrow = {Arrow.None, Arrow.Filled}, pattern = LinePattern.Dash)"
    *_, line, tip = icon(tmp_path, line).figures
    assert line.dashes
    assert numbers(tip.data)[2:4] == pytest.approx([14, 0])
    assert tip.fill == "#000000"


def test_shapes_may_depend_on_parameters(tmp_path: Path) -> None:
    two = (
        "Rectangle(extent = {{0, 0}, {9, 9}}, visible = marked), Line(points = {{0, 0}, {9, 9}}, visible = not marked)"
    )
    (tmp_path / "a.mo").write_text(CLASS.replace("Icon(GRAPHICS)", f"Icon(graphics = {{{two}}})"))
    component = load(tmp_path / "a.mo")
    assert strokes(component, "one") == [3, 1]
    assert strokes(component, "two") == [3, 3]


def test_the_coordinates_may_be_others(tmp_path: Path) -> None:
    line = "Line(points = {{0, 0}, {400, 100}})"
    chosen = icon(tmp_path, line, before="coordinateSystem(extent = {{0, 0}, {400, 100}}), ")
    assert numbers(chosen.figures[-1].data) == pytest.approx([-28, 7, 28, -7])


def test_ends_are_where_they_are_placed(tmp_path: Path) -> None:
    drawn = icon(tmp_path, "Line(points = {{0, 0}, {9, 9}})")
    assert drawn.ports["a"] == ("W", pytest.approx(0))
    assert drawn.ports["b"] == ("N", pytest.approx(0))
    assert drawn.tips["b"] == pytest.approx((0, -90 * 0.28))  # to the edge of the connector's own picture


def test_texts_show_values_and_names_stay_below(tmp_path: Path) -> None:
    words = 'Text(extent = {{-80, -20}, {80, 20}}, textString = "c %c%%", textColor = {0, 0, 255})'
    name = 'Text(extent = {{-150, 60}, {150, 100}}, textString = "%name")'
    below = 'Text(extent = {{-150, -130}, {150, -90}}, textString = "c=%c")'
    component = drive(tmp_path, f"{words}, {name}, {below}")
    symbol = component.parts["two"].icon
    assert symbol is not None
    assert symbol.key == ("c",)
    text = schematic(component)
    assert ">c 5%</text>" in text
    assert ">c 7%</text>" in text
    assert text.count(">two</text>") == 1
    assert ">c = 7</text>" in text


def test_a_class_that_draws_nothing_is_a_box(tmp_path: Path) -> None:
    text = re.sub(r"annotation\(Icon\(graphics.*?\}\)\);", "", CLASS, flags=re.DOTALL)
    (tmp_path / "a.mo").write_text(text.replace("Icon(GRAPHICS)", 'Icon(graphics = {Bitmap(fileName = "x.png")})'))
    assert load(tmp_path / "a.mo").parts["one"].icon is None


BROKEN = ["Line(points = {{0, 0}})", "Line(points = 3)", "Rectangle(extent = {{0, 0}, {0, 0}})", "Text(textString = 3)",
          "Ellipse(extent = {1, 2})", "Line(points = {{0, 0}, {1e999, 0}})", "1", "Polygon()",
          "Rectangle(extent = {{0, 0}, {9, 9}}, visible = nothing)", "Line(points = {{0, -sin()}})",
          "Line(points = {{0, -{}}, {1, 1}})"]  # fmt: skip


@pytest.mark.parametrize("graphics", BROKEN)
def test_what_cannot_be_drawn_is_left_out(graphics: str, tmp_path: Path) -> None:
    component = drive(tmp_path, graphics)
    assert "</svg>" in schematic(component)


@pytest.mark.parametrize("extent", ["{{0, 0}, {100, 0}}", "{{7, -20}, {7, 30}}"])
def test_a_sheet_without_height_or_width_is_drawn(extent: str, tmp_path: Path) -> None:
    before = f"coordinateSystem(extent = {extent}), "
    assert "</svg>" in schematic(drive(tmp_path, "Line(points = {{0, 0}, {9, 9}})", before=before))


def test_symbols_and_names_do_not_meet(tmp_path: Path) -> None:
    component = drive(tmp_path, "Rectangle(extent = {{-60, -90}, {60, 90}}, fillPattern = FillPattern.Sphere)")
    boxes = [item for _, item in layout(component).everything() if isinstance(item, Placed)]
    for part in boxes:
        others = [other for other in boxes if other is not part]
        assert all(abs(other.at[0] - part.at[0]) > 20 or abs(other.at[1] - part.at[1]) > 20 for other in others)
    assert boxes[0].half[1] == pytest.approx(28 * 0.9, abs=3)


def test_the_inspector_has_the_symbol(tmp_path: Path) -> None:
    part: Any = drive(tmp_path, "Line(points = {{0, 0}, {9, 9}})").parts["two"]
    answer = described(owner_of(part))
    assert answer["symbol"].startswith("<svg")
    assert "M0 0 L2.52 -2.52" in answer["symbol"]
