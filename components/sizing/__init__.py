"""Static design checks of machine elements: plain functions of floats, NumPy arrays or CasADi expressions, in SI units.

Sizing files (`modelica-like size`) can use every function that returns a `Result`.
"""

from components.sizing.belts import BeltForces as BeltForces
from components.sizing.belts import BeltGeometry as BeltGeometry
from components.sizing.belts import TimingBeltLoad as TimingBeltLoad
from components.sizing.belts import belt_forces as belt_forces
from components.sizing.belts import belt_geometry as belt_geometry
from components.sizing.belts import belt_velocity as belt_velocity
from components.sizing.belts import centre_distance as centre_distance
from components.sizing.belts import effective_pull as effective_pull
from components.sizing.belts import exact_centre_distance as exact_centre_distance
from components.sizing.belts import pitch_diameter as pitch_diameter
from components.sizing.belts import strand_resultant as strand_resultant
from components.sizing.belts import timing_belt_load as timing_belt_load
from components.sizing.belts import wrap_angle as wrap_angle
from components.sizing.clutch_heat import ClutchHeat as ClutchHeat
from components.sizing.clutch_heat import clutch_heat as clutch_heat
from components.sizing.clutches import ClutchSelection as ClutchSelection
from components.sizing.clutches import MachineTableClutch as MachineTableClutch
from components.sizing.clutches import clutch_selection as clutch_selection
from components.sizing.clutches import friction_work as friction_work
from components.sizing.clutches import machine_table_clutch as machine_table_clutch
from components.sizing.clutches import referred_inertia as referred_inertia
from components.sizing.clutches import referred_mass as referred_mass
from components.sizing.clutches import slip_angle as slip_angle
from components.sizing.dc_motor_fit import LineConsistency as LineConsistency
from components.sizing.dc_motor_fit import MotorFit as MotorFit
from components.sizing.dc_motor_fit import fit_current_line as fit_current_line
from components.sizing.dc_motor_fit import fit_least_squares as fit_least_squares
from components.sizing.dc_motor_fit import fit_speed_line as fit_speed_line
from components.sizing.dc_motor_fit import line_consistency as line_consistency
from components.sizing.dc_motors import DcMotor as DcMotor
from components.sizing.dc_motors import DriveForClutch as DriveForClutch
from components.sizing.dc_motors import GeneratorPoint as GeneratorPoint
from components.sizing.dc_motors import MotorLines as MotorLines
from components.sizing.dc_motors import MotorPoint as MotorPoint
from components.sizing.dc_motors import MotorSummary as MotorSummary
from components.sizing.dc_motors import dc_motor_point as dc_motor_point
from components.sizing.dc_motors import drive_for_clutch as drive_for_clutch
from components.sizing.dc_motors import generator_point as generator_point
from components.sizing.dc_motors import generator_voltage as generator_voltage
from components.sizing.dc_motors import measured_lines as measured_lines
from components.sizing.dc_motors import motor_lines as motor_lines
from components.sizing.dc_motors import motor_on_lines as motor_on_lines
from components.sizing.dc_motors import motor_point as motor_point
from components.sizing.dc_motors import motor_summary as motor_summary
from components.sizing.dc_motors import overload_current as overload_current
from components.sizing.dc_motors import rope_brake_mass as rope_brake_mass
from components.sizing.dc_motors import series_motor_speed as series_motor_speed
from components.sizing.dc_motors import shunt_motor as shunt_motor
from components.sizing.dc_motors import torque_at_speed as torque_at_speed
from components.sizing.dc_windings import CommutationRipple as CommutationRipple
from components.sizing.dc_windings import MachineConstant as MachineConstant
from components.sizing.dc_windings import commutated as commutated
from components.sizing.dc_windings import commutation_ripple as commutation_ripple
from components.sizing.dc_windings import conductor_force as conductor_force
from components.sizing.dc_windings import conductor_voltage as conductor_voltage
from components.sizing.dc_windings import machine_constant as machine_constant
from components.sizing.deflection import Deflection as Deflection
from components.sizing.deflection import deflection as deflection
from components.sizing.deflection import midspan_sag as midspan_sag
from components.sizing.deflection import round_second_moment as round_second_moment
from components.sizing.deflection import square_second_moment as square_second_moment
from components.sizing.flywheels import Flywheel as Flywheel
from components.sizing.flywheels import cylinder_inertia as cylinder_inertia
from components.sizing.flywheels import cylinder_mass as cylinder_mass
from components.sizing.flywheels import flywheel as flywheel
from components.sizing.flywheels import flywheel_for_time as flywheel_for_time
from components.sizing.flywheels import switching_time as switching_time
from components.sizing.gear_geometry import GearPair as GearPair
from components.sizing.gear_geometry import tooth_form as tooth_form
from components.sizing.gear_life import HARDENED_FLANK as HARDENED_FLANK
from components.sizing.gear_life import HARDENED_ROOT as HARDENED_ROOT
from components.sizing.gear_life import GearLife as GearLife
from components.sizing.gear_life import LifeCurve as LifeCurve
from components.sizing.gear_life import LoadStage as LoadStage
from components.sizing.gear_life import StageDamage as StageDamage
from components.sizing.gear_life import gear_life as gear_life
from components.sizing.gear_life import life_factor as life_factor
from components.sizing.gear_strength import GearMaterial as GearMaterial
from components.sizing.gear_strength import GearStrength as GearStrength
from components.sizing.gear_strength import gear_strength as gear_strength
from components.sizing.gear_teeth import GearTeeth as GearTeeth
from components.sizing.gear_teeth import gear_teeth as gear_teeth
from components.sizing.lepelletier import Lepelletier as Lepelletier
from components.sizing.lepelletier import LepelletierGear as LepelletierGear
from components.sizing.lepelletier import lepelletier as lepelletier
from components.sizing.lepelletier import lepelletier_gear as lepelletier_gear
from components.sizing.ravigneaux import RavigneauxAssembly as RavigneauxAssembly
from components.sizing.ravigneaux import RavigneauxGear as RavigneauxGear
from components.sizing.ravigneaux import RavigneauxTeeth as RavigneauxTeeth
from components.sizing.ravigneaux import ravigneaux_assembly as ravigneaux_assembly
from components.sizing.ravigneaux import ravigneaux_gear as ravigneaux_gear
from components.sizing.ravigneaux import ravigneaux_meshes as ravigneaux_meshes
from components.sizing.rolling_bearings import BearingLife as BearingLife
from components.sizing.rolling_bearings import bearing_life as bearing_life
from components.sizing.shaft_fatigue import ShaftFatigue as ShaftFatigue
from components.sizing.shaft_fatigue import ShaftMaterial as ShaftMaterial
from components.sizing.shaft_fatigue import shaft_fatigue as shaft_fatigue
from components.sizing.shaft_statics import BearingReaction as BearingReaction
from components.sizing.shaft_statics import Load as Load
from components.sizing.shaft_statics import SectionForces as SectionForces
from components.sizing.shaft_statics import ShaftStatics as ShaftStatics
from components.sizing.shaft_statics import bearing_reactions as bearing_reactions
from components.sizing.shaft_statics import section_forces as section_forces
from components.sizing.shaft_statics import shaft_statics as shaft_statics
from components.sizing.shaft_strength import SHOULDER_IN_BENDING as SHOULDER_IN_BENDING
from components.sizing.shaft_strength import SHOULDER_IN_TORSION as SHOULDER_IN_TORSION
from components.sizing.shaft_strength import NotchCoefficients as NotchCoefficients
from components.sizing.shaft_strength import Section as Section
from components.sizing.shaft_strength import ShaftDiameter as ShaftDiameter
from components.sizing.shaft_strength import ShaftStress as ShaftStress
from components.sizing.shaft_strength import SteppedShaft as SteppedShaft
from components.sizing.shaft_strength import bending_stress as bending_stress
from components.sizing.shaft_strength import shaft_diameter as shaft_diameter
from components.sizing.shaft_strength import shaft_stress as shaft_stress
from components.sizing.shaft_strength import stepped_shaft as stepped_shaft
from components.sizing.shaft_strength import stress_concentration as stress_concentration
from components.sizing.shaft_strength import torsional_stress as torsional_stress
from components.sizing.shaft_strength import von_mises as von_mises
from components.sizing.speed_limits import BeltSpeedLimit as BeltSpeedLimit
from components.sizing.speed_limits import SpeedLimit as SpeedLimit
from components.sizing.speed_limits import belt_speed_limit as belt_speed_limit
from components.sizing.speed_limits import speed_limit as speed_limit
from modelica_like.language.results import Result as Result
from modelica_like.language.results import comparison as comparison

__all__ = [
    "HARDENED_FLANK",
    "HARDENED_ROOT",
    "SHOULDER_IN_BENDING",
    "SHOULDER_IN_TORSION",
    "BearingLife",
    "BearingReaction",
    "BeltForces",
    "BeltGeometry",
    "BeltSpeedLimit",
    "ClutchHeat",
    "ClutchSelection",
    "CommutationRipple",
    "DcMotor",
    "Deflection",
    "DriveForClutch",
    "Flywheel",
    "GearLife",
    "GearMaterial",
    "GearPair",
    "GearStrength",
    "GearTeeth",
    "GeneratorPoint",
    "Lepelletier",
    "LepelletierGear",
    "LifeCurve",
    "LineConsistency",
    "Load",
    "LoadStage",
    "MachineConstant",
    "MachineTableClutch",
    "MotorFit",
    "MotorLines",
    "MotorPoint",
    "MotorSummary",
    "NotchCoefficients",
    "RavigneauxAssembly",
    "RavigneauxGear",
    "RavigneauxTeeth",
    "Result",
    "Section",
    "SectionForces",
    "ShaftDiameter",
    "ShaftFatigue",
    "ShaftMaterial",
    "ShaftStatics",
    "ShaftStress",
    "SpeedLimit",
    "StageDamage",
    "SteppedShaft",
    "TimingBeltLoad",
    "bearing_life",
    "bearing_reactions",
    "belt_forces",
    "belt_geometry",
    "belt_speed_limit",
    "belt_velocity",
    "bending_stress",
    "centre_distance",
    "clutch_heat",
    "clutch_selection",
    "commutated",
    "commutation_ripple",
    "comparison",
    "conductor_force",
    "conductor_voltage",
    "cylinder_inertia",
    "cylinder_mass",
    "dc_motor_point",
    "deflection",
    "drive_for_clutch",
    "effective_pull",
    "exact_centre_distance",
    "fit_current_line",
    "fit_least_squares",
    "fit_speed_line",
    "flywheel",
    "flywheel_for_time",
    "friction_work",
    "gear_life",
    "gear_strength",
    "gear_teeth",
    "generator_point",
    "generator_voltage",
    "lepelletier",
    "lepelletier_gear",
    "life_factor",
    "line_consistency",
    "machine_constant",
    "machine_table_clutch",
    "measured_lines",
    "midspan_sag",
    "motor_lines",
    "motor_on_lines",
    "motor_point",
    "motor_summary",
    "overload_current",
    "pitch_diameter",
    "ravigneaux_assembly",
    "ravigneaux_gear",
    "ravigneaux_meshes",
    "referred_inertia",
    "referred_mass",
    "rope_brake_mass",
    "round_second_moment",
    "section_forces",
    "series_motor_speed",
    "shaft_diameter",
    "shaft_fatigue",
    "shaft_statics",
    "shaft_stress",
    "shunt_motor",
    "slip_angle",
    "speed_limit",
    "square_second_moment",
    "stepped_shaft",
    "strand_resultant",
    "stress_concentration",
    "switching_time",
    "timing_belt_load",
    "tooth_form",
    "torque_at_speed",
    "torsional_stress",
    "von_mises",
    "wrap_angle",
]
