"""A simulation as a CasADi function: derivatives, second derivatives, the check of the mode sequence, two designs."""

from math import pi
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from modelica_like import build, load, simulation_function
from modelica_like.errors import LanguageError, NoGradient

EXAMPLES = Path(__file__).parents[2] / "examples"
INPUTS = ("clutch_torque", "load_torque")
w, J = 6000 * pi / 30, 0.02 + 500 * (0.015 / (2 * pi)) ** 2
M, L = J * w / 0.2 + 15, 15.0


def table(**options: Any) -> Any:
    drive = load(EXAMPLES / "machine_table_direct.toml")
    drive.set("clutch_torque", f"{M!r} N.m")
    return simulation_function(drive, INPUTS, ["clutch.lock_time", "clutch.loss_energy"], **options)


def test_values_and_jacobian_are_those_of_the_paper() -> None:
    function = table()
    p = ca.MX.sym("p", 2)
    jacobian = ca.Function("jacobian", [p], [ca.jacobian(function(p), p)])
    assert function.start_values == pytest.approx([M, L])
    assert np.array(function([90.0, 14.0])).ravel() == pytest.approx([J * w / 76, 90 * J * w**2 / 76 / 2], rel=1e-9)
    expected = [[-J * w / 76**2, J * w / 76**2], [-J * w**2 * 14 / 76**2 / 2, 90 * J * w**2 / 76**2 / 2]]
    assert np.array(jacobian([90.0, 14.0])) == pytest.approx(np.array(expected), rel=1e-8)


def test_a_compiled_drive_offers_it_itself() -> None:
    drive = load(EXAMPLES / "machine_table_direct.toml")
    drive.set("clutch_torque", f"{M!r} N.m")
    function = build(drive).function(INPUTS, ["clutch.lock_time"])
    assert float(function([90.0, 14.0])) == pytest.approx(J * w / 76, rel=1e-9)


def test_value_and_jacobian_share_one_simulation() -> None:
    function = table()
    p = ca.MX.sym("p", 2)
    both = ca.Function("both", [p], [function(p), ca.jacobian(function(p), p)])
    before = function.runs
    both([91.0, 13.0])
    assert function.runs == before + 1


def test_values_alone_need_no_derivatives_and_are_those_beside_them() -> None:
    names = ["clutch.lock_time", "shaft1.tau", "at(shaft1.tau, 0.3 s)", "stored_energy"]
    function = simulation_function(EXAMPLES / "machine_tool_startup.toml", ["k1", "J1.J"], names)
    differentiated = []
    function._by_run_time = lambda values, of=function._by_run_time: differentiated.append(1) or of(values)
    point = [6000.0, 1.7]
    alone = np.array(function(point)).ravel()
    assert (function.runs, differentiated) == (1, [])
    beside = [one.value for one in function.at(point).outputs]
    assert (function.runs, differentiated) == (1, [1])
    assert alone == pytest.approx(beside, rel=1e-7)


def test_adjoint_and_forward_products() -> None:
    function = table()
    p, direction = ca.MX.sym("p", 2), ca.MX.sym("direction", 2)
    forward = ca.Function("forward", [p, direction], [ca.jtimes(function(p), p, direction)])
    adjoint = ca.Function("adjoint", [p, direction], [ca.jtimes(function(p), p, direction, True)])
    jacobian = np.array(ca.Function("jacobian", [p], [ca.jacobian(function(p), p)])([90.0, 14.0]))
    assert np.array(forward([90.0, 14.0], [1.0, 2.0])).ravel() == pytest.approx(jacobian @ [1, 2], rel=1e-12)
    assert np.array(adjoint([90.0, 14.0], [1.0, 2.0])).ravel() == pytest.approx(jacobian.T @ [1, 2], rel=1e-12)


def test_second_derivatives_of_the_friction_work() -> None:
    function = table()
    p = ca.MX.sym("p", 2)
    hessian = ca.Function("hessian", [p], [ca.hessian(function(p)[1], p)[0]])
    # W = M J w²/(2 (M - L))
    cross = -J * w**2 / 2 * (M + L) / (M - L) ** 3
    expected = [[J * w**2 * L / (M - L) ** 3, cross], [cross, J * w**2 * M / (M - L) ** 3]]
    assert np.array(hessian([M, L])) == pytest.approx(np.array(expected), rel=1e-6)
    assert function.second_error < 1e-4


def test_hessian_products_of_document_000() -> None:
    """The clutch locks after J w/(M - L), with the friction work M J w²/(2 (M - L))."""
    function = table()
    direction = np.array([1.0, -0.5])
    products = function.hessian_products([M, L], direction)
    times = 2 * J * w / (M - L) ** 3 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    cross = -J * w**2 / 2 * (M + L) / (M - L) ** 3
    work = np.array([[J * w**2 * L / (M - L) ** 3, cross], [cross, J * w**2 * M / (M - L) ** 3]])
    assert products == pytest.approx(np.array([times @ direction, work @ direction]), rel=1e-6)
    assert function.second_error < 1e-4


def test_what_is_linear_has_no_second_derivative() -> None:
    """The friction work is linear in J, on which the time does not depend: the clutch is sized for it."""
    function = simulation_function(
        EXAMPLES / "machine_table_direct.toml", ["hub_inertia"], ["clutch.lock_time", "clutch.loss_energy"]
    )
    products = function.hessian_products(function.start_values, [1.0])
    assert np.all(np.abs(products * function.start_values**2).ravel() < 1e-5 * np.array([0.2, 5453.0]))
    assert function.second_error < 1e-2


def test_another_mode_sequence_is_refused(capfd: pytest.CaptureFixture[str]) -> None:
    function = table()
    with pytest.raises(NoGradient, match=r"'clutch\.mode: backward → stuck' is missing"):
        function.at([16.0, 15.0])
    with pytest.raises(RuntimeError, match="has another mode sequence"):
        function([16.0, 15.0])
    capfd.readouterr()
    assert isinstance(function.refusal, NoGradient)


def test_an_optimiser_gets_nan_if_it_wants() -> None:
    function = table(nan_where_refused=True)
    assert np.all(np.isnan(np.array(function([16.0, 15.0]))))
    assert isinstance(function.refusal, NoGradient)
    assert np.all(np.isfinite(np.array(function([80.0, 15.0]))))
    assert function.refusal is None


def test_any_sequence_goes_on() -> None:
    drive = load(EXAMPLES / "machine_table_direct.toml")
    drive.set("clutch_torque", f"{M!r} N.m")
    function = simulation_function(drive, INPUTS, ["table.v"], any_sequence=True)
    # the clutch still slips at the end: v = lead/(2 pi) (M - L)/J t
    assert float(function([16.0, 15.0])) == pytest.approx(0.015 / (2 * pi) / J * 0.4, rel=1e-9)


def test_a_series_is_no_output() -> None:
    with pytest.raises(LanguageError, match="is a trajectory"):
        simulation_function(EXAMPLES / "machine_table_direct.toml", ["load_torque"], ["series(table.s)"])


def test_second_derivatives_beside_another_sequence_are_refused() -> None:
    """The clutch locks just before the end; a little weaker, it does not: the speed at the end has a kink."""
    drive = load(EXAMPLES / "machine_table_direct.toml")
    drive.set("clutch_torque", f"{M!r} N.m")
    function = simulation_function(drive, ["clutch_torque"], ["table.v"], any_sequence=True, until=0.2002)
    p = ca.MX.sym("p", 1)
    hessian = ca.Function("hessian", [p], [ca.hessian(function(p), p)[0]])
    with pytest.raises(RuntimeError):
        hessian([M])
    assert function.refusal is not None
    assert function.refusal.what.startswith("The second derivatives of table.v by clutch_torque are not certain")
    assert function.second_error > 0.1
