"""Machine elements for drive-trains, written in the language of `modelica_like`."""

from components.fixed import Fixed as Fixed
from components.fixed import TranslationalFixed as TranslationalFixed
from components.friction import BearingFriction as BearingFriction
from components.friction import Brake as Brake
from components.friction import Clutch as Clutch
from components.friction import DryFriction as DryFriction
from components.friction import MultiPlateClutch as MultiPlateClutch
from components.gears import IdealGear as IdealGear
from components.inertias import Inertia as Inertia
from components.inertias import Mass as Mass
from components.interfaces import Compliant as Compliant
from components.interfaces import CompliantWithRelativeStates as CompliantWithRelativeStates
from components.interfaces import Flange as Flange
from components.interfaces import LinearFlange as LinearFlange
from components.loads import SpeedDependentLoad as SpeedDependentLoad
from components.planetary import IdealPlanetary as IdealPlanetary
from components.sensors import AngleSensor as AngleSensor
from components.sensors import ForceSensor as ForceSensor
from components.sensors import MultiSensor as MultiSensor
from components.sensors import PositionSensor as PositionSensor
from components.sensors import PowerSensor as PowerSensor
from components.sensors import RelativeAngleSensor as RelativeAngleSensor
from components.sensors import RelativeSpeedSensor as RelativeSpeedSensor
from components.sensors import SpeedSensor as SpeedSensor
from components.sensors import TorqueSensor as TorqueSensor
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

__all__ = [
    "AngleSensor",
    "BallScrew",
    "BearingFriction",
    "Brake",
    "Clutch",
    "CoilForce",
    "Compliant",
    "CompliantWithRelativeStates",
    "Constant",
    "ConstantForce",
    "ConstantSpeed",
    "ConstantTorque",
    "Damper",
    "DryFriction",
    "ElastoBacklash",
    "ElastoBacklash2",
    "Fixed",
    "Flange",
    "Force",
    "ForceSensor",
    "IdealGear",
    "IdealPlanetary",
    "Inertia",
    "LinearFlange",
    "MachineTable",
    "Mass",
    "MultiPlateClutch",
    "MultiSensor",
    "PositionSensor",
    "PowerSensor",
    "Product",
    "Pulse",
    "Ramp",
    "RelativeAngleSensor",
    "RelativeSpeedSensor",
    "Sine",
    "Speed",
    "SpeedDependentLoad",
    "SpeedSensor",
    "Spring",
    "SpringDamper",
    "Step",
    "Table",
    "TimeFormula",
    "Torque",
    "TorqueSensor",
    "TorqueStep",
    "TranslationalDamper",
    "TranslationalFixed",
    "TranslationalSpeed",
    "TranslationalSpring",
    "TranslationalSpringDamper",
    "Trapezoid",
]
