"""Machine elements for drive-trains, written in the language of `modelica_like`."""

from importlib import import_module
from typing import Any

from modelica_like.former import moved

# Modules by folder and their public names, each loaded on first use: a netlist needs few of them. For type checkers
# and editors, `__init__.pyi` has the same.
_NAMES = {
    "adaptors": (
        "AngleToTorqueAdaptor CurrentToVoltageAdaptor ForceToPositionAdaptor HeatFlowToTemperatureAdaptor "
        "PositionToForceAdaptor TemperatureToHeatFlowAdaptor TorqueToAngleAdaptor VoltageToCurrentAdaptor"
    ),
    "blocks.control": "PI PID ClutchActuator Feedback FirstOrder Gain Integrator Limiter P Sum",
    "blocks.linear_blocks": "Derivative SecondOrder StateSpace TransferFunction",
    "blocks.nonlinear_blocks": "DeadZone Hysteresis PulseCounter Quantizer SlewRateLimiter VariableLimiter",
    "blocks.point_to_point": "KinematicPTP2",
    "blocks.sampled": "FrequencyMeter NormalNoise UniformNoise ZeroOrderHold",
    "blocks.signal_tables": "Table1D Table2D",
    "blocks.signals": "CoilForce Constant Product Pulse Ramp Sine Step Table TimeFormula Trapezoid",
    "blocks.stepped_signals": "BooleanPulse BooleanStep BooleanTable StepTable",
    "blocks.waves": "CombiTable Cosine Exponentials ExpSine LogFrequencySweep SawTooth Sinc VariableSine",
    "clutches.actuators": "ElectromagneticActuator HydraulicActuator PneumaticActuator",
    "clutches.contacts": "DogClutch RigidBacklash",
    "clutches.friction": "BearingFriction Brake Clutch DryFriction MultiPlateClutch",
    "clutches.one_way": "Freewheel OneWayClutch TorqueLimiter",
    "clutches.speed_clutches": "CentrifugalClutch ViscousClutch",
    "clutches.synchronisers": "Synchroniser",
    "clutches.thermal_clutches": "ThermalBrake ThermalClutch",
    "clutches.torque_converters": "TorqueConverter",
    "electrical.analog": (
        "Capacitor ConstantCurrent ConstantVoltage CurrentSensor CurrentSink ElectricalPowerSensor Ground Inductor "
        "Pin Resistor SignalCurrent SignalVoltage Switch VariableResistor VoltageSensor"
    ),
    "electrical.batteries": "Battery",
    "electrical.choppers": "HBridge",
    "electrical.converters": "RotationalEMF TranslationalEMF",
    "electrical.switching": "Contactor Diode IdealDiode IdealSwitch IdealThyristor",
    "gears.belts": "TimingBelt",
    "gears.gear_meshes": "GearMesh",
    "gears.gearboxes": "Gearbox",
    "gears.ideal_gears": "IdealGear",
    "gears.lossy_gears": "ConstantEfficiencyGear LossyGear",
    "gears.planetary": "Differential IdealPlanetary LossyPlanetarySet PlanetarySet",
    "gears.shift_schedule": "ShiftSchedule",
    "gears.transmissions": "Lepelletier Ravigneaux",
    "gears.variable_drives": "ChainDrive VariableGear",
    "gears.worms": "WormGear",
    "interfaces": "Compliant CompliantWithRelativeStates Flange LinearFlange",
    "machines.asynchronous_machines": "AsynchronousMachine AsynchronousMachineDQ",
    "machines.commutated_machines": "CommutatedDCMachine",
    "machines.dc_machines": "PermanentMagnetDCMachine SeparatelyExcitedDCMachine SeriesDCMachine ShuntDCMachine",
    "machines.servos": "PositionServo ServoMotor",
    "machines.synchronous_machines": "MappedDrive PMSynchronousDrive PMSynchronousMachine",
    "mechanics.fixed": "Disc Fixed TranslationalFixed",
    "mechanics.inertias": "Inertia Mass",
    "mechanics.motions": (
        "InitializeFlange Move RelativeStates TranslationalInitializeFlange TranslationalMove "
        "TranslationalRelativeStates"
    ),
    "mechanics.sensors": (
        "AngleSensor ForceSensor MultiSensor PositionSensor PowerSensor RelativeAngleSensor RelativeSpeedSensor "
        "SpeedLimit SpeedSensor TorqueSensor"
    ),
    "mechanics.sources": "ConstantForce ConstantSpeed ConstantTorque Force Speed Torque TorqueStep",
    "mechanics.springs": (
        "Damper ElastoBacklash ElastoBacklash2 Spring SpringDamper TranslationalDamper TranslationalSpring "
        "TranslationalSpringDamper"
    ),
    "rotational.absorbers": "CentrifugalPendulum TunedAbsorber",
    "rotational.bristle_friction": "LuGreFriction",
    "rotational.couplings": (
        "ArcSpring DualMassFlywheel ElasticCoupling HystereticCoupling OldhamCoupling RuptureCoupling"
    ),
    "rotational.drag_losses": "ChurningGear DeepGrooveBearing OpenPlates",
    "rotational.eddy_current_brakes": "EddyCurrentForce EddyCurrentTorque",
    "rotational.flexible_shafts": "FlexibleShaft StribeckBearing",
    "rotational.loads": "SpeedDependentLoad",
    "rotational.machine_loads": "CentrifugalPump Conveyor CuttingLoad DisplacementLoad FormingForce",
    "rotational.shaft_sensors": "AccelerationSensor PulseSensor RelativeAccelerationSensor",
    "rotational.shaft_sources": (
        "Accelerate InverseSpeedDependentTorque LinearSpeedDependentTorque Position QuadraticSpeedDependentTorque "
        "SignTorque Torque2"
    ),
    "rotational.universal_joints": "UniversalJoint",
    "thermal": (
        "FixedTemperature HeatPort HeatSource PrescribedHeatFlow PrescribedTemperature TemperatureSensor "
        "ThermalConductor ThermalMass"
    ),
    "translational.hoists": "HoldingBrake Rope WinchDrum",
    "translational.linkages": "Cam FourBar SliderCrank",
    "translational.screw_drives": "BallScrewDrive",
    "translational.slides": "ElastoGap MassWithStopAndFriction Rod StribeckFriction SupportFriction TranslationalBrake",
    "translational.spindles": "BallScrew MachineTable",
    "translational.translational_sensors": (
        "LinearAccelerationSensor LinearMultiSensor LinearPowerSensor RelativeLinearAccelerationSensor "
        "RelativePositionSensor RelativeVelocitySensor VelocitySensor"
    ),
    "translational.translational_sources": (
        "ConstantVelocity Force2 ForceStep InverseSpeedDependentForce LinearSpeedDependentForce "
        "QuadraticSpeedDependentForce SignForce TranslationalAccelerate TranslationalPosition TranslationalSpeed"
    ),
    "translational.wheels": "IdealGearR2T IdealRollingWheel",
    "vehicles.drivers": "Driver",
    "vehicles.engines": "CombustionEngine",
    "vehicles.tyres": "AxleLoads Tyre",
    "vehicles.vehicle": "RoadLoad RollingResistance Vehicle",
}
_HOME = {name: module for module, names in _NAMES.items() for name in names.split()}
# Modules were in one row before there were folders; netlists and programs may have those names. Three of them are names
# of folders now, which have the classes, too.
_FORMER = {
    f"{__name__}.{module.partition('.')[2]}": f"{__name__}.{module}"
    for module in (*_NAMES, "gears.shift_report", "machines.rotors", "mechanics.speed_laws")
    if "." in module
}
_FOLDERS = {module.partition(".")[0] for module in _NAMES}

__all__ = sorted(_HOME)  # pyright: ignore[reportUnsupportedDunderAll] -- the stub says what there is

moved(_FORMER)


def __getattr__(name: str) -> Any:
    if name in _HOME:
        globals()[name] = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
        return globals()[name]
    if name in _FOLDERS or f"{__name__}.{name}" in _FORMER:
        return import_module(f"{__name__}.{name}")
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME, *_FOLDERS})
