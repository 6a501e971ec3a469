"""Ideal elements: combinations of modes that are impossible, and wrong declarations."""

import pytest

from components import Capacitor, ConstantVoltage, Ground, IdealSwitch, Inductor, Pulse, Resistor
from components.electrical import TwoPins
from modelica_like import Assembly, simulate
from modelica_like.errors import LanguageError, NoValidModes
from modelica_like.flatten import flatten
from modelica_like.language import Equations, Mode


def switched(close: float, load: TwoPins) -> Assembly:
    """24 V on a load in series with a resistor, by a switch that is closed for 1 ms."""
    parts = {"U": ConstantVoltage(V=24.0), "S": IdealSwitch(), "load": load, "R": Resistor(R=5.0), "earth": Ground()}
    parts["clock"] = Pulse(period=1.0, width=1e-3, start_time=close)
    connect = {"s": ["clock.y", "S.closed"], "1": ["U.p", "S.p"], "2": ["S.n", "load.p"], "0": ["U.n", "earth.p"]}
    if isinstance(load, Capacitor):
        return Assembly("circuit", parts=parts, connect=connect | {"0": [*connect["0"], "load.n", "R.n"],
                                                                   "2": [*connect["2"], "R.p"]})  # fmt: skip
    return Assembly("circuit", parts=parts, connect=connect | {"3": ["load.n", "R.p"], "0": [*connect["0"], "R.n"]})


class Wired(TwoPins):
    """Closed or open, but the equation of the open one is missing."""

    contact = Mode("open", "closed", ideal={"open": "i", "closed": "v"})

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.contact.choose(open=self.v, closed=self.v) == 0


CASES = {
    "a switch interrupts the current of an inductor": (
        NoValidModes,
        lambda: simulate(switched(0.0, Inductor(L=1e-3, i=0.0)), 0.01),
        "At t = 0.001 s no combination of modes is valid: with S off, 4.768 A are left over.\n"
        "The elements are ideal, and states change continuously; here a current would stop at once.\n"
        "Give the current another path (a freewheeling diode), or put a resistance in series with a capacitor.",
    ),
    "a switch connects a capacitor to a source": (
        NoValidModes,
        lambda: simulate(switched(0.0, Capacitor(C=1e-3, v=4.0)), 0.01),
        "At t = 0 s no combination of modes is valid: with S on, 20 V are left over.\n"
        "The elements are ideal, and states change continuously; here voltages would jump.\n"
        "Give the current another path (a freewheeling diode), or put a resistance in series with a capacitor.",
    ),
    "an ideal mode without its equation": (
        LanguageError,
        lambda: flatten(Wired()),
        "Wired.contact is ideal, but no equation sets i and v to zero.\n"
        "Write contact.choose(open=self.i, closed=self.v) == 0.",
    ),
    "an ideal mode without a variable": (
        LanguageError,
        lambda: type("Half", (TwoPins,), {"contact": Mode("open", "closed", ideal={"closed": "v"})}),
        "Half.contact needs two modes with one zero variable each to be ideal.",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_message(check_message, name):
    check_message(*CASES[name])


def test_the_compiled_runtime_tells_the_same():
    with pytest.raises(NoValidModes, match=r"At t = 0.001 s no combination of modes is valid: S would take 4.768"):
        simulate(switched(0.0, Inductor(L=1e-3, i=0.0)), 0.01, solver="native")
