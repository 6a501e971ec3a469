within;
package Machines
  model Start "a DC machine that starts with a ramp of the voltage, with a record of its data"
    import Modelica.Electrical.Machines.Utilities.ParameterRecords.DcPermanentMagnetData;
    parameter Modelica.Units.SI.Torque load = 63.66;
    parameter DcPermanentMagnetData data;
    Modelica.Electrical.Machines.BasicMachines.DCMachines.DC_PermanentMagnet dcpm(
      VaNominal = data.VaNominal, IaNominal = data.IaNominal, wNominal = data.wNominal, TaNominal = data.TaNominal,
      Ra = data.Ra, TaRef = data.TaRef, La = data.La, Jr = data.Jr, useSupport = false, Js = data.Js,
      frictionParameters = data.frictionParameters, coreParameters = data.coreParameters,
      strayLoadParameters = data.strayLoadParameters, brushParameters = data.brushParameters,
      TaOperational = 293.15, alpha20a = data.alpha20a, phiMechanical(fixed = true, start = 0),
      wMechanical(fixed = true, start = 0), ia(fixed = true));
    Modelica.Blocks.Sources.Ramp ramp(duration = 0.8, startTime = 0.2, height = 100);
    Modelica.Electrical.Analog.Sources.SignalVoltage signalVoltage;
    Modelica.Electrical.Analog.Basic.Ground ground;
    Modelica.Mechanics.Rotational.Components.Inertia loadInertia(J = 0.15);
    Modelica.Mechanics.Rotational.Sources.TorqueStep loadTorqueStep(
      stepTorque = -load, startTime = 1.5, useSupport = false, offsetTorque = 0);
  equation
    connect(ramp.y, signalVoltage.v);
    connect(signalVoltage.p, dcpm.pin_ap);
    connect(signalVoltage.n, dcpm.pin_an);
    connect(signalVoltage.n, ground.p);
    connect(dcpm.flange, loadInertia.flange_a);
    connect(loadInertia.flange_b, loadTorqueStep.flange);
    annotation(experiment(StopTime = 2));
  end Start;

  model Controlled "a speed control"
    Modelica.Blocks.Sources.Step step(height = 10);
    Modelica.Blocks.Continuous.LimPID control(
      controllerType = Modelica.Blocks.Types.SimpleController.PI, k = 2, Ti = 0.5, yMax = 12);
    Modelica.Mechanics.Rotational.Sources.Torque torque;
    Modelica.Mechanics.Rotational.Components.Inertia inertia(J = 1, phi(fixed = true), w(fixed = true));
    Modelica.Mechanics.Rotational.Sensors.SpeedSensor speed;
  equation
    connect(step.y, control.u_s);
    connect(control.y, torque.tau);
    connect(torque.flange, inertia.flange_a);
    connect(inertia.flange_b, speed.flange);
    connect(speed.w, control.u_m);
    annotation(experiment(StopTime = 5));
  end Controlled;
end Machines;
