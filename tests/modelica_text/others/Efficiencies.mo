package Efficiencies
  import Modelica.Constants.pi;
  block FromMap "electric power by a map over torque and speed, given or in a file"
    parameter Boolean mapsOnFile = false annotation(choices(checkBox = true));
    parameter Real tauFactor = 1 annotation(Dialog(enable = mapsOnFile));
    parameter Real speedFactor = 60/(2*pi);
    parameter String mapsFileName = "NoName";
    parameter String effTableName = "noName";
    parameter Real effTable[:, :] = [0.0, 0.0, 1.0; 0.0, 0.5, 0.6; 1.0, 0.7, 0.8];
    Modelica.Blocks.Tables.CombiTable2Ds toEff(tableOnFile = mapsOnFile, smoothness = Modelica.Blocks.Types.Smoothness.LinearSegments,
      fileName = mapsFileName, tableName = effTableName, table = effTable, extrapolation = Modelica.Blocks.Types.Extrapolation.HoldLastPoint);
    Modelica.Blocks.Interfaces.RealInput w;
    Modelica.Blocks.Interfaces.RealInput tau;
    Modelica.Blocks.Interfaces.RealOutput elePow(unit = "W");
    Modelica.Blocks.Math.Abs abs1, abs2;
    Modelica.Blocks.Math.Gain toMapTorque(k = tauFactor_);
    Modelica.Blocks.Math.Gain toMapSpeed(k = speedFactor_);
    Modelica.Blocks.Math.Product mechanical;
    Modelica.Blocks.Math.Division divide;
    final parameter Real speedFactor_(fixed = false);
    final parameter Real tauFactor_(fixed = false);
  initial equation
    if mapsOnFile then
      speedFactor_ = speedFactor;
      tauFactor_ = tauFactor;
    else
      speedFactor_ = 1;
      tauFactor_ = 1;
    end if;
  equation
    connect(tau, abs2.u);
    connect(w, abs1.u);
    connect(abs2.y, toMapTorque.u);
    connect(abs1.y, toMapSpeed.u);
    connect(toMapTorque.y, toEff.u1);
    connect(toMapSpeed.y, toEff.u2);
    connect(mechanical.u1, tau);
    connect(mechanical.u2, w);
    connect(mechanical.y, divide.u1);
    connect(toEff.y, divide.u2);
    connect(divide.y, elePow);
  end FromMap;
  model Test
    Modelica.Blocks.Sources.Constant tau(k = 0.5), w(k = 0.5);
    FromMap a;
  equation
    connect(tau.y, a.tau); connect(w.y, a.w);
  end Test;
  model OnFile
    extends Test(a(mapsOnFile = true, tauFactor = 2, mapsFileName = "map.txt", effTableName = "eff"));
  end OnFile;
end Efficiencies;
