"""Frictions that stick together on one shaft: their own text against our components, which share by themselves."""

import random
from pathlib import Path

import numpy as np
import pytest
from library_references import LIBRARY

from modelica_like import load, simulate
from modelica_like.netlist.modelica.classes import with_libraries
from modelica_like.netlist.modelica.read import read_modelica

EXAMPLES = Path(__file__).parents[2] / "examples"
UNTIL = 3.0
PARTS = "Modelica.Mechanics.Rotational.Components"


def drive(seed: int) -> str:
    """Write two or three frictions on one shaft, perhaps with a gear between them, and a torque to and fro.

    Of 130 drives four are refused as chattering: a lossy gear without load does not know which side drives. In number
    74 a load turns round: which of two frictions has lost its peak before the shaft moves is open (stick_slip.md).
    """
    choose = random.Random(seed)

    def some(low: float, high: float) -> float:
        return round(choose.uniform(low, high), 3)

    parts = [
        f"{PARTS}.Inertia first(J={some(0.3, 3)}, phi(fixed=true), w(start={choose.choice([0, 0, 1.5])}, fixed=true));"
    ]
    parts += [f"{PARTS}.Inertia last(J={some(0.3, 3)});", "Modelica.Mechanics.Rotational.Sources.Torque q;"]
    sine = f"amplitude={some(5, 40)}, f={some(0.3, 2)}, offset={choose.choice([0, some(-5, 5)])}, phase={some(0, 6)}"
    parts.append(f"Modelica.Blocks.Sources.Sine s({sine});")
    joints, end, geared = ["connect(s.y, q.tau);", "connect(q.flange, first.flange_a);"], "first.flange_b", False
    for k in range(choose.choice([2, 2, 3])):
        if not geared and choose.random() < 0.5:
            parts.append(f"{PARTS}.IdealGear g(ratio={some(0.5, 3)});")
            joints.append(f"connect({end}, g.flange_a);")
            end, geared = "g.flange_b", True
        limit = some(1, 8)
        peak = 1 if geared else choose.choice([1, 1.3])  # two with peaks behind a gear: which lasts is open
        kind = choose.choice([
            f"{PARTS}.BearingFriction f{k}(tau_pos=[0,{limit};10,{limit + some(0, 3)}], peak={peak});",
            f"{PARTS}.BearingFriction f{k}(tau_pos=[0,{limit}]);",
            f"{PARTS}.Brake f{k}(fn_max={limit}, mue_pos=[0,0.8]); Modelica.Blocks.Sources.Constant c{k}(k=1);",
            f"{PARTS}.LossyGear f{k}(ratio={some(0.5, 2)}, lossTable=[0,0.8,{some(0.6, 0.95)},{some(0.5, 4)},1]);",
        ])  # fmt: skip
        parts.append(kind)
        joints.append(f"connect({end}, f{k}.flange_a);")
        joints += [f"connect(c{k}.y, f{k}.f_normalized);"] if "Brake" in kind else []
        end = f"f{k}.flange_b"
    joints.append(f"connect({end}, last.flange_a);")
    return "\n".join(["model Drive", *parts, "equation", *joints, "end Drive;", ""])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(24))
def test_a_shaft_moves_as_that_of_our_components(tmp_path: Path, seed: int) -> None:
    (tmp_path / "Drive.mo").write_text(drive(seed))
    times, speeds = np.linspace(0.013, UNTIL - 0.013, 250), []
    for table in (True, False):
        with with_libraries([str(LIBRARY)]):
            model, _ = read_modelica(tmp_path / "Drive.mo", "Drive", table=table)
        run = simulate(model, UNTIL, rtol=1e-8, solver="native", points=3001)
        speeds.append(np.interp(times, run.time, run["first.w"]))
    assert np.abs(speeds[0] - speeds[1]).max() < 1e-4


@pytest.mark.slow
def test_heat_of_frictions_that_stick_together() -> None:
    """Its components have been compared with the reference."""
    model, _ = read_modelica(
        LIBRARY / "Modelica" / "package.mo", "Modelica.Mechanics.Translational.Examples.HeatLosses", table=False
    )
    runs = [simulate(m, 1.0, rtol=1e-8) for m in (model, load(EXAMPLES / "msl/translational/HeatLosses.toml"))]
    for name in ("mass1.v", "mass2.v", "mass3.v", "massWithStopAndFriction.s"):
        assert runs[0].final[name] == pytest.approx(runs[1].final[name], rel=1e-6, abs=1e-8)
