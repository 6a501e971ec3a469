"""Adaptors between shafts and signals: where a drive is cut into parts that exchange signals, e.g. FMUs.

Which side gives the angle and which the torque decides about the states of the parts. In signals, a torque is the one
that the other part exerts on this one.
"""

from __future__ import annotations

from components.interfaces import Flange
from modelica_like.language import Component, Equations, Expr, Input, Output, Variable, der, signal_in, signal_out, var


class TorqueToAngleAdaptor(Component):
    """Shaft end of a part that takes a torque and tells how it moves: it keeps its inertia and its states."""

    flange = Flange("shaft end")
    use_w: bool = True
    """Tell the speed as well."""
    use_a: bool = True
    """Tell the acceleration as well."""
    tau: Input = signal_in("N.m", "torque on the shaft")
    phi: Output = signal_out("rad", "angle of the shaft")
    w: Output = signal_out("rad/s", "speed of the shaft; 0 unless use_w")
    a: Output = signal_out("rad/s2", "acceleration of the shaft; 0 unless use_a")
    speed: Variable = var("rad/s", "speed")

    def equations(self) -> Equations:
        yield self.phi == self.flange.phi
        yield self.speed == der(self.flange.phi)
        yield self.w == (self.speed if self.use_w else 0)
        if self.use_a:
            yield self.a == der(self.speed)
        else:
            yield self.a == 0
        yield self.flange.tau == -self.tau

    def source_power(self) -> Expr:
        return self.tau * der(self.flange.phi)


class AngleToTorqueAdaptor(Component):
    """Shaft end of a part that is moved, and answers with a torque: it has no states of its own.

    A spring needs the angle only, a damper the speed too, an inertia the acceleration as well. They have to be
    derivatives of each other, which is up to the one who gives them.
    """

    flange = Flange("shaft end")
    phi: Input = signal_in("rad", "angle of the shaft")
    w: Input = signal_in("rad/s", "speed of the shaft", default=0.0)
    a: Input = signal_in("rad/s2", "acceleration of the shaft", default=0.0)
    tau: Output = signal_out("N.m", "torque on the other part")

    def equations(self) -> Equations:
        yield self.flange.phi == self.phi
        yield self.tau == self.flange.tau

    def source_power(self) -> Expr:
        return -self.flange.tau * der(self.flange.phi)
