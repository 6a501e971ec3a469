package Friction
  partial model PartialFriction
    parameter Real speed_small = 0.001;
    Real speed_rel;
    Real acceleration_rel;
    Real friction0;
    Real friction0_max;
    output Boolean free;
    Real sa(unit = "1");
    output Boolean startForward(start = false, fixed = true), startBackward(start = false, fixed = true);
    output Boolean locked(start = false);
    constant Integer Unknown = 3, Free = 2, Forward = 1, Stuck = 0, Backward = -1;
    output Integer mode(final min = Backward, final max = Unknown, start = Unknown, fixed = true);
  protected
    constant Real unitAcceleration = 1 annotation(HideResult = true);
    constant Real unitFriction = 1 annotation(HideResult = true);
  equation
    startForward = pre(mode) == Stuck and (sa > friction0_max/unitFriction or pre(startForward) and sa > friction0/unitFriction)
      or pre(mode) == Backward and speed_rel > speed_small or initial() and speed_rel > 0;
    startBackward = pre(mode) == Stuck and (sa < -friction0_max/unitFriction or pre(startBackward) and sa < -friction0/unitFriction)
      or pre(mode) == Forward and speed_rel < -speed_small or initial() and speed_rel < 0;
    locked = not free and not (pre(mode) == Forward or startForward or pre(mode) == Backward or startBackward);
    acceleration_rel/unitAcceleration = if locked then 0 else if free then sa
      else if startForward then sa - friction0_max/unitFriction else if startBackward then sa + friction0_max/unitFriction
      else if pre(mode) == Forward then sa - friction0_max/unitFriction else sa + friction0_max/unitFriction;
    mode = if free then Free
      else if (pre(mode) == Forward or pre(mode) == Free or startForward) and speed_rel > 0 then Forward
      else if (pre(mode) == Backward or pre(mode) == Free or startBackward) and speed_rel < 0 then Backward else Stuck;
  end PartialFriction;
  model Coulomb
    extends Modelica.Mechanics.Rotational.Interfaces.PartialCompliant;
    extends PartialFriction;
    parameter Real T = 1;
  equation
    speed_rel = der(phi_rel);
    acceleration_rel = der(speed_rel);
    friction0 = T;
    friction0_max = T;
    free = false;
    tau = if locked then sa else if startForward then T else if startBackward then -T else if pre(mode) == Forward then T else -T;
  end Coulomb;
  model Test
    Modelica.Mechanics.Rotational.Components.Inertia J(J = 2, phi(fixed = true), w(start = 3, fixed = true));
    Coulomb f(T = 4);
    Modelica.Mechanics.Rotational.Components.Fixed wall;
    Modelica.Mechanics.Rotational.Sources.TorqueStep drive(stepTorque = 10, startTime = 3);
  equation
    connect(wall.flange, f.flange_a); connect(f.flange_b, J.flange_a); connect(drive.flange, J.flange_b);
    annotation(experiment(StopTime = 4));
  end Test;
end Friction;
