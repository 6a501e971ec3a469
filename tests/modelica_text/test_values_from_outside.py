"""Formulas of an enclosing netlist for values inside its assemblies, written as Modelica text and read again."""

from pathlib import Path

import numpy as np
import pytest

from modelica_like import load, simulate
from modelica_like.netlist.modelica.write import modelica_text

STAGE = """
[parameters]
i = 2.0
J = "1 kg.m2"
[parts]
g = { is = "IdealGear", ratio = "i" }
w = { is = "Inertia", J = "J" }
s = { is = "SpringDamper", c = "50 N.m/rad", d = "1 N.m.s/rad" }
[series]
a = ["g", "w", "s"]
[expose]
flange_a = "g.flange_a"
flange_b = "s.flange_b"
"""
BOX = """
[parameters]
r = 3.0
[parts]
one = { is = "./stage.toml", i = "r/2" }
[expose]
flange_a = "one.flange_a"
flange_b = "one.flange_b"
"""
DRIVE = """
[parameters]
q = 5
J = "3 kg.m2"
n = "120 rpm"
[parts]
m = { is = "Inertia", J = "J", phi = "0 rad", w = "n" }
Stage = { is = "./stage.toml", i = "q/2" }
two = { is = "./stage.toml", count = 2, "w.J" = "J + q*1 kg.m2" }
box = { is = "./box.toml", r = "q - 1", "one.s.c" = "q*30 N.m/rad" }
e = { is = "Inertia", J = "Stage.w.J" }
t = { is = "ConstantTorque", tau_constant = "q*1 N.m" }
[series]
x = ["t", "m", "Stage", "two[1]", "two[2]", "box", "e"]
[start]
"Stage.s.phi_rel" = "q*0.02 rad"
[simulate]
until = "1 s"
start = "rest"
"""


@pytest.mark.parametrize("given", [{}, {"q": 4.0}, {"J": 2.0}, {"Stage.i": 1.5}])
def test_they_become_modifications(given: dict[str, float], tmp_path: Path) -> None:
    for name, text in (("stage", STAGE), ("box", BOX), ("drive", DRIVE)):
        (tmp_path / f"{name}.toml").write_text(text)
    drive = load(tmp_path / "drive.toml")
    (tmp_path / "drive.mo").write_text(modelica_text(drive))
    again = load(tmp_path / "drive.mo")
    for path, value in given.items():
        drive.set(path, value)
        again.set(path, value)
    run, twin = (simulate(each, 1.0, rtol=1e-9, atol=1e-11) for each in (drive, again))
    assert set(run.names) == set(twin.names)
    ends = np.array([[each.final[name] for name in run.names] for each in (run, twin)])
    assert ends[1] == pytest.approx(ends[0], rel=1e-9, abs=1e-9)
