"""Runs whose stored energies do not follow their powers are repeated with shorter steps, or refused."""

import numpy as np
import pytest

from components import Inertia
from modelica_like import Options, build, simulate
from modelica_like.errors import UnknownName, ValueOutOfRange
from modelica_like.language import Component, Equations
from modelica_like.runs import conserve
from modelica_like.solve.recorder import Segment

STEPPED_OVER = """
[parts]
m = { is = "Mass", m = "1 kg", s = -0.3, v = "1 m/s" }
k = { is = "FormingForce", table = [["0 mm", "0 N"], ["1 mm", "80 kN"], ["4 mm", "80 kN"], ["5 mm", "0 N"]] }
f = { is = "TranslationalFixed" }
[connect]
a = ["m.flange_b", "k.flange"]
b = ["k.support", "f.flange"]
"""


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_a_force_over_a_short_way_stops_a_mass(solver):
    """Its 0.5 J are less than 320 J. On the ramp of 8e7 N/m it stops after 0.3 s and a quarter of a swing."""
    from modelica_like.netlist import loads

    run = simulate(loads(STEPPED_OVER), 1.0, solver=solver)
    assert abs(run["m.v"][-1]) < 1e-6
    assert run["m.s"][-1] == pytest.approx(1 / np.sqrt(8e7), rel=1e-5)


PULSE = """
[parts]
m = {{ is = "Mass", m = "1 kg", s = {s}, v = {v} }}
k = {{ is = "FormingForce", s_scale = {width}, f_scale = {force}, table = [[0, 0], [1, 1], [2, 1], [3, 0]] }}
f = {{ is = "TranslationalFixed" }}
[connect]
a = ["m.flange_b", "k.flange"]
b = ["k.support", "f.flange"]
"""


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("points", [1, 5, 500, 5000])
@pytest.mark.parametrize(("v", "width", "share"), [(54.55, 1e-5, 0.25), (10.0, 2e-6, 0.8), (270.0, 5e-4, 0.2)])
def test_a_force_narrower_than_results_is_accounted_for(solver, points, v, width, share):
    """The run sees it: so must its balance, or the run would be refused, with some numbers of results only."""
    from modelica_like.netlist import loads

    taken = share * 0.5 * v**2
    drive = loads(PULSE.format(s=-0.6 * v, v=v, width=width, force=taken / (2.0 * width)))
    run = simulate(drive, 1.0, solver=solver, points=points)
    balance = run.energy()
    # The place is known to 1e-9 of the way so far, so the window is it to 1e-9 of the way over its width.
    near = 1e-5 + 1e-9 * 0.6 * v / width
    assert run.notices == balance.notices == ()
    assert balance["k"].lost == pytest.approx(taken, rel=near)
    assert balance["m"].stored == pytest.approx(-taken, rel=near)
    assert balance["k"].lost == pytest.approx(run.read("k.loss_energy")[0], rel=1e-6)


def forged(run):
    """A run in which a mass jumps from one speed to another between two results, as if something were stepped over."""
    (segment,) = run.segments
    x = segment.x.copy()
    x[run.model.states.index("mass.w"), len(segment.times) // 2 :] += 0.1
    run.segments = (Segment(segment.times, x, segment.z, segment.d),)
    return run


class Free(Component):
    """A mass that nothing moves."""

    mass = Inertia(J=2.0, phi=0.0, w=1.0)

    def equations(self) -> Equations:
        return ()


@pytest.fixture
def free():
    return simulate(build(Free()), 1.0, options=Options(points=10))


def test_a_jump_between_two_results_is_found_where_it_is(free):
    astray = conserve.find_astray(forged(free))
    assert (astray.component, astray.begin, astray.end) == ("mass", pytest.approx(0.4), pytest.approx(0.5))
    assert astray.energy == pytest.approx(0.5 * 2.0 * (1.1**2 - 1.0**2), rel=1e-6)


def test_a_run_within_its_tolerances_is_not_found(free):
    assert conserve.find_astray(free) is None


def test_it_is_repeated_with_shorter_steps_and_told(free):
    asked = []

    def repeat(options):
        asked.append(options.max_step)
        return simulate(free.model, 1.0, options=options)

    run = conserve.conserving(forged(free), repeat)
    assert asked == [pytest.approx(0.1 / 8)]
    assert run.notices == (
        "Between 0.4 s and 0.5 s the stored energy of mass changes by 0.21 J more than its power explains: the run was "
        "repeated with steps of at most 0.0125 s.",
    )


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_steps_are_limited(solver):
    run = simulate(build(Free()), 1.0, solver=solver, options=Options(points=10, max_step=1e-3))
    assert run.statistics.steps >= 1000


def test_wrong_options():
    with pytest.raises(ValueOutOfRange, match=r"max_step = -1 s is out of range: it must be positive\."):
        Options(max_step=-1.0)
    with pytest.raises(UnknownName, match=r"There is no on_energy_drift 'notes'; did you mean 'note'\?"):
        Options(on_energy_drift="notes")
