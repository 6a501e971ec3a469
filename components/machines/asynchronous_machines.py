"""Asynchronous machines with a squirrel cage: by the formula of Kloss, and in dq coordinates."""

from __future__ import annotations

from math import pi

from components import icons
from components.machines.rotors import Machine
from components.thermal import Lossy
from modelica_like.language import (
    Equations,
    Expr,
    Input,
    Parameter,
    Variable,
    der,
    param,
    signal_in,
    var,
)


class AsynchronousMachine(Lossy, Machine):
    """Asynchronous machine whose torque follows its speed at once, by the formula of M. Kloss.

    tau = 2·tau_k·(v_rel)²/(s/s_k + s_k/s) with the slip s = (w_s - w)/w_s of the field, w_s = 2·pi·f/p. At another
    frequency than f_nominal the flux is kept (voltage and frequency in proportion), and the same difference of speeds
    gives the same torque. Losses of the stator are left out: what is lost is that difference times the torque.
    """

    icon = icons.ASYNCHRONOUS
    f: Input = signal_in("Hz", "frequency of the supply; negative: the other direction", default="50 Hz")
    v_rel: Input = signal_in("1", "flux over nominal flux, such as 1/sqrt(3) in a star", default=1.0)
    tau_k: Parameter = param("N.m", "breakdown torque", min=0)
    s_k: Parameter = param("1", "breakdown slip at f_nominal", min=1e-12)
    f_nominal: Parameter = param("Hz", "frequency to which s_k belongs", default="50 Hz", min=1e-12)
    w_s: Variable = var("rad/s", "speed of the field")
    s: Variable = var("1", "slip at f_nominal")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.w_s == 2 * pi * self.f / self.p
        yield self.s * 2 * pi * self.f_nominal / self.p == self.w_s - self.w
        # This form does not divide by the slip.
        yield self.tau == 2 * self.tau_k * self.v_rel**2 * self.s * self.s_k / (self.s**2 + self.s_k**2)

    def stored_energy(self) -> Expr:
        return self.kinetic_energy()

    def dissipation(self) -> Expr:
        return self.tau * (self.w_s - self.w)

    def source_power(self) -> Expr:
        return self.tau * self.w_s


class AsynchronousMachineDQ(Lossy, Machine):
    """Asynchronous machine on an ideal three-phase supply, in coordinates that turn with the voltage.

    Flux linkages of stator and rotor are states; the values of the rotor are those referred to the stator, and the
    amplitudes are those of a phase. P. Vas, Sensorless Vector and Direct Torque Control, Oxford 1998.
    """

    icon = icons.ASYNCHRONOUS
    v: Input = signal_in("V", "amplitude of the phase voltage")
    f: Input = signal_in("Hz", "frequency of the supply; negative: the other direction", default="50 Hz")
    Rs: Parameter = param("Ohm", "resistance of a phase of the stator", min=0)
    Rr: Parameter = param("Ohm", "resistance of a phase of the rotor", min=0)
    Lm: Parameter = param("H", "magnetising inductance", min=1e-12)
    L_s: Parameter = param("H", "leakage inductance of the stator", min=1e-12)
    L_r: Parameter = param("H", "leakage inductance of the rotor", min=0)
    psi_ds: Variable = var("Wb", "flux linkage of the stator along the voltage", default=0.0)
    psi_qs: Variable = var("Wb", "flux linkage of the stator across the voltage", default=0.0)
    psi_dr: Variable = var("Wb", "flux linkage of the rotor along the voltage", default=0.0)
    psi_qr: Variable = var("Wb", "flux linkage of the rotor across the voltage", default=0.0)
    i_ds: Variable = var("A", "current of the stator along the voltage")
    i_qs: Variable = var("A", "current of the stator across the voltage")
    i_dr: Variable = var("A", "current of the rotor along the voltage")
    i_qr: Variable = var("A", "current of the rotor across the voltage")

    def equations(self) -> Equations:
        yield from super().equations()
        Ls, Lr, turning = self.L_s + self.Lm, self.L_r + self.Lm, 2 * pi * self.f
        slipping = turning - self.p * self.w
        yield self.psi_ds == Ls * self.i_ds + self.Lm * self.i_dr
        yield self.psi_qs == Ls * self.i_qs + self.Lm * self.i_qr
        yield self.psi_dr == Lr * self.i_dr + self.Lm * self.i_ds
        yield self.psi_qr == Lr * self.i_qr + self.Lm * self.i_qs
        yield der(self.psi_ds) == self.v - self.Rs * self.i_ds + turning * self.psi_qs
        yield der(self.psi_qs) == -self.Rs * self.i_qs - turning * self.psi_ds
        yield der(self.psi_dr) == -self.Rr * self.i_dr + slipping * self.psi_qr
        yield der(self.psi_qr) == -self.Rr * self.i_qr - slipping * self.psi_dr
        yield self.tau == 1.5 * self.p * (self.psi_ds * self.i_qs - self.psi_qs * self.i_ds)

    def stored_energy(self) -> Expr:
        stator = self.psi_ds * self.i_ds + self.psi_qs * self.i_qs
        rotor = self.psi_dr * self.i_dr + self.psi_qr * self.i_qr
        return self.kinetic_energy() + 0.75 * (stator + rotor)

    def dissipation(self) -> Expr:
        stator, rotor = self.i_ds**2 + self.i_qs**2, self.i_dr**2 + self.i_qr**2
        return 1.5 * (self.Rs * stator + self.Rr * rotor)

    def source_power(self) -> Expr:
        return 1.5 * self.v * self.i_ds
