"""Belt drives."""

from __future__ import annotations

from components import icons
from components.interfaces import TwoFlanges
from components.thermal import Lossy
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
    der,
    maximum,
    param,
    signal_out,
    tanh,
    var,
)


class TimingBelt(Lossy, TwoFlanges):
    """Belt on two pulleys that turn the same way: elastic and damped strands, pre-tension, and slip.

    The strands are stretched by x = r_a·phi_a - r_b·phi_b minus the slip, so the strand forces are
    F_0 ± (c·x + d·der(x)), and the force on the circumference is their difference. A strand that would have to push is
    slack, and the other one carries alone; the report of a run says so. With mu and wrap_angle given, the belt
    slips where the ratio of the strand forces reaches exp(mu·wrap_angle) (L. Euler, J. A. Eytelwein), that is at
    F = 2·F_0·tanh(mu·wrap_angle/2); then no strand becomes slack.
    """

    icon = icons.BELT
    r_a: Parameter = param("m", "radius of the pulley at flange_a", min=1e-12)
    r_b: Parameter = param("m", "radius of the pulley at flange_b", min=1e-12)
    c: Parameter = param("N/m", "stiffness of one strand", min=1e-12)
    d: Parameter = param("N.s/m", "damping coefficient of one strand", min=1e-12)
    F_0: Parameter = param("N", "pre-tension of each strand", default=0.0, min=0)
    mu: Parameter = param(
        "1", "coefficient of friction between belt and pulley; without a value it does not slip", default=None, min=0
    )
    wrap_angle: Parameter = param("rad", "wrap angle on the smaller pulley", default=3.141592653589793, min=0)
    x: Variable = var("m", "stretch of the driving strand", state="always", default=0)
    v_rel: Variable = var("m/s", "relative velocity of the circumferences")
    f: Variable = var("N", "force on the circumference")
    F_1: Output = signal_out("N", "force in the strand that is stretched by x")
    F_2: Output = signal_out("N", "force in the other strand")
    grip = Mode("sticking", "forward", "backward", description="slip of the belt")
    strands = Mode("tight", "slack", description="whether a pre-tensioned strand has been slack")

    @property
    def slip_force(self) -> Expr:
        """Largest force on the circumference."""
        return 2 * self.F_0 * tanh(0.5 * self.mu * self.wrap_angle)

    @property
    def pulls(self) -> tuple[Expr, Expr]:
        """Forces in both strands."""
        more = self.c * self.x + self.d * der(self.x)
        pulls = self.F_0 + more, self.F_0 - more
        return pulls if self.given("mu") else (maximum(pulls[0], 0), maximum(pulls[1], 0))

    @property
    def springs(self) -> tuple[Expr, Expr]:
        """Elastic parts of the forces in both strands."""
        return maximum(self.F_0 + self.c * self.x, 0), maximum(self.F_0 - self.c * self.x, 0)

    def equations(self) -> Equations:
        yield from super().equations()
        a, b = self.flange_a, self.flange_b
        w_a, w_b = der(a.phi - self.phi_support), der(b.phi - self.phi_support)
        yield self.v_rel == self.r_a * w_a - self.r_b * w_b
        first, second = self.pulls
        yield self.f == first - second
        yield a.tau == self.r_a * self.f
        yield b.tau == -self.r_b * self.f
        yield first == self.F_1
        yield second == self.F_2
        sticking = der(self.x) - self.v_rel
        if self.given("mu"):
            slip = self.slip_force
            yield self.grip.choose(sticking=sticking, forward=self.f - slip, backward=self.f + slip) == 0
        else:
            yield sticking == 0

    def events(self) -> Events:
        if self.given("mu"):
            yield self.grip.go("sticking", "forward", when=self.f > self.slip_force, because="slip force exceeded")
            yield self.grip.go("sticking", "backward", when=self.f < -self.slip_force, because="slip force exceeded")
            yield self.grip.go("forward", "sticking", when=self.v_rel < der(self.x), because="slip reached zero")
            yield self.grip.go("backward", "sticking", when=self.v_rel > der(self.x), because="slip reached zero")
        else:
            least = self.F_0 - absolute(self.c * self.x + self.d * der(self.x))
            notice = "has a slack strand: its pre-tension is too small for the torque"
            yield self.strands.go("tight", "slack", when=all_of(self.F_0 > 0, least < 0), notice=notice)

    def stored_energy(self) -> Expr:
        first, second = self.springs
        return 0.5 * (first**2 + second**2) / self.c

    def dissipation(self) -> Expr:
        (pull_1, pull_2), (spring_1, spring_2) = self.pulls, self.springs
        stretching = (pull_1 - spring_1 - pull_2 + spring_2) * der(self.x)
        return stretching + self.f * (self.v_rel - der(self.x))
