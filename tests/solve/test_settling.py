"""Where drives settle that run from their guesses, near which Newton's method finds nothing, and which never do."""

import numpy as np
import pytest

from components import Brake, ConstantTorque, Damper, Fixed, Inertia
from modelica_like import Assembly, build
from modelica_like.errors import InitializationError
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Mode,
    Parameter,
    Variable,
    der,
    guess,
    param,
    sqrt,
    var,
)
from modelica_like.native.start import initialize


def run_down(drive: Component) -> dict[str, float]:
    """States, implicit unknowns and modes of a steady start."""
    model = build(drive)
    point = initialize(model, start="steady")
    modes = {one.path: point.d[k] for k, one in enumerate(model.flat_discretes)}
    return dict(zip((*model.states, *model.implicit), (*point.x, *point.z), strict=True)) | modes


def refuses(drive: Component) -> bool:
    with pytest.raises(InitializationError, match="No steady state was found"):
        run_down(drive)
    return True


class Tank(Component):
    """x falls to 4, where what flows out is what flows in; z + z³ = x."""

    x: Variable = var("1", "level")
    z: Variable = var("1", "root", guess=1.0)
    w: Variable = var("1", "integral of nothing that counts", default=7.0)
    T: Parameter = param("s", "time", default=1.0)
    q: Parameter = param("1", "what flows in", default=2.0)

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.q - sqrt(self.x)
        yield self.z + self.z**3 == self.x
        yield self.T * der(self.w) == self.z


@pytest.mark.parametrize("T", [1e-6, 1.0, 1e3])
@pytest.mark.parametrize("begin", [100.0, 1e-3])
def test_a_tank_settles_at_its_level(T: float, begin: float) -> None:
    found = run_down(Tank(x=guess(begin), T=T))
    assert found["x"] == pytest.approx(4.0, rel=1e-6)
    (root,) = [one.real for one in np.roots([1, 0, 1, -found["x"]]) if abs(one.imag) < 1e-9]
    assert found.get("z", root) == pytest.approx(root, rel=1e-8)
    assert found["w"] == 7.0  # on which nothing depends


def test_what_has_no_number_does_not_settle() -> None:
    assert refuses(Tank(x=guess(-1.0)))


class Rootless(Component):
    """z⁴ + z + 1 is positive for every number."""

    x: Variable = var("1", "level", default=1.0)
    z: Variable = var("1", "root", guess=1.0)
    T: Parameter = param("s", "time", default=1.0)

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.z - self.x
        yield self.z**4 + self.z + 1 == 0


def test_without_a_solution_at_its_begin_nothing_settles() -> None:
    assert refuses(Rootless())


class Relay(Component):
    """Goes up below 1, and down above 2, for ever; or rests at 3 if it may go on."""

    x: Variable = var("1", "place", default=0.0)
    T: Parameter = param("s", "time", default=1.0)
    top: Parameter = param("1", "where it turns", default=2.0)
    way = Mode("up", "down")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.way.choose(up=3 - self.x, down=-self.x)

    def events(self) -> Events:
        yield self.way.go("up", "down", when=self.x > self.top, reset={self.x: self.top})
        yield self.way.go("down", "up", when=self.x < 1)


def test_a_relay_settles_only_if_it_stops_switching() -> None:
    assert refuses(Relay())
    found = run_down(Relay(top=5.0))
    assert found["x"] == pytest.approx(3.0, abs=1e-6)
    assert found["way"] == 0


class Latch(Component):
    """Goes up to 2, falls back to 1.5, and stays there."""

    x: Variable = var("1", "place", default=0.0)
    y: Variable = var("1", "follows", default=0.0)
    T: Parameter = param("s", "time", default=1.0)
    way = Mode("up", "caught")

    def equations(self) -> Equations:
        yield self.T * der(self.x) == self.way.choose(up=3 - self.x, caught=0)
        yield self.T * der(self.y) == self.x - self.y

    def events(self) -> Events:
        yield self.way.go("up", "caught", when=self.x > 2, reset={self.x: 1.5})


def test_transitions_fire_with_the_states_they_reset() -> None:
    found = run_down(Latch())
    assert (found["x"], found["y"], found["way"]) == (1.5, pytest.approx(1.5, rel=1e-12), 1)


@pytest.mark.parametrize("begin", [-30.0, 0.0, 30.0])
@pytest.mark.parametrize(("push", "speed"), [(4.0, 0.0), (-4.0, 0.0), (12.0, 1.0), (-12.0, -1.0)])
def test_a_brake_holds_or_slips(begin: float, push: float, speed: float) -> None:
    """It bears 10 N.m; what is left turns the shaft against 2 N.m s/rad."""
    parts: dict[str, Component] = {
        "push": ConstantTorque(tau_constant=push), "wheel": Inertia(J=1.0, w=guess(begin)),
        "brake": Brake(capacity=10.0), "oil": Damper(d=2.0), "wall": Fixed(),
    }  # fmt: skip
    found = run_down(Assembly("d", parts=parts, series={"s": list(parts)}))
    (w,) = (value for name, value in found.items() if name.endswith((".w", ".w_rel")))
    assert w == pytest.approx(speed, abs=1e-12)


def test_large_drives_settle() -> None:
    """Their slopes are sparse: hundreds of tanks find the level of a single one."""
    tanks = {f"t{k}": Tank(x=guess(100.0), w=0.0) for k in range(300)}
    assert run_down(Assembly("tanks", parts=tanks))["t299.x"] == pytest.approx(4.0, rel=1e-6)
