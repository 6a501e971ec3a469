within;
package Drives "Texts that use every construct that is read"
  import SI = Modelica.Units.SI;
  import Modelica.Constants.{pi, g_n};
  import Modelica.Mechanics.Rotational.Components.*;
  import Modelica.Mechanics.Rotational;

  constant Real twice = 2;
  type Law = enumeration(Linear "proportional to speed", Quadratic "to its square");
  type Speed = SI.AngularVelocity(displayUnit = "rpm");

  connector Node "of a user's own circuits"
    SI.Voltage v;
    flow SI.Current i;
  end Node;

  record Data
    parameter SI.Inertia J = 1;
    parameter SI.RotationalDampingConstant d(min = 0) = 0.5;
  end Data;

  record Heavy = Data(J = 4);

  function clipped "a limited value"
    input Real u;
    input Real low = -1;
    input Real high = 1;
    output Real y;
  protected
    Real inner;
  algorithm
    inner := u;
    if inner > high then
      inner := high;
    elseif inner < low then
      inner := low;
    end if;
    y := inner;
  end clipped;

  function powers
    input Real x;
    input Integer n;
    output Real y[n];
  protected
    Real last;
    Integer k;
  algorithm
    last := 1;
    for i in 1:n loop
      last := last*x;
      y[i] := last;
    end for;
    k := 0;
    while k < 2 loop
      k := k + 1;
    end while;
  end powers;

  model TwoMasses "Two-mass oscillator from classes of the standard library"
    extends Modelica.Icons.Example;
    parameter SI.Torque tau = 10 "driving torque";
    parameter Real ratio(min = 0.1) = 2*twice - 1;
    parameter Integer stages = 2;
    parameter Boolean damped = true;
    final parameter SI.Inertia J = 0.1*ratio^2;
    Modelica.Blocks.Sources.Step step(height = tau, startTime = 0.1);
    Rotational.Sources.Torque torque(useSupport = true) annotation(Placement(visible = true));
    Rotational.Components.Inertia motor(J = J, phi(fixed = true, start = 0), w(displayUnit = "rpm", fixed = true, start = 1));
    SpringDamper shaft[stages](each c = 1e3, d = {0.5, 0.25});
    Inertia load[stages](each J = 1, phi(each final fixed = true), each w(fixed = true, start = 1));
    Rotational.Components.Damper damper(d = 3) if damped;
    Rotational.Components.Brake brake(fn_max = 20, mu_pos = [0, 0.5; 1, 0.25]) if not damped;
    Fixed fixed;
    output SI.Power power = torque.flange.tau*motor.w "into the shaft";
    output SI.AngularAcceleration a = motor.a;
  equation
    connect(step.y, torque.tau);
    connect(torque.flange, motor.flange_a);
    connect(motor.flange_b, shaft[1].flange_a);
    for i in 1:stages loop
      connect(shaft[i].flange_b, load[i].flange_a);
    end for;
    connect(load[1].flange_b, shaft[2].flange_a);
    connect(damper.flange_a, load[stages].flange_b);
    connect(damper.flange_b, fixed.flange);
    connect(brake.flange_a, load[stages].flange_b);
    connect(fixed.flange, torque.support);
    annotation(experiment(StopTime = 1.5, Interval = 0.01), Documentation(info = "<html>\"quoted\"</html>"));
  end TwoMasses;

  model Modified "the same with modifications of several levels"
    extends TwoMasses(ratio = 1, damper(d = 5), load(each J = 2), tau = 4);
  end Modified;

  model Chain
    replaceable Rotational.Components.Spring k(c = 100) constrainedby Rotational.Interfaces.PartialCompliant;
    parameter Boolean damped = true annotation(Evaluate = true);
    Inertia load[3](each J = 2, phi(start = {0.1, 0, 0}, each fixed = true), w(each fixed = true));
    Damper damper(d = 1) if damped and size(load, 1) > 2;
    Fixed fixed;
  equation
    connect(load[1].flange_b, k.flange_a);
    connect(k.flange_b, load[2].flange_a);
    connect(damper.flange_a, load[2].flange_b) "with a text" annotation(Line(points = {{0, 0}}));
    connect(damper.flange_b, fixed.flange);
  end Chain;

  model Rearranged
    extends Chain(redeclare SpringDamper k(c = 50, d = 0.5), final damped = false);
    Real energy = sum(0.5*load[i].J*load[i].w^2 for i in 1:size(load, 1)) + 0.5*k.c*k.phi_rel^2;
  end Rearranged;

  model Accelerated "starts with an acceleration"
    Inertia mass(J = 2, w(fixed = true), a(fixed = true, start = 3));
    Rotational.Components.Spring spring(c = 60);
    Fixed fixed;
  equation
    connect(fixed.flange, spring.flange_a);
    connect(spring.flange_b, mass.flange_a);
  end Accelerated;

  partial model Shaft
    extends Rotational.Interfaces.PartialTwoFlanges;
    SI.Angle phi(start = 0);
    Speed w(start = 1, stateSelect = StateSelect.prefer);
  equation
    phi = flange_a.phi;
    phi = flange_b.phi;
    w = der(phi);
  end Shaft;

  model Rotor "an own mass with laws of drag"
    extends Shaft;
    parameter SI.Inertia J = 1;
    parameter Real k[:] = {0.1, 0.2};
    parameter Law law = Law.Linear;
    SI.Torque drag[size(k, 1)];
  equation
    for i in 1:size(k, 1) loop
      drag[i] = k[i]*(if law == Law.Linear then w else w*abs(w));
    end for;
    J*der(w) = flange_a.tau + flange_b.tau - sum(drag);
  end Rotor;

  model Coupled "own classes, records, an array of own classes"
    parameter Heavy data(d = 0.25);
    replaceable model Coupling = Spring constrainedby Spring(c = 1);
    Rotor rotor[2](each J = data.J, law = {Law.Linear, Law.Quadratic}, w(each fixed = true), phi(each fixed = true));
    Coupling coupling(c = 100);
  equation
    connect(rotor[1].flange_b, coupling.flange_a);
    connect(coupling.flange_b, rotor[2].flange_a);
  end Coupled;

  model Redeclared
    extends Coupled(redeclare model Coupling = SpringDamper(d = 20));
  end Redeclared;

  model Resistor
    Node a;
    Node b;
    parameter SI.Resistance R = 2;
  equation
    a.v - b.v = R*a.i;
    a.i + b.i = 0;
  end Resistor;

  model Capacitor
    Node a;
    Node b;
    parameter SI.Capacitance C = 0.5;
    SI.Voltage v;
  equation
    v = a.v - b.v;
    C*der(v) = a.i;
    a.i + b.i = 0;
  initial equation
    v = 3;
  end Capacitor;

  model Earth
    Node a;
  equation
    a.v = 0;
  end Earth;

  model Discharge
    Capacitor store;
    Resistor wire(R = 4);
    Earth earth;
  equation
    connect(store.a, wire.a);
    connect(store.b, earth.a);
    connect(wire.b, earth.a);
  end Discharge;

  model Ball "bounces, counts, and stops counting high bounces"
    parameter Real e = 0.7;
    parameter SI.Length h0 = 1;
    SI.Length h(start = h0, fixed = true);
    SI.Velocity v(start = 0, fixed = true);
    Integer n(start = 0);
    discrete SI.Velocity fastest(start = 0);
    discrete SI.Time last(start = -1);
  equation
    der(h) = v;
    der(v) = -g_n;
    when h < 0 then
      reinit(v, -e*pre(v));
      n = pre(n) + 1;
      fastest = max(pre(fastest), -v);
      last = time;
    end when;
    assert(n < 1000, "too many bounces");
  end Ball;

  model Thermostat "two points, with a memory of its own"
    parameter SI.Temperature T_low = 292, T_high = 294;
    SI.Temperature T(start = 290, fixed = true);
    Boolean on(start = true);
    Boolean cold = T < 291;
    Real signal;
  equation
    when T > T_high then
      on = false;
    elsewhen T < T_low then
      on = true;
    end when;
    signal = if cold then 2 elseif on then 1 else 0;
    10*der(T) = -(T - 280) + (if on then 20 else 0);
  end Thermostat;

  model Sampled "a value that is held, and an if-equation"
    Real x(start = 1, fixed = true);
    discrete Real held(start = 0);
    Real y;
    Real smoothed = noEvent(if x > 0.5 then x else 0.5) + smooth(1, if x > 2 then 1 else 0);
    Real table[3] = powers(x, 3);
    Real limited = clipped(3*x, high = 0.75);
  equation
    der(x) = -x;
    when sample(0, 0.25) then
      held = x;
    end when;
    if x > 0.5 then
      y = 1;
    else
      y = -1;
    end if;
  end Sampled;

  partial model Friction "after Otter, Elmqvist, Mattsson: a path parameter, and Booleans with a memory"
    parameter Real slide = 2 "friction that slides";
    parameter Real stick = 3 "friction that sticks";
    SI.Velocity v(start = 0, fixed = true);
    SI.Acceleration a;
    SI.Force f;
    Real q "friction while it sticks, acceleration and friction while it slides";
    Integer mode(start = 0) "1: forward, 0: sticks, -1: backward";
    Boolean starts(start = false);
    Boolean backs(start = false);
    Boolean locked(start = true);
  equation
    der(v) = a;
    starts = pre(mode) == 0 and (q > stick or pre(starts) and q > slide) or pre(mode) == -1 and v > 0;
    backs = pre(mode) == 0 and (q < -stick or pre(backs) and q < -slide) or pre(mode) == 1 and v < 0;
    locked = not (pre(mode) <> 0 or starts or backs);
    a = if locked then 0 elseif starts or pre(mode) == 1 and not backs then q - slide else q + slide;
    f = if locked then q elseif starts or pre(mode) == 1 and not backs then slide else -slide;
    mode = if (pre(mode) == 1 or starts) and v > 0 then 1 elseif (pre(mode) == -1 or backs) and v < 0 then -1 else 0;
  end Friction;

  model Sledge
    extends Friction;
    parameter SI.Mass m = 1;
    Integer turns(start = 0);
  equation
    m*a = 5*sin(pi/2*time) - f;
    when {edge(starts), change(backs)} then
      turns = pre(turns) + 1;
    end when;
  end Sledge;

  model Steady "starts where its acceleration is zero, under a preload that holds it where it is wanted"
    parameter Real wanted = 2;
    parameter Real preload(fixed = false);
    Real x;
    Real v;
    Real steps;
  equation
    der(x) = v;
    der(v) = preload - 3*x - v + (if time > 1 then 1 else 0);
    steps = floor(4*time);
  initial equation
    der(x) = 0;
    der(v) = 0;
    x = wanted;
  end Steady;

  block Filter "a block between signals"
    extends Modelica.Blocks.Interfaces.SISO;
    parameter SI.Time T = 0.1;
    Modelica.Blocks.Interfaces.BooleanOutput high;
  equation
    T*der(y) = u - y;
    high = y > 0.5;
  initial equation
    y = 0;
  end Filter;

  model Signals
    Modelica.Blocks.Sources.Constant one(k = 1);
    Filter filter(T = 0.2);
    Modelica.Blocks.Math.Gain gain(k = pi);
  equation
    connect(one.y, filter.u);
    connect(filter.y, gain.u);
  end Signals;

  model Clocked "integral controller whose clock ticks every 0.1 s"
    parameter Real T = 0.1;
    Real x(start = 0, fixed = true);
    discrete Real e, s(start = 0);
    Integer n(start = 0);
    Real u;
  equation
    when Clock(T) then
      e = 1 - sample(x);
      s = previous(s) + e;
      n = previous(n) + 1;
    end when;
    u = hold(s);
    der(x) = u - x;
  end Clocked;

  model Late "y' = -y(t - 1), with y = 1 before the start"
    parameter Real T = 1;
    Real y(start = 1, fixed = true);
  equation
    der(y) = -delay(y, T, 2);
  end Late;
end Drives;

// The bouncing ball of Modelica's textbooks: it lies still once a rebound is too low.
model TextbookBall
  parameter Real e = 0.7;
  parameter Real g = 9.81;
  Real h(start = 1, fixed = true);
  Real v(start = 0, fixed = true);
  Boolean flying(start = true, fixed = true);
  Boolean impact;
  Real v_new(start = 0, fixed = true);
equation
  impact = h <= 0;
  der(v) = if flying then -g else 0;
  der(h) = v;
  when {h <= 0 and v <= 0, impact} then
    v_new = if edge(impact) then -e*pre(v) else 0;
    flying = v_new > 0;
    reinit(v, v_new);
  end when;
end TextbookBall;
