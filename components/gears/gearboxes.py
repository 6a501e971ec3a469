"""Gears with losses, elasticity and backlash together."""

from __future__ import annotations

from typing import Literal

from components import icons
from components.gears.lossy_gears import LossRows, LossyGear
from components.interfaces import Flange
from components.mechanics.springs import ElastoBacklash, SpringDamper
from modelica_like.language import (
    Component,
    Equations,
    Parameter,
    column,
    connect,
    param,
    rows,
    series,
)


class Gearbox(Component):
    """Gear with mesh efficiency and bearing friction, and its elasticity and backlash seen from flange_b.

    Modelica Standard Library, Rotational.Gearbox. The inertia of the input wheel belongs to the shaft at flange_a.
    """

    icon = icons.GEARBOX
    flange_a = Flange("input shaft")
    flange_b = Flange("output shaft")
    support = Flange("housing", optional=True)
    loss_table: LossRows = rows(
        column("speed |w_a|", "rad/s", rising=True), column("eta_mf1", min=1e-3, max=1), column("eta_mf2", max=1),
        column("|tau_bf1|", "N.m"), column("|tau_bf2|", "N.m"), default=((0.0, 1.0, 1.0, 0.0, 0.0),),
    )  # fmt: skip
    """As in a `LossyGear`: rows of speed |w_a| in rad/s, eta_mf1, eta_mf2, and |tau_bf1|, |tau_bf2| in N.m."""
    extrapolate: Literal["hold", "linear", "error"] = "hold"
    """Beyond the rows: `hold` the last values, continue the last slopes (`linear`), or end the run (`error`)."""
    has_backlash: bool = True
    """The flanks have backlash."""
    ratio: Parameter = param("1", "transmission ratio, speed of flange_a over speed of flange_b")
    c: Parameter = param("N.m/rad", "stiffness of the flanks", min=0)
    d: Parameter = param("N.m.s/rad", "damping coefficient of the flanks", default=0.0, min=0)
    b: Parameter = param("rad", "total backlash", default=1e-3, min=1e-10)

    def build(self) -> None:
        self.gear = LossyGear(ratio="ratio", loss_table=self.loss_table, extrapolate=self.extrapolate)
        self.flanks = ElastoBacklash(c="c", d="d", b="b") if self.has_backlash else SpringDamper(c="c", d="d")

    def equations(self) -> Equations:
        yield connect(self.flange_a, self.gear.flange_a)
        yield from series(self.gear, self.flanks)
        yield connect(self.flange_b, self.flanks.flange_b)
        if self.support.used:
            yield connect(self.support, self.gear.support)
