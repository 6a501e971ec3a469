package Old "names of version 3.2"
  import Modelica.SIunits.Conversions.from_rpm;
  import Modelica.SIunits.Conversions.NonSIunits.*;
  import NonSI = Modelica.SIunits.Conversions.NonSIunits;
  import Modelica.Constants.*;
  model Motor
    parameter NonSI.AngularVelocity_rpm nominal = 300;
    parameter AngularVelocity_rpm other = 600;
    final parameter Modelica.SIunits.AngularVelocity w = from_rpm(nominal);
    final parameter Modelica.SIunits.AngularVelocity w2 = Modelica.SIunits.Conversions.from_rpm(other);
    Modelica.Blocks.Sources.Sine sine(amplitude = 2, freqHz = 0.5);
    Modelica.Blocks.Nonlinear.Limiter limiter(uMax = 1, limitsAtInit = true);
    Modelica.Electrical.Analog.Sources.SineVoltage source(V = 3, freqHz = 0.5);
    Modelica.Electrical.Analog.Basic.EMF emf(k = 2);
    Modelica.Electrical.Analog.Basic.Resistor R(R = 4);
    Modelica.Electrical.Analog.Basic.Ground ground;
    Modelica.Mechanics.Rotational.Components.Inertia J(J = 2, w(start = from_rpm(60), fixed = true), phi(fixed = true));
    Modelica.Mechanics.Rotational.Components.Brake brake(mue_pos = [0, 0.5], fn_max = 2, cgeo = 1);
    Modelica.Blocks.Sources.Constant off(k = 0);
    Modelica.Blocks.Tables.CombiTable1D table(table = [0, 0; 1, 2]);
    Modelica.Blocks.Math.Add3 sum(k2 = -1, k3 = 2);
    Modelica.Thermal.HeatTransfer.Celsius.FixedTemperature room(T = 20);
    Modelica.Thermal.HeatTransfer.Components.HeatCapacitor body(C = 10, T(start = 300, fixed = true));
    Modelica.Thermal.HeatTransfer.Components.Convection convection;
    Modelica.Blocks.Sources.Constant G(k = 5);
    Real mu = pi;
  equation
    connect(sine.y, limiter.u);
    connect(source.p, R.p); connect(R.n, emf.p); connect(emf.n, source.n); connect(ground.p, source.n);
    connect(emf.flange, J.flange_a); connect(J.flange_b, brake.flange_a); connect(off.y, brake.f_normalized);
    connect(limiter.y, table.u[1]);
    connect(sine.y, sum.u1); connect(limiter.y, sum.u2); connect(table.y[1], sum.u3);
    connect(room.port, convection.fluid); connect(convection.solid, body.port); connect(G.y, convection.Gc);
  end Motor;
end Old;
