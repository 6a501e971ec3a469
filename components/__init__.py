"""Machine elements for drive-trains, written in the language of `modelica_like`."""

from components.adaptors import AngleToTorqueAdaptor as AngleToTorqueAdaptor
from components.adaptors import CurrentToVoltageAdaptor as CurrentToVoltageAdaptor
from components.adaptors import ForceToPositionAdaptor as ForceToPositionAdaptor
from components.adaptors import HeatFlowToTemperatureAdaptor as HeatFlowToTemperatureAdaptor
from components.adaptors import PositionToForceAdaptor as PositionToForceAdaptor
from components.adaptors import TemperatureToHeatFlowAdaptor as TemperatureToHeatFlowAdaptor
from components.adaptors import TorqueToAngleAdaptor as TorqueToAngleAdaptor
from components.adaptors import VoltageToCurrentAdaptor as VoltageToCurrentAdaptor
from components.belts import TimingBelt as TimingBelt
from components.bristle_friction import LuGreFriction as LuGreFriction
from components.choppers import HBridge as HBridge
from components.control import PI as PI
from components.control import PID as PID
from components.control import ClutchActuator as ClutchActuator
from components.control import Feedback as Feedback
from components.control import FirstOrder as FirstOrder
from components.control import Gain as Gain
from components.control import Integrator as Integrator
from components.control import Limiter as Limiter
from components.control import P as P
from components.control import Sum as Sum
from components.dc_machines import PermanentMagnetDCMachine as PermanentMagnetDCMachine
from components.dc_machines import SeparatelyExcitedDCMachine as SeparatelyExcitedDCMachine
from components.dc_machines import SeriesDCMachine as SeriesDCMachine
from components.dc_machines import ShuntDCMachine as ShuntDCMachine
from components.eddy_current_brakes import EddyCurrentForce as EddyCurrentForce
from components.eddy_current_brakes import EddyCurrentTorque as EddyCurrentTorque
from components.electrical import Capacitor as Capacitor
from components.electrical import ConstantCurrent as ConstantCurrent
from components.electrical import ConstantVoltage as ConstantVoltage
from components.electrical import CurrentSensor as CurrentSensor
from components.electrical import CurrentSink as CurrentSink
from components.electrical import Ground as Ground
from components.electrical import Inductor as Inductor
from components.electrical import Pin as Pin
from components.electrical import Resistor as Resistor
from components.electrical import SignalVoltage as SignalVoltage
from components.electrical import Switch as Switch
from components.electrical import VariableResistor as VariableResistor
from components.electrical import VoltageSensor as VoltageSensor
from components.fixed import Disc as Disc
from components.fixed import Fixed as Fixed
from components.fixed import TranslationalFixed as TranslationalFixed
from components.flexible_shafts import FlexibleShaft as FlexibleShaft
from components.flexible_shafts import StribeckBearing as StribeckBearing
from components.friction import BearingFriction as BearingFriction
from components.friction import Brake as Brake
from components.friction import Clutch as Clutch
from components.friction import DryFriction as DryFriction
from components.friction import MultiPlateClutch as MultiPlateClutch
from components.gearboxes import Gearbox as Gearbox
from components.gears import IdealGear as IdealGear
from components.inertias import Inertia as Inertia
from components.inertias import Mass as Mass
from components.interfaces import Compliant as Compliant
from components.interfaces import CompliantWithRelativeStates as CompliantWithRelativeStates
from components.interfaces import Flange as Flange
from components.interfaces import LinearFlange as LinearFlange
from components.loads import SpeedDependentLoad as SpeedDependentLoad
from components.lossy_gears import ConstantEfficiencyGear as ConstantEfficiencyGear
from components.lossy_gears import LossyGear as LossyGear
from components.motions import InitializeFlange as InitializeFlange
from components.motions import Move as Move
from components.motions import RelativeStates as RelativeStates
from components.motions import TranslationalInitializeFlange as TranslationalInitializeFlange
from components.motions import TranslationalMove as TranslationalMove
from components.motions import TranslationalRelativeStates as TranslationalRelativeStates
from components.one_way import Freewheel as Freewheel
from components.one_way import OneWayClutch as OneWayClutch
from components.one_way import TorqueLimiter as TorqueLimiter
from components.planetary import Differential as Differential
from components.planetary import IdealPlanetary as IdealPlanetary
from components.planetary import LossyPlanetarySet as LossyPlanetarySet
from components.planetary import PlanetarySet as PlanetarySet
from components.point_to_point import KinematicPTP2 as KinematicPTP2
from components.screw_drives import BallScrewDrive as BallScrewDrive
from components.sensors import AngleSensor as AngleSensor
from components.sensors import ForceSensor as ForceSensor
from components.sensors import MultiSensor as MultiSensor
from components.sensors import PositionSensor as PositionSensor
from components.sensors import PowerSensor as PowerSensor
from components.sensors import RelativeAngleSensor as RelativeAngleSensor
from components.sensors import RelativeSpeedSensor as RelativeSpeedSensor
from components.sensors import SpeedLimit as SpeedLimit
from components.sensors import SpeedSensor as SpeedSensor
from components.sensors import TorqueSensor as TorqueSensor
from components.shaft_sensors import AccelerationSensor as AccelerationSensor
from components.shaft_sensors import RelativeAccelerationSensor as RelativeAccelerationSensor
from components.shaft_sources import Accelerate as Accelerate
from components.shaft_sources import InverseSpeedDependentTorque as InverseSpeedDependentTorque
from components.shaft_sources import LinearSpeedDependentTorque as LinearSpeedDependentTorque
from components.shaft_sources import Position as Position
from components.shaft_sources import QuadraticSpeedDependentTorque as QuadraticSpeedDependentTorque
from components.shaft_sources import SignTorque as SignTorque
from components.shaft_sources import Torque2 as Torque2
from components.shift_schedule import ShiftSchedule as ShiftSchedule
from components.signals import CoilForce as CoilForce
from components.signals import Constant as Constant
from components.signals import Product as Product
from components.signals import Pulse as Pulse
from components.signals import Ramp as Ramp
from components.signals import Sine as Sine
from components.signals import Step as Step
from components.signals import Table as Table
from components.signals import TimeFormula as TimeFormula
from components.signals import Trapezoid as Trapezoid
from components.slides import ElastoGap as ElastoGap
from components.slides import MassWithStopAndFriction as MassWithStopAndFriction
from components.slides import Rod as Rod
from components.slides import StribeckFriction as StribeckFriction
from components.slides import SupportFriction as SupportFriction
from components.slides import TranslationalBrake as TranslationalBrake
from components.sources import ConstantForce as ConstantForce
from components.sources import ConstantSpeed as ConstantSpeed
from components.sources import ConstantTorque as ConstantTorque
from components.sources import Force as Force
from components.sources import Speed as Speed
from components.sources import Torque as Torque
from components.sources import TorqueStep as TorqueStep
from components.sources import TranslationalSpeed as TranslationalSpeed
from components.spindles import BallScrew as BallScrew
from components.spindles import MachineTable as MachineTable
from components.springs import Damper as Damper
from components.springs import ElastoBacklash as ElastoBacklash
from components.springs import ElastoBacklash2 as ElastoBacklash2
from components.springs import Spring as Spring
from components.springs import SpringDamper as SpringDamper
from components.springs import TranslationalDamper as TranslationalDamper
from components.springs import TranslationalSpring as TranslationalSpring
from components.springs import TranslationalSpringDamper as TranslationalSpringDamper
from components.stepped_signals import BooleanPulse as BooleanPulse
from components.stepped_signals import BooleanStep as BooleanStep
from components.stepped_signals import BooleanTable as BooleanTable
from components.stepped_signals import StepTable as StepTable
from components.thermal import FixedTemperature as FixedTemperature
from components.thermal import HeatPort as HeatPort
from components.thermal import HeatSource as HeatSource
from components.thermal import TemperatureSensor as TemperatureSensor
from components.thermal import ThermalConductor as ThermalConductor
from components.thermal import ThermalMass as ThermalMass
from components.torque_converters import TorqueConverter as TorqueConverter
from components.translational_sensors import LinearAccelerationSensor as LinearAccelerationSensor
from components.translational_sensors import LinearMultiSensor as LinearMultiSensor
from components.translational_sensors import LinearPowerSensor as LinearPowerSensor
from components.translational_sensors import RelativeLinearAccelerationSensor as RelativeLinearAccelerationSensor
from components.translational_sensors import RelativePositionSensor as RelativePositionSensor
from components.translational_sensors import RelativeVelocitySensor as RelativeVelocitySensor
from components.translational_sensors import VelocitySensor as VelocitySensor
from components.translational_sources import ConstantVelocity as ConstantVelocity
from components.translational_sources import Force2 as Force2
from components.translational_sources import ForceStep as ForceStep
from components.translational_sources import InverseSpeedDependentForce as InverseSpeedDependentForce
from components.translational_sources import LinearSpeedDependentForce as LinearSpeedDependentForce
from components.translational_sources import QuadraticSpeedDependentForce as QuadraticSpeedDependentForce
from components.translational_sources import SignForce as SignForce
from components.translational_sources import TranslationalAccelerate as TranslationalAccelerate
from components.translational_sources import TranslationalPosition as TranslationalPosition
from components.transmissions import Lepelletier as Lepelletier
from components.transmissions import Ravigneaux as Ravigneaux
from components.universal_joints import UniversalJoint as UniversalJoint
from components.vehicles import RollingResistance as RollingResistance
from components.vehicles import Vehicle as Vehicle
from components.waves import CombiTable as CombiTable
from components.waves import Cosine as Cosine
from components.waves import Exponentials as Exponentials
from components.waves import ExpSine as ExpSine
from components.waves import LogFrequencySweep as LogFrequencySweep
from components.waves import SawTooth as SawTooth
from components.waves import Sinc as Sinc
from components.waves import VariableSine as VariableSine
from components.wheels import IdealGearR2T as IdealGearR2T
from components.wheels import IdealRollingWheel as IdealRollingWheel

__all__ = [
    "PI",
    "PID",
    "Accelerate",
    "AccelerationSensor",
    "AngleSensor",
    "AngleToTorqueAdaptor",
    "BallScrew",
    "BallScrewDrive",
    "BearingFriction",
    "BooleanPulse",
    "BooleanStep",
    "BooleanTable",
    "Brake",
    "Capacitor",
    "Clutch",
    "ClutchActuator",
    "CoilForce",
    "CombiTable",
    "Compliant",
    "CompliantWithRelativeStates",
    "Constant",
    "ConstantCurrent",
    "ConstantEfficiencyGear",
    "ConstantForce",
    "ConstantSpeed",
    "ConstantTorque",
    "ConstantVelocity",
    "ConstantVoltage",
    "Cosine",
    "CurrentSensor",
    "CurrentSink",
    "CurrentToVoltageAdaptor",
    "Damper",
    "Differential",
    "Disc",
    "DryFriction",
    "EddyCurrentForce",
    "EddyCurrentTorque",
    "ElastoBacklash",
    "ElastoBacklash2",
    "ElastoGap",
    "ExpSine",
    "Exponentials",
    "Feedback",
    "FirstOrder",
    "Fixed",
    "FixedTemperature",
    "Flange",
    "FlexibleShaft",
    "Force",
    "Force2",
    "ForceSensor",
    "ForceStep",
    "ForceToPositionAdaptor",
    "Freewheel",
    "Gain",
    "Gearbox",
    "Ground",
    "HBridge",
    "HeatFlowToTemperatureAdaptor",
    "HeatPort",
    "HeatSource",
    "IdealGear",
    "IdealGearR2T",
    "IdealPlanetary",
    "IdealRollingWheel",
    "Inductor",
    "Inertia",
    "InitializeFlange",
    "Integrator",
    "InverseSpeedDependentForce",
    "InverseSpeedDependentTorque",
    "KinematicPTP2",
    "Lepelletier",
    "Limiter",
    "LinearAccelerationSensor",
    "LinearFlange",
    "LinearMultiSensor",
    "LinearPowerSensor",
    "LinearSpeedDependentForce",
    "LinearSpeedDependentTorque",
    "LogFrequencySweep",
    "LossyGear",
    "LossyPlanetarySet",
    "LuGreFriction",
    "MachineTable",
    "Mass",
    "MassWithStopAndFriction",
    "Move",
    "MultiPlateClutch",
    "MultiSensor",
    "OneWayClutch",
    "P",
    "PermanentMagnetDCMachine",
    "Pin",
    "PlanetarySet",
    "Position",
    "PositionSensor",
    "PositionToForceAdaptor",
    "PowerSensor",
    "Product",
    "Pulse",
    "QuadraticSpeedDependentForce",
    "QuadraticSpeedDependentTorque",
    "Ramp",
    "Ravigneaux",
    "RelativeAccelerationSensor",
    "RelativeAngleSensor",
    "RelativeLinearAccelerationSensor",
    "RelativePositionSensor",
    "RelativeSpeedSensor",
    "RelativeStates",
    "RelativeVelocitySensor",
    "Resistor",
    "Rod",
    "RollingResistance",
    "SawTooth",
    "SeparatelyExcitedDCMachine",
    "SeriesDCMachine",
    "ShiftSchedule",
    "ShuntDCMachine",
    "SignForce",
    "SignTorque",
    "SignalVoltage",
    "Sinc",
    "Sine",
    "Speed",
    "SpeedDependentLoad",
    "SpeedLimit",
    "SpeedSensor",
    "Spring",
    "SpringDamper",
    "Step",
    "StepTable",
    "StribeckBearing",
    "StribeckFriction",
    "Sum",
    "SupportFriction",
    "Switch",
    "Table",
    "TemperatureSensor",
    "TemperatureToHeatFlowAdaptor",
    "ThermalConductor",
    "ThermalMass",
    "TimeFormula",
    "TimingBelt",
    "Torque",
    "Torque2",
    "TorqueConverter",
    "TorqueLimiter",
    "TorqueSensor",
    "TorqueStep",
    "TorqueToAngleAdaptor",
    "TranslationalAccelerate",
    "TranslationalBrake",
    "TranslationalDamper",
    "TranslationalFixed",
    "TranslationalInitializeFlange",
    "TranslationalMove",
    "TranslationalPosition",
    "TranslationalRelativeStates",
    "TranslationalSpeed",
    "TranslationalSpring",
    "TranslationalSpringDamper",
    "Trapezoid",
    "UniversalJoint",
    "VariableResistor",
    "VariableSine",
    "Vehicle",
    "VelocitySensor",
    "VoltageSensor",
    "VoltageToCurrentAdaptor",
]
