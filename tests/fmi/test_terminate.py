"""FMUs of both versions and kinds end a run where a component does, at sqrt(2 x / a): alone and in a system."""

from math import sqrt
from pathlib import Path
from typing import Any, Literal

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2Discard, fmi2LastSuccessfulTime, fmi2Terminated

from modelica_like import Assembly, cosim, export_fmu, run_fmu
from modelica_like.fmi.cosimulation.system import System, Unit
from modelica_like.language import Component, Equations, Events, Parameter, Variable, der, param, terminate, var, when
from modelica_like.runs.recorded import RecordedSolution

END = sqrt(2 / 3)
SECOND_VERSION = "2.0"
CVODE = 1e-6
"""Relative; FMPy's CVODE has a relative tolerance of 1e-5 by default in Model Exchange, but this is a parabola."""
FIXED = 1e-5
"""Relative; fixed steps find events behind a ten-thousandth of a step of 0.01 s."""


class Lift(Component):
    a: Parameter = param("m/s2", "acceleration", default=3.0)
    x_top: Parameter = param("m", "height", default=1.0)
    x: Variable = var("m", "position", state="always", default=0.0)
    v: Variable = var("m/s", "speed", state="always", default=0.0)

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield der(self.v) == self.a

    def events(self) -> Events:
        yield when(self.x > self.x_top, {self.v: 0.5 * self.v, **terminate("is at the top")})


def exported(folder: Path, version: str, **options: Any) -> Path:
    path = folder / "lift.fmu"
    export_fmu(Assembly("drive", parts={"lift": Lift()}), path, version=version, outputs=["*"], check=False, **options)
    return path


def ends_rightly(run: RecordedSolution, close: float) -> None:
    assert run.ended is not None
    assert str(run.ended) == f"The run ended at {run.ended.time:.9g} s: drive has terminated it."
    assert run.ended.time == run.time[-1] == pytest.approx(END, rel=close)
    assert run["lift.x"][-1] == pytest.approx(1.0, rel=close)
    assert run["lift.v"][-1] == pytest.approx(0.5 * 3 * END, rel=close)  # what the event does is done


@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize("kind", ["me", "cs"])
def test_a_run_of_the_fmu_ends_there(version: str, kind: Literal["me", "cs"], tmp_path: Path) -> None:
    path = exported(tmp_path, version)
    ends_rightly(run_fmu(path, kind=kind, stop=2.0, step=0.05), CVODE)
    assert run_fmu(path, kind=kind, stop=0.5).ended is None


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_fixed_steps_end_there(version: str, tmp_path: Path) -> None:
    ends_rightly(run_fmu(exported(tmp_path, version, fixed_step=0.01), stop=2.0, step=0.05), FIXED)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_a_system_ends_with_its_first_fmu(version: str, tmp_path: Path) -> None:
    path = exported(tmp_path, version)
    units = (Unit("slow", path, {"lift.a": 1.0}), Unit("fast", path))
    run = cosim(System("two lifts", units, ()), until=2.0, step=0.1)
    assert run.ended is not None
    assert (run.ended.component, run.ended.reason) == ("fast", "has terminated it")
    assert run.ended.time == pytest.approx(END, rel=1e-9)
    np.testing.assert_allclose(run.time, np.arange(9) * 0.1)  # the communication points before
    np.testing.assert_allclose(run["slow.lift.x"], run.time**2 / 2, atol=1e-9)


def test_a_step_of_fmi_2_is_discarded(tmp_path: Path) -> None:
    path = exported(tmp_path, SECOND_VERSION)
    fmu: Any = fmpy.instantiate_fmu(fmpy.extract(str(path)), fmpy.read_model_description(str(path)), "CoSimulation")
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    for _ in range(2):  # also if it is asked again
        with pytest.raises(FMICallException) as refused:
            fmu.doStep(currentCommunicationPoint=fmu.getRealStatus(fmi2LastSuccessfulTime), communicationStepSize=1.0)
        assert refused.value.status == fmi2Discard
        assert fmu.getBooleanStatus(fmi2Terminated)
        assert fmu.getRealStatus(fmi2LastSuccessfulTime) == pytest.approx(END, rel=1e-9)
    fmu.terminate()
    fmu.freeInstance()
