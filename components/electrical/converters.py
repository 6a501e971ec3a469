"""Ideal converters between a circuit and a shaft or slide: what every electrical machine is at its core."""

from __future__ import annotations

from components import icons
from components.electrical.analog import TwoPins
from components.interfaces import LinearOneFlange, OneFlange
from modelica_like.language import Equations, Parameter, Variable, der, param, var


class RotationalEMF(TwoPins, OneFlange):
    """Ideal rotating converter: the voltage is k·w, and the current drives the shaft with the torque k·i.

    A resistor, an inductor and an inertia beside it make it a machine of your own, driven or generating.
    """

    icon = icons.EMF
    k: Parameter = param("N.m/A", "torque over current, which is also voltage over speed")
    w: Variable = var("rad/s", "speed of the shaft relative to the housing")

    def equations(self) -> Equations:
        yield from TwoPins.equations(self)
        yield from OneFlange.equations(self)
        yield der(self.phi) == self.w
        yield self.v == self.k * self.w
        yield self.flange.tau == -self.k * self.i


class TranslationalEMF(TwoPins, LinearOneFlange):
    """Ideal converter of a voice coil or a linear motor: the voltage is k·v_slide, the current pushes with k·i."""

    icon = icons.EMF
    k: Parameter = param("N/A", "force over current, which is also voltage over velocity")
    v_slide: Variable = var("m/s", "velocity of the slide relative to the housing")

    def equations(self) -> Equations:
        yield from TwoPins.equations(self)
        yield from LinearOneFlange.equations(self)
        yield der(self.s) == self.v_slide
        yield self.v == self.k * self.v_slide
        yield self.flange.f == -self.k * self.i
