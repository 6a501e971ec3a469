package Batteries
  model Pack "cells in series and in parallel, an open circuit voltage that rises with the charge, one R-C pair"
    import SI = Modelica.SIunits;
    SI.Power powDeliv "power that is delivered";
    Real SOC "state of charge";
    parameter SI.ElectricCharge QCellNom(min = 0) = 10*3.6e3;
    parameter SI.Voltage ECellMin(min = 0) = 3.0, ECellMax(min = 0.0001) = 4.0;
    parameter Real SOCInit(min = 0, max = 1) = 0.5 annotation(Dialog(group = "SOC parameters"));
    parameter SI.Current ICellMax(min = 0) = 10*QCellNom/3.6e3;
    parameter SI.Resistance R0Cell(min = 0) = 0.05*ECellMax/ICellMax "series resistance \"R0\"";
    parameter Integer ns = 1, np = 1;
    SI.Voltage uBat;
    Modelica.Electrical.Analog.Basic.Capacitor cBattery(final C = CBattery, v(start = eMin + SOCInit*(eMax - eMin), fixed = true));
    Modelica.Electrical.Analog.Basic.Resistor R0(final R = R0Cell*ns/np);
    Modelica.Electrical.Analog.Interfaces.Pin p;
    Modelica.Electrical.Analog.Interfaces.NegativePin n;
    Modelica.Blocks.Sources.RealExpression outPow(y = (p.v - n.v)*n.i);
  protected
    parameter SI.Voltage eMin = ECellMin*ns, eMax = ECellMax*ns;
    final parameter SI.Capacitance C = QCellNom/(ECellMax - ECellMin);
    parameter SI.Capacitance CBattery = C*np/ns;
    SI.Voltage eBatt;
  equation
    assert(SOCInit >= 0, "SOCInit(=" + String(SOCInit) + ") must be at least 0");
    assert(abs(p.i/np) < ICellMax, "Cell current i=" + String(abs(p.i/np)) + "\n exceeds ICellMax (=" + String(ICellMax) + "A)");
    uBat = p.v - n.v;
    eBatt = cBattery.v;
    powDeliv = (p.v - n.v)*n.i;
    SOC = (eBatt - eMin)/(eMax - eMin);
    connect(p, R0.p);
    connect(R0.n, cBattery.p);
    connect(cBattery.n, n);
  end Pack;
  model Test
    Pack pack(ns = 10, np = 2);
    Modelica.Electrical.Analog.Sources.ConstantCurrent load(I = 20);
    Modelica.Electrical.Analog.Basic.Ground ground;
  equation
    connect(pack.p, load.p); connect(load.n, pack.n); connect(pack.n, ground.p);
    annotation(experiment(StopTime = 360));
  end Test;
end Batteries;
