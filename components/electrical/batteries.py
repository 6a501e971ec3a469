"""Batteries: cells whose voltage follows from their state of charge."""

from __future__ import annotations

from components import icons
from components.electrical.analog import TwoPins
from components.tabulated import ROUNDING, Tabulated
from components.thermal import Lossy
from modelica_like.language import (
    Equations,
    Events,
    Expr,
    LanguageError,
    Mode,
    Parameter,
    Variable,
    column,
    der,
    param,
    rows,
    var,
)


class Battery(Tabulated, Lossy, TwoPins):
    """Cells in series and parallel: open-circuit voltage over the state of charge, behind their internal resistance.

    With R_1 and C_1, part of the resistance acts with a delay (one RC element). The current is positive while the
    battery is charged. The stored energy is zero at the start. Modelica Standard Library, Electrical.Batteries,
    BatteryStacks.
    """

    icon = icons.BATTERY
    ocv: tuple[tuple[float, float], ...] = rows(
        column("state of charge", rising=True, min=0, max=1),
        column("open-circuit voltage of a cell", scale="v_scale", min=0),
    )
    v_scale: Parameter = param("V", "scale of the voltages", default=1.0)
    Q: Parameter = param("A.h", "charge of a full cell", min=1e-12)
    R_i: Parameter = param("Ohm", "internal resistance of a cell that acts at once", default=0.0, min=0)
    R_1: Parameter = param("Ohm", "resistance of a cell that acts with a delay", default=None, min=1e-12)
    C_1: Parameter = param("F", "capacitance in parallel to it", default=None, min=1e-12)
    N_s: Parameter = param("1", "cells in series", default=1.0, min=1)
    N_p: Parameter = param("1", "cells in parallel", default=1.0, min=1)
    soc: Variable = var("1", "state of charge, 0 to 1", default=1.0)
    i_cell: Variable = var("A", "current into a cell")
    v_cell: Variable = var("V", "open-circuit voltage of a cell")
    v_1: Variable = var("V", "delayed voltage of a cell", default=0.0)
    E: Variable = var("J", "energy in all cells, from the start on", default=0.0)
    charge = Mode("kept", "empty", "full", description="whether it was never empty or overcharged")

    @property
    def delayed(self) -> bool:
        """Whether part of the resistance acts with a delay."""
        return self.given("R_1") and self.given("C_1")

    def equations(self) -> Equations:
        yield from super().equations()
        if self.given("R_1") != self.given("C_1"):
            there, missing = ("R_1", "C_1") if self.given("R_1") else ("C_1", "R_1")
            raise LanguageError(
                f"{self.label} has {there}, but no {missing}.",
                advice=f"Give both, for resistance that acts with a delay, or leave {there} out.",
            )
        yield self.i_cell == self.i / self.N_p
        yield self.Q * der(self.soc) == self.i_cell
        yield self.v_cell == self.v_scale * self.look_up(self.soc, self.ocv)
        if self.delayed:
            yield self.C_1 * der(self.v_1) == self.i_cell - self.v_1 / self.R_1
        else:
            yield self.v_1 == 0
        yield self.v == self.N_s * (self.v_cell + self.R_i * self.i_cell + self.v_1)
        yield der(self.E) == self.N_s * self.N_p * self.v_cell * self.i_cell

    def events(self) -> Events:
        yield self.charge.go("kept", "empty", when=self.soc < -ROUNDING, notice="is empty: it gives more than it had")
        yield self.charge.go("kept", "full", when=self.soc > 1 + ROUNDING, notice="is overcharged")
        yield from self.leaving("ocv", self.soc, self.ocv, self.soc > 0, self.soc < 1)

    def stored_energy(self) -> Expr:
        return self.E + (self.N_s * self.N_p * 0.5 * self.C_1 * self.v_1**2 if self.delayed else 0.0)

    def dissipation(self) -> Expr:
        slow = self.v_1**2 / self.R_1 if self.delayed else 0.0
        return self.N_s * self.N_p * (self.R_i * self.i_cell**2 + slow)
