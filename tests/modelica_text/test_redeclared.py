"""Classes that are replaced, inherited by packages or handed on, against closed forms."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modelica_like import load, simulate
from modelica_like.errors import ModelicaTextError

MEDIA = """
  partial package Medium
    constant Real c = 1;
    replaceable function g input Real T; output Real y; algorithm y := 0; end g;
    function h input Real T; output Real y; algorithm y := c*T + g(T); end h;
    model Tank Real e = c*time; end Tank;
  end Medium;
  package Water extends Medium(c = 4);
    redeclare function extends g algorithm y := 100*T; end g;
  end Water;
  package Ice = Water(c = 7);
  model Vessel replaceable package M = Medium; Real e = M.h(time); Real k = M.c; M.Tank t; end Vessel;
  model Pipe replaceable package M = Medium; Vessel u[2](redeclare package M = M); end Pipe;
  model Plant replaceable package Med = Water; Pipe p(redeclare package M = Med); end Plant;
"""
LAWS = """
  partial model Law parameter Real k = 1; parameter Real q = 1; Real y; end Law;
  model Linear extends Law; equation y = k*q*time; end Linear;
  model Square extends Law; equation y = k*q*time^2; end Square;
  model In replaceable model L = Linear constrainedby Law; L l(k = 3); end In;
  model Mid replaceable model L = Linear constrainedby Law; In i(redeclare model L = L(q = 7)); end Mid;
  model Plain Real y = time; parameter Real k = 1; end Plain;
  model More extends Plain(k = 5); Real z = k*y; end More;
  model Base
    replaceable model L Real y = time; end L;
    L l; replaceable Plain a; replaceable Plain b(k = 3);
  end Base;
  model Derived extends Base;
    redeclare model extends L Real z = 3*y; end L;
    redeclare More a; redeclare More b;
  end Derived;
  partial function any input Real x; output Real y; end any;
  function one extends any; algorithm y := x; end one;
  function several extends any; input Real k = 3; algorithm y := k*x; end several;
  model Called replaceable function f = one constrainedby any; Real y = f(time); end Called;
"""
CASES: dict[str, dict[str, Any]] = {
    MEDIA + "model T Vessel a(redeclare package M = Water), b, c(redeclare package M = Ice); Real z = Water.h(time);"
    " Water.Tank t; end T;": {
        "a.e": lambda t: 104 * t, "a.k": lambda t: 4 + 0 * t, "a.t.e": lambda t: 4 * t, "b.e": lambda t: t,
        "c.e": lambda t: 107 * t, "z": lambda t: 104 * t, "t.e": lambda t: 4 * t,
    },
    MEDIA + "model T Pipe a(redeclare package M = Water), b; Plant c, d(redeclare package Med = Ice); end T;": {
        "a.u[2].e": lambda t: 104 * t, "b.u[1].e": lambda t: t, "c.p.u[1].e": lambda t: 104 * t,
        "d.p.u[2].e": lambda t: 107 * t,
    },
    LAWS + "model T Mid a(redeclare model L = Square(q = 2)), b; end T;": {
        "a.i.l.y": lambda t: 21 * t**2, "b.i.l.y": lambda t: 21 * t,
    },
    LAWS + "model T Derived d; Base e; end T;": {
        "d.l.z": lambda t: 3 * t, "d.a.z": lambda t: 5 * t, "d.b.z": lambda t: 3 * t, "e.l.y": lambda t: t,
    },
    LAWS + "model T Called a, b(redeclare function f = several), c(redeclare function f = several(k = 9)); end T;": {
        "a.y": lambda t: t, "b.y": lambda t: 3 * t, "c.y": lambda t: 9 * t,
    },
    """
    record R Real a; Real b; end R;
    function turned input R u; input Real k; output R v; algorithm v.a := k*u.a; v.b := u.b; end turned;
    function added input R u; input R v; output R w; algorithm w := R(u.a + v.a, u.b + v.b); end added;
    model T parameter R p(a = 1, b = 2); parameter R q = turned(p, 3); R v = added(turned(R(time, 1), 2), q);
    end T;
    """: {"v.a": lambda t: 2 * t + 3, "v.b": lambda t: 3 + 0 * t},
    """
    type Gear = enumeration(low, mid, high);
    type Axis = Real[3];
    model T
      parameter Real i[Gear] = {3, 2, 1}; Gear g(start = Gear.low, fixed = true); Axis a = {1, 2, 3}*time;
      Real y; Real s;
    equation
      when time > 0.5 then g = Gear.high; end when;
      y = i[Gear.mid]*time + a[3]; s = sum(i[k] for k in Gear);
    end T;
    """: {"y": lambda t: 5 * t, "s": lambda t: 6 + 0 * t},
    """
    model T
      Real a[3] = {time, 1, 0}; Real b[3] = {0, 0, 2}; Real c[3] = cross(a, b); Real e[:] = cat(1, a, {5});
      Real f[2, 3] = cat(2, [1; 2], [3, 4; 5, 6]*time); Real g[2, 2] = diagonal({time, 2});
      Real h = semiLinear(time - 0.5, 2, 3);
      Real o[2, 2] = outerProduct({1, 2}, {time, 3}); Real y = e[4] + f[2, 3] + g[1, 1] + o[2, 1];
    end T;
    """: {
        "c[1]": lambda t: 2 + 0 * t, "c[2]": lambda t: -2 * t, "y": lambda t: 5 + 6 * t + t + 2 * t,
        "h": lambda t: np.where(t < 0.5, 3, 2) * (t - 0.5),
    },
    """
    connector Port
      Modelica.Mechanics.Rotational.Interfaces.Flange_a f; Modelica.Thermal.HeatTransfer.Interfaces.HeatPort_a h;
    end Port;
    model Motor
      Port port; Modelica.Mechanics.Rotational.Sources.ConstantTorque t(tau_constant = 3);
      Modelica.Thermal.HeatTransfer.Sources.FixedHeatFlow q(Q_flow = 10);
    equation
      connect(t.flange, port.f); connect(q.port, port.h);
    end Motor;
    model Load
      Port port; Modelica.Mechanics.Rotational.Components.Inertia J(J = 1, phi(fixed = true), w(fixed = true));
      Modelica.Thermal.HeatTransfer.Components.HeatCapacitor C(C = 5, T(start = 300, fixed = true));
    equation
      connect(port.f, J.flange_a); connect(C.port, port.h);
    end Load;
    model T Motor m; Load l; equation connect(m.port, l.port); end T;
    """: {"l.J.w": lambda t: 3 * t, "l.C.T": lambda t: 300 + 2 * t},
}  # fmt: skip


@pytest.mark.parametrize("text", CASES)
def test_a_text_has_its_closed_form(text: str, tmp_path: Path) -> None:
    (tmp_path / "p.mo").write_text(f"package P\n{text}\nend P;\n")
    run = simulate(load(f"{tmp_path / 'p.mo'}:P.T"), 1.0, rtol=1e-10, atol=1e-12)
    for name, law in CASES[text].items():
        assert np.asarray(run[name], float) == pytest.approx(law(run.time), abs=1e-7), name


def test_a_class_that_is_itself_is_told(tmp_path: Path) -> None:
    (tmp_path / "p.mo").write_text("package P\n  model L = L(k = 1);\n  model T\n    L l;\n  end T;\nend P;\n")
    with pytest.raises(ModelicaTextError, match=r"P.L extends itself\."):
        load(f"{tmp_path / 'p.mo'}:P.T")
