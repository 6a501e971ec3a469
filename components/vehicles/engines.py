"""Combustion engines by their maps."""

from __future__ import annotations

from components import icons
from components.commands import Commanded
from components.interfaces import Flange
from components.machines.rotors import Rotor
from components.tabulated import Flat, Tabulated
from modelica_like.language import (
    Equations,
    Events,
    Expr,
    Input,
    Mode,
    Parameter,
    Variable,
    absolute,
    column,
    cos,
    der,
    maximum,
    minimum,
    param,
    rows,
    signal_in,
    var,
)


class MappedEngine(Tabulated, Rotor, partial=True):
    """Engine whose torque is a map over speed and throttle, with firing orders and drag.

    The torque of combustion is that of the map times 1 + Σ a·cos(order·phi + phase), the sum over the firing orders;
    the drag acts against it. A subclass says what the throttle is, and when there is combustion.
    """

    icon = icons.ENGINE
    flange = Flange("crankshaft", free=True)
    speeds: Flat = rows(column("speed of a row", scale="w_scale", rising=True), flat=True)
    pedals: Flat = rows(column("pedal of a column", rising=True), flat=True)
    torque: tuple[Flat, ...] = rows(column("torque of the combustion", scale="tau_scale", min=0), more=True)
    drag: tuple[tuple[float, float], ...] = rows(
        column("speed", scale="w_scale", rising=True), column("drag", scale="tau_scale", min=0), default=((0.0, 0.0),)
    )
    orders: tuple[tuple[float, float, float], ...] = rows(
        column("order"), column("amplitude over mean torque", min=0), column("phase in rad"), default=((1.0, 0.0, 0.0),)
    )
    w_scale: Parameter = param("rad/s", "speed that counts as 1 in the tables", default=1.0)
    tau_scale: Parameter = param("N.m", "torque that counts as 1 in the tables", default=1.0)
    J: Parameter = param("kg.m2", "moment of inertia of crankshaft and flywheel", min=0)
    w_0: Parameter = param("rad/s", "speed from which on the drag is the full one", default=1.0, min=1e-12)
    throttle: Variable = var("1", "pedal that counts, 0 to 1")
    tau_combustion: Variable = var("N.m", "torque of the combustion")
    tau_drag: Variable = var("N.m", "drag against forward rotation")
    pedal_range = Mode("kept", "left", description="whether the pedal was always within the columns of the map")

    def full_torque(self) -> Expr:
        """Return the torque of combustion while there is fuel."""
        speed = self.w / self.w_scale
        mean = self.tau_scale * self.look_up_map(speed, self.speeds, self.throttle, self.pedals, self.torque)
        return mean * sum((a * cos(order * self.phi + phase) for order, a, phase in self.orders), 1.0)

    def equations(self) -> Equations:
        yield from super().equations()
        full = minimum(maximum(self.w / self.w_0, -1), 1)
        yield self.tau_drag == full * self.tau_scale * self.look_up(absolute(self.w) / self.w_scale, self.drag)
        yield from self.turning(self.J, self.tau_combustion - self.tau_drag)

    def events(self) -> Events:
        yield from super().events()
        speed = self.w / self.w_scale
        yield from self.leaving("drag", absolute(speed), self.drag)
        yield from self.leaving("speeds", speed, [(s,) for s in self.speeds])
        yield from self.leaving("pedals", self.throttle, [(p,) for p in self.pedals], watch=self.pedal_range)

    def stored_energy(self) -> Expr:
        return 0.5 * self.J * self.w_rotor**2

    def loss_power(self) -> Expr:
        return self.tau_drag * self.w

    def source_power(self) -> Expr:
        return self.tau_combustion * self.w


class CombustionEngine(Commanded, MappedEngine):
    """Engine by its map, with firing orders, drag, idle controller and rev limit.

    A PI controller presses the pedal to keep the speed above w_idle. Above w_max the fuel is cut until the speed has
    fallen by w_band. Below w_stall the engine stalls, without a value where it turns backwards, until it is turned
    faster than w_start.
    """

    pedal: Input = signal_in("1", "pedal, 0 to 1", default=0.0)
    w_idle: Parameter = param("rad/s", "idle speed; without a value there is no idle controller", default=None, min=0)
    k_idle: Parameter = param("s/rad", "gain of the idle controller, pedal over speed", default=0.01, min=1e-12)
    T_idle: Parameter = param("s", "reset time of the idle controller", default=0.5, min=1e-12)
    w_max: Parameter = param("rad/s", "speed at which the fuel is cut", default=1e6, min=0)
    w_band: Parameter = param("rad/s", "by which the speed falls until it is given again", default=5.0, min=0)
    w_stall: Parameter = param("rad/s", "speed below which the engine goes out", default=0.0, min=0)
    w_fire: Parameter = param("rad/s", "slowest speed at which a starter lets it fire", default=10.0, min=1e-12)
    w_start: Parameter = param("rad/s", "speed from which it runs again", default="max(1.2 * w_stall, w_fire)", min=0)
    idle: Variable = var("1", "integral of the idle controller", default=0.0)
    fuel = Mode(
        "given", "cut", "out", description="whether there is combustion",
        hysteresis="w_start well above w_stall, and w_band well above zero",
    )  # fmt: skip

    def equations(self) -> Equations:
        yield from super().equations()
        driver = minimum(maximum(self.pedal, 0), 1)
        if self.given("w_idle"):
            missing = self.k_idle * (self.w_idle - self.w)
            pressed = minimum(maximum(missing + self.idle, 0), 1)
            yield self.T_idle * der(self.idle) == pressed - self.idle
            yield self.throttle == maximum(driver, pressed)
        else:
            yield self.idle == 0
            yield self.throttle == driver
        yield self.tau_combustion == self.fuel.choose(given=self.full_torque(), cut=0, out=0)

    def events(self) -> Events:
        fuel, w = self.fuel, self.w
        yield fuel.go("given", "cut", when=w > self.w_max, because="the rev limit is reached")
        yield fuel.go("cut", "given", when=w < self.w_max - self.w_band, because="the speed is below the rev limit")
        yield fuel.go(("given", "cut"), "out", when=w < self.w_stall, notice="stalls")
        yield fuel.go("out", "given", when=w > self.w_start, because="the engine is turned fast enough")
        yield from super().events()
        yield from self.above_one("pedal")
