"""Output derivatives up to the third, against symbolic differentiation and closed forms."""

from typing import Any

import casadi as ca
import pytest
from fmpy.fmi1 import FMICallException

from components import Inertia, SpringDamper, Torque
from modelica_like.language import (
    Component,
    Equations,
    Input,
    Parameter,
    Variable,
    connect,
    der,
    param,
    series,
    signal_in,
    var,
)

RATE, START = 0.3, 0.4
UNARY = [
    "exp", "log", "sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "atanh", "erf",
    "log1p", "expm1", "fabs", "sign", "floor",
]  # fmt: skip
FORMS: dict[str, Any] = {
    **{name: getattr(ca, name) for name in UNARY},
    "product": lambda x: x * ca.sin(x),
    "quotient": lambda x: ca.cos(x) / (1 + x * x),
    "inverse": lambda x: 1 / x - 2 * x,
    "acosh": lambda x: ca.acosh(1 + x),
    "constant power": lambda x: x**2.5,
    "power": lambda x: x ** (1 + x),
    "atan2": lambda x: ca.atan2(ca.sin(x), 1 + x),
    "hypot": lambda x: ca.hypot(x, ca.exp(x)),
    "fmod": lambda x: ca.fmod(x * x, 0.1),
    "remainder": lambda x: ca.remainder(x * x, 0.1),
    "branches": lambda x: ca.if_else(x < 0, ca.log(x - 9), ca.fmin(x**3, 5) + ca.fmax(ca.exp(-x), x)),
    "copysign": lambda x: ca.copysign(x * x, -x),
}


class Everything(Component):
    """All operations of a moving value."""

    rate: Parameter = param("1/s", default=RATE)
    x: Variable = var("1", default=START)
    z: Variable = var("1")
    for _k in range(len(FORMS)):
        vars()[f"y{_k}"] = var("1")

    def equations(self) -> Equations:
        yield der(self.x) == self.rate
        yield self.z**3 + self.z == self.x
        for k, form in enumerate(FORMS.values()):
            yield getattr(self, f"y{k}") == form(self.x)


EVERYTHING = Everything()


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_every_operation(exported, version):
    case = exported(EVERYTHING, version)
    fmu = case.started(until=1.0)
    rates = fmu.getRealOutputDerivatives if version == "2.0" else fmu.getOutputDerivatives
    x = ca.SX.sym("x")
    for k, (name, form) in enumerate(FORMS.items()):
        exact, expression = [], form(x)
        for order in (1, 2, 3):
            expression = ca.gradient(expression, x)
            exact.append(float(ca.Function("f", [x], [expression])(START)) * RATE**order)
        found = [rates([case.ref(f"y{k}")], [order])[0] for order in (1, 2, 3)]
        assert found == pytest.approx(exact, rel=1e-12, abs=1e-12), name


def test_implicit_unknowns_follow(exported):
    case = exported(EVERYTHING)
    fmu = case.started(until=1.0)
    (z,) = fmu.getReal([case.ref("z")])
    d = 3 * z**2 + 1
    exact = [RATE / d, -6 * z / d**3 * RATE**2, (108 * z**2 / d**5 - 6 / d**4) * RATE**3]
    assert fmu.getRealOutputDerivatives([case.ref("z")] * 3, [1, 2, 3]) == pytest.approx(exact, rel=1e-12)


class Swinging(Component):
    """J1 phi1'' = tau + c x + d x', J2 phi2'' = -c x - d x', x = phi2 - phi1, with tau on a straight line."""

    tau: Input = signal_in("N.m", "torque")
    source, one, two = Torque(), Inertia(J=2.0, phi=0.0, w=3.0), Inertia(J=5.0)
    shaft = SpringDamper(c=400.0, d=7.0, phi_rel=0.1, w_rel=-2.0)

    def equations(self) -> Equations:
        yield from series(self.source, self.one, self.shaft, self.two)
        yield connect(self.tau, self.source.tau)


SWINGING = Swinging()


def test_closed_form_of_two_inertias(exported):
    case = exported(SWINGING)
    fmu = case.started(until=1.0, tau=6.0)
    fmu.setRealInputDerivatives([case.ref("tau")], [1], [4.0])
    twist = [0.1, -2.0]
    torque = [6.0, 4.0]
    for k in range(2):
        pull = 400.0 * twist[k] + 7.0 * twist[k + 1]
        twist.append(-pull / 5 - (torque[k] + pull) / 2)
    angle = [(torque[k] + 400.0 * twist[k] + 7.0 * twist[k + 1]) / 2 for k in range(2)]
    found = fmu.getRealOutputDerivatives([case.ref("shaft.phi_rel")] * 3, [1, 2, 3])
    assert found == pytest.approx(twist[1:], rel=1e-12)
    assert fmu.getRealOutputDerivatives([case.ref("one.phi")] * 3, [1, 2, 3]) == pytest.approx([3.0, *angle], rel=1e-12)
    for order in (0, 4, -1):
        with pytest.raises(FMICallException):
            fmu.getRealOutputDerivatives([case.ref("one.phi")], [order])
