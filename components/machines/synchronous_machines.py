"""Synchronous machines with permanent magnets, in dq coordinates, and drives on a DC supply."""

from __future__ import annotations

from math import sqrt as root

from components import icons
from components.electrical.analog import Pin
from components.machines.rotors import Machine
from components.tabulated import Flat, Tabulated
from components.thermal import Lossy
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Expr,
    Input,
    Mode,
    Parameter,
    Variable,
    absolute,
    column,
    der,
    maximum,
    minimum,
    param,
    rows,
    signal_in,
    sqrt,
    var,
    where,
)

_NONE = 1e-6
"""Part that counts as none: roots have a slope there."""


class PMSynchronous(Lossy, Machine, partial=True):
    """Machine with permanent magnets, in coordinates that turn with the rotor; amplitudes are those of a phase.

    v_d = R·i_d + L_d·der(i_d) - p·w·L_q·i_q, v_q = R·i_q + L_q·der(i_q) + p·w·(L_d·i_d + psi), and the torque is
    3/2·p·(psi + (L_d - L_q)·i_d)·i_q.
    """

    psi: Parameter = param("Wb", "flux linkage of the magnets", min=1e-12)
    R: Parameter = param("Ohm", "resistance of a phase", min=0)
    L_d: Parameter = param("H", "inductance along the magnets", min=1e-12)
    i_d: Variable = var("A", "current along the magnets", default=0.0)
    i_q: Variable = var("A", "current across the magnets, which makes the torque", default=0.0)

    @property
    def inductance_across(self) -> Expr:
        """Inductance across the magnets."""
        return self.L_d

    def voltages(self) -> tuple[Expr, Expr]:
        """Return the voltages along and across the magnets."""
        w, L_q = self.p * self.w, self.inductance_across
        along = self.R * self.i_d + self.L_d * der(self.i_d) - w * L_q * self.i_q
        return along, self.R * self.i_q + L_q * der(self.i_q) + w * (self.L_d * self.i_d + self.psi)

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.tau == 1.5 * self.p * (self.psi + (self.L_d - self.inductance_across) * self.i_d) * self.i_q

    def stored_energy(self) -> Expr:
        return self.kinetic_energy() + 0.75 * (self.L_d * self.i_d**2 + self.inductance_across * self.i_q**2)

    def dissipation(self) -> Expr:
        return 1.5 * self.R * (self.i_d**2 + self.i_q**2)


class PMSynchronousMachine(PMSynchronous):
    """Synchronous machine with permanent magnets whose voltages are signals, for a control of your own."""

    icon = icons.SYNCHRONOUS
    v_d: Input = signal_in("V", "voltage along the magnets", default=0.0)
    v_q: Input = signal_in("V", "voltage across the magnets")
    L_q: Parameter = param("H", "inductance across the magnets", default="L_d", min=1e-12)

    @property
    def inductance_across(self) -> Expr:
        return self.L_q

    def equations(self) -> Equations:
        yield from super().equations()
        along, across = self.voltages()
        yield along == self.v_d
        yield across == self.v_q

    def source_power(self) -> Expr:
        return 1.5 * (self.v_d * self.i_d + self.v_q * self.i_q)


class OnSupply(Component, partial=True):
    """Drive on a DC supply, from which it takes its power, and to which it gives it back while it brakes.

    A battery cannot give more than E²/(4·R): where the drive asks for more, there is no solution, and the run ends.
    With V_min a little above half of its open-circuit voltage E, a sentence says so.
    """

    p_dc = Pin("positive terminal of the supply")
    n_dc = Pin("negative terminal of the supply")
    inlet = "p_dc"
    V_min: Parameter = param("V", "voltage without which it does not work: the run ends there", default=1.0, min=1e-12)
    v_dc: Variable = var("V", "voltage of the supply", guess=300.0, nominal=100.0)
    i_dc: Variable = var("A", "current from the supply")

    supply = Mode("there", "lost", description="whether there always was a voltage")

    def power(self) -> Expr:
        """Return the power that it takes."""
        raise NotImplementedError

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.v_dc == self.p_dc.v - self.n_dc.v
        yield self.p_dc.i == self.i_dc
        yield self.n_dc.i == -self.i_dc
        yield self.i_dc == self.power() / maximum(self.v_dc, self.V_min)

    def events(self) -> Events:
        yield from super().events()
        notice = "has less than {V_min} V at its supply"
        yield self.supply.go("there", "lost", when=self.v_dc < self.V_min, notice=notice, fails=True)


class PMSynchronousDrive(OnSupply, PMSynchronous):
    """Synchronous machine with its inverter: follows a torque within the limits of current and voltage.

    The currents follow their set values with the time constant T_current, decoupled. The amplitude of the voltage is
    no more than modulation·v_dc/sqrt(3), without the drop at the resistance; above the speed at which the magnets
    induce that, a negative i_d weakens their field. The largest torque is then where the circle of the current meets
    that of the voltage, or on the top of the latter. The magnets lie on the surface of the rotor: L_q = L_d. The
    inverter loses the part 1 - eta of the power.
    """

    icon = icons.DRIVE
    tau_ref: Input = signal_in("N.m", "set value of the torque")
    I_max: Parameter = param("A", "largest amplitude of the current", min=1e-12)
    modulation: Parameter = param("1", "part of the voltage that is used", default=0.95, min=1e-3, max=1)
    T_current: Parameter = param("s", "time constant of the currents", default=1e-3, min=1e-12)
    eta: Parameter = param("1", "efficiency of the inverter", default=1.0, min=1e-3, max=1)
    psi_max: Variable = var("Wb", "flux linkage at which the voltage is used up")
    iq_max: Variable = var("A", "largest current that makes torque")
    id_ref: Variable = var("A", "set value of i_d")
    iq_ref: Variable = var("A", "set value of i_q")

    def equations(self) -> Equations:
        yield from super().equations()
        L, psi, most = self.L_d, self.psi, self.I_max
        turning, voltage, any_current = absolute(self.p * self.w), self.modulation * self.v_dc / root(3), psi + L * most
        yield self.psi_max == where(turning * any_current > voltage, voltage / turning, any_current)
        meets = (self.psi_max**2 - psi**2 - (L * most) ** 2) / (2 * psi * L)
        weakest = minimum(maximum(meets, -minimum(psi / L, most)), 0)
        left = minimum(most**2 - weakest**2, (self.psi_max**2 - (psi + L * weakest) ** 2) / L**2)
        yield self.iq_max == sqrt(maximum(left, (_NONE * most) ** 2))
        wanted = self.tau_ref / (1.5 * self.p * psi)
        yield self.iq_ref == minimum(maximum(wanted, -self.iq_max), self.iq_max)
        allowed = (sqrt(maximum(self.psi_max**2 - (L * self.iq_ref) ** 2, (_NONE * psi) ** 2)) - psi) / L
        yield self.id_ref == minimum(maximum(allowed, -most), 0)
        yield self.T_current * der(self.i_d) == self.id_ref - self.i_d
        yield self.T_current * der(self.i_q) == self.iq_ref - self.i_q

    def electrical(self) -> Expr:
        """Return the power into the machine."""
        along, across = self.voltages()
        return 1.5 * (along * self.i_d + across * self.i_q)

    def power(self) -> Expr:
        taken = self.electrical()
        return where(taken > 0, taken / self.eta, taken * self.eta)

    def dissipation(self) -> Expr:
        return super().dissipation() + self.power() - self.electrical()


class MappedDrive(OnSupply, Tabulated, Lossy, Machine):
    """Electric drive by what its data sheet says: largest torque over speed, and efficiency over speed and torque.

    The torque follows its set value with the time constant T. Driving, it takes tau·w/eta from the supply, and braking
    it gives tau·w·eta back; both directions count as one.
    """

    icon = icons.DRIVE
    tau_ref: Input = signal_in("N.m", "set value of the torque")
    limit: tuple[tuple[float, float], ...] = rows(
        column("speed", scale="w_scale", rising=True), column("largest torque", scale="tau_scale", min=0)
    )
    speeds: Flat = rows(column("speed of a row", scale="w_scale", rising=True), flat=True, default=(0.0,))
    torques: Flat = rows(column("torque of a column", scale="tau_scale", rising=True), flat=True, default=(0.0,))
    eta: tuple[Flat, ...] = rows(column("efficiency", min=0.01, max=1), more=True, default=((1.0,),))
    w_scale: Parameter = param("rad/s", "speed that counts as 1 in the tables", default=1.0)
    tau_scale: Parameter = param("N.m", "torque that counts as 1 in the tables", default=1.0)
    T: Parameter = param("s", "time constant of the torque", default=0.01, min=1e-12)
    tau: Variable = var("N.m", "torque on the rotor", default=0.0)
    tau_max: Variable = var("N.m", "largest torque")
    efficiency: Variable = var("1", "efficiency", guess=1.0)
    speed_range = Mode("kept", "left", description="whether the speed was always within the rows of eta")
    torque_range = Mode("kept", "left", description="whether the torque was always within the columns of eta")

    def equations(self) -> Equations:
        yield from super().equations()
        speed, torque = absolute(self.w) / self.w_scale, absolute(self.tau) / self.tau_scale
        yield self.tau_max == self.tau_scale * self.look_up(speed, self.limit)
        yield self.T * der(self.tau) == minimum(maximum(self.tau_ref, -self.tau_max), self.tau_max) - self.tau
        yield self.efficiency == self.look_up_map(speed, self.speeds, torque, self.torques, self.eta)

    def events(self) -> Events:
        yield from super().events()
        speed, torque = absolute(self.w) / self.w_scale, absolute(self.tau) / self.tau_scale
        yield from self.leaving("limit", speed, self.limit)
        yield from self.leaving("speeds", speed, [(value,) for value in self.speeds], watch=self.speed_range)
        yield from self.leaving("torques", torque, [(value,) for value in self.torques], watch=self.torque_range)

    def power(self) -> Expr:
        mechanical = self.tau * self.w
        return where(mechanical > 0, mechanical / self.efficiency, mechanical * self.efficiency)

    def stored_energy(self) -> Expr:
        return self.kinetic_energy()

    def dissipation(self) -> Expr:
        return self.power() - self.tau * self.w
