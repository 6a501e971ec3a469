"""Model Exchange in an importer like most written in C: SUNDIALS CVODE with roots, restarted only when told to."""

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sksundae.cvode as sundae

from modelica_like import simulate
from modelica_like.language import (
    Component,
    Discrete,
    Equations,
    Events,
    Parameter,
    Variable,
    der,
    if_,
    integer,
    param,
    pre,
    var,
    when,
)

DRIVES = [
    "machine_table_direct", "machine_table_geared", "machine_tool_startup", "ravigneaux", "lepelletier", "dc_bench",
    "stick_slip", "two_mass", "msl/rotational/CoupledClutches", "msl/rotational/LossyGearDemo1",
    "msl/rotational/Backlash", "msl/rotational/Friction", "msl/rotational/OneWayClutch",
    "msl/rotational/SimpleGearShift", "msl/translational/Friction", "../tests/system/new_drives/winch",
]  # fmt: skip
POINTS = 200
RTOL = 1e-8
AGREEMENT = 1e-4
ROOT = 2  # CV_ROOT_RETURN
BESIDE = 1e-6  # s; what jumps at an event is compared further away from it


class Importer:
    """An instance of FMI 2.0 under CVODE."""

    def __init__(self, fmu: Any, states: int, guards: int) -> None:
        self.fmu, self.states, self.guards = fmu, states, guards
        self.time = 0.0
        self.update()
        self.nominals = self.get("fmi2GetNominalsOfContinuousStates", states)
        self.restart()

    def get(self, name: str, count: int) -> Any:
        values = (ctypes.c_double * count)()
        getattr(self.fmu, name)(self.fmu.component, values, count)
        return np.array(values)

    def move(self, time: float, x: Any) -> None:
        self.fmu.setTime(time)
        self.fmu.fmi2SetContinuousStates(self.fmu.component, (ctypes.c_double * len(x))(*x), len(x))

    def rates(self, time: float, x: Any, result: Any) -> None:
        self.move(time, x)
        result[:] = self.get("fmi2GetDerivatives", self.states)

    def indicators(self, time: float, x: Any, result: Any) -> None:
        self.move(time, x)
        result[:] = self.get("fmi2GetEventIndicators", self.guards)

    def update(self) -> bool:
        """Handle the events of this instant; return whether the FMU says that its states have changed."""
        _, _, _, changed, defined, moment = self.fmu.newDiscreteStates()
        self.moment = moment if defined else np.inf
        self.fmu.enterContinuousTimeMode()
        # A root finder sees what becomes positive, not what is.
        indicators = self.get("fmi2GetEventIndicators", self.guards)
        assert np.all(indicators < 0.0), f"t = {self.time:.12g} s: {indicators}"
        return changed

    def restart(self) -> None:
        roots = {"eventsfn": lambda t, x, g: self.indicators(t, x, g), "num_events": self.guards} if self.guards else {}
        weights = RTOL / 100 * self.nominals
        self.solver = sundae.CVODE(self.rates, rtol=RTOL, atol=weights, max_num_steps=100_000, **roots)
        self.solver.init_step(self.time, self.get("fmi2GetContinuousStates", self.states))

    def go(self, until: float) -> None:
        while self.time < until:
            target = min(until, self.moment)
            found = self.solver.step(target, tstop=target) if target > self.time else None
            if found is not None:
                assert found.success, f"t = {self.time:.12g} s: {found.message}"
                self.time = float(found.t)
                self.move(self.time, found.y)
            due = self.time >= self.moment or (found is not None and found.status == ROOT)
            if self.fmu.completedIntegratorStep()[0] or due:
                self.fmu.enterEventMode()
                if self.update():
                    self.restart()


@pytest.mark.parametrize("netlist", DRIVES)
def test_agrees_with_idas(exported: Callable[..., Any], netlist: str) -> None:
    case = exported(f"{netlist}.toml")
    model = case.model
    truth = simulate(model, rtol=1e-9, atol=1e-11)
    until = float(truth.time[-1])
    outputs = [one for one in case.face.variables if one.reference in case.face.outputs and not one.modes]
    names = [*outputs, *(one for one in case.face.variables if one.slot[0] == "state" and one.name in model.position)]
    importer = Importer(case.started("me", until=until), len(model.states), model.events.guards.numel_out(0))
    events = [one.time for one in truth.events]
    instants = [t for t in np.linspace(0, until, POINTS + 1)[1:] if all(abs(t - e) > BESIDE for e in events)]
    found = []
    for instant in instants:
        importer.go(instant)
        found.append(importer.fmu.getReal([one.reference for one in names]))
    rows = [truth.at(t) for t in instants]
    worst = {}
    for one, column in zip(names, np.transpose(found), strict=True):
        exact = truth[one.name]
        size = np.ptp(exact) + 1e-3 * np.max(np.abs(exact)) + 1e-6 * (one.nominal or 1.0)
        worst[one.name] = float(np.max(np.abs(column - [row[one.name] for row in rows])) / size)
    culprit = max(worst, key=worst.__getitem__)
    assert worst[culprit] <= AGREEMENT, f"{culprit}: {worst[culprit]:.2g} of its range"


def test_a_gap_without_width_is_crossed_at_once(exported: Callable[..., Any]) -> None:
    case = exported("elements/gears_and_losses.toml")
    model = case.model
    importer = Importer(case.started("me", until=0.02), len(model.states), model.events.guards.numel_out(0))
    x, press = (
        next(one.reference for one in case.face.variables if one.name == f"mesh.{name}") for name in ("x", "press")
    )
    for instant in np.linspace(0.0, 0.02, 101)[1:]:
        importer.go(instant)
        overlap, pressed = importer.fmu.getReal([x, press])
        assert pressed == pytest.approx(overlap, abs=1e-9)


class Slowed(Component):
    """Goes on more slowly behind a border: an importer stops a time resolution before it, which then lasts longer."""

    rate: Parameter = param("1/s", "first speed", default=1.0)
    slower: Parameter = param("1", "second speed over the first one", default=0.3)
    x: Variable = var("1", "position", default=0)
    n: Discrete = integer("how often it passes the border")

    def equations(self) -> Equations:
        yield der(self.x) == self.rate * if_(self.n > 0, self.slower, 1)

    def events(self) -> Events:
        yield when(self.x > 0.5123, {self.n: pre(self.n) + 1})


@pytest.mark.parametrize("slower", [0.9, 0.3, 0.01])
def test_a_border_behind_which_all_is_slower_is_passed_once(exported: Callable[..., Any], slower: float) -> None:
    case = exported(Slowed(slower=slower))
    importer = Importer(case.started("me", until=1.0), 1, case.model.events.guards.numel_out(0))
    importer.go(1.0)
    x, n = (next(one.reference for one in case.face.variables if one.name == name) for name in "xn")
    assert importer.fmu.getReal([x, n]) == pytest.approx([0.5123 + slower * (1 - 0.5123), 1.0], abs=1e-7)
