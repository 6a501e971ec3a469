"""The diode's law has no jump: what lies at the edge of both states is the same in both."""

import pytest

from components import Capacitor, ConstantVoltage, Diode, Ground
from modelica_like import Assembly, simulate

G, V_F, R = 1e-3, 0.8, 5e-3


@pytest.mark.parametrize(("over", "current"), [(-1e-6, G * (V_F - 1e-6)), (1e-6, G * V_F + 1e-6 / R)])
def test_the_current_at_the_forward_voltage(over: float, current: float) -> None:
    parts = {"source": ConstantVoltage(V=V_F + over), "diode": Diode(V_f=V_F, R=R, G=G), "earth": Ground()}
    wires = {"a": ("source.p", "diode.p"), "b": ("source.n", "diode.n", "earth.p")}
    run = simulate(Assembly("d", parts=parts, connect=wires), 0.1)
    assert run.final["diode.i"] == pytest.approx(current, rel=1e-9)


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
def test_a_capacitor_that_is_charged_through_a_diode(solver: str, rtol: float) -> None:
    """Both plates approach V_f exponentially; the leakage takes them through it, whatever the tolerance."""
    parts = {
        "a": Capacitor(C=0.01, v=9.4), "diode": Diode(V_f=V_F, R=R), "b": Capacitor(C=0.01, v=7.4), "earth": Ground(),
    }  # fmt: skip
    wires = {"p": ("a.p", "diode.p"), "n": ("diode.n", "b.p"), "g": ("a.n", "b.n", "earth.p")}
    run = simulate(Assembly("d", parts=parts, connect=wires), 0.3, solver=solver, rtol=rtol)
    assert [event.after for event in run.events if event.time > 0] == ["blocking"]
    # 1.2 V of excess are shared; the leakage of G·V_f flows in both states from then on. When it blocks hangs on 4 µV:
    # where that is less than the tolerance, nothing but the tolerance can be asked for.
    hidden = solver == "idas" and rtol > 1e-7
    expected = 9.4 - 0.6 - 1e-5 * V_F * 0.3 / 0.01
    assert run.final["a.v"] == pytest.approx(expected, abs=2 * rtol * 9.4 if hidden else 2e-6)
