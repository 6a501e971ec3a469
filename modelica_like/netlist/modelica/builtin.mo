type AssertionLevel = enumeration(warning, error);
// What Modelica texts use without a component behind it: units, constants, enumerations, bases of elements.
// The names are those of the Modelica Standard Library; the text is this package's own.
package Modelica
  package Units
    package SI
      type Angle = Real(unit = "rad");
      type Length = Real(unit = "m");
      type Position = Length;
      type Distance = Length(min = 0);
      type Radius = Distance;
      type Diameter = Distance;
      type Thickness = Distance;
      type Breadth = Distance;
      type Height = Distance;
      type Area = Real(unit = "m2");
      type Volume = Real(unit = "m3");
      type Time = Real(unit = "s");
      type Period = Time;
      type Duration = Time;
      type AngularVelocity = Real(unit = "rad/s");
      type AngularAcceleration = Real(unit = "rad/s2");
      type AngularFrequency = AngularVelocity;
      type Velocity = Real(unit = "m/s");
      type Acceleration = Real(unit = "m/s2");
      type Frequency = Real(unit = "Hz");
      type DampingCoefficient = Real(unit = "1/s");
      type Mass = Real(unit = "kg", min = 0);
      type Density = Real(unit = "kg/m3");
      type Inertia = Real(unit = "kg.m2");
      type MomentOfInertia = Inertia;
      type Force = Real(unit = "N");
      type Torque = Real(unit = "N.m");
      type Impulse = Real(unit = "N.s");
      type Pressure = Real(unit = "Pa");
      type AbsolutePressure = Pressure(min = 0);
      type Stress = Pressure;
      type ModulusOfElasticity = Pressure;
      type DynamicViscosity = Real(unit = "Pa.s");
      type KinematicViscosity = Real(unit = "m2/s");
      type MassFlowRate = Real(unit = "kg/s");
      type VolumeFlowRate = Real(unit = "m3/s");
      type Energy = Real(unit = "J");
      type Work = Energy;
      type Power = Real(unit = "W");
      type RotationalSpringConstant = Real(unit = "N.m/rad");
      type RotationalDampingConstant = Real(unit = "N.m.s/rad");
      type TranslationalSpringConstant = Real(unit = "N/m");
      type TranslationalDampingConstant = Real(unit = "N.s/m");
      type Temperature = Real(unit = "K");
      type TemperatureDifference = Temperature;
      type HeatFlowRate = Power;
      type Heat = Energy;
      type HeatCapacity = Real(unit = "J/K");
      type SpecificHeatCapacity = Real(unit = "J/(kg.K)");
      type ThermalConductance = Real(unit = "W/K");
      type ThermalResistance = Real(unit = "K/W");
      type ThermalConductivity = Real(unit = "W/(m.K)");
      type LinearTemperatureCoefficient = Real(unit = "1/K");
      type Voltage = Real(unit = "V");
      type ElectricPotential = Voltage;
      type Current = Real(unit = "A");
      type ElectricCurrent = Current;
      type ElectricCharge = Real(unit = "C");
      type Resistance = Real(unit = "Ohm");
      type Conductance = Real(unit = "S");
      type Capacitance = Real(unit = "F");
      type Inductance = Real(unit = "H");
      type MagneticFlux = Real(unit = "Wb");
      type ElectricalTorqueConstant = Real(unit = "N.m/A");
      type CoefficientOfFriction = Real(min = 0);
      type Efficiency = Real(min = 0);
      type PerUnit = Real;
    end SI;
    package NonSI
      type Temperature_degC = Real(unit = "degC");
      type Angle_deg = Real(unit = "deg");
      type AngularVelocity_rpm = Real(unit = "1/min");
      type Velocity_kmh = Real(unit = "km/h");
      type Time_hour = Real(unit = "h");
      type Time_minute = Real(unit = "min");
      type Time_day = Real(unit = "d");
      type Energy_kWh = Real(unit = "kW.h");
      type ElectricCharge_Ah = Real(unit = "A.h");
      type Pressure_bar = Real(unit = "bar");
    end NonSI;
    package Conversions
      function from_deg
        input Real degree;
        output Real radian;
      algorithm
        radian := degree*3.14159265358979323846/180;
      end from_deg;
      function to_deg
        input Real radian;
        output Real degree;
      algorithm
        degree := radian*180/3.14159265358979323846;
      end to_deg;
      function from_rpm
        input Real rpm;
        output Real speed;
      algorithm
        speed := rpm*3.14159265358979323846/30;
      end from_rpm;
      function to_rpm
        input Real speed;
        output Real rpm;
      algorithm
        rpm := speed*30/3.14159265358979323846;
      end to_rpm;
      function from_degC
        input Real celsius;
        output Real kelvin;
      algorithm
        kelvin := celsius + 273.15;
      end from_degC;
      function to_degC
        input Real kelvin;
        output Real celsius;
      algorithm
        celsius := kelvin - 273.15;
      end to_degC;
      function from_kmh
        input Real kmh;
        output Real speed;
      algorithm
        speed := kmh/3.6;
      end from_kmh;
      function to_kmh
        input Real speed;
        output Real kmh;
      algorithm
        kmh := 3.6*speed;
      end to_kmh;
    end Conversions;
  end Units;
  package Constants
    constant Real pi = 3.14159265358979323846;
    constant Real e = 2.718281828459045235360;
    constant Real D2R = 3.14159265358979323846/180;
    constant Real R2D = 180/3.14159265358979323846;
    constant Real eps = 2.2204460492503131e-16;
    constant Real small = 1e-60;
    constant Real inf = 1e60;
    constant Real g_n = 9.80665;
    constant Real T_zero = -273.15;
    constant Real mu_0 = 1.25663706127e-6;
  end Constants;
  package Electrical
    package Analog
      package Interfaces
        partial model TwoPin
          Units.SI.Voltage v "voltage between the ends";
          PositivePin p;
          NegativePin n;
        equation
          v = p.v - n.v;
        end TwoPin;
        partial model OnePort
          extends TwoPin;
          Units.SI.Current i "from p to n";
        equation
          0 = p.i + n.i;
          i = p.i;
        end OnePort;
      end Interfaces;
      package Basic
        model Conductor
          extends Interfaces.OnePort;
          parameter Units.SI.Conductance G;
        equation
          i = G*v;
        end Conductor;
      end Basic;
      package Sources
        model SineVoltage
          extends Interfaces.OnePort;
          parameter Real V, phase = 0, f, offset = 0, startTime = 0;
        equation
          v = offset + (if time < startTime then 0 else V*sin(2*Constants.pi*f*(time - startTime) + phase));
        end SineVoltage;
        model StepVoltage
          extends Interfaces.OnePort;
          parameter Real V, offset = 0, startTime = 0;
        equation
          v = offset + (if time < startTime then 0 else V);
        end StepVoltage;
      end Sources;
      package Sensors
        model PotentialSensor
          Interfaces.PositivePin p;
          Blocks.Interfaces.RealOutput phi(unit = "V");
        equation
          p.i = 0;
          phi = p.v;
        end PotentialSensor;
      end Sensors;
    end Analog;
    package Machines
      package Losses
        record FrictionParameters
          parameter Units.SI.Power PRef = 0;
          parameter Units.SI.AngularVelocity wRef = 1;
          parameter Real power_w = 2;
        end FrictionParameters;
        record StrayLoadParameters
          parameter Units.SI.Power PRef = 0;
          parameter Units.SI.Current IRef = 1;
          parameter Units.SI.AngularVelocity wRef = 1;
          parameter Real power_w = 1;
        end StrayLoadParameters;
        record BrushParameters
          parameter Units.SI.Voltage V = 0;
          parameter Units.SI.Current ILinear = 1;
        end BrushParameters;
        record CoreParameters
          parameter Units.SI.Power PRef = 0;
          parameter Units.SI.Voltage VRef = 1;
          parameter Units.SI.AngularVelocity wRef = 1;
        end CoreParameters;
      end Losses;
      package Utilities
        package ParameterRecords
          record DcPermanentMagnetData
            parameter Units.SI.Inertia Jr = 0.15;
            parameter Units.SI.Inertia Js = Jr;
            parameter Units.SI.Voltage VaNominal = 100;
            parameter Units.SI.Current IaNominal = 100;
            parameter Units.SI.AngularVelocity wNominal = 1425*2*3.14159265358979323846/60;
            parameter Units.SI.Temperature TaNominal = 293.15;
            parameter Units.SI.Resistance Ra = 0.05;
            parameter Units.SI.Temperature TaRef = 293.15;
            parameter Thermal.LinearTemperatureCoefficient20 alpha20a = 0;
            parameter Units.SI.Inductance La = 0.0015;
            parameter Losses.FrictionParameters frictionParameters(wRef = wNominal);
            parameter Losses.CoreParameters coreParameters(VRef = VaNominal - Ra*IaNominal, wRef = wNominal);
            parameter Losses.StrayLoadParameters strayLoadParameters(IRef = IaNominal, wRef = wNominal);
            parameter Losses.BrushParameters brushParameters(ILinear = 0.01*IaNominal);
          end DcPermanentMagnetData;
          record DcElectricalExcitedData
            extends DcPermanentMagnetData;
            parameter Units.SI.Current IeNominal = 1;
            parameter Units.SI.Resistance Re = 100;
            parameter Units.SI.Temperature TeRef = 293.15;
            parameter Thermal.LinearTemperatureCoefficient20 alpha20e = 0;
            parameter Units.SI.Inductance Le = 1;
            parameter Real sigmae = 0;
          end DcElectricalExcitedData;
        end ParameterRecords;
      end Utilities;
      package Thermal
        type LinearTemperatureCoefficient20 = Real(unit = "1/K");
        package Constants
          constant Real alpha20Copper = 3.92e-3;
          constant Real alpha20Aluminium = 4.03e-3;
          constant Real alpha20Brass = 1.5e-3;
        end Constants;
      end Thermal;
    end Machines;
  end Electrical;
  package Mechanics
    package Rotational
      package Interfaces
        partial model PartialTwoFlanges
          Flange_a flange_a "left end";
          Flange_b flange_b "right end";
        end PartialTwoFlanges;
        partial model PartialCompliant
          extends PartialTwoFlanges;
          Units.SI.Angle phi_rel(start = 0) "relative angle";
          Units.SI.Torque tau "torque between the ends";
        equation
          phi_rel = flange_b.phi - flange_a.phi;
          flange_b.tau = tau;
          flange_a.tau = -tau;
        end PartialCompliant;
        partial model PartialCompliantWithRelativeStates
          extends PartialTwoFlanges;
          Units.SI.Angle phi_rel(start = 0, stateSelect = StateSelect.prefer) "relative angle";
          Units.SI.AngularVelocity w_rel(start = 0, stateSelect = StateSelect.prefer) "relative speed";
          Units.SI.AngularAcceleration a_rel(start = 0) "relative acceleration";
          Units.SI.Torque tau "torque between the ends";
        equation
          phi_rel = flange_b.phi - flange_a.phi;
          w_rel = der(phi_rel);
          a_rel = der(w_rel);
          flange_b.tau = tau;
          flange_a.tau = -tau;
        end PartialCompliantWithRelativeStates;
        partial model PartialElementaryOneFlangeAndSupport2
          parameter Boolean useSupport = false;
          Flange_b flange "shaft end";
          Support support if useSupport "housing";
        protected
          Units.SI.Angle phi_support "angle of the housing";
        equation
          if useSupport then
            phi_support = support.phi;
            support.tau = -flange.tau;
          else
            phi_support = 0;
          end if;
        end PartialElementaryOneFlangeAndSupport2;
        partial model PartialElementaryTwoFlangesAndSupport2
          extends PartialTwoFlanges;
          parameter Boolean useSupport = false;
          Support support if useSupport "housing";
        protected
          Units.SI.Angle phi_support "angle of the housing";
        equation
          if useSupport then
            phi_support = support.phi;
            support.tau = -flange_a.tau - flange_b.tau;
          else
            phi_support = 0;
          end if;
        end PartialElementaryTwoFlangesAndSupport2;
        partial model PartialTorque
          extends PartialElementaryOneFlangeAndSupport2;
          Units.SI.Angle phi "angle of the shaft against the housing";
        equation
          phi = flange.phi - phi_support;
        end PartialTorque;
        partial model PartialAbsoluteSensor
          Flange_a flange "shaft end";
        equation
          flange.tau = 0;
        end PartialAbsoluteSensor;
        partial model PartialRelativeSensor
          extends PartialTwoFlanges;
        equation
          flange_a.tau + flange_b.tau = 0;
        end PartialRelativeSensor;
      end Interfaces;
      package Components
        model TorqueToAngleAdaptor "end that takes what flows in and tells its motion"
          parameter Boolean use_w = true;
          parameter Boolean use_a = true;
          Interfaces.Flange_a flange;
          Modelica.Blocks.Interfaces.RealInput tau;
          Modelica.Blocks.Interfaces.RealOutput phi;
          Modelica.Blocks.Interfaces.RealOutput w if use_w;
          Modelica.Blocks.Interfaces.RealOutput a if use_w and use_a;
        protected
          Real rate = der(flange.phi);
        equation
          flange.tau = tau;
          phi = flange.phi;
          if use_w then
            w = rate;
          end if;
          if use_w and use_a then
            a = der(rate);
          end if;
        end TorqueToAngleAdaptor;
        model AngleToTorqueAdaptor "end that takes a motion and tells what flows"
          parameter Boolean use_w = true;
          parameter Boolean use_a = true;
          Interfaces.Flange_b flange;
          Modelica.Blocks.Interfaces.RealInput phi;
          Modelica.Blocks.Interfaces.RealInput w if use_w "the rate, which follows from the motion";
          Modelica.Blocks.Interfaces.RealInput a if use_w and use_a;
          Modelica.Blocks.Interfaces.RealOutput tau;
        equation
          flange.phi = phi;
          tau = -flange.tau;
        end AngleToTorqueAdaptor;
        model GeneralTorqueToAngleAdaptor "end that takes what flows in and tells its motion"
          parameter Boolean use_pder = true;
          parameter Boolean use_pder2 = true;
          Interfaces.Flange_a flange;
          Modelica.Blocks.Interfaces.RealInput f;
          Modelica.Blocks.Interfaces.RealOutput p;
          Modelica.Blocks.Interfaces.RealOutput pder if use_pder;
          Modelica.Blocks.Interfaces.RealOutput pder2 if use_pder and use_pder2;
        protected
          Real rate = der(flange.phi);
        equation
          flange.tau = f;
          p = flange.phi;
          if use_pder then
            pder = rate;
          end if;
          if use_pder and use_pder2 then
            pder2 = der(rate);
          end if;
        end GeneralTorqueToAngleAdaptor;
        model GeneralAngleToTorqueAdaptor "end that takes a motion and tells what flows"
          parameter Boolean use_pder = true;
          parameter Boolean use_pder2 = true;
          Interfaces.Flange_b flange;
          Modelica.Blocks.Interfaces.RealInput p;
          Modelica.Blocks.Interfaces.RealInput pder if use_pder "the rate, which follows from the motion";
          Modelica.Blocks.Interfaces.RealInput pder2 if use_pder and use_pder2;
          Modelica.Blocks.Interfaces.RealOutput f;
        equation
          flange.phi = p;
          f = -flange.tau;
        end GeneralAngleToTorqueAdaptor;
      end Components;
    end Rotational;
    package Translational
      package Interfaces
        partial model PartialTwoFlanges
          Flange_a flange_a "left end";
          Flange_b flange_b "right end";
        end PartialTwoFlanges;
        partial model PartialRigid
          extends PartialTwoFlanges;
          Units.SI.Position s "position of the middle";
          parameter Units.SI.Length L = 0 "distance of the ends";
        equation
          flange_a.s = s - L/2;
          flange_b.s = s + L/2;
        end PartialRigid;
        partial model PartialCompliant
          extends PartialTwoFlanges;
          Units.SI.Distance s_rel(min = -1e60, start = 0) "relative position";
          Units.SI.Force f "force between the ends";
        equation
          s_rel = flange_b.s - flange_a.s;
          flange_b.f = f;
          flange_a.f = -f;
        end PartialCompliant;
        partial model PartialCompliantWithRelativeStates
          extends PartialTwoFlanges;
          Units.SI.Position s_rel(start = 0, stateSelect = StateSelect.prefer) "relative position";
          Units.SI.Velocity v_rel(start = 0, stateSelect = StateSelect.prefer) "relative velocity";
          Units.SI.Force f "force between the ends";
        equation
          s_rel = flange_b.s - flange_a.s;
          v_rel = der(s_rel);
          flange_b.f = f;
          flange_a.f = -f;
        end PartialCompliantWithRelativeStates;
        partial model PartialElementaryOneFlangeAndSupport2
          parameter Boolean useSupport = false;
          Units.SI.Length s "position against the housing";
          Flange_b flange "slide end";
          Support support if useSupport "housing";
        protected
          Units.SI.Position s_support "position of the housing";
        equation
          if useSupport then
            s_support = support.s;
            support.f = -flange.f;
          else
            s_support = 0;
          end if;
          s = flange.s - s_support;
        end PartialElementaryOneFlangeAndSupport2;
        partial model PartialForce
          extends PartialElementaryOneFlangeAndSupport2;
          Units.SI.Force f "force on the slide";
        equation
          f = flange.f;
        end PartialForce;
        partial model PartialAbsoluteSensor
          Flange_a flange "slide end";
        equation
          flange.f = 0;
        end PartialAbsoluteSensor;
        partial model PartialRelativeSensor
          extends PartialTwoFlanges;
        equation
          flange_a.f + flange_b.f = 0;
        end PartialRelativeSensor;
      end Interfaces;
      package Components
        model GeneralForceToPositionAdaptor "end that takes what flows in and tells its motion"
          parameter Boolean use_pder = true;
          parameter Boolean use_pder2 = true;
          Interfaces.Flange_a flange;
          Modelica.Blocks.Interfaces.RealInput f;
          Modelica.Blocks.Interfaces.RealOutput p;
          Modelica.Blocks.Interfaces.RealOutput pder if use_pder;
          Modelica.Blocks.Interfaces.RealOutput pder2 if use_pder and use_pder2;
        protected
          Real rate = der(flange.s);
        equation
          flange.f = f;
          p = flange.s;
          if use_pder then
            pder = rate;
          end if;
          if use_pder and use_pder2 then
            pder2 = der(rate);
          end if;
        end GeneralForceToPositionAdaptor;
        model GeneralPositionToForceAdaptor "end that takes a motion and tells what flows"
          parameter Boolean use_pder = true;
          parameter Boolean use_pder2 = true;
          Interfaces.Flange_b flange;
          Modelica.Blocks.Interfaces.RealInput p;
          Modelica.Blocks.Interfaces.RealInput pder if use_pder "the rate, which follows from the motion";
          Modelica.Blocks.Interfaces.RealInput pder2 if use_pder and use_pder2;
          Modelica.Blocks.Interfaces.RealOutput f;
        equation
          flange.s = p;
          f = -flange.f;
        end GeneralPositionToForceAdaptor;
      end Components;
    end Translational;
  end Mechanics;
  package Thermal
    package HeatTransfer
      package Interfaces
        partial model PartialElementaryConditionalHeatPortWithoutT
          parameter Boolean useHeatPort = false;
          HeatPort_a heatPort if useHeatPort "where the loss goes";
        protected
          Units.SI.Power lossPower "loss";
        equation
          if useHeatPort then
            heatPort.Q_flow = -lossPower;
          end if;
        end PartialElementaryConditionalHeatPortWithoutT;
      end Interfaces;
      package Components
        model Convection
          Interfaces.HeatPort_a solid;
          Interfaces.HeatPort_b fluid;
          Blocks.Interfaces.RealInput Gc(unit = "W/K") "conductance";
          Units.SI.HeatFlowRate Q_flow "heat flow from the solid";
          Units.SI.TemperatureDifference dT "solid against fluid";
        equation
          dT = solid.T - fluid.T;
          solid.Q_flow = Q_flow;
          fluid.Q_flow = -Q_flow;
          Q_flow = Gc*dT;
        end Convection;
      end Components;
    end HeatTransfer;
  end Thermal;
end Modelica;
