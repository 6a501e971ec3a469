"""DC machines, as motors and as generators."""

from __future__ import annotations

from components import icons
from components.electrical.analog import Pin
from components.feasible import Feasible
from components.machines.rotors import Rotor
from components.thermal import Conducting
from modelica_like.language import (
    Equations,
    Events,
    Expr,
    Parameter,
    Variable,
    absolute,
    der,
    maximum,
    minimum,
    param,
    sign,
    var,
    where,
)

_RPM = 0.10471975511965977
_LINEAR_BELOW = 1e-3


class DCMachine(Feasible, Conducting, Rotor, partial=True):
    """Linear DC machine: induced voltage k·flux·w, torque k·flux·i, with the flux relative to its nominal value.

    Armature: v = R·ia + v_brush + v_core, v_core = La·der(i) + k·flux·w, where ia - i flows through the conductance of
    the core losses. A machine driven above its no-load speed is a generator, with the same equations. The
    constant k is given, or follows from the nominal operating point. All losses leave through one heat port. Modelica
    Standard Library, Electrical.Machines.BasicMachines.DCMachines.

    A subclass defines the flux.
    """

    icon = icons.MOTOR
    misfit = "has no induced voltage at its nominal point: I_nominal drops V_nominal at its resistances"
    renamed = {"alpha": "alpha20 = alpha/(1 - alpha*(T_ref - 293.15 K)): alpha was the coefficient at T_ref"}
    ap = Pin("positive armature terminal")
    an = Pin("negative armature terminal")
    inlet = "ap"
    V_nominal: Parameter = param("V", "nominal voltage", default=100.0)
    I_nominal: Parameter = param("A", "nominal armature current", default=100.0)
    w_nominal: Parameter = param("rad/s", "nominal speed", default=1425 * _RPM, min=1e-12)
    T_nominal: Parameter = param("K", "armature temperature at the nominal operating point", default=293.15)
    k: Parameter = param(
        "V.s/rad", "induced voltage over speed at nominal flux; replaces the nominal operating point", default=None
    )
    Ra: Parameter = param("Ohm", "armature resistance at T_ref", default=0.05, min=0)
    La: Parameter = param("H", "armature inductance", default=0.0015, min=0)
    Jr: Parameter = param("kg.m2", "moment of inertia of the rotor", default=0.15, min=0)
    V_brush: Parameter = param("V", "voltage drop of all brushes", default=0.0, min=0)
    I_brush: Parameter = param("A", "current at which it is reached", default=1.0, min=1e-12)
    P_friction: Parameter = param("W", "friction loss at w_nominal", default=0.0, min=0)
    p_friction: Parameter = param("1", "exponent of the speed in the friction torque", default=2.0, min=0)
    P_core: Parameter = param(
        "W", "core loss at nominal induced voltage; without a value there is none", default=None, min=1e-12
    )
    P_stray: Parameter = param("W", "stray load loss at nominal current and speed", default=0.0, min=0)
    p_stray: Parameter = param("1", "exponent of the speed in the stray load torque", default=1.0, min=0)
    quasi_static: bool = False
    """Leave out all inductances."""
    v: Variable = var("V", "armature voltage")
    ia: Variable = var("A", "armature current")
    i: Variable = var("A", "armature current without that of the core losses")
    v_core: Variable = var("V", "voltage at air gap and armature inductance")
    v_induced: Variable = var("V", "induced voltage")
    tau_electrical: Variable = var("N.m", "torque of the air gap on the rotor")

    # -- differences of the types --------------------------------------------------------------------------------

    def flux(self) -> Expr | float:
        """Return the flux over its nominal value."""
        return 1.0

    def excitation(self) -> Equations:
        """Yield the equations of the excitation winding."""
        return iter(())

    def series_voltage(self) -> Expr | float:
        """Return the voltage at a winding in series with the armature."""
        return 0.0

    def series_resistance(self) -> Expr | float:
        """Return its resistance at T_ref."""
        return 0.0

    def excitation_loss(self) -> Expr | float:
        """Return the loss of the excitation winding."""
        return 0.0

    def excitation_energy(self) -> Expr | float:
        """Return the energy of the excitation field."""
        return 0.0

    # -- common to all types
    # -----------------------------------------------------------------------------------------------

    def resistance(self, cold: Expr | float) -> Expr:
        """Return the resistance of a warm winding."""
        return cold * self.warmth(self.temperature)

    def brush_voltage(self, current: Expr) -> Expr:
        """Return the voltage drop of the brushes."""
        return self.V_brush * maximum(minimum(current / self.I_brush, 1), -1)

    @property
    def nominal_induced_voltage(self) -> Expr:
        """Induced voltage at the nominal operating point."""
        if self.given("k"):
            return self.k * self.w_nominal
        warm = (self.Ra + self.series_resistance()) * self.warmth(self.T_nominal)
        return self.V_nominal - warm * self.I_nominal - self.brush_voltage(self.I_nominal)

    @property
    def constant(self) -> Expr:
        """Induced voltage over speed at nominal flux."""
        return self.k if self.given("k") else self.nominal_induced_voltage / self.w_nominal

    def fits(self) -> Expr:
        return self.nominal_induced_voltage > 0

    def events(self) -> Events:
        if not self.given("k"):
            yield from super().events()

    def _power_law(self, exponent: Expr) -> Expr:
        x = absolute(self.w) / self.w_nominal
        linear = _LINEAR_BELOW ** (exponent - 1) * x
        return sign(self.w) * where(x > _LINEAR_BELOW, x**exponent, linear)

    def friction_torque(self) -> Expr:
        """Return the torque of bearings and ventilation against forward rotation."""
        return self.P_friction / self.w_nominal * self._power_law(self.p_friction)

    def stray_torque(self) -> Expr:
        """Return the torque of the stray load losses."""
        load = (self.ia / self.I_nominal) ** 2
        return self.P_stray / self.w_nominal * load * self._power_law(self.p_stray)

    def equations(self) -> Equations:
        yield from super().equations()
        ap, an, constant = self.ap, self.an, self.constant
        yield self.v == ap.v - an.v
        yield from self.excitation()
        yield an.i == -ap.i
        yield (
            self.v
            == self.resistance(self.Ra) * self.ia + self.brush_voltage(self.ia) + self.v_core + self.series_voltage()
        )
        conductance = self.P_core / self.nominal_induced_voltage**2 if self.given("P_core") else 0.0
        yield self.ia == self.i + conductance * self.v_core
        if self.quasi_static:
            yield self.v_core == self.v_induced
        else:
            yield self.La * der(self.i) == self.v_core - self.v_induced
        yield self.v_induced == constant * self.flux() * self.w
        yield self.tau_electrical == constant * self.flux() * self.i
        yield from self.turning(self.Jr, self.tau_electrical - self.friction_torque() - self.stray_torque())

    def stored_energy(self) -> Expr:
        field = 0.0 if self.quasi_static else 0.5 * self.La * self.i**2 + self.excitation_energy()
        return 0.5 * self.Jr * self.w_rotor**2 + field

    def dissipation(self) -> Expr:
        armature = (self.resistance(self.Ra) * self.ia + self.brush_voltage(self.ia)) * self.ia
        core = (self.ia - self.i) * self.v_core
        mechanical = (self.friction_torque() + self.stray_torque()) * self.w
        return armature + core + mechanical + self.excitation_loss()


class PermanentMagnetDCMachine(DCMachine):
    """DC machine with permanent magnets: constant flux, speed falls linearly with the torque."""

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.ap.i == self.ia


class ExcitedDCMachine(DCMachine, partial=True):
    """DC machine with an excitation winding across a voltage; its flux is proportional to the excitation current."""

    Ie_nominal: Parameter = param("A", "nominal excitation current", default=1.0)
    Re: Parameter = param("Ohm", "excitation resistance at T_ref", default=100.0, min=0)
    Le: Parameter = param("H", "excitation inductance", default=1.0, min=0)
    ve: Variable = var("V", "excitation voltage")
    ie: Variable = var("A", "excitation current")
    psi_e: Variable = var("Wb", "excitation flux linkage")

    def flux(self) -> Expr:
        return self.ie / self.Ie_nominal

    def excitation(self) -> Equations:
        yield self.psi_e == self.Le * self.ie
        if self.quasi_static:
            yield self.ve == self.resistance(self.Re) * self.ie
        else:
            yield der(self.psi_e) == self.ve - self.resistance(self.Re) * self.ie

    def excitation_loss(self) -> Expr:
        return self.resistance(self.Re) * self.ie**2

    def excitation_energy(self) -> Expr:
        return 0.5 * self.Le * self.ie**2


class SeparatelyExcitedDCMachine(ExcitedDCMachine):
    """DC machine whose excitation winding has its own supply; less excitation makes it faster."""

    ep = Pin("positive excitation terminal")
    en = Pin("negative excitation terminal")

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.ap.i == self.ia
        yield self.ve == self.ep.v - self.en.v
        yield self.ep.i == self.ie
        yield self.en.i == -self.ie


class ShuntDCMachine(ExcitedDCMachine):
    """DC machine whose excitation winding is across the armature terminals."""

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.ap.i == self.ia + self.ie
        yield self.ve == self.v


class SeriesDCMachine(DCMachine):
    """DC machine whose excitation winding carries the armature current: the torque grows with its square.

    Without load its flux becomes zero and it runs away.
    """

    w_nominal: Parameter = param("rad/s", "nominal speed", default=1410 * _RPM, min=1e-12)
    Re: Parameter = param("Ohm", "resistance of the excitation winding at T_ref", default=0.01, min=0)
    Le: Parameter = param("H", "inductance of the excitation winding", default=0.0005, min=0)
    psi_e: Variable = var("Wb", "excitation flux linkage")

    def flux(self) -> Expr:
        return self.ia / self.I_nominal

    def series_resistance(self) -> Expr:
        return self.Re

    def series_voltage(self) -> Expr:
        induced = 0.0 if self.quasi_static else der(self.psi_e)
        return self.resistance(self.Re) * self.ia + induced

    def excitation(self) -> Equations:
        yield self.psi_e == self.Le * self.ia

    def excitation_loss(self) -> Expr:
        return self.resistance(self.Re) * self.ia**2

    def excitation_energy(self) -> Expr:
        return 0.5 * self.Le * self.ia**2

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.ap.i == self.ia
