package Planar
  import SI = Modelica.SIunits;
  import MB = Modelica.Mechanics.MultiBody;
  model PlanarWorld
    parameter SI.Acceleration[2] g = {0, -9.81} "gravity";
    parameter Boolean enableAnimation = false;
    parameter SI.Length defaultDiameter = 0.1;
    annotation(defaultComponentName = "planarWorld", defaultComponentPrefixes = "inner",
      missingInnerMessage = "No planarWorld is defined: a default one is used.");
  end PlanarWorld;
  package Interfaces
    connector Frame
      SI.Position x, y;
      SI.Angle phi;
      flow SI.Force fx, fy;
      flow SI.Torque t;
    end Frame;
    connector Frame_a = Frame annotation(Icon(graphics = {Rectangle(extent = {{-40, 100}, {40, -100}})}));
    connector Frame_b
      extends Frame;
    end Frame_b;
  end Interfaces;
  model Body
    Interfaces.Frame_a frame_a;
    outer PlanarWorld planarWorld "world";
    parameter Boolean animate = true;
    parameter StateSelect stateSelect = StateSelect.default;
    parameter SI.Mass m;
    parameter SI.Inertia I;
    parameter SI.Acceleration g[2] = planarWorld.g;
    parameter SI.Diameter diameter = planarWorld.defaultDiameter annotation(Dialog(enable = animate));
    SI.Force f[2];
    SI.Position r[2](each final stateSelect = stateSelect, start = {0, 0}, each fixed = true);
    SI.Velocity v[2](final stateSelect = {stateSelect, stateSelect}, start = {2, 3}, fixed = {true, true});
    SI.Acceleration a[2](start = {0, 0});
    SI.Angle phi(final stateSelect = stateSelect, start = 0, fixed = true);
    SI.AngularVelocity w(start = 1, fixed = true);
    SI.AngularAcceleration z(start = 0);
    MB.Visualizers.Advanced.Shape sphere(shapeType = "sphere", color = {63, 63, 255}, length = diameter,
      r = {frame_a.x, frame_a.y, 0}, R = MB.Frames.axisRotation(3, frame_a.phi, w)) if planarWorld.enableAnimation and animate;
  equation
    r = {frame_a.x, frame_a.y};
    v = der(r);
    phi = frame_a.phi;
    w = der(frame_a.phi);
    a = der(v);
    z = der(w);
    f = {frame_a.fx, frame_a.fy};
    f + m*g = m*a;
    frame_a.t = I*z;
  end Body;
  model Rod
    Interfaces.Frame_a frame_a;
    Interfaces.Frame_b frame_b;
    parameter SI.Length r[2];
    final parameter SI.Length l = sqrt(r*r);
    SI.Position r0[2];
    Real R[2, 2];
  equation
    R = {{cos(frame_a.phi), -sin(frame_a.phi)}, {sin(frame_a.phi), cos(frame_a.phi)}};
    r0 = R*r;
    {frame_a.x, frame_a.y} + r0 = {frame_b.x, frame_b.y};
    frame_a.phi = frame_b.phi;
    frame_a.fx + frame_b.fx = 0;
    frame_a.fy + frame_b.fy = 0;
    frame_a.t + frame_b.t + r0*{frame_b.fy, -frame_b.fx} = 0;
  end Rod;
  model Test
    inner PlanarWorld planarWorld;
    Body body(m = 2, I = 0.5);
  end Test;
  model WithoutWorld
    Body body(m = 2, I = 0.5);
  end WithoutWorld;
  model Pendulum
    inner PlanarWorld planarWorld(g = {0, -10});
    model Pivot
      Interfaces.Frame_b frame_b;
      SI.Angle phi(start = 0, fixed = true);
      SI.AngularVelocity w(start = 0.01, fixed = true);
    equation
      w = der(phi);
      {frame_b.x, frame_b.y} = zeros(2);
      frame_b.phi = phi;
      frame_b.t = 0;
    end Pivot;
    Pivot pivot;
    Rod rod(r = {0, -2.5});
    Body body(m = 3, I = 0, r(each fixed = false), v(fixed = {false, false}), phi(fixed = false), w(fixed = false));
  equation
    connect(pivot.frame_b, rod.frame_a);
    connect(rod.frame_b, body.frame_a);
  end Pendulum;
end Planar;
