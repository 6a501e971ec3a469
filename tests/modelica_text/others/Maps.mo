package Maps
  block TorqueLimit "torque of a drive by its speed: constant torque, constant power, and nothing above a speed"
    Modelica.Blocks.Interfaces.RealInput w annotation(Placement(transformation(extent = {{-140, -20}, {-100, 20}})));
    Modelica.Blocks.Interfaces.RealOutput high;
    parameter Modelica.SIunits.Power powMax = 1000 "largest power";
    parameter Modelica.SIunits.Torque tauMax = 50 "largest torque";
    parameter Modelica.SIunits.AngularVelocity wMax = 40;
    Integer region "0, 1: below and above the base speed, 2: fading, 3: nothing";
  protected
    parameter Real alpha = 0.25 "part of wMax in which the torque fades";
  public
    Modelica.Blocks.Interfaces.RealOutput low;
  algorithm
    if w < powMax/tauMax then
      region := 0;
      high := tauMax;
    else
      region := 1;
      high := powMax/w;
    end if;
    if w > wMax then
      if w < (1 + alpha)*wMax then
        region := 2;
        high := powMax/wMax*(1 - (w - wMax)/(alpha*wMax));
      else
        region := 3;
        high := 0;
      end if;
    end if;
    low := -high;
  end TorqueLimit;
  model Test
    Modelica.Blocks.Sources.Ramp w(height = 60, duration = 6);
    TorqueLimit limit;
  equation
    connect(w.y, limit.w);
  end Test;
end Maps;
