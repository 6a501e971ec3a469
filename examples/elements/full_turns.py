"""Mechanisms in coordinates, as a textbook writes them: no variable is a state everywhere."""

from modelica_like.language import Component, Equations, Expr, Parameter, Variable, cos, der, param, sin, var


class Pendulum(Component):
    """Point mass on a rod without mass, in Cartesian coordinates; y points up."""

    m: Parameter = param("kg", "mass", min=1e-12)
    L: Parameter = param("m", "length of the rod", min=1e-12)
    g: Parameter = param("m/s2", "gravity", default="9.81 m/s2")
    x: Variable = var("m", "position to the right")
    y: Variable = var("m", "position upwards")
    vx: Variable = var("m/s", "velocity to the right")
    vy: Variable = var("m/s", "velocity upwards")
    pull: Variable = var("N/m", "force of the rod over its length")

    def equations(self) -> Equations:
        yield der(self.x) == self.vx
        yield der(self.y) == self.vy
        yield self.m * der(self.vx) == -self.pull * self.x
        yield self.m * der(self.vy) == -self.pull * self.y - self.m * self.g
        yield self.x**2 + self.y**2 == self.L**2

    def stored_energy(self) -> Expr:
        return self.m * (self.vx**2 + self.vy**2) / 2 + self.m * self.g * self.y


class SliderCrank(Component):
    """Crank pin and slider, both with a mass, joined by a rod; the slider moves along x."""

    crank: Parameter = param("m", "length of the crank", min=1e-12)
    rod: Parameter = param("m", "length of the rod", min=1e-12)
    m_pin: Parameter = param("kg", "mass at the pin", min=1e-12)
    m_slider: Parameter = param("kg", "mass of the slider", min=1e-12)
    x: Variable = var("m", "position of the pin")
    y: Variable = var("m", "position of the pin")
    s: Variable = var("m", "position of the slider")
    vx: Variable = var("m/s", "velocity of the pin")
    vy: Variable = var("m/s", "velocity of the pin")
    v: Variable = var("m/s", "velocity of the slider")
    pull: Variable = var("N/m", "force of the crank over its length")
    push: Variable = var("N/m", "force of the rod over its length")

    def equations(self) -> Equations:
        yield der(self.x) == self.vx
        yield der(self.y) == self.vy
        yield der(self.s) == self.v
        yield self.m_pin * der(self.vx) == -self.pull * self.x + self.push * (self.s - self.x)
        yield self.m_pin * der(self.vy) == -self.pull * self.y - self.push * self.y
        yield self.m_slider * der(self.v) == -self.push * (self.s - self.x)
        yield self.x**2 + self.y**2 == self.crank**2
        yield (self.s - self.x) ** 2 + self.y**2 == self.rod**2

    def stored_energy(self) -> Expr:
        return (self.m_pin * (self.vx**2 + self.vy**2) + self.m_slider * self.v**2) / 2


class FourBar(Component):
    """Four-bar linkage that two equations close; crank, coupler and rocker have moments of inertia, but no mass."""

    crank: Parameter = param("m", "length of the crank", min=1e-12)
    coupler: Parameter = param("m", "length of the coupler", min=1e-12)
    rocker: Parameter = param("m", "length of the rocker", min=1e-12)
    ground: Parameter = param("m", "distance of both axes", min=1e-12)
    J: Parameter = param("kg.m2", "moment of inertia of the crank", min=1e-12)
    J_coupler: Parameter = param("kg.m2", "moment of inertia of the coupler", min=0)
    J_rocker: Parameter = param("kg.m2", "moment of inertia of the rocker", min=0)
    phi: Variable = var("rad", "angle of the crank")
    beta: Variable = var("rad", "angle of the coupler")
    psi: Variable = var("rad", "angle of the rocker")
    w: Variable = var("rad/s", "speed of the crank")
    w_beta: Variable = var("rad/s", "speed of the coupler")
    w_psi: Variable = var("rad/s", "speed of the rocker")
    fx: Variable = var("N", "force between coupler and rocker")
    fy: Variable = var("N", "force between coupler and rocker")

    def across(self, angle: Expr) -> Expr:
        """Return the part of the force across a bar."""
        return cos(angle) * self.fy - sin(angle) * self.fx

    def equations(self) -> Equations:
        yield der(self.phi) == self.w
        yield der(self.beta) == self.w_beta
        yield der(self.psi) == self.w_psi
        yield self.J * der(self.w) == self.crank * self.across(self.phi)
        yield self.J_coupler * der(self.w_beta) == self.coupler * self.across(self.beta)
        yield self.J_rocker * der(self.w_psi) == -self.rocker * self.across(self.psi)
        closes_x = self.crank * cos(self.phi) + self.coupler * cos(self.beta) - self.rocker * cos(self.psi)
        yield closes_x == self.ground
        yield self.crank * sin(self.phi) + self.coupler * sin(self.beta) == self.rocker * sin(self.psi)

    def stored_energy(self) -> Expr:
        return (self.J * self.w**2 + self.J_coupler * self.w_beta**2 + self.J_rocker * self.w_psi**2) / 2
