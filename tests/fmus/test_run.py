"""Foreign FMUs as solutions: names, inputs, events, energies, pictures."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from modelica_like import simulate
from modelica_like.errors import MissingValue, UnknownName, ValueOutOfRange
from modelica_like.fmi.export import export_fmu
from modelica_like.fmi.run import run_fmu
from modelica_like.netlist import loads
from modelica_like.runs.trajectories import Trajectories

Built = Mapping[tuple[str, str], Path]
VERSIONS = pytest.mark.parametrize("version", ["2.0", "3.0"])


@VERSIONS
def test_is_a_solution(version: str, reference_fmus: Built) -> None:
    run = run_fmu(reference_fmus["stick_slip", version])
    assert isinstance(run, Trajectories)
    assert len(run["mass.s"]) == len(run.time)
    assert run["friction.mode"].max() == 5
    assert run["mass.m"][0] == 1.0
    assert "mass.s" in run
    assert "mass.x" not in run
    assert repr(run).startswith("<Solution of stick_slip: 8 variables, t = 0 … 5 s, 9 mode changes")


@VERSIONS
def test_tells_events_with_the_names_of_modes(version: str, reference_fmus: Built) -> None:
    first = run_fmu(reference_fmus["stick_slip", version]).events[0]
    assert (first.mode, first.before, first.after) == ("friction.mode", "stuck", "backward")
    assert first.time == pytest.approx(0.8, abs=1e-9)


def test_locates_events_however_coarse_the_communication_step(reference_fmus: Built) -> None:
    """As long as no mode comes and goes within one step: sliding lasts 0.38 s."""
    fine, coarse = (run_fmu(reference_fmus["stick_slip", "2.0"], step=step) for step in (1e-3, 0.25))
    assert [event.time for event in coarse.events] == pytest.approx([event.time for event in fine.events], abs=1e-9)
    assert len(np.unique(coarse.time)) == 21 + len(coarse.events)


@VERSIONS
@pytest.mark.parametrize("kind", ["me", "cs"])
def test_inputs_and_parameters(version: str, kind: str, reference_fmus: Built) -> None:
    """Newton: the speed of the centre of mass is the integral of the torque over both inertias."""
    ramp = [(0.0, 1.0), (0.5, 3.0)]
    run = run_fmu(reference_fmus["two_mass", version], {"motor.tau": ramp}, {"J1.J": 0.04}, kind=kind, tolerance=1e-9)
    centre = (0.04 * run["J1.w"] + 0.08 * run["J2.w"]) / 0.12
    np.testing.assert_allclose(centre, (run.time + 2 * run.time**2) / 0.12, rtol=1e-6, atol=1e-9)


def test_records_what_was_asked_for(reference_fmus: Built) -> None:
    run = run_fmu(reference_fmus["two_mass", "3.0"], outputs=["J2.w"], stop=0.1, step=0.01)
    assert run.names == ("J2.w",)
    assert len(run.time) == 11


def test_has_the_times_of_a_simulation_where_nobody_wants_others(tmp_path: Path) -> None:
    """An FMU without a suggested step."""
    drive = loads('[parts]\nwheel = { is = "Inertia", J = 1, phi = 0, w = 1 }')
    export_fmu(drive, tmp_path / "wheel.fmu", check=False)
    run = run_fmu(tmp_path / "wheel.fmu", stop=3.0)
    assert run.time == pytest.approx(simulate(drive, 3.0).time, abs=1e-12)


def test_starts_later(reference_fmus: Built) -> None:
    run = run_fmu(reference_fmus["machine_table", "2.0"], start=1.0, stop=1.4)
    assert run.time[0] == 1.0
    assert run.events[0].time == pytest.approx(1.2, abs=1e-9)


def test_values_in_between(reference_fmus: Built) -> None:
    run = run_fmu(reference_fmus["machine_table", "2.0"], step=0.1)
    assert run.at(0.05)["table.v"] == pytest.approx(0.375)
    assert run.at(0.3)["clutch.mode"] == 1
    assert run.final["table.v"] == pytest.approx(1.5)
    with pytest.raises(ValueOutOfRange, match="is not within the run"):
        run.at(1.0)


def test_energies_need_energy_terms(reference_fmus: Built) -> None:
    with pytest.raises(MissingValue) as told:
        run_fmu(reference_fmus["two_mass", "2.0"]).energy()
    assert str(told.value) == (
        "two_mass has no energies.\nIt has no variables ….stored_energy, ….loss_power or ….source_power."
    )


def test_unknown_variable(reference_fmus: Built) -> None:
    with pytest.raises(UnknownName) as told:
        _ = run_fmu(reference_fmus["two_mass", "2.0"])["J1.v"]
    assert str(told.value) == "two_mass has no variable 'J1.v'; did you mean 'J1.w'?"


def test_plots_and_tables(reference_fmus: Built) -> None:
    run = run_fmu(reference_fmus["dc_bench", "3.0"])
    figure = run.plot("*.w", "clutch.tau")
    speeds, torques, _ = figure.axes
    assert speeds.get_ylabel() == "speed in rad/s"
    assert len(torques.get_lines()) == 1 + len(run.events)
    frame = run.to_pandas()
    assert frame["generator.v"].iloc[-1] == pytest.approx(22.316, abs=1e-3)
    assert run.to_xarray()["motor.ia"].attrs["units"] == "A"
