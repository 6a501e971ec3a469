package Roads
  model Drag "rolling and air resistance that holds the vehicle at rest"
    import Modelica.Constants.g_n;
    extends Modelica.Mechanics.Translational.Interfaces.PartialElementaryOneFlangeAndSupport2;
    parameter Modelica.SIunits.Mass m "mass";
    parameter Modelica.SIunits.Density rho = 1.2 "air";
    parameter Modelica.SIunits.Area A "front area";
    parameter Real cw "air drag", cr(start = 0.01) "rolling drag";
    Modelica.SIunits.Force f "resistance";
    Modelica.SIunits.Velocity v(start = 0);
  protected
    parameter Real rolling = cr*m*g_n;
    parameter Real air = 1/2*rho*A*cw;
  equation
    v = der(s);
    f = flange.f;
    f = sign(v)*(rolling + air*v^2);
  end Drag;
  model Test
    Modelica.Mechanics.Translational.Components.Mass car(m = 100, s(fixed = true), v(start = 30, fixed = true));
    Drag drag(m = car.m, A = 2, cw = 0, cr = 0.1);
  equation
    connect(car.flange_b, drag.flange);
  end Test;
end Roads;
