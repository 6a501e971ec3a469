package Cars "architecture whose parts are replaced, data in records, an inner settings object"
  import SI = Modelica.SIunits;
  record EngineData
    extends Modelica.Icons.Record;
    parameter SI.Inertia J = 0.1;
    parameter SI.Torque tau_max = 100;
    parameter Real curve[:, 2] = [0, 0; 1, 1] "torque over pedal";
    final parameter Real P = tau_max*curve[end, 2]*100 "power at 100 rad/s";
  end EngineData;
  record Small = EngineData(J = 0.05, tau_max = 40);
  record Large
    extends EngineData(J = 0.2, tau_max = 200, curve = [0, 0; 0.5, 0.5; 1, 2]);
  end Large;
  model Settings
    parameter SI.Acceleration g = Modelica.Constants.g_n;
    parameter Boolean lossy = false;
  end Settings;
  package Interfaces
    partial model Engine
      outer Settings settings;
      Modelica.Mechanics.Rotational.Interfaces.Flange_b crank;
      Modelica.Blocks.Interfaces.RealInput pedal(min = 0, max = 1);
    protected
      parameter Boolean includeMount = false "mount towards the body";
    public
      Modelica.Mechanics.Rotational.Interfaces.Flange_a mount if includeMount;
    end Engine;
    partial model Transmission
      Modelica.Mechanics.Rotational.Interfaces.Flange_a shaft_in;
      Modelica.Mechanics.Rotational.Interfaces.Flange_b shaft_out;
    end Transmission;
    partial model Chassis
      Modelica.Mechanics.Rotational.Interfaces.Flange_a hub;
      parameter SI.Mass m = 1000;
    end Chassis;
  end Interfaces;
  package Engines
    extends Modelica.Icons.VariantsPackage;
    model Ideal
      extends Interfaces.Engine;
      replaceable parameter EngineData data constrainedby EngineData annotation(choicesAllMatching = true);
      Modelica.Mechanics.Rotational.Components.Inertia J(J = data.J);
      Modelica.Mechanics.Rotational.Sources.Torque torque;
    equation
      torque.tau = data.tau_max*pedal*(if settings.lossy then 0.9 else 1);
      connect(torque.flange, J.flange_a);
      connect(J.flange_b, crank);
    end Ideal;
  end Engines;
  package Transmissions
    model Fixed
      extends Interfaces.Transmission;
      parameter Real ratio = 4;
      Modelica.Mechanics.Rotational.Components.IdealGear gear(ratio = ratio);
    equation
      connect(shaft_in, gear.flange_a);
      connect(gear.flange_b, shaft_out);
    end Fixed;
  end Transmissions;
  model Minimal
    extends Interfaces.Chassis;
    parameter SI.Radius radius = 0.3;
    Modelica.Mechanics.Rotational.Components.IdealRollingWheel tyres(radius = radius, useSupportT = true, useSupportR = true);
    Modelica.Mechanics.Translational.Components.Mass body(m = m, s(stateSelect = StateSelect.always, start = 0, fixed = true), v(fixed = true));
    Modelica.Mechanics.Translational.Components.Damper drag(d = 10);
    Modelica.Mechanics.Translational.Components.Fixed ground;
    Modelica.Mechanics.Rotational.Components.Fixed fixed;
  equation
    connect(tyres.flangeT, body.flange_a);
    connect(body.flange_b, drag.flange_a);
    connect(drag.flange_b, ground.flange);
    connect(ground.flange, tyres.supportT);
    connect(fixed.flange, tyres.supportR);
    connect(hub, tyres.flangeR);
  end Minimal;
  partial model Architecture
    inner replaceable Settings settings annotation(Placement(transformation(extent = {{60, 60}, {80, 80}})));
    replaceable Interfaces.Engine engine constrainedby Interfaces.Engine annotation(choicesAllMatching = true);
    replaceable Interfaces.Transmission transmission;
    replaceable Interfaces.Chassis chassis(final m = mass) constrainedby Interfaces.Chassis(m = mass);
    parameter SI.Mass mass = 500;
    Modelica.Blocks.Sources.Constant pedal(k = 0.5);
  equation
    connect(pedal.y, engine.pedal);
    connect(engine.crank, transmission.shaft_in);
    connect(transmission.shaft_out, chassis.hub);
  end Architecture;
  model SmallCar
    extends Architecture(
      redeclare Engines.Ideal engine(redeclare Small data),
      redeclare Transmissions.Fixed transmission(ratio = 5),
      redeclare Minimal chassis(radius = 0.25));
  end SmallCar;
  model LargeCar
    extends Architecture(
      redeclare replaceable Engines.Ideal engine(data = Large(tau_max = 150)),
      redeclare Transmissions.Fixed transmission,
      redeclare Minimal chassis,
      settings(lossy = true),
      mass = 800);
    Real P = engine.data.P;
  end LargeCar;
end Cars;
