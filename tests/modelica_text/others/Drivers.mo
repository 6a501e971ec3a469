package Drivers
  block Proportional "follows a cycle of a file"
    parameter String CycleFileName = "cycle.txt" "drive cycle";
    parameter Real k "gain";
    parameter Real yMax = 1.e6 "largest output";
    parameter Modelica.Blocks.Types.Extrapolation extrapolation = Modelica.Blocks.Types.Extrapolation.LastTwoPoints;
  protected
    parameter Boolean dummy(fixed = false);
  public
    Modelica.Blocks.Interfaces.RealInput V;
    Modelica.Blocks.Math.UnitConversions.From_kmh from_kmh;
    Modelica.Blocks.Sources.CombiTimeTable driveCyc(columns = {2}, extrapolation = extrapolation, fileName = CycleFileName, tableName = "Cycle", tableOnFile = true);
    Modelica.Blocks.Math.Feedback feedback;
    Modelica.Blocks.Math.Gain gain(k = k);
    Modelica.Blocks.Nonlinear.Limiter limAcc(uMax = yMax, uMin = 0);
    Modelica.Blocks.Nonlinear.Limiter limBrak(uMax = 0, uMin = -yMax);
    Modelica.Blocks.Interfaces.RealOutput accel(unit = "N");
    Modelica.Blocks.Interfaces.RealOutput brake(unit = "N");
  initial equation
    if extrapolation == Modelica.Blocks.Types.Extrapolation.HoldLastPoint then
      dummy = true;
    else
      dummy = false;
    end if;
  equation
    connect(V, feedback.u2);
    connect(from_kmh.u, driveCyc.y[1]);
    connect(from_kmh.y, feedback.u1);
    connect(feedback.y, gain.u);
    connect(limBrak.y, brake);
    connect(limAcc.y, accel);
    connect(limBrak.u, gain.y);
    connect(limAcc.u, gain.y);
  end Proportional;
  model Test
    Proportional driver(k = 500, extrapolation = Modelica.Blocks.Types.Extrapolation.HoldLastPoint);
    Modelica.Blocks.Math.Add add(k1 = 1, k2 = 1);
    Modelica.Mechanics.Translational.Sources.Force force;
    Modelica.Mechanics.Translational.Components.Mass car(m = 1000, s(fixed = true), v(fixed = true));
    Modelica.Mechanics.Translational.Sensors.SpeedSensor sensor;
  equation
    connect(driver.accel, add.u1);
    connect(driver.brake, add.u2);
    connect(add.y, force.f);
    connect(force.flange, car.flange_a);
    connect(car.flange_b, sensor.flange);
    connect(sensor.v, driver.V);
    annotation(experiment(StopTime = 20));
  end Test;
end Drivers;
