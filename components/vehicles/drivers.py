"""Driver models that follow a speed profile."""

from __future__ import annotations

from components import icons
from components.blocks.control import PI
from components.blocks.signals import Table
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Input,
    Mode,
    Output,
    Parameter,
    column,
    connect,
    param,
    rows,
    signal_in,
    signal_out,
)


class Driver(Component):
    """Driver model that follows a profile of speed over time, such as a driving cycle, with accelerator and brake.

    A PI controller with anti-windup; a positive output goes to the accelerator, a negative one to the brake.
    """

    icon = icons.DRIVER
    v: Input = signal_in("m/s", "speed of the vehicle")
    profile: tuple[tuple[float, float], ...] = rows(
        column("time", scale="time_scale", rising=True), column("speed", scale="v_scale")
    )
    time_scale: Parameter = param("s", "scale of the times in the profile", default=1.0)
    v_scale: Parameter = param("m/s", "speed that counts as 1 in the profile", default=1.0)
    k: Parameter = param("s/m", "gain, pedal over error of the speed", default=0.5, min=1e-12)
    Ti: Parameter = param("s", "reset time", default=5.0, min=1e-12)
    v_ref: Output = signal_out("m/s", "speed of the profile")
    accelerator: Output = signal_out("1", "accelerator, 0 to 1")
    brake: Output = signal_out("1", "brake, 0 to 1")
    foot = Mode("accelerator", "brake", description="pedal on which the foot is")

    def build(self) -> None:
        self.wish = Table(table=self.profile, scale="v_scale", time_scale="time_scale")
        self.control = PI(k="k", Ti="Ti", y_max=1.0, integral=0.0)

    def equations(self) -> Equations:
        yield connect(self.v_ref, self.wish.y, self.control.u_s)
        yield connect(self.v, self.control.u_m)
        yield self.accelerator == self.foot.choose(accelerator=self.control.y, brake=0)
        yield self.brake == self.foot.choose(accelerator=0, brake=-self.control.y)

    def events(self) -> Events:
        yield self.foot.initially("brake", when=self.control.y < 0)
        yield self.foot.go("accelerator", "brake", when=self.control.y < 0)
        yield self.foot.go("brake", "accelerator", when=self.control.y > 0)
