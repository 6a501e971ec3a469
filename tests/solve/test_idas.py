"""One interval by IDAS: against closed forms, and where it gives up."""

import casadi as ca
import numpy as np
import pytest

from modelica_like import Options, build
from modelica_like.errors import StepFailed
from modelica_like.language import Component, Equations, Parameter, Variable, cos, der, param, var
from modelica_like.native.start import initialize
from modelica_like.solve import idas
from modelica_like.solve.idas import Grid, Integrator, linear_solver
from modelica_like.solve.initialize import Point

TIGHT = Options(rtol=1e-10, atol=1e-12)


class Decay(Component):
    """x falls as exp(-t/T); y, and then z, follow from nonlinear equations with the time in them."""

    T: Parameter = param("s", "time constant", default=2.0)
    rate: Parameter = param("1/s", "of the cosine", default=3.0)
    x: Variable = var("1", "state", default=5.0)
    far: Variable = var("1", "a state of another size", default=-4e6, nominal=1e6)
    y: Variable = var("1", "implicit")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == -self.x
        yield self.T * der(self.far) == -self.far
        yield self.y + self.y**3 == self.x + cos(self.rate * self.time)


class BlowUp(Component):
    """x = 1/(1 - t/T) from t = 0 on."""

    T: Parameter = param("s", "time that is left", default=1.0)
    calm: Variable = var("1", "another state", default=1.0)
    x: Variable = var("1", "state", default=1.0)

    def equations(self) -> Equations:
        yield self.T * der(self.calm) == 0
        yield self.T * der(self.x) == self.x**2


def started(model: Component, options: Options = TIGHT) -> tuple[Integrator, Point]:
    compiled = build(model)
    return Integrator(compiled, options), initialize(compiled, 0.0, "given")


@pytest.mark.parametrize("t", [0.0, 7.0])
@pytest.mark.parametrize("span", [0.5, 3.0])
def test_states_and_implicit_unknowns_at_equal_distances(t: float, span: float) -> None:
    integrator, point = started(Decay())
    start = Point(t, point.x, point.z, point.d)
    x, z = integrator.run(start, span, Grid(looks=4))
    passed = span * np.array([0.25, 0.5, 0.75, 1.0])
    np.testing.assert_allclose(x, [5.0 * np.exp(-passed / 2), -4e6 * np.exp(-passed / 2)], rtol=1e-8)
    for k in range(4):
        roots = np.roots([1.0, 0.0, 1.0, -x[0, k] - np.cos(3 * (t + passed[k]))])
        assert z[0, k] == pytest.approx(float(roots[np.abs(roots.imag).argmin()].real), rel=1e-12)
    assert integrator.steps > 10
    assert integrator.evaluations > integrator.steps
    assert integrator.calls == 1


def test_what_errors_are_measured_by() -> None:
    integrator, point = started(Decay(), Options(rtol=1e-6, atol=1e-8))
    wanted = np.array([5e-6 + 1e-8, 4.0 + 1e-2])
    assert integrator.weights(point.x) == pytest.approx(wanted)
    np.testing.assert_allclose(integrator.weights(point.x[:, None] * [1.0, -1.0]).T, [wanted, wanted])
    assert integrator.relax()
    assert integrator.weights(point.x) == pytest.approx(10 * wanted)
    assert not integrator.relax()
    assert integrator.rtol == pytest.approx(1e-5)


@pytest.mark.parametrize("t", [0.0, 3.0])
def test_where_it_gives_up_is_told(t: float) -> None:
    integrator, point = started(BlowUp(), Options())
    with pytest.raises(StepFailed, match=rf"^IDAS gave up at about t = {t + 1:g} s:") as caught:
        integrator.run(Point(t, point.x, point.z, point.d), 4.0, Grid(looks=40))
    assert caught.value.why == "x changes fastest relative to its tolerance."


def test_what_it_reached_is_an_answer_to_who_is_not_patient() -> None:
    integrator, start = started(BlowUp(), Options(rtol=1e-9))
    x, _ = integrator.run(start, 4.0, Grid(looks=40), patient=False, partial=True)
    times = 0.1 * np.arange(1, x.shape[1] + 1)
    assert 8 <= len(times) <= 9
    np.testing.assert_allclose(x[1], 1 / (1 - times), rtol=1e-6)
    assert integrator.gave_up.what.startswith("IDAS gave up at about t = ")
    with pytest.raises(StepFailed):
        integrator.run(start, 4.0, Grid(looks=3), patient=False, partial=True)


def test_what_is_not_finite_has_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    integrator, start = started(Decay())
    states = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, np.nan]])
    monkeypatch.setattr(integrator, "_call", lambda *_: (states, np.zeros((1, 3)), ""))
    with pytest.raises(StepFailed, match="not finite"):
        integrator.run(start, 1.0, Grid(looks=3))
    x, z = integrator.run(start, 1.0, Grid(looks=3), patient=False, partial=True)
    np.testing.assert_array_equal(x, states[:, :2])
    assert z.shape == (1, 2)


@pytest.mark.parametrize(("whole", "large", "made"), [(True, 2, 2), (True, 3, 1), (False, 2, 1)])
def test_whole_runs_of_large_models_have_their_own_instances(
    whole: bool, large: int, made: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """For each length one, which needs no factor of time; all others share one."""
    monkeypatch.setattr(idas, "_SPARSE_FROM", large)
    compiled = build(Decay())
    integrator, start = Integrator(compiled, TIGHT, whole=whole), initialize(compiled, 0.0, "given")
    lengths: list[int] = []
    make = integrator._make
    monkeypatch.setattr(integrator, "_make", lambda *asked: lengths.append(1) or make(*asked))
    for span in (0.5, 2.0, 0.5):
        x, _ = integrator.run(start, span, Grid(looks=2))
        np.testing.assert_allclose(x[0], 5.0 * np.exp(-np.array([0.25, 0.5]) * span), rtol=1e-8)
    assert len(lengths) == made


@pytest.mark.parametrize(("unknowns", "stride", "solver"), [(48, 1, "qr"), (50, 1, "csparse"), (50, 17, "qr")])
def test_which_linear_solver(unknowns: int, stride: int, solver: str) -> None:
    # A chain, link by link or shuffled: then it fills up in this order.
    places = [k * stride % unknowns for k in range(unknowns)]
    pairs = [(places[k], places[n]) for k in range(unknowns) for n in (k - 1, k, k + 1) if 0 <= n < unknowns]
    pattern = ca.Sparsity.triplet(unknowns, unknowns, [row for row, _ in pairs], [column for _, column in pairs])
    assert linear_solver(pattern) == solver
