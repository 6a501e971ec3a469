"""The run-time of FMUs does what Python does: starts, holds, sharing and impacts."""

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from components import (
    Brake,
    Clutch,
    ConstantForce,
    ConstantTorque,
    Fixed,
    Freewheel,
    IdealGear,
    Inertia,
    Mass,
    MassWithStopAndFriction,
    TranslationalSpring,
)
from components.interfaces import LinearCompliantWithRelativeStates
from modelica_like import simulate
from modelica_like.language import Assembly, Component, Equations, Events, Hold, Mode, Parameter, all_of, der, param
from modelica_like.native.start import initialize
from modelica_like.netlist import load
from modelica_like.solve.initialize import call

ROOT = Path(__file__).parents[2]


def netlists() -> list[str]:
    """Examples with a mode that holds something."""
    spec = importlib.util.spec_from_file_location("importers_page", ROOT / "docs" / "importers.py")
    assert spec is not None
    assert spec.loader is not None
    page: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(page)
    return [f"{name}.toml" for name in page.drives() if holds_something(load(ROOT / "examples" / f"{name}.toml"))]


def holds_something(drive: Component) -> bool:
    return any(mode.holds for part in drive.walk() for mode in part.modes.values())


def overtaken():
    """A freewheel whose output lags: both go on with their common momentum, then a torque parts them again."""
    parts = {
        "a": Inertia(J=1.0, w=5.0, phi=0.0),
        "wheel": Freewheel(),
        "b": Inertia(J=3.0, w=0.0),
        "push": ConstantTorque(tau_constant=-2.0),
    }
    drive = Assembly(
        "overtaken", parts=parts, series={"shaft": ["a", "wheel", "b"]}, connect={"c": ["push.flange", "a.flange_a"]}
    )
    drive.simulate.update(until=1.0)
    return drive


def caught():
    """Freewheels in series that lock one after the other, with an impact each."""
    parts = {
        "a": Inertia(J=1.0, w=1.0, phi=0.0),
        "first": Freewheel(),
        "b": Inertia(J=1.0, w=4.0),
        "second": Freewheel(),
        "c": Inertia(J=2.0, w=5.0),
        "push": ConstantTorque(tau_constant=6.0),
    }
    joints = {"push": ["push.flange", "a.flange_a"]}
    drive = Assembly("caught", parts=parts, series={"shaft": ["a", "first", "b", "second", "c"]}, connect=joints)
    drive.simulate.update(until=2.0)
    return drive


def side_by_side():
    """Two clutches that hold the same motion and share the torque 1 : 3."""
    parts = {
        "push": ConstantTorque(tau_constant=1.0),
        "a": Inertia(J=1.0, w=1.0, phi=0.0),
        "c": Clutch(capacity=1.0),
        "d": Clutch(capacity=3.0),
        "b": Inertia(J=2.0, w=0.0),
    }
    lines = {"shaft": ["push", "a", "c", "b"]}
    joints = {"l": ["a.flange_b", "d.flange_a"], "r": ["b.flange_a", "d.flange_b"]}
    drive = Assembly("side_by_side", parts=parts, series=lines, connect=joints)
    drive.simulate.update(until=1.0, start="rest")
    return drive


def closed_loop():
    """A clutch and a gear with a brake on either side: a loop in which everything comes to stick."""
    parts = {
        "push": ConstantTorque(tau_constant=3.0),
        "a": Inertia(J=1.0, w=2.0, phi=0.0),
        "gear": IdealGear(ratio=2.0),
        "clutch": Clutch(capacity=20.0),
        "b": Inertia(J=0.5),
        "left": Brake(capacity=4.0),
        "right": Brake(capacity=6.0),
        "housing": Fixed(),
    }
    lines = {"top": ["push", "a", "gear", "b"], "below": ["a", "clutch", "b"]}
    joints = {
        "left": ["left.flange_a", "a.flange_a"],
        "right": ["right.flange_a", "b.flange_b"],
        "ground": ["housing.flange", "left.support", "right.support", "gear.support"],
    }
    drive = Assembly("closed_loop", parts=parts, series=lines, connect=joints)
    drive.simulate.update(until=2.0, start="rest")
    return drive


def at_the_stop():
    """A mass meets its stops and leaves them; another one goes on behind a spring."""
    parts = {
        "stopped": MassWithStopAndFriction(m=1.0, smin=-1.0, smax=1.0, F_Coulomb=0.5, s=0.0, v=3.0),
        "spring": TranslationalSpring(c=40.0, s_rel0=0.0),
        "other": Mass(m=2.0, v=3.0, s=0.0),
    }
    drive = Assembly("at_the_stop", parts=parts, series={"line": [*parts]})
    drive.simulate.update(until=2.5)
    return drive


class Buffer(LinearCompliantWithRelativeStates):
    """Two bodies that part again with some of the speed at which they meet."""

    e: Parameter = param("1", "restitution", default=0.6)
    contact = Mode("apart", "meeting", holds={"meeting": Hold("v_rel", reaction="f", restitution="e")})

    def equations(self) -> Equations:
        yield from super().equations()
        yield self.contact.choose(apart=self.f, meeting=der(self.v_rel)) == 0

    def events(self) -> Events:
        yield self.contact.go("apart", "meeting", when=all_of(self.s_rel < 0, self.v_rel < 0))


def bouncing():
    """A force drives a mass against another one, which it strikes three times."""
    parts = {
        "push": ConstantForce(f_constant=4.0),
        "a": Mass(m=1.0, v=1.0, s=0.0),
        "buffer": Buffer(),
        "b": Mass(m=2.0, v=0.0, s=0.5),
    }
    drive = Assembly("bouncing", parts=parts, series={"line": [*parts]})
    drive.simulate.update(until=1.5)
    return drive


DRIVES = (overtaken, caught, side_by_side, closed_loop, at_the_stop, bouncing)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize("make", DRIVES)
def test_a_run_is_that_of_python(exported, make, version):
    drive = make()
    until = drive.simulate["until"]
    case = exported(drive, version)
    run = simulate(case.model, until, rtol=1e-10, atol=1e-12, start=drive.simulate.get("start", "given"))
    told: list[str] = []
    tell = {"2.0": "logger", "3.0": "logMessage"}[version]
    fmu = case.instance(**({} if version == "2.0" else {tell: lambda *a: told.append(a[-1].decode())}))
    if version == "3.0":
        fmu.setDebugLogging(True, ["logEvents"])
    case.initialize(fmu, until=until, tolerance=1e-9)
    fmu.doStep(0.0, until)
    names = [one.name for one in case.face.variables if one.slot[0] in ("state", "variable")]
    read = (fmu.getReal if version == "2.0" else fmu.getFloat64)([case.ref(name) for name in names])
    fmu.freeInstance()
    found = dict(zip(names, read, strict=True))
    assert found == pytest.approx({name: run.final[name] for name in names}, rel=1e-6, abs=1e-6)
    if version == "3.0":
        events = [text.partition(" s: ")[2] for text in told]
        assert events == [f"{e.mode}: {e.before} -> {e.after}" for e in run.events]


def test_an_impact_tells_the_importer_that_states_have_jumped(exported):
    case = exported(overtaken())
    fmu = case.started("me")
    _, _, _, jumped, *_ = fmu.newDiscreteStates()
    assert jumped
    assert fmu.getReal([case.ref("a.w"), case.ref("b.w")]) == pytest.approx([1.25, 1.25], rel=1e-12)
    _, _, _, jumped, *_ = fmu.newDiscreteStates()
    assert not jumped


@pytest.mark.slow
@pytest.mark.parametrize("netlist", netlists())
def test_every_example_starts_as_in_python(exported, netlist):
    """States, modes and, by the reactions, what elements share."""
    case = exported(netlist)
    model = case.model
    assert model.held.motions
    point = initialize(model, start=model.settings.get("start", "given"))
    values = call(model, model.equations.variables, point)
    fmu = case.started("me")
    modes = [one for one in case.face.variables if one.modes]
    assert fmu.getInteger([one.reference for one in modes]) == [int(point.d[one.slot[1]]) for one in modes]
    variables = [one for one in case.face.variables if one.slot[0] == "variable"]
    assert case.states(fmu) == pytest.approx(
        [x for name, x in zip(model.states, point.x, strict=True) if name in case.face.by_name], rel=1e-9, abs=1e-9
    )
    read = np.array(fmu.getReal([one.reference for one in variables]))
    assert read == pytest.approx(values[[one.slot[1] for one in variables]], rel=1e-8, abs=1e-8)
    fmu.freeInstance()
