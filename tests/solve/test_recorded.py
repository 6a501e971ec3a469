"""Trajectories from elsewhere: values between results, events and energies by their columns."""

import numpy as np
import pytest

from modelica_like.errors import MissingValue, UnknownName, ValueOutOfRange
from modelica_like.runs.recorded import RecordedModel, RecordedSolution, RecordedVariable

TIME = np.array([0.0, 1.0, 2.0, 2.0, 4.0])
COLUMNS = {
    "w": [0.0, 10.0, 20.0, 5.0, 9.0],
    "motor.source_power": [10.0, 10.0, 10.0, 4.0, 4.0],
    "brake.loss_power": [0.0, 2.0, 4.0, 6.0, 6.0],
    "wheel.stored_energy": [1.0, 6.0, 8.0, 3.0, 5.0],
}
MODES = RecordedVariable("brake.mode", names={0: "free", 1: "stuck"})
GEAR = RecordedVariable("gear", kind="discrete")
DISCRETES = np.array([[0.0, 0.0, 0.0, 1.0, 1.0], [1.0, 1.0, 1.0, 1.0, 2.5]])


def recorded(*names: str) -> RecordedSolution:
    variables = tuple(RecordedVariable(name) for name in names)
    model = RecordedModel("drive", variables, (MODES, GEAR), {"wheel.J": 0.5})
    return RecordedSolution(model, TIME, np.array([COLUMNS.get(name, TIME) for name in names]), DISCRETES, 0.0)


def test_values_by_name() -> None:
    run = recorded(*COLUMNS)
    np.testing.assert_array_equal(run["time"], TIME)
    np.testing.assert_array_equal(run["w"], COLUMNS["w"])
    np.testing.assert_array_equal(run["gear"], DISCRETES[1])
    np.testing.assert_array_equal(run["wheel.J"], np.full(5, 0.5))
    assert all(name in run for name in ("w", "gear", "wheel.J"))
    assert "v" not in run
    with pytest.raises(UnknownName, match=r"^drive has no variable 'wheel\.j'; did you mean 'wheel\.J'\?"):
        run["wheel.j"]


@pytest.mark.parametrize(
    ("t", "w", "gear"), [(0.0, 0.0, 1.0), (0.25, 2.5, 1.0), (2.0, 5.0, 1.0), (3.5, 8.0, 1.0), (4, 9.0, 2.5)]
)
def test_between_results_it_is_a_straight_line_and_at_events_the_right_side(t: float, w: float, gear: float) -> None:
    now = recorded(*COLUMNS).at(t)
    assert (now["w"], now["gear"]) == (w, gear)
    with pytest.raises(ValueOutOfRange):
        recorded(*COLUMNS).at(4.1)


def test_the_end_and_the_events() -> None:
    run = recorded(*COLUMNS)
    assert run.final["time"] == 4.0
    assert (run.final["w"], run.final["gear"], run.final["brake.loss_power"]) == (9.0, 2.5, 6.0)
    told = [(event.time, event.mode, event.before, event.after) for event in run.events]
    assert told == [(2.0, "brake.mode", "free", "stuck"), (4.0, "gear", "1", "2.5")]


def test_parts_and_variables_are_attributes() -> None:
    run = recorded(*COLUMNS, "belt[2].w")
    assert (run.statistics.steps, run.statistics.evaluations, run.statistics.integrations) == (5, 0, 0)
    np.testing.assert_array_equal(run.w, COLUMNS["w"])
    np.testing.assert_array_equal(run.brake.loss_power, COLUMNS["brake.loss_power"])
    assert dir(run.brake) == ["loss_power", "mode"]
    assert repr(run.brake) == "<brake: loss_power, mode>"
    assert dir(run).count("motor") == 1
    assert "belt[2]" not in dir(run)
    with pytest.raises(
        AttributeError, match=r"^The run of drive has no 'brake\.lost_power'; did you mean 'loss_power'\?"
    ):
        run.brake.lost_power  # noqa: B018
    with pytest.raises(AttributeError, match=r"^The run of drive has no 'brakes'; did you mean 'brake'\?"):
        run.brakes  # noqa: B018
    with pytest.raises(AttributeError, match=r"^The run of drive has no 'xyz'\.$"):
        run.xyz  # noqa: B018
    with pytest.raises(AttributeError, match="has no attribute '_w'"):
        run._w  # noqa: B018


def test_energies_are_integrals_of_columns() -> None:
    """Motor 20 + 8 J, brake 4 + 12 J, wheel 4 J more; what they keep or take has come through connectors."""
    balance = recorded(*COLUMNS).energy()
    assert (balance.source, balance.lost, balance.stored) == (28.0, 16.0, 4.0)
    assert {row.component: row.inflow for row in balance} == {"motor": -28.0, "brake": 16.0, "wheel": 4.0}
    assert balance.throughput == 48.0
    assert balance.power_closure == pytest.approx(8 / 48)
    assert {(row.at_events, row.residual, row.drift, row.impact) for row in balance} == {(0.0,) * 4}
    assert {(row.imbalance, row.imbalance_time, row.gain, row.gain_time) for row in balance} == {(0.0,) * 4}
    assert recorded("wheel.stored_energy").energy().throughput == 4.0
    # Work that is taken away, and a loss of the wrong sign, are exchanged, too.
    variables = (RecordedVariable("motor.source_power"), RecordedVariable("motor.loss_power"))
    for source, lost in ((-5.0, -3.0), (-3.0, -5.0)):
        values = np.broadcast_to([[source], [lost]], (2, 5))
        run = RecordedSolution(RecordedModel("drive", variables, (), {}), TIME, values, np.empty((0, 5)), 0.0)
        assert run.energy().throughput == 20.0
    with pytest.raises(MissingValue):
        recorded("w").energy()
