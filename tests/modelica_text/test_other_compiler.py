"""Written Modelica text runs in an independent compiler, rumoca, with the same trajectories.

The standard library's text is not here; classes/Modelica.mo has the few classes that these drives use, in their ideal
form.
"""

from pathlib import Path

import numpy as np
import pytest
import rumoca

from components import Fixed, IdealGear, Inertia, QuadraticSpeedDependentTorque, SpringDamper, Torque
from components.interfaces import Compliant
from modelica_like import load, simulate
from modelica_like.language import Assembly, Component, Equations, Expr, Parameter, connect, cos, param, sin
from modelica_like.netlist.modelica.write import modelica_text

EXAMPLES = Path(__file__).parents[2] / "examples"
CLASSES = Path(__file__).parent / "classes" / "Modelica.mo"
SAME = 1e-6
"""Largest difference over the largest value; both solvers work at 1e-10."""


class Cushion(Compliant):
    """An own class with a nonlinear equation: a spring that stiffens, with a wave in it."""

    c: Parameter = param("N.m/rad", "stiffness")
    wave: Parameter = param("1", "part of it that waves", default=0.2)

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.tau == self.c * (self.phi_rel + self.phi_rel**3 + self.wave * sin(3 * self.phi_rel))

    def stored_energy(self) -> Expr:
        x = self.phi_rel
        return self.c * (x**2 / 2 + x**4 / 4 + self.wave * (1 - cos(3 * x)) / 3)


class Train(Assembly):
    """Two gears, an elastic shaft, an own spring to the housing, a fan."""

    def __init__(self) -> None:
        super().__init__("train")
        self.torque, self.fan = Torque(tau=3.0), QuadraticSpeedDependentTorque(tau_nominal=-4.0, w_nominal=10.0)
        self.rotor = Inertia(J=0.05, phi=0.2, w=1.0)
        self.first, self.second = IdealGear(ratio=2.5), IdealGear(ratio=-0.8)
        self.shaft = SpringDamper(c=300.0, d=0.6, phi_rel=0.01, w_rel=0.0)
        self.load, self.cushion, self.wall = Inertia(J=0.4), Cushion(c=40.0), Fixed(phi0=0.1)

    def equations(self) -> Equations:
        yield connect(self.torque.flange, self.rotor.flange_a)
        yield connect(self.rotor.flange_b, self.first.flange_a)
        yield connect(self.first.flange_b, self.shaft.flange_a)
        yield connect(self.shaft.flange_b, self.second.flange_a)
        yield connect(self.second.flange_b, self.load.flange_a, self.fan.flange)
        yield connect(self.load.flange_b, self.cushion.flange_a)
        yield connect(self.cushion.flange_b, self.wall.flange)


def compiled_elsewhere(drive: Component, folder: Path) -> rumoca.Model:
    text = modelica_text(drive)
    file = folder / "drive.mo"
    file.write_text(text, encoding="utf-8")
    name = next(line.split()[1] for line in reversed(text.splitlines()) if line.startswith("model "))
    return rumoca.Session(roots=[str(CLASSES)]).load(str(file), model=name)


@pytest.mark.parametrize(
    ("drive", "until", "names"),
    [
        (load(EXAMPLES / "two_mass.toml"), 0.5, ["J1.phi", "J1.w", "J2.w", "shaft.tau"]),
        (load(EXAMPLES / "elements" / "converters.toml"), 0.1, ["rotor.w", "armature.i", "slide.s", "slide.v"]),
        (Train(), 2.0, ["rotor.w", "load.phi", "load.w", "shaft.tau", "cushion.tau"]),
    ],
    ids=["two_mass", "converters", "train"],
)
def test_another_compiler_finds_the_same_curves(
    drive: Component, until: float, names: list[str], tmp_path: Path
) -> None:
    settings = rumoca.SimConfig(rtol=1e-10, atol=1e-10)
    theirs = compiled_elsewhere(drive, tmp_path).simulate(t=(0.0, until), dt=until / 100, config=settings)
    ours = simulate(drive, until, points=100, rtol=1e-10)
    for name in names:
        difference = np.abs(np.array(theirs[name]) - ours[name])
        assert np.max(difference) <= SAME * np.max(np.abs(ours[name])), name
