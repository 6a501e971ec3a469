package Signals "blocks as libraries write them"
  partial block Base
    extends Modelica.Blocks.Interfaces.SISO(u(unit = "rad/s"), y(unit = "N.m"));
  end Base;
  block Controller "PI with anti windup, a switch between two gains, a dead time"
    extends Base;
    parameter Real k = 2, Ti(unit = "s") = 0.5;
    parameter Boolean limited = true;
    Modelica.Blocks.Math.Gain P(final k = k);
    Modelica.Blocks.Continuous.Integrator I(final k = k/Ti, initType = Modelica.Blocks.Types.Init.InitialState, y_start = 0);
    Modelica.Blocks.Math.Add add;
    Modelica.Blocks.Logical.GreaterThreshold late(threshold = 1);
    Modelica.Blocks.Logical.Switch switch;
    Modelica.Blocks.Sources.ContinuousClock clock;
    Modelica.Blocks.Sources.Constant zero(k = 0);
    Modelica.Blocks.Nonlinear.Limiter limiter(uMax = 10) if limited;
    Modelica.Blocks.Math.Gain through(k = 1) if not limited;
  equation
    connect(u, P.u);
    connect(u, I.u);
    connect(P.y, add.u1);
    connect(I.y, add.u2);
    connect(clock.y, late.u);
    connect(late.y, switch.u2);
    connect(add.y, switch.u1);
    connect(zero.y, switch.u3);
    connect(switch.y, limiter.u);
    connect(limiter.y, y);
    connect(switch.y, through.u);
    connect(through.y, y);
  end Controller;
  model Test
    Controller c;
    Modelica.Blocks.Sources.Step step(height = 1, startTime = 0);
    Modelica.Blocks.Sources.BooleanStep on(startTime = 0.5);
    Modelica.Blocks.Math.BooleanToReal number(realTrue = 3);
    Modelica.Blocks.Logical.Hysteresis hysteresis(uLow = 1.2, uHigh = 1.5);
    Modelica.Blocks.Math.MultiSum multi(nu = 2, k = {1, 2});
    Modelica.Blocks.Math.Max max;
    Modelica.Blocks.Sources.TimeTable profile(table = [0, 0; 1, 10; 2, 10]);
    Modelica.Blocks.Routing.RealPassThrough pass;
  equation
    connect(step.y, c.u);
    connect(on.y, number.u);
    connect(profile.y, hysteresis.u);
    connect(number.y, multi.u[1]);
    connect(profile.y, multi.u[2]);
    connect(number.y, max.u1); connect(profile.y, max.u2);
    connect(max.y, pass.u);
    annotation(experiment(StopTime = 2));
  end Test;
end Signals;
