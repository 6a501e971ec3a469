"""What a foreign FMU does wrong becomes a sentence; nothing of it reaches this process."""

import resource
import sys
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from modelica_like.errors import FmuCrashed, FmuFailed, FmuRefused, FmuTimeout, UnknownName, ValueOutOfRange
from modelica_like.fmi.run import run_fmu

Built = Mapping[tuple[str, str], Path]

CRASH, HANG, LEAVE, FAIL, CRASH_AT_START, NOT_A_NUMBER, CRASH_AT_END, EAT = 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0
IN_ITS_OWN = "It ran in a separate process."

MISDEEDS = {
    "crash": (CRASH, FmuCrashed, f"hostile_fmi2.fmu crashed with SIGSEGV after t = 0.49 s.\n{IN_ITS_OWN}"),
    "crash at the start": (
        CRASH_AT_START,
        FmuCrashed,
        f"hostile_fmi2.fmu crashed with SIGSEGV before the end of its first step.\n{IN_ITS_OWN}",
    ),
    "leave": (
        LEAVE,
        FmuCrashed,
        f"hostile_fmi2.fmu ended its process with exit code 0, after t = 0.49 s.\n{IN_ITS_OWN}",
    ),
    "hang": (
        HANG,
        FmuTimeout,
        "hostile_fmi2.fmu did not finish within 3 s, and was stopped after t = 0.49 s.\n"
        "Give it more time with `timeout`, or a shorter run.",
    ),
    "fail": (FAIL, FmuFailed, "hostile_fmi2.fmu failed: fmi2DoStep failed with status 3 (error)."),
}


@pytest.mark.parametrize("misdeed", MISDEEDS)
def test_becomes_a_sentence(misdeed: str, hostile: Path) -> None:
    what, kind, sentence = MISDEEDS[misdeed]
    with pytest.raises(kind) as told:
        run_fmu(hostile, parameters={"misdeed": what}, timeout=3.0)
    assert str(told.value) == sentence


def test_results_that_are_not_finite_are_told(hostile: Path) -> None:
    with pytest.raises(FmuFailed) as told:
        run_fmu(hostile, parameters={"misdeed": NOT_A_NUMBER})
    assert str(told.value) == (
        "hostile_fmi2.fmu: x is not finite at t = 0.5 s.\n"
        "The run is on the error, as `run`. If this value does not matter, choose others by `outputs`."
    )
    run = told.value.run
    np.testing.assert_array_equal(np.isnan(run["x"]), run.time >= 0.5 - 1e-9)


def test_a_crash_after_the_run_is_told_and_its_results_are_kept(hostile: Path) -> None:
    run = run_fmu(hostile, parameters={"misdeed": CRASH_AT_END})
    assert run.final["x"] == pytest.approx(1.0)
    assert run.notices == (
        "hostile_fmi2.fmu crashed with SIGSEGV while it was freed, after its results were complete.",
    )


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere memory cannot be limited")
def test_memory_is_limited(hostile: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It takes pages of 16 MB without looking whether it gets them."""
    monkeypatch.setenv("MODELICA_LIKE_FMU_MEMORY", "700")
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss  # of the largest process so far, a compiler perhaps
    with pytest.raises(FmuCrashed) as told:
        run_fmu(hostile, parameters={"misdeed": EAT})
    assert str(told.value) == f"hostile_fmi2.fmu crashed with SIGSEGV after t = 0.49 s.\n{IN_ITS_OWN}"
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss <= max(before, 1_200_000)


def test_noise_goes_nowhere(hostile: Path, capfd: pytest.CaptureFixture[str]) -> None:
    run = run_fmu(hostile, points=10)
    np.testing.assert_allclose(run["x"], run.time)
    assert capfd.readouterr() == ("", "")


MISTAKES = {
    "parameter": (
        {"parameters": {"shaft.cc": 1.0}},
        UnknownName,
        "two_mass_fmi2.fmu has no variable 'shaft.cc'; did you mean 'shaft.c'?",
    ),
    "quantity": (
        {"parameters": {"J1.J": "200 kg.cm2"}},
        ValueOutOfRange,
        "The parameter 'J1.J' must be a number or an array of numbers.\n"
        "Give '200 kg.cm2' as a number in the unit of the FMU.",
    ),
    "output": ({"outputs": ["J3.w"]}, UnknownName, "two_mass_fmi2.fmu has no variable 'J3.w'; did you mean 'J2.w'?"),
    "input": (
        {"inputs": {"J1.J": 1.0}},
        UnknownName,
        "two_mass_fmi2.fmu: 'J1.J' is not an input but a parameter. It has motor.tau.",
    ),
    "table": (
        {"inputs": {"motor.tau": [(1.0, 0.0), (0.0, 1.0)]}},
        ValueOutOfRange,
        "The input 'motor.tau' must be a number, or pairs of rising time and value.",
    ),
    "end": (
        {"stop": -1.0},
        ValueOutOfRange,
        "two_mass_fmi2.fmu: the end time -1 s is not after the start time 0 s.",
    ),
    "step": ({"step": 0.0}, ValueOutOfRange, "two_mass_fmi2.fmu: the step must be positive, not 0 s."),
    "timeout": ({"timeout": 0.0}, ValueOutOfRange, "two_mass_fmi2.fmu: the time limit must be positive, not 0 s."),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_tells_mistakes(mistake: str, reference_fmus: Built) -> None:
    arguments, kind, sentence = MISTAKES[mistake]
    with pytest.raises(kind) as told:
        run_fmu(reference_fmus["two_mass", "2.0"], **arguments)
    assert str(told.value) == sentence


def test_tells_a_missing_kind(reference_fmus: Built) -> None:
    with pytest.raises(FmuRefused) as told:
        run_fmu(reference_fmus["dc_bench", "2.0"], kind="me")
    assert str(told.value) == ("dc_bench_fmi2.fmu has no ModelExchange part.\nChoose the other kind, or none.")


def test_tells_scheduled_execution(tmp_path: Path) -> None:
    path = tmp_path / "tasks.fmu"
    description = (
        '<fmiModelDescription fmiVersion="3.0" modelName="tasks" instantiationToken="x">'
        '<ScheduledExecution modelIdentifier="tasks"/><ModelVariables/><ModelStructure/></fmiModelDescription>'
    )
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", description)
    with pytest.raises(FmuRefused, match=r"^tasks\.fmu is for Scheduled Execution only: its importer"):
        run_fmu(path)


def test_a_component_without_inputs_says_so(reference_fmus: Built) -> None:
    with pytest.raises(UnknownName, match=r"'k' is not an input but a parameter\. It has none\.$"):
        run_fmu(reference_fmus["dc_bench", "2.0"], inputs={"k": 1.0})
