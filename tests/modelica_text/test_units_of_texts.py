"""Units that ends of connections declare: differing ones are refused, what Modelica permits is not."""

from pathlib import Path

import pytest

from modelica_like import load, simulate
from modelica_like.errors import ModelicaTextError

SIGNALS = """
model A
  block Give
    Modelica.Blocks.Interfaces.RealOutput yONE = 3;
  end Give;
  block Take
    Modelica.Blocks.Interfaces.RealInput uOTHER;
    Real e(start = 0, fixed = true);
  equation
    der(e) = u;
  end Take;
  Give give;
  Take take;
equation
  connect(give.y, take.u);
end A;
"""
PLUGS = """
model A
  connector P
    Real v(unit = "V");
    flow Real i(unit = "A");
  end P;
  connector Q
    Real v(unit = "ONE");
    flow Real i(unit = "OTHER");
  end Q;
  model Pole
    P p;
  equation
    p.v = 2;
  end Pole;
  model Load
    Q q;
  equation
    q.i = 3*q.v;
  end Load;
  Pole pole;
  Load load;
equation
  connect(pole.p, load.q);
end A;
"""
BUS = """
model A
  connector Bus
    input Real torque(unit = "ONE");
    output Real speed(unit = "rad/s");
  end Bus;
  connector Other
    output Real torque(unit = "OTHER");
    input Real speed(unit = "1/s");
  end Other;
  model Drive
    Bus bus;
  equation
    bus.speed = 2*bus.torque;
  end Drive;
  model Control
    Other bus;
  equation
    bus.torque = 5;
  end Control;
  Drive drive;
  Control control;
equation
  connect(drive.bus, control.bus);
end A;
"""


def read(folder: Path, text: str, one: str, other: str, *, attributes: bool = False) -> Path:
    one, other = (f'(unit = "{unit}")' if attributes and unit else unit for unit in (one, other))
    (folder / "a.mo").write_text(text.replace("ONE", one).replace("OTHER", other))
    return folder / "a.mo"


PERMITTED = [
    ("N.m", "N.m"), ("N.m", ""), ("", "N.m"), ("", ""), ("1", "N.m"), ("N.m", "1"), ("N.m", "J"), ("rad/s", "1/s"),
    ("kg.m2/s2", "N.m"), ("Hz", "s-1"), ("anything", "W"), ("deg", "deg"), ("kW", "kW"),
]  # fmt: skip
REFUSED = [("N.m", "N"), ("kW", "W"), ("deg", "rad"), ("degC", "K"), ("rpm", "rad/s"), ("m", "s")]


@pytest.mark.parametrize(("one", "other"), PERMITTED)
def test_units_that_fit_or_are_not_told(one: str, other: str, tmp_path: Path) -> None:
    result = simulate(load(read(tmp_path, SIGNALS, one, other, attributes=True)), 2.0)
    assert result.final["take.e"] == pytest.approx(6)


@pytest.mark.parametrize(("one", "other"), REFUSED)
def test_units_of_signals_that_differ(one: str, other: str, tmp_path: Path) -> None:
    with pytest.raises(ModelicaTextError) as caught:
        load(read(tmp_path, SIGNALS, one, other, attributes=True))
    assert caught.value.what == f"give.y is in {one}, and take.u in {other}."
    assert [place.line for place in caught.value.where] == [15, 4, 7]


def test_units_of_connectors(tmp_path: Path) -> None:
    result = simulate(load(read(tmp_path, PLUGS, "V", "A")), 1.0)
    assert result.final["pole.p.i"] == pytest.approx(-6)
    with pytest.raises(ModelicaTextError) as caught:
        load(read(tmp_path, PLUGS, "V", "mA"))
    assert caught.value.what == "pole.p.i is in A, and load.q.i in mA."
    assert [place.line for place in caught.value.where] == [24, 5, 9]


def test_units_of_inputs_and_outputs_in_connectors(tmp_path: Path) -> None:
    assert simulate(load(read(tmp_path, BUS, "N.m", "N.m")), 1.0).final["drive.bus.speed"] == pytest.approx(10)
    with pytest.raises(ModelicaTextError, match=r"drive\.bus\.torque is in N\.m, and control\.bus\.torque in N\."):
        load(read(tmp_path, BUS, "N.m", "N"))


def test_elements_of_one_input_of_a_component_have_no_units(tmp_path: Path) -> None:
    # As in the standard library: `Move` takes an angle, a speed and an acceleration by one input of three elements.
    (tmp_path / "a.mo").write_text("""
model A
  block Give
    Modelica.Blocks.Interfaces.RealOutput y(unit = "deg") = 0;
  end Give;
  Give give[3];
  Modelica.Mechanics.Rotational.Sources.Move move;
  Modelica.Mechanics.Rotational.Components.Inertia J(J = 1);
equation
  for k in 1:3 loop
    connect(give[k].y, move.u[k]);
  end for;
  connect(move.flange, J.flange_a);
end A;
""")
    assert simulate(load(tmp_path / "a.mo"), 1.0).final["J.w"] == pytest.approx(0)


def test_units_of_components_of_the_table(tmp_path: Path) -> None:
    text = """
model A
  block Give
    Modelica.Blocks.Interfaces.RealOutput y[2](unit = {"W", "N.m"}) = {3, 4};
  end Give;
  Give give;
  Modelica.Mechanics.Rotational.Sources.Torque torque;
  Modelica.Mechanics.Rotational.Components.Inertia J(J = 2, phi(fixed = true), w(fixed = true));
equation
  connect(give.y[2], torque.tau);
  connect(torque.flange, J.flange_a);
end A;
"""
    (tmp_path / "a.mo").write_text(text)
    assert simulate(load(tmp_path / "a.mo"), 3.0).final["J.w"] == pytest.approx(6)
    (tmp_path / "a.mo").write_text(text.replace("y[2], torque", "y[1], torque"))
    with pytest.raises(ModelicaTextError) as caught:
        load(tmp_path / "a.mo")
    assert caught.value.what == "give.y[1] is in W, and torque.tau in N.m."
    assert [place.line for place in caught.value.where] == [10, 4, 7]
