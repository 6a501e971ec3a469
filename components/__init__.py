"""Machine elements for drive-trains, written in the language of `modelica_like`."""

from importlib import import_module
from typing import Any

# Modules and their public names, each loaded on first use: a netlist needs few of them. For type checkers and
# editors, `__init__.pyi` has the same.
_NAMES = {
    "absorbers": "CentrifugalPendulum TunedAbsorber",
    "actuators": "ElectromagneticActuator HydraulicActuator PneumaticActuator",
    "adaptors": (
        "AngleToTorqueAdaptor CurrentToVoltageAdaptor ForceToPositionAdaptor HeatFlowToTemperatureAdaptor "
        "PositionToForceAdaptor TemperatureToHeatFlowAdaptor TorqueToAngleAdaptor VoltageToCurrentAdaptor"
    ),
    "asynchronous_machines": "AsynchronousMachine AsynchronousMachineDQ",
    "batteries": "Battery",
    "belts": "TimingBelt",
    "bristle_friction": "LuGreFriction",
    "choppers": "HBridge",
    "commutated_machines": "CommutatedDCMachine",
    "contacts": "DogClutch RigidBacklash",
    "control": "PI PID ClutchActuator Feedback FirstOrder Gain Integrator Limiter P Sum",
    "converters": "RotationalEMF TranslationalEMF",
    "couplings": "ArcSpring DualMassFlywheel ElasticCoupling HystereticCoupling OldhamCoupling RuptureCoupling",
    "dc_machines": "PermanentMagnetDCMachine SeparatelyExcitedDCMachine SeriesDCMachine ShuntDCMachine",
    "drag_losses": "ChurningGear DeepGrooveBearing OpenPlates",
    "drivers": "Driver",
    "eddy_current_brakes": "EddyCurrentForce EddyCurrentTorque",
    "electrical": (
        "Capacitor ConstantCurrent ConstantVoltage CurrentSensor CurrentSink ElectricalPowerSensor Ground Inductor "
        "Pin Resistor SignalCurrent SignalVoltage Switch VariableResistor VoltageSensor"
    ),
    "engines": "CombustionEngine",
    "fixed": "Disc Fixed TranslationalFixed",
    "flexible_shafts": "FlexibleShaft StribeckBearing",
    "friction": "BearingFriction Brake Clutch DryFriction MultiPlateClutch",
    "gear_meshes": "GearMesh",
    "gearboxes": "Gearbox",
    "gears": "IdealGear",
    "hoists": "HoldingBrake Rope WinchDrum",
    "inertias": "Inertia Mass",
    "interfaces": "Compliant CompliantWithRelativeStates Flange LinearFlange",
    "linear_blocks": "Derivative SecondOrder StateSpace TransferFunction",
    "linkages": "Cam FourBar SliderCrank",
    "loads": "SpeedDependentLoad",
    "lossy_gears": "ConstantEfficiencyGear LossyGear",
    "machine_loads": "CentrifugalPump Conveyor CuttingLoad DisplacementLoad FormingForce",
    "motions": (
        "InitializeFlange Move RelativeStates TranslationalInitializeFlange TranslationalMove "
        "TranslationalRelativeStates"
    ),
    "nonlinear_blocks": "DeadZone Hysteresis PulseCounter Quantizer SlewRateLimiter VariableLimiter",
    "one_way": "Freewheel OneWayClutch TorqueLimiter",
    "planetary": "Differential IdealPlanetary LossyPlanetarySet PlanetarySet",
    "point_to_point": "KinematicPTP2",
    "sampled": "FrequencyMeter NormalNoise UniformNoise ZeroOrderHold",
    "screw_drives": "BallScrewDrive",
    "sensors": (
        "AngleSensor ForceSensor MultiSensor PositionSensor PowerSensor RelativeAngleSensor RelativeSpeedSensor "
        "SpeedLimit SpeedSensor TorqueSensor"
    ),
    "servos": "PositionServo ServoMotor",
    "shaft_sensors": "AccelerationSensor PulseSensor RelativeAccelerationSensor",
    "shaft_sources": (
        "Accelerate InverseSpeedDependentTorque LinearSpeedDependentTorque Position QuadraticSpeedDependentTorque "
        "SignTorque Torque2"
    ),
    "shift_schedule": "ShiftSchedule",
    "signal_tables": "Table1D Table2D",
    "signals": "CoilForce Constant Product Pulse Ramp Sine Step Table TimeFormula Trapezoid",
    "slides": "ElastoGap MassWithStopAndFriction Rod StribeckFriction SupportFriction TranslationalBrake",
    "sources": "ConstantForce ConstantSpeed ConstantTorque Force Speed Torque TorqueStep",
    "speed_clutches": "CentrifugalClutch ViscousClutch",
    "spindles": "BallScrew MachineTable",
    "springs": (
        "Damper ElastoBacklash ElastoBacklash2 Spring SpringDamper TranslationalDamper TranslationalSpring "
        "TranslationalSpringDamper"
    ),
    "stepped_signals": "BooleanPulse BooleanStep BooleanTable StepTable",
    "switching": "Contactor Diode IdealDiode IdealSwitch IdealThyristor",
    "synchronisers": "Synchroniser",
    "synchronous_machines": "MappedDrive PMSynchronousDrive PMSynchronousMachine",
    "thermal": (
        "FixedTemperature HeatPort HeatSource PrescribedHeatFlow PrescribedTemperature TemperatureSensor "
        "ThermalConductor ThermalMass"
    ),
    "thermal_clutches": "ThermalBrake ThermalClutch",
    "torque_converters": "TorqueConverter",
    "translational_sensors": (
        "LinearAccelerationSensor LinearMultiSensor LinearPowerSensor RelativeLinearAccelerationSensor "
        "RelativePositionSensor RelativeVelocitySensor VelocitySensor"
    ),
    "translational_sources": (
        "ConstantVelocity Force2 ForceStep InverseSpeedDependentForce LinearSpeedDependentForce "
        "QuadraticSpeedDependentForce SignForce TranslationalAccelerate TranslationalPosition TranslationalSpeed"
    ),
    "transmissions": "Lepelletier Ravigneaux",
    "tyres": "AxleLoads Tyre",
    "universal_joints": "UniversalJoint",
    "variable_drives": "ChainDrive VariableGear",
    "vehicles": "RoadLoad RollingResistance Vehicle",
    "waves": "CombiTable Cosine Exponentials ExpSine LogFrequencySweep SawTooth Sinc VariableSine",
    "wheels": "IdealGearR2T IdealRollingWheel",
    "worms": "WormGear",
}
_HOME = {name: module for module, names in _NAMES.items() for name in names.split()}

__all__ = sorted(_HOME)  # pyright: ignore[reportUnsupportedDunderAll] -- the stub says what there is


def __getattr__(name: str) -> Any:
    if name in _HOME:
        globals()[name] = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
        return globals()[name]
    if name in _NAMES:
        return import_module(f"{__name__}.{name}")
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME, *_NAMES})
