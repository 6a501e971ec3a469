"""Gradients through impacts and through reactions that several elements share."""

import numpy as np
import pytest

from components import Brake, Clutch, ConstantTorque, Fixed, Freewheel, IdealGear, Inertia, Ramp, Torque, UniversalJoint
from components.interfaces import CompliantWithRelativeStates
from modelica_like import Options, build, sensitivities, simulate
from modelica_like.language import Assembly, Equations, Events, Hold, Mode, Parameter, der, param

METHODS = ("forward", "adjoint")
TIGHT = Options(rtol=1e-11, atol=1e-13)


class DogClutch(CompliantWithRelativeStates):
    """Somebody else's component, with names of its own."""

    begin: Parameter = param("s", "time at which it engages")
    bounce: Parameter = param("1", "restitution", default=0.0)
    teeth = Mode("waiting", "open", "engaged", holds={"engaged": Hold("w_rel", reaction="tau", restitution="bounce")})

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.teeth.choose(engaged=der(self.w_rel), otherwise=self.tau) == 0

    def events(self) -> Events:
        yield self.teeth.initially("open", when=self.time >= self.begin)
        yield self.teeth.go("waiting", "engaged", at=self.begin)


def engaged(bounce: float = 0.0) -> Assembly:
    parts = {
        "push": ConstantTorque(tau_constant=2.0),
        "a": Inertia(J=2.0, w=5.0, phi=0.0),
        "dog": DogClutch(begin=0.4, bounce=bounce, phi_rel=0.0),
        "b": Inertia(J=3.0, w=1.0),
    }
    return Assembly("engaged", parts=parts, series={"shaft": [*parts]})


@pytest.mark.parametrize("method", METHODS)
def test_a_dog_clutch_conserves_momentum(method: str) -> None:
    names = ["a.J", "b.J", "push.tau_constant", "dog.begin"]
    result = sensitivities(engaged(), ["b.w", "b.phi", "dog.lock_time"], names, until=1.0, method=method)
    a, b, tau, begin, t = 2.0, 3.0, 2.0, 0.4, 1.0
    total = 5.0 * a + b
    w = (total + tau * t) / (a + b)
    left = t - begin
    # From `begin` on the turned angle is (total·left + tau/2·(t² - begin²))/(a + b).
    turned = (total * left + tau / 2 * (t**2 - begin**2)) / (a + b)
    assert [one.value for one in result.outputs] == pytest.approx([w, begin + turned, begin], rel=1e-9)
    expected = [
        [(5.0 - w) / (a + b), (1.0 - w) / (a + b), t / (a + b), 0.0],
        [(5.0 * left - turned) / (a + b), (left - turned) / (a + b), (t**2 - begin**2) / 2 / (a + b),
         1.0 - (total + tau * begin) / (a + b)],
        [0.0, 0.0, 0.0, 1.0],
    ]  # fmt: skip
    assert result.derivatives == pytest.approx(np.array(expected), rel=1e-8, abs=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_a_freewheel_whose_output_lags(method: str) -> None:
    parts = {"a": Inertia(J=2.0, w=5.0, phi=0.0), "wheel": Freewheel(), "b": Inertia(J=3.0, w=1.0)}
    drive = Assembly("lagging", parts=parts, series={"shaft": [*parts]})
    result = sensitivities(drive, ["a.w", "b.w"], ["a.J", "b.J"], until=1.0, method=method)
    assert result.derivatives == pytest.approx(np.array([[0.48, -0.32]] * 2), rel=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_clutches_side_by_side_break_away_together(method: str) -> None:
    """They hold 4 N.m of the 2/3 of the ramp that the wheel behind them takes, each in proportion."""
    parts = {
        "ramp": Ramp(height=8.0, duration=1.0),
        "push": Torque(),
        "a": Inertia(J=1.0, w=0.0, phi=0.0),
        "c": Clutch(capacity=1.0),
        "b": Inertia(J=2.0, w=0.0),
        "d": Clutch(capacity=3.0),
    }
    joints = {"l": ["a.flange_b", "d.flange_a"], "r": ["b.flange_a", "d.flange_b"], "t": ["ramp.y", "push.tau"]}
    drive = Assembly("rising", parts=parts, series={"shaft": ["push", "a", "c", "b"]}, connect=joints)
    names = ["c.capacity", "d.capacity", "ramp.height", "a.J"]
    result = sensitivities(
        drive, ["c.unlock_time", "d.unlock_time", "at(c.tau, 0.3 s)"], names, until=0.9, method=method
    )
    shared = -8.0 * 0.3 * 2 / 3
    expected = [
        [0.75 / 4, 0.75 / 4, -0.75 / 8, 0.75 / 3],
        [0.75 / 4, 0.75 / 4, -0.75 / 8, 0.75 / 3],
        [shared * 3 / 16, -shared / 16, shared / 4 / 8, -shared / 4 / 3],
    ]
    assert [one.value for one in result.outputs] == pytest.approx([0.75, 0.75, shared / 4], rel=1e-9)
    assert result.derivatives == pytest.approx(np.array(expected), rel=1e-8)


# -- against differences ---------------------------------------------------------------------------------------------


def braked() -> Assembly:
    """A freewheel strikes a shaft that a brake holds: the brake is knocked loose."""
    parts = {
        "push": ConstantTorque(tau_constant=0.5),
        "a": Inertia(J=1.0, w=5.0, phi=0.0),
        "wheel": Freewheel(),
        "b": Inertia(J=2.0, w=0.0),
        "brake": Brake(capacity=1.0),
    }
    fixed = {"ground": Fixed()}
    joints = {"g": ["ground.flange", "brake.support"]}
    return Assembly("braked", parts=parts | fixed, series={"shaft": [*parts]}, connect=joints)


def loop() -> Assembly:
    """A gear and a clutch side by side, and a brake on either side: what sticks depends on the ratio."""
    parts = {
        "push": ConstantTorque(tau_constant=3.0),
        "a": Inertia(J=1.0, w=2.0, phi=0.0),
        "gear": IdealGear(ratio=2.0),
        "b": Inertia(J=0.5),
        "clutch": Clutch(capacity=20.0),
        "left": Brake(capacity=4.0),
        "right": Brake(capacity=6.0),
        "ground": Fixed(),
    }
    joints = {
        "left": ["left.flange_a", "a.flange_a"],
        "right": ["right.flange_a", "b.flange_b"],
        "ground": ["ground.flange", "left.support", "right.support", "gear.support"],
    }
    lines = {"top": ["push", "a", "gear", "b"], "below": ["a", "clutch", "b"]}
    drive = Assembly("loop", parts=parts, series=lines, connect=joints)
    drive.simulate.update(start="rest")
    return drive


def joint() -> Assembly:
    """An impact behind a universal joint: what it does depends on the angle at which it happens."""
    parts = {
        "push": ConstantTorque(tau_constant=2.0),
        "a": Inertia(J=2.0, w=5.0, phi=0.3),
        "joint": UniversalJoint(beta=0.9),
        "m": Inertia(J=0.7),
        "dog": DogClutch(begin=0.4, phi_rel=0.0),
        "b": Inertia(J=3.0, w=1.0),
    }
    return Assembly("joint", parts=parts, series={"shaft": [*parts]})


CASES = {
    "knocked loose": (braked, ("a.w", "b.phi"), ("a.J", "b.J", "push.tau_constant", "brake.capacity"), 1.0),
    "loop": (loop, ("left.tau", "right.tau", "clutch.tau", "left.lock_time"),
             ("a.J", "gear.ratio", "push.tau_constant", "left.capacity", "right.capacity"), 1.0),
    "joint": (joint, ("a.w", "b.phi"), ("a.J", "b.J", "m.J", "joint.beta", "dog.begin"), 0.8),
    "bounce": (lambda: engaged(0.5), ("a.w", "b.phi"), ("a.J", "b.J", "dog.begin", "dog.bounce"), 0.8),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_derivatives_equal_extrapolated_differences(case: str) -> None:
    make, outputs, names, until = CASES[case]
    model = build(make())
    run = simulate(model, until, start=model.settings.get("start", "given"), options=TIGHT)
    forward, adjoint = (sensitivities(run, outputs, names, method=method).derivatives for method in METHODS)
    values = np.array([model.p[model.parameter_position[name]] for name in names])
    weights = values * np.cos(1.0 + np.arange(len(values)))

    def ends(scale: float) -> np.ndarray:
        moved = model.with_parameters(dict(zip(names, values + scale * weights, strict=True)))
        result = sensitivities(moved, outputs, names[:1], until=until, options=TIGHT, precision=1e-11)
        return np.array([one.value for one in result.outputs])

    coarse, fine = ((ends(h) - ends(-h)) / (2 * h) for h in (4e-4, 2e-4))
    scale = np.max(np.abs(forward * weights), axis=1)
    assert np.max(np.abs(forward @ weights - (4 * fine - coarse) / 3) / scale) < 1e-6
    assert np.max(np.abs((adjoint - forward) * weights) / scale[:, None]) < 1e-8
