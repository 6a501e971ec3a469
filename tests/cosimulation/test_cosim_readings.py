"""Readings of co-simulations: the closed form of two masses, whatever the step; what does not settle is refused."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar
from two_masses import closed_form

from modelica_like.errors import MissingValue, UnknownName
from modelica_like.fmi.cosimulation.run import cosim
from modelica_like.fmi.cosimulation.split import Split
from modelica_like.runs.results import SETTLED

END = 0.2


def value(name: str, t: float) -> float:
    return float(closed_form(np.array([t]))[name][0])


def lowest(name: str, sign: float) -> float:
    """The lowest value of a signal times a sign, at the best of many times, made precise."""
    times = np.linspace(0, END, 20001)
    begin = times[np.argmin(sign * closed_form(times)[name])]
    near = max(begin - 1e-5, 0), min(begin + 1e-5, END)
    found = minimize_scalar(lambda t: sign * value(name, t), bounds=near, method="bounded", options={"xatol": 1e-12})
    return float(found.fun)


def expected() -> dict[str, tuple[float, float]]:
    """Values of readings, and the amounts that their errors are compared with."""
    least, most, fastest = lowest("shaft.tau", 1), -lowest("shaft.tau", -1), -lowest("J2.w", -1)
    work, _ = quad(lambda t: -value("shaft.tau", t) * value("J2.w", t), 0, END, limit=500, epsabs=1e-12)
    mean, square = (quad(lambda t, n=n: value("shaft.tau", t) ** n, 0, END, limit=500)[0] / END for n in (1, 2))
    return {
        "peak(shaft.tau)": (-least, -least),
        "max(shaft.tau)": (most, -least),
        "mean(shaft.tau)": (mean, -least),
        "rms(shaft.tau)": (square**0.5, -least),
        "at(J2.w, 0.1 s)": (value("J2.w", 0.1), fastest),
        "first(J2.w > 5 rad/s)": (brentq(lambda t: value("J2.w", t) - 5, 0.05, 0.15), END),
        "integral(-shaft.tau*J2.w)": (work, -least * fastest * END),
        "J2.w": (value("J2.w", END), fastest),
    }


@pytest.mark.slow
@pytest.mark.parametrize("options", [{"step": 5e-3, "master": "gauss-seidel"}, {"tolerance": 1e-4, "interval": 0.01}])
def test_closed_forms_of_two_masses(oscillator: Split, options: dict[str, Any]) -> None:
    """The last change is the error of what is of the second order; three of them are above that of any order."""
    forms = expected()
    run = cosim(oscillator.system, until=END, fmu_tolerance=1e-9, readings=[*forms], **options)
    for name, (true, size) in forms.items():
        assert run.readings[name].change <= SETTLED * size
        assert run.readings[name] == pytest.approx(true, abs=3 * SETTLED * size), name
    assert str(run.read("peak(shaft.tau)")[0].unit) == "N.m"
    plain = cosim(oscillator.system, until=END, fmu_tolerance=1e-9, **options)
    np.testing.assert_array_equal(run["shaft.tau"], plain["shaft.tau"])


def test_what_does_not_settle_is_refused(oscillator: Split) -> None:
    """The energy that a coupling makes goes down with its tolerance, and so it has no last value."""
    with pytest.raises(MissingValue, match=r"still changes with the tolerance 2\.5e-12"):
        cosim(oscillator.system, until=2e-4, tolerance=1e-11, readings=["shaft.residual_energy"])
    with pytest.raises(UnknownName, match=r"J2\.x"):
        cosim(oscillator.system, until=0.02, readings=["max(J2.x)"])
