// Blocks of the Modelica Standard Library that libraries use and no component stands for; written anew.
within Modelica;
package Blocks
  package Types
    type Smoothness = enumeration(LinearSegments, ContinuousDerivative, ConstantSegments,
        MonotoneContinuousDerivative1, MonotoneContinuousDerivative2, ModifiedContinuousDerivative);
    type Extrapolation = enumeration(HoldLastPoint, LastTwoPoints, Periodic, NoExtrapolation);
    type Regularization = enumeration(Exp, Sine, Linear, Cosine);
    type Init = enumeration(NoInit, SteadyState, InitialState, InitialOutput);
    type SimpleController = enumeration(P, PI, PD, PID);
    class ExternalCombiTable1D
      extends ExternalObject;
      function constructor
        input String tableName, fileName;
        input Real table[:, :];
        input Integer columns[:];
        input Smoothness smoothness;
        input Extrapolation extrapolation = Extrapolation.LastTwoPoints;
        input Boolean verboseRead = true;
        input String delimiter = ",";
        input Integer nHeaderLines = 0;
        output ExternalCombiTable1D object;
        external "C" object = ModelicaStandardTables_CombiTable1D_init3(fileName);
      end constructor;
    end ExternalCombiTable1D;
    class ExternalCombiTimeTable
      extends ExternalObject;
      function constructor
        input String tableName, fileName;
        input Real table[:, :], startTime;
        input Integer columns[:];
        input Smoothness smoothness;
        input Extrapolation extrapolation;
        input Real shiftTime = 0;
        input String delimiter = ",";
        input Integer nHeaderLines = 0;
        output ExternalCombiTimeTable object;
        external "C" object = ModelicaStandardTables_CombiTimeTable_init3(fileName);
      end constructor;
    end ExternalCombiTimeTable;
    class ExternalCombiTable2D
      extends ExternalObject;
      function constructor
        input String tableName, fileName;
        input Real table[:, :];
        input Smoothness smoothness;
        input Extrapolation extrapolation = Extrapolation.LastTwoPoints;
        input Boolean verboseRead = true;
        input String delimiter = ",";
        input Integer nHeaderLines = 0;
        output ExternalCombiTable2D object;
        external "C" object = ModelicaStandardTables_CombiTable2D_init3(fileName);
      end constructor;
    end ExternalCombiTable2D;
  end Types;
  package Interfaces
    connector RealInput = input Real;
    connector RealOutput = output Real;
    connector BooleanInput = input Boolean;
    connector BooleanOutput = output Boolean;
    connector IntegerInput = input Integer;
    connector IntegerOutput = output Integer;
    partial block SO
      RealOutput y "output";
    end SO;
    partial block SI
      RealInput u "input";
    end SI;
    partial block SISO
      RealInput u "input";
      RealOutput y "output";
    end SISO;
    partial block SI2SO
      RealInput u1 "first input";
      RealInput u2 "second input";
      RealOutput y "output";
    end SI2SO;
    partial block MISO
      parameter Integer nin = 1;
      RealInput u[nin] "inputs";
      RealOutput y "output";
    end MISO;
    partial block MO
      parameter Integer nout = 1;
      RealOutput y[nout] "outputs";
    end MO;
    partial block Compared
      RealInput u1, u2;
      BooleanOutput y;
    end Compared;
    partial block Threshold
      parameter Real threshold = 0;
      RealInput u;
      BooleanOutput y;
    end Threshold;
    partial block Booleans
      BooleanInput u1, u2;
      BooleanOutput y;
    end Booleans;
  end Interfaces;
  package Math
    block Add extends Interfaces.SI2SO; parameter Real k1 = 1, k2 = 1; equation y = k1*u1 + k2*u2; end Add;
    block Add3
      parameter Real k1 = 1, k2 = 1, k3 = 1;
      Interfaces.RealInput u1, u2, u3;
      Interfaces.RealOutput y = k1*u1 + k2*u2 + k3*u3;
    end Add3;
    block Division extends Interfaces.SI2SO; equation y = u1/u2; end Division;
    block Max extends Interfaces.SI2SO; equation y = max(u1, u2); end Max;
    block Min extends Interfaces.SI2SO; equation y = min(u1, u2); end Min;
    block Power extends Interfaces.SISO; parameter Real base = 10; equation y = base^u; end Power;
    block Abs extends Interfaces.SISO; parameter Boolean generateEvent = false;
    equation y = if generateEvent then (if u >= 0 then u else -u) else abs(u); end Abs;
    block Sign extends Interfaces.SISO; parameter Boolean generateEvent = false;
    equation y = if generateEvent then sign(u) else noEvent(sign(u)); end Sign;
    block Sqrt extends Interfaces.SISO; equation y = sqrt(u); end Sqrt;
    block Sin extends Interfaces.SISO; equation y = sin(u); end Sin;
    block Cos extends Interfaces.SISO; equation y = cos(u); end Cos;
    block Tan extends Interfaces.SISO; equation y = tan(u); end Tan;
    block Tanh extends Interfaces.SISO; equation y = tanh(u); end Tanh;
    block Exp extends Interfaces.SISO; equation y = exp(u); end Exp;
    block Sum extends Interfaces.MISO; parameter Real k[nin] = ones(nin); equation y = k*u; end Sum;
    block MultiSum
      parameter Integer nu = 0;
      parameter Real k[nu] = fill(1, nu);
      Interfaces.RealInput u[nu];
      Interfaces.RealOutput y = k*u;
    end MultiSum;
    block BooleanToReal
      parameter Real realTrue = 1, realFalse = 0;
      Interfaces.BooleanInput u;
      Interfaces.RealOutput y = if u then realTrue else realFalse;
    end BooleanToReal;
    block RealToBoolean
      parameter Real threshold = 0.5;
      Interfaces.RealInput u;
      Interfaces.BooleanOutput y = u >= threshold;
    end RealToBoolean;
    package UnitConversions
      block To_deg extends Interfaces.SISO(u(unit = "rad"), y(unit = "deg")); equation y = 180/Constants.pi*u; end To_deg;
      block From_deg extends Interfaces.SISO(u(unit = "deg"), y(unit = "rad")); equation y = Constants.pi/180*u; end From_deg;
      block To_rpm extends Interfaces.SISO(u(unit = "rad/s"), y(unit = "1/min")); equation y = 30/Constants.pi*u; end To_rpm;
      block From_rpm extends Interfaces.SISO(u(unit = "1/min"), y(unit = "rad/s")); equation y = Constants.pi/30*u; end From_rpm;
      block To_kmh extends Interfaces.SISO(u(unit = "m/s"), y(unit = "km/h")); equation y = 3.6*u; end To_kmh;
      block From_kmh extends Interfaces.SISO(u(unit = "km/h"), y(unit = "m/s")); equation y = u/3.6; end From_kmh;
      block To_degC extends Interfaces.SISO(u(unit = "K"), y(unit = "degC")); equation y = u - 273.15; end To_degC;
      block From_degC extends Interfaces.SISO(u(unit = "degC"), y(unit = "K")); equation y = u + 273.15; end From_degC;
      block To_kWh extends Interfaces.SISO(u(unit = "J"), y(unit = "kW.h")); equation y = u/3.6e6; end To_kWh;
    end UnitConversions;
  end Math;
  package Logical
    block Greater extends Interfaces.Compared; equation y = u1 > u2; end Greater;
    block GreaterEqual extends Interfaces.Compared; equation y = u1 >= u2; end GreaterEqual;
    block Less extends Interfaces.Compared; equation y = u1 < u2; end Less;
    block LessEqual extends Interfaces.Compared; equation y = u1 <= u2; end LessEqual;
    block GreaterThreshold extends Interfaces.Threshold; equation y = u > threshold; end GreaterThreshold;
    block GreaterEqualThreshold extends Interfaces.Threshold; equation y = u >= threshold; end GreaterEqualThreshold;
    block LessThreshold extends Interfaces.Threshold; equation y = u < threshold; end LessThreshold;
    block LessEqualThreshold extends Interfaces.Threshold; equation y = u <= threshold; end LessEqualThreshold;
    block And extends Interfaces.Booleans; equation y = u1 and u2; end And;
    block Or extends Interfaces.Booleans; equation y = u1 or u2; end Or;
    block Xor extends Interfaces.Booleans; equation y = (u1 or u2) and not (u1 and u2); end Xor;
    block Not
      Interfaces.BooleanInput u;
      Interfaces.BooleanOutput y = not u;
    end Not;
    block Switch
      Interfaces.RealInput u1, u3;
      Interfaces.BooleanInput u2;
      Interfaces.RealOutput y = if u2 then u1 else u3;
    end Switch;
    block Hysteresis
      parameter Real uLow, uHigh;
      parameter Boolean pre_y_start = false;
      Interfaces.RealInput u;
      Interfaces.BooleanOutput y;
    initial equation
      pre(y) = pre_y_start;
    equation
      y = not pre(y) and u > uHigh or pre(y) and u >= uLow;
    end Hysteresis;
  end Logical;
  package Nonlinear
    block FixedDelay extends Interfaces.SISO; parameter Real delayTime; equation y = delay(u, delayTime); end FixedDelay;
  end Nonlinear;
  package Continuous
    block PI extends Interfaces.SISO;
      parameter Real k = 1, T, x_start = 0, y_start = 0;
      parameter Types.Init initType = Types.Init.NoInit;
      Real x(start = x_start);
    initial equation
      if initType == Types.Init.SteadyState then
        der(x) = 0;
      elseif initType == Types.Init.InitialState then
        x = x_start;
      elseif initType == Types.Init.InitialOutput then
        y = y_start;
      end if;
    equation
      der(x) = u/T;
      y = k*(x + u);
    end PI;
    block Der extends Interfaces.SISO; equation y = der(u); end Der;
  end Continuous;
  package Sources
    block RealExpression
      Interfaces.RealOutput y = 0;
    end RealExpression;
    block BooleanExpression
      Interfaces.BooleanOutput y = false;
    end BooleanExpression;
    block IntegerExpression
      Interfaces.IntegerOutput y = 0;
    end IntegerExpression;
    block BooleanConstant
      parameter Boolean k = true;
      Interfaces.BooleanOutput y = k;
    end BooleanConstant;
    block BooleanStep
      parameter Real startTime = 0;
      parameter Boolean startValue = false;
      Interfaces.BooleanOutput y = if time >= startTime then not startValue else startValue;
    end BooleanStep;
    block ContinuousClock
      parameter Real offset = 0, startTime = 0;
      Interfaces.RealOutput y = offset + (if time < startTime then 0 else time - startTime);
    end ContinuousClock;
    block TimeTable
      parameter Real table[:, 2], timeScale = 1, offset = 0, startTime = 0, shiftTime = startTime;
      Interfaces.RealOutput y = offset + Tables.valueOfTime(tableID, 1, time/timeScale);
    protected
      parameter Types.ExternalCombiTimeTable tableID = Types.ExternalCombiTimeTable("NoName", "NoName", table,
        startTime/timeScale, {2}, Types.Smoothness.LinearSegments, Types.Extrapolation.LastTwoPoints, shiftTime/timeScale);
    end TimeTable;
    block CombiTimeTable
      extends Tables.Given;
      parameter Real offset[:] = {0}, startTime = 0, timeScale = 1, shiftTime = startTime;
      parameter Integer columns[:] = 2:size(table, 2);
      parameter Integer timeEvents = 1;
      final parameter Integer nout = max(size(columns, 1), size(offset, 1));
      Interfaces.RealOutput y[nout];
    protected
      parameter Types.ExternalCombiTimeTable tableID = Types.ExternalCombiTimeTable(name, file, table,
        startTime/timeScale, columns, smoothness, extrapolation, shiftTime/timeScale, delimiter, nHeaderLines);
    equation
      for k in 1:nout loop
        y[k] = offset[if size(offset, 1) == 1 then 1 else k] + Tables.valueOfTime(tableID, k, time/timeScale);
      end for;
    end CombiTimeTable;
  end Sources;
  package Routing
    block RealPassThrough extends Interfaces.SISO; equation y = u; end RealPassThrough;
    block BooleanPassThrough
      Interfaces.BooleanInput u;
      Interfaces.BooleanOutput y = u;
    end BooleanPassThrough;
  end Routing;
  package Tables
    function value1D
      input Types.ExternalCombiTable1D tableID;
      input Integer icol;
      input Real u;
      output Real y;
      external "C" y = ModelicaStandardTables_CombiTable1D_getValue(tableID, icol, u);
    end value1D;
    function valueOfTime
      input Types.ExternalCombiTimeTable tableID;
      input Integer icol;
      input Real timeIn;
      output Real y;
      external "C" y = ModelicaStandardTables_CombiTimeTable_getValue(tableID, icol, timeIn);
    end valueOfTime;
    function value2D
      input Types.ExternalCombiTable2D tableID;
      input Real u1, u2;
      output Real y;
      external "C" y = ModelicaStandardTables_CombiTable2D_getValue(tableID, u1, u2);
    end value2D;
    partial block Given
      parameter Boolean tableOnFile = false, verboseRead = true, verboseExtrapolation = false;
      parameter Real table[:, :] = fill(0.0, 0, 2);
      parameter String tableName = "NoName", fileName = "NoName", delimiter = ",";
      parameter Integer nHeaderLines = 0;
      parameter Types.Smoothness smoothness = Types.Smoothness.LinearSegments;
      parameter Types.Extrapolation extrapolation = Types.Extrapolation.LastTwoPoints;
    protected
      final parameter String name = if tableOnFile then tableName else "NoName", file = if tableOnFile then fileName else "NoName";
    end Given;
    partial block Given1D
      extends Given;
      parameter Integer columns[:] = 2:size(table, 2);
    protected
      parameter Types.ExternalCombiTable1D tableID = Types.ExternalCombiTable1D(name, file, table, columns, smoothness,
        extrapolation, verboseRead, delimiter, nHeaderLines);
    end Given1D;
    partial block Given2D
      extends Given;
    protected
      parameter Types.ExternalCombiTable2D tableID = Types.ExternalCombiTable2D(name, file, table, smoothness,
        extrapolation, verboseRead, delimiter, nHeaderLines);
    end Given2D;
    block CombiTable1Ds
      extends Given1D;
      Interfaces.RealInput u;
      Interfaces.RealOutput y[size(columns, 1)];
    equation
      for k in 1:size(columns, 1) loop
        y[k] = value1D(tableID, k, u);
      end for;
    end CombiTable1Ds;
    block CombiTable1Dv
      extends Given1D;
      Interfaces.RealInput u[size(columns, 1)];
      Interfaces.RealOutput y[size(columns, 1)];
    equation
      for k in 1:size(columns, 1) loop
        y[k] = value1D(tableID, k, u[k]);
      end for;
    end CombiTable1Dv;
    block CombiTable2Ds
      extends Given2D;
      Interfaces.RealInput u1, u2;
      Interfaces.RealOutput y = value2D(tableID, u1, u2);
    end CombiTable2Ds;
  end Tables;
end Blocks;
