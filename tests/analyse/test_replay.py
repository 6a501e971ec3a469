"""The chain of steps and jumps: its method, its places, its agreement with the run."""

from pathlib import Path

import numpy as np
import pytest

from components import Fixed, Inertia, SpringDamper
from modelica_like import build, simulate
from modelica_like.analyse.replay.kinks import Kinks
from modelica_like.analyse.replay.make import replay
from modelica_like.analyse.replay.step import Step
from modelica_like.analyse.replay.tableau import radau
from modelica_like.analyse.replay.tolerances import Tolerances
from modelica_like.language import Component, Equations, series

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_three_stages_are_the_radau_method_of_the_book() -> None:
    # Hairer, Wanner, table IV.5.6
    root = np.sqrt(6)
    tableau = radau(3)
    assert tableau.nodes == pytest.approx([(4 - root) / 10, (4 + root) / 10, 1])
    assert tableau.weights == pytest.approx([(16 - root) / 36, (16 + root) / 36, 1 / 9])
    assert tableau.matrix[0, 0] == pytest.approx((88 - 7 * root) / 360)
    assert tableau.gamma == pytest.approx(1 / 3.637834252744496)


@pytest.mark.parametrize("stages", [3, 5, 7])
def test_the_quadrature_has_its_order(stages: int) -> None:
    tableau = radau(stages)
    for power in range(2 * stages - 1):
        assert tableau.weights @ tableau.nodes**power == pytest.approx(1 / (power + 1), rel=1e-13)


class Oscillator(Component):
    wall = Fixed()
    spring = SpringDamper(c="100 N.m/rad", d="0 N.m.s/rad")
    mass = Inertia(J="1 kg.m2", phi=0.0, w=1.0)

    def equations(self) -> Equations:
        yield from series(self.wall, self.spring, self.mass)


@pytest.mark.parametrize("precision", [1e-4, 1e-8])
def test_the_steps_keep_their_tolerance(precision: float) -> None:
    run = simulate(Oscillator(), "2 s")
    chain = replay(run, tolerances=Tolerances(precision))
    names = list(run.model.states)
    exact = {"phi": np.sin(20.0) / 10, "w": np.cos(20.0)}
    for row, name in enumerate(names):
        assert chain.nodes[-1].x[row] == pytest.approx(
            exact[name.rpartition(".")[2].replace("_rel", "")], abs=precision
        )


@pytest.mark.parametrize("netlist", ["msl/rotational/CoupledClutches", "machine_tool_startup", "machine_table_geared"])
def test_the_replay_is_the_run(netlist: str) -> None:
    run = simulate(build(EXAMPLES / f"{netlist}.toml"), rtol=1e-9, atol=1e-11)
    chain = replay(run)
    last = run.segments[-1]
    assert chain.nodes[-1].t == last.times[-1]
    assert chain.nodes[-1].x == pytest.approx(last.x[:, -1], rel=1e-6, abs=1e-7)
    times = [jump.before.t for _, jump in chain.jumps]
    assert times == pytest.approx([segment.times[0] for segment in run.segments[1:]], abs=1e-7)
    modes = [segment.d for segment in run.segments[1:]]
    for (_, jump), d in zip(chain.jumps, modes, strict=True):
        assert np.array_equal(jump.after.d, d)


def test_a_segment_ends_just_before_its_event() -> None:
    chain = replay(simulate(EXAMPLES / "machine_tool_startup.toml"))
    shifts = [jump.trigger.shift for _, jump in chain.jumps if jump.trigger is not None]
    assert len(shifts) >= 3
    assert all(0.0 <= shift < 1e-12 for shift in shifts)


def test_steps_end_at_kinks() -> None:
    # The friction law of the clutch changes from a line to a cubic at the slip speed w_min.
    run = simulate(EXAMPLES / "machine_tool_startup.toml")
    chain = replay(run)
    row = run.model.states.index("clutch.w_rel")
    assert Kinks(run.model).count > 0
    steps = [move for move in chain.moves if isinstance(move, Step)]
    across = [s for s in steps if (abs(s.before.x[row]) - 12.57) * (abs(s.after.x[row]) - 12.57) < -1e-16]
    ends = [abs(step.after.x[row]) for step in steps]
    assert min(abs(end - 12.57) for end in ends) < 1e-8
    assert all(min(abs(abs(p.x[row]) - 12.57) for p in (s.before, s.after)) < 1e-8 for s in across)


def test_times_can_be_nodes() -> None:
    stops = [0.05, 0.1234, 0.3]
    chain = replay(simulate(EXAMPLES / "machine_table_direct.toml"), stops=stops)
    assert set(stops) <= {point.t for point in chain.nodes}
