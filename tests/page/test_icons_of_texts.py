"""A part whose class is Modelica text: its icon is on the sheet and in the inspector."""

import pytest
from hand import Hand

TEXT = """[parts]
rotor = { is = "./parts.mo:Rotor", J = "2 kg.m2" }
shaft = { is = "SpringDamper", c = "100 N.m/rad", d = "1 N.m.s/rad" }
wall = { is = "Fixed" }

[series]
drive = ["rotor", "shaft", "wall"]

[start]
"rotor.w" = "3 rad/s"
"rotor.phi" = 0
"shaft.phi_rel" = 0

[simulate]
until = "1 s"
"""
OTHERS = {
    "parts.mo": """model Rotor
  extends Modelica.Mechanics.Rotational.Interfaces.PartialTwoFlanges;
  parameter Real J(unit = "kg.m2") = 1;
  Real phi(unit = "rad");
  Real w(unit = "rad/s");
equation
  phi = flange_a.phi;
  phi = flange_b.phi;
  w = der(phi);
  J*der(w) = flange_a.tau + flange_b.tau;
  annotation(Icon(graphics = {
    Rectangle(extent = {{-100, -10}, {100, 10}}, lineColor = {64, 64, 64}, fillColor = {192, 192, 192},
      fillPattern = FillPattern.HorizontalCylinder),
    Rectangle(extent = {{-60, -60}, {60, 60}}, fillColor = {170, 213, 255}, fillPattern = FillPattern.Solid),
    Text(extent = {{-50, -30}, {50, 30}}, textString = "J %J", textColor = {200, 0, 0})}));
end Rotor;
"""
}


@pytest.mark.browser
def test_the_icon_is_on_the_sheet_and_in_the_inspector(hand: Hand) -> None:
    hand.select("rotor")
    drawn = hand.page.locator("#inspector .symbol svg g.drawn path")
    drawn.first.wait_for()
    assert drawn.count() == 2
    assert hand.page.locator("#inspector .symbol svg").bounding_box()["height"] > 10
    shown = hand.page.locator("svg g.drawn text", has_text="J 2")
    assert shown.count() == 1
