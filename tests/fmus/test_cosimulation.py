"""Foreign FMUs in a system: one drives another, one of ours closes the loop, and what one does wrong is told."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from modelica_like.errors import FmuCrashed, FmuFailed, FmuTimeout, ModelicaLikeError
from modelica_like.fmi.cosimulation.run import cosim
from modelica_like.fmi.cosimulation.system import Link, Port, System, Unit
from modelica_like.fmi.export import export_fmu
from modelica_like.netlist import loads

Built = Mapping[tuple[str, str], Path]
J1, J2, C, D = 0.02, 0.08, 400.0, 0.2
TORQUE = Link("torque", Port("first", "shaft.tau"), (Port("second", "motor.tau"),))


@pytest.mark.parametrize("versions", [("2.0", "3.0"), ("3.0", "2.0")], ids=" drives ".join)
@pytest.mark.parametrize("master", ["jacobi", "gauss-seidel"])
def test_momentum_is_the_integral_of_the_torque(versions: tuple[str, str], master: str, reference_fmus: Built) -> None:
    """The torque in the first one's shaft brakes its far mass, and drives the second one."""
    units = (
        Unit("first", reference_fmus["two_mass", versions[0]]),
        Unit("second", reference_fmus["two_mass", versions[1]]),
    )
    run = cosim(System("cascade", units, (TORQUE,)), until=0.1, step=1e-4, master=master)
    momentum = J1 * run["second.J1.w"] + J2 * run["second.J2.w"]
    expected = -J2 * run["first.J2.w"]
    assert np.abs(momentum - expected).max() < 3e-3 * np.ptp(expected)


def test_our_controller_brakes_a_foreign_drive(reference_fmus: Built, tmp_path: Path) -> None:
    """tau = 5 - 0.5 (J1.w + J2.w/10): a linear system, whose matrix exponential is the truth; the step varies."""
    text = """
        name = "control"
        [parts]
        fast = { is = "Gain", k = "0.5 N.m.s/rad" }
        wanted = { is = "Constant", k = "5 N.m" }
        difference = { is = "Feedback" }
        [connect]
        wanted = ["wanted.y", "difference.u1"]
        braked = ["fast.y", "difference.u2"]
    """
    export_fmu(loads(text), tmp_path / "control.fmu", "2.0", "cs", check=False)
    units = (Unit("control", tmp_path / "control.fmu"), Unit("drive", reference_fmus["two_mass", "2.0"]))
    links = (
        Link("speed", Port("drive", "J1.w"), (Port("control", "fast.u"),)),
        Link("torque", Port("control", "difference.y"), (Port("drive", "motor.tau"),)),
    )
    run = cosim(System("loop", units, links), until=0.2, tolerance=1e-5)
    # w1, w2, twist
    a = np.array([[-(0.5 + D) / J1, D / J1, C / J1], [D / J2, -D / J2, -C / J2], [-1.0, 1.0, 0.0]])
    rest = -np.linalg.solve(a, [5.0 / J1, 0.0, 0.0])
    truth = np.array([rest - expm(a * t) @ rest for t in run.time[::50]])
    assert run["drive.J1.w"][::50] == pytest.approx(truth[:, 0], abs=1e-2 * np.ptp(truth[:, 0]))
    assert run["drive.J2.w"][::50] == pytest.approx(truth[:, 1], abs=1e-2 * np.ptp(truth[:, 1]))


def test_parameters_and_names_belong_to_each_fmu(reference_fmus: Built) -> None:
    """Without the link both are the same drive; twice the torque, twice the speed."""
    units = tuple(
        Unit(name, reference_fmus["two_mass", "2.0"], {"motor.tau": tau}) for name, tau in (("a", 1.0), ("b", 2.0))
    )
    run = cosim(System("pair", units, ()), until=0.1, step=1e-2, outputs=["*.J2.w"])
    assert run.names == ("a.J2.w", "b.J2.w")
    assert run["b.J2.w"] == pytest.approx(2 * run["a.J2.w"])


def test_several_instances_of_one_fmu_do_not_share_anything(reference_fmus: Built) -> None:
    unit = Unit("first", reference_fmus["two_mass", "3.0"])
    alone = cosim(System("one", (unit,), ()), until=0.1, step=1e-2, outputs=["*.J2.w"])
    units = (unit, Unit("second", unit.file, {"motor.tau": 0.0}))
    both = cosim(System("two", units, ()), until=0.1, step=1e-2, outputs=["*.J2.w"])
    np.testing.assert_array_equal(both["first.J2.w"], alone["first.J2.w"])
    assert not both["second.J2.w"].any()


BAD = "bad (hostile_fmi2.fmu)"
OWN = "The FMUs of bench ran in a process of their own."
MISDEEDS: dict[str, tuple[float, type[ModelicaLikeError], str]] = {
    "crash": (1.0, FmuCrashed, f"{BAD} crashed with SIGSEGV after t = 0.49 s.\n{OWN}"),
    "crash at the start": (5.0, FmuCrashed, f"{BAD} crashed with SIGSEGV before the end of its first step.\n{OWN}"),
    "leave": (3.0, FmuCrashed, f"{BAD} ended its process with exit code 0, after t = 0.49 s.\n{OWN}"),
    "hang": (
        2.0, FmuTimeout,
        "bench did not finish within 3 s, and was stopped after t = 0.49 s.\n"
        f"{BAD} was running.\nGive it more time with `timeout`, or a shorter run.",
    ),
    "fail": (
        4.0, FmuFailed,
        f"{BAD} failed: fmi2DoStep failed with status 3 (error).\n"
        "If the exchanged values grow without bounds, choose a shorter step.",
    ),
}  # fmt: skip


@pytest.mark.parametrize("misdeed", MISDEEDS)
def test_what_one_does_wrong_is_told_by_its_name(misdeed: str, hostile: Path, reference_fmus: Built) -> None:
    what, kind, sentence = MISDEEDS[misdeed]
    units = (Unit("good", reference_fmus["two_mass", "2.0"]), Unit("bad", hostile, {"misdeed": what}))
    with pytest.raises(kind) as told:
        cosim(System("bench", units, ()), until=1.0, step=1e-2, timeout=3.0)
    assert str(told.value) == sentence


def test_what_is_no_number_stops_the_run(hostile: Path, reference_fmus: Built) -> None:
    units = (Unit("good", reference_fmus["two_mass", "2.0"]), Unit("bad", hostile, {"misdeed": 6.0}))
    link = Link("noise", Port("bad", "x"), (Port("good", "motor.tau"),))
    with pytest.raises(FmuFailed) as told:
        cosim(System("bench", units, (link,)), until=1.0, step=1e-2)
    assert str(told.value).startswith(f"{BAD}: x is not finite at t = 0.5 s.\n")


def test_an_input_to_which_nothing_is_connected_is_told(reference_fmus: Built) -> None:
    units = (Unit("drive", reference_fmus["two_mass", "2.0"]),)
    run = cosim(System("bench", units, ()), until=0.01, step=1e-3)
    assert run.notices == ("Nothing is connected to drive.motor.tau: it stays at 5 N.m.",)
