"""Gears with friction in teeth and bearings."""

from __future__ import annotations

from components import icons
from components.clutches.friction import HOLDS, ShaftSticking
from components.interfaces import TwoFlanges
from components.tabulated import Tabulated
from modelica_like.language import (
    Equations,
    Events,
    Expr,
    Mode,
    Output,
    Parameter,
    Variable,
    absolute,
    all_of,
    column,
    der,
    maximum,
    minimum,
    param,
    rows,
    signal_out,
    var,
    where,
)

_IDEAL = (1.0, 1.0, 0.0, 0.0)
LossRows = tuple[tuple[float, float, float, float, float], ...]


class MeshWithFriction(ShaftSticking, TwoFlanges, partial=True):
    """Gear with friction in teeth and bearings, which stick if the torques are too small to turn them.

    The mesh transmits the torque x = -flange_b.tau/ratio, referred to flange_a. The lost torque is a line in x while
    flange_a drives, and another line while flange_b drives; in forward rotation the larger value applies, in backward
    rotation the smaller one. At standstill it keeps the gear at rest, between these limits (C. Pelchen,
    C. Schweiger, M. Otter: Modeling and simulating the efficiency of gearboxes, 2nd Modelica Conference 2002; the
    driving side after C. Bertsch, 2009). The efficiency against the drive matters more with a larger inertia on the
    load side: if it is negative, the motion is unique only if the inertia of the drive is large enough.

    A subclass defines the efficiencies and the friction of the bearings at a speed.
    """

    icon = icons.GEAR
    ratio: Parameter = param("1", "transmission ratio, speed of flange_a over speed of flange_b")
    faint: Parameter = param("N.m", "torque at flange_a beyond what holds that counts as rounding", default=1e-9, min=0)
    mode = Mode(
        "free", "stuck", "start_forward", "start_backward", "forward", "backward",
        description="friction mode", holds=HOLDS,
    )  # fmt: skip
    phi_a: Variable = var("rad", "angle of flange_a relative to the housing")
    w_a: Variable = var("rad/s", "speed of flange_a relative to the housing", state="always")
    tau_loss: Variable = var("N.m", "lost torque at flange_a, against forward rotation")

    @property
    def slip(self) -> Expr:
        return self.w_a

    @property
    def friction(self) -> Expr:
        return self.tau_loss

    def efficiencies(self, speed: Expr | float) -> tuple[Expr | float, Expr | float]:
        """Return the mesh efficiency while flange_a drives, and while flange_b drives."""
        raise NotImplementedError

    def bearing_losses(self, speed: Expr | float) -> tuple[Expr | float, Expr | float]:
        """Return the torque lost in bearings at flange_a, while flange_a and while flange_b drives."""
        raise NotImplementedError

    def forward_loss(self, speed: Expr | float) -> Expr:
        """Return the lost torque in forward rotation."""
        return maximum(*self._lines(speed, 1.0))

    def backward_loss(self, speed: Expr | float) -> Expr:
        """Return the lost torque in backward rotation; it is negative."""
        return minimum(*self._lines(speed, -1.0))

    def _lines(self, speed: Expr | float, direction: float) -> tuple[Expr, Expr]:
        eta_a, eta_b = self.efficiencies(speed)
        bearing_a, bearing_b = self.bearing_losses(speed)
        passed = -self.flange_b.tau / self.ratio
        return (1 / eta_a - 1) * passed + direction * bearing_a, (eta_b - 1) * passed + direction * bearing_b

    def holds_forward(self) -> Expr:
        return self.forward_loss(0) + self.faint

    def holds_backward(self) -> Expr:
        return self.backward_loss(0) - self.faint

    def equations(self) -> Equations:
        yield from super().equations()
        a, b, loss = self.flange_a, self.flange_b, self.tau_loss
        yield self.phi_a == a.phi - self.phi_support
        yield self.phi_a == self.ratio * (b.phi - self.phi_support)
        yield der(self.phi_a) == self.w_a
        yield b.tau + self.ratio * (a.tau - loss) == 0
        yield self.mode.choose(
            free=loss,
            stuck=self.sticking(),
            start_forward=loss - self.forward_loss(0),
            start_backward=loss - self.backward_loss(0),
            forward=loss - self.forward_loss(maximum(self.w_a, 0)),
            backward=loss - self.backward_loss(maximum(-self.w_a, 0)),
        ) == 0  # fmt: skip

    def rubs(self) -> bool:
        """Return whether there can be friction; without any, the gear is always free and has no events."""
        return True

    def events(self) -> Events:
        if self.rubs():
            yield self.mode.initially("forward", when=self.w_a > 0)
            yield self.mode.initially("backward", when=self.w_a < 0)
            yield self.mode.initially("stuck", when=all_of(self.w_a <= 0, self.w_a >= 0))
            yield from super().events()


class LossyGear(Tabulated, MeshWithFriction):
    """Gear with the loss table of the Modelica Standard Library, Rotational.LossyGear.

    -flange_b.tau = ratio·(eta_mf·flange_a.tau - tau_bf), where eta_mf is eta_mf1 while flange_a drives and 1/eta_mf2
    while flange_b drives, tau_bf likewise. Two numbers are enough in a `ConstantEfficiencyGear`.
    """

    loss_table: LossRows = rows(
        column("speed |w_a|", scale="w_scale", rising=True),
        column("eta_mf1", min=1e-3, max=1), column("eta_mf2", max=1),
        column("|tau_bf1|", scale="tau_scale"), column("|tau_bf2|", scale="tau_scale"),
    )  # fmt: skip
    w_scale: Parameter = param("rad/s", "speed that counts as 1 in loss_table", default=1.0)
    tau_scale: Parameter = param("N.m", "torque that counts as 1 in loss_table", default=1.0)

    def _column(self, speed: Expr | float, column: int) -> Expr:
        return self.look_up(speed / self.w_scale, self.loss_table, column)

    def rubs(self) -> bool:
        cells = [pair for row in self.loss_table for pair in zip(row[1:], _IDEAL, strict=True)]
        return any(not isinstance(cell, float | int) or cell != ideal for cell, ideal in cells)

    def efficiencies(self, speed: Expr | float) -> tuple[Expr | float, Expr | float]:
        return self._column(speed, 1), self._column(speed, 2)

    def bearing_losses(self, speed: Expr | float) -> tuple[Expr | float, Expr | float]:
        # The table's torques are those behind the mesh, seen from the driving side.
        eta_a, eta_b = self.efficiencies(speed)
        tau_a, tau_b = (self.tau_scale * absolute(self._column(speed, k)) for k in (3, 4))
        return tau_a / eta_a, tau_b * eta_b

    def events(self) -> Events:
        yield from super().events()
        if self.rubs():
            yield from self.leaving("loss_table", absolute(self.w_a) / self.w_scale, self.loss_table)


class ConstantEfficiencyGear(MeshWithFriction):
    """Gear with one efficiency in each direction of power.

    Without a value, the efficiency against the drive is 2 - 1/efficiency: the same friction in the teeth (G. Niemann,
    H. Winter: Maschinenelemente III, worm gears). If it is not above zero, the gear is self-locking: no torque at
    flange_b can turn it, only a drive at flange_a.
    """

    icon = icons.WORM
    efficiency: Parameter = param("1", "power out at flange_b over power in at flange_a", min=1e-3, max=1)
    efficiency_back: Parameter = param(
        "1", "power out at flange_a over power in at flange_b; not above 0: none", default=None, max=1
    )
    tau_friction: Parameter = param("N.m", "friction torque of the bearings at flange_a", default=0.0, min=0)
    self_locking: Output = signal_out("1", "1 for a self-locking gear, otherwise 0")

    @property
    def backward(self) -> Expr:
        """Efficiency while flange_b drives."""
        return self.efficiency_back if self.given("efficiency_back") else 2 - 1 / self.efficiency

    def efficiencies(self, speed: Expr | float) -> tuple[Expr | float, Expr | float]:
        return self.efficiency, self.backward

    def bearing_losses(self, speed: Expr | float) -> tuple[Expr | float, Expr | float]:
        return self.tau_friction, self.tau_friction

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.self_locking == where(self.backward > 0, 0, 1)
