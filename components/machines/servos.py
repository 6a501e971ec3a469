"""Servo motors with their drives: current, speed and position controlled in a cascade."""

from __future__ import annotations

from components import icons
from components.blocks.control import PI, Gain, P
from components.electrical.analog import CurrentSensor, Ground, SignalVoltage
from components.interfaces import Flange
from components.machines.dc_machines import PermanentMagnetDCMachine
from components.mechanics.sensors import AngleSensor, SpeedSensor
from modelica_like.language import (
    Component,
    Equations,
    Input,
    Parameter,
    connect,
    param,
    signal_in,
)


class Servo(Component, partial=True):
    """Motor with cascaded control of current and speed.

    The current controller compensates the time constant of the winding and the induced voltage, so that the current
    follows with the time constant T_current until the voltage V_max is reached. The speed controller is set by the
    symmetrical optimum for the inertia J_total; it demands at most the current I_max. For a three-phase motor
    use values with the same torque over current and voltage over speed (the machine is a
    PermanentMagnetDCMachine); its drive has no loss.
    """

    icon = icons.SERVO
    flange = Flange("shaft end")
    outlet = "flange"
    k: Parameter = param("N.m/A", "torque over current", min=1e-12)
    R: Parameter = param("Ohm", "resistance of the winding", min=1e-12)
    L: Parameter = param("H", "inductance of the winding", min=1e-12)
    J: Parameter = param("kg.m2", "moment of inertia of the rotor", min=0)
    J_total: Parameter = param("kg.m2", "moment of inertia for which the speed controller is set", default="J", min=0)
    I_max: Parameter = param("A", "largest current", min=0)
    V_max: Parameter = param("V", "largest voltage", min=0)
    T_current: Parameter = param("s", "time constant of the current", default=1e-3, min=1e-12)
    a: Parameter = param("1", "time constant of the speed over that of the current", default=4.0, min=1)
    speed = PI(k="J_total / k / (a * T_current)", Ti="a**2 * T_current", y_max="I_max", integral=0.0)
    current = PI(k="L / T_current", Ti="L / R", y_max="V_max", integral=0.0)
    induced = Gain(k="k")
    inverter = SignalVoltage()
    earth = Ground()
    ammeter = CurrentSensor()
    motor = PermanentMagnetDCMachine(k="k", Ra="R", La="L", Jr="J", ia=0.0)
    tacho = SpeedSensor()

    def equations(self) -> Equations:
        yield connect(self.tacho.w, self.speed.u_m, self.induced.u)
        yield connect(self.speed.y, self.current.u_s)
        yield connect(self.ammeter.i, self.current.u_m)
        yield connect(self.induced.y, self.current.u_ff)
        yield connect(self.current.y, self.inverter.v_ref)
        yield connect(self.inverter.p, self.ammeter.p)
        yield connect(self.ammeter.n, self.motor.ap)
        yield connect(self.inverter.n, self.earth.p, self.motor.an)
        yield connect(self.motor.flange, self.tacho.flange, self.flange)


class ServoMotor(Servo):
    """Motor with a drive that controls its speed."""

    w_ref: Input = signal_in("rad/s", "set value of the speed")

    def equations(self) -> Equations:
        yield from super().equations()
        yield connect(self.w_ref, self.speed.u_s)


class PositionServo(Servo):
    """Motor with a drive that controls its angle: a proportional controller gives the speed, up to w_max."""

    renamed = {"servo": "its values and parts without 'servo.': J instead of servo.J"}
    phi_ref: Input = signal_in("rad", "set value of the angle")
    w_ff: Input = signal_in("rad/s", "speed of the set value, as feed-forward", default=0.0)
    Kv: Parameter = param("1/s", "gain, speed over error of the angle", min=0)
    w_max: Parameter = param("rad/s", "largest speed", min=0)
    position = P(k="Kv", y_max="w_max")
    encoder = AngleSensor()

    def equations(self) -> Equations:
        yield from super().equations()
        yield connect(self.phi_ref, self.position.u_s)
        yield connect(self.w_ff, self.position.u_ff)
        yield connect(self.encoder.phi, self.position.u_m)
        yield connect(self.position.y, self.speed.u_s)
        yield connect(self.encoder.flange, self.flange)
