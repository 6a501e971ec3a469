# ruff: noqa: E501 messages stand here as they are told
"""What linearisation, operating points, sweeps and calibration say about wrong calls and points that do not exist."""

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from components import ConstantTorque, Inertia
from modelica_like import build, open_loop, order_response, overlay, simulate
from modelica_like.analyse.calibration.calibrate import Numbers, OperatingPoints, Trajectories, calibrate
from modelica_like.analyse.calibration.measurements import read_table
from modelica_like.analyse.linear.campbell import campbell
from modelica_like.analyse.linear.linearize import linearize, when
from modelica_like.analyse.operating.curves import characteristic
from modelica_like.analyse.operating.steady import steady
from modelica_like.analyse.sweeps.importance import importance
from modelica_like.analyse.sweeps.plan import LatinHypercube, Sobol
from modelica_like.analyse.sweeps.ranges import by_name, read_assignment, read_range
from modelica_like.analyse.sweeps.sweep import sweep
from modelica_like.analyse.sweeps.workers import Job, in_processes
from modelica_like.errors import (
    CalibrationFailed,
    CheckpointMismatch,
    DuplicateName,
    InitializationError,
    LanguageError,
    MissingExtra,
    ModelicaLikeError,
    NetlistError,
    UnitError,
    UnknownName,
    ValueOutOfRange,
    WorkersLost,
)
from modelica_like.language import Component, Equations, series
from modelica_like.show.report.files import write_dataset

EXAMPLES = Path(__file__).parents[2] / "examples"
MOTOR, GEARED = EXAMPLES / "dc_bench_motor.toml", EXAMPLES / "machine_table_geared.toml"


class Accelerated(Component):
    """An inertia under a torque."""

    def build(self) -> None:
        self.torque = ConstantTorque(tau_constant=2.0)
        self.mass = Inertia(J=4.0, w=1.0, phi=0.0)

    def equations(self) -> Equations:
        yield from series(self.torque, self.mass)


def model() -> Any:
    return build(Accelerated())


def excited() -> Any:
    return linearize(model(), inputs=["torque.tau_constant"], outputs=["mass.w"])


def swept(**changed: Any) -> Any:
    over = changed.pop("over", {"mass.J": [1.0, 2.0]})
    return sweep(model(), over, changed.pop("outputs", ["mass.w"]), until=1.0, **changed)


def fitted(data: Any, parameters: Any = None, **changed: Any) -> Any:
    return calibrate(model(), data, {"mass.J": (1.0, 2.0)} if parameters is None else parameters, **changed)


def missing(package: str, action: Callable[[], object]) -> object:
    """Act as if a package were not installed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, package, None)
        return action()


def dies(*_: object) -> None:
    os._exit(3)


CASES: dict[str, tuple[type[ModelicaLikeError], Callable[[], object], str]] = {
    "a time without a unit that fits": (UnitError, lambda: when("3 kg"), """\
at expects s; '3 kg' is kg."""),
    "an input of a linear model": (UnknownName, lambda: linearize(model(), inputs=["mass.j"]), """\
Accelerated has no input or parameter 'mass.j'; did you mean 'mass.J'?"""),
    "an output of a linear model": (UnknownName, lambda: linearize(model(), outputs=["mass.v"]), """\
Accelerated has no variable 'mass.v'; did you mean 'mass.w'?"""),
    "a variable of a mode's shape": (UnknownName, lambda: linearize(model()).modes().shape(0, ["mass.v"]), """\
Accelerated has no variable 'mass.v'; did you mean 'mass.w'?"""),
    "scipy": (MissingExtra, lambda: missing("scipy.signal", linearize(model()).to_scipy), """\
scipy is not installed.
Install it with: pip install "modelica-like[analyse]\""""),
    "python-control": (MissingExtra, lambda: missing("control", linearize(model()).to_control), """\
control is not installed.
Install it with: pip install "modelica-like[analyse]\""""),
    "a Campbell diagram over two": (ValueOutOfRange, lambda: campbell(model(), {}, "mass.w"), """\
A Campbell diagram varies one parameter, not 0."""),
    "a Campbell diagram of one point": (ValueOutOfRange, lambda: campbell(model(), {"mass.J": [1.0]}, "mass.w", at="given"), """\
A Campbell diagram needs at least two values of mass.J."""),
    "nothing holds": (ValueOutOfRange, lambda: steady(MOTOR, {"motor.w": 400.0}), """\
dc_bench_motor: motor.w cannot be held by nothing: each held variable needs one parameter.
Write for example steady(drive, {"motor.w": "3000 rpm"}, by="load.tau_constant")."""),
    "a held name": (UnknownName, lambda: steady(MOTOR, {"motor.x": 400.0}, by="first_load"), """\
dc_bench_motor has no variable 'motor.x'; did you mean 'motor.w'?"""),
    "a name of an operating point": (UnknownName, lambda: steady(MOTOR)["motor.x"], """\
dc_bench_motor has no variable 'motor.x'; did you mean 'motor.w'?"""),
    "what does not change it": (InitializationError, lambda: steady(MOTOR, {"motor.w": 400.0}, by="last_load"), """\
dc_bench_motor: motor.w cannot be held by last_load: in steady state it does not depend on it.
Choose a parameter that changes it, such as the torque of a load."""),
    "a point of a curve": (InitializationError, lambda: characteristic(model(), {"torque.tau_constant": [1.0]}), """\
At torque.tau_constant = 1.0: No steady state was found at t = 0 s: mass.w keeps changing.
Check that the drive has an equilibrium. Give guesses near the steady motion, such as guess(100) for a speed; an operating point can also start from the end of a run."""),
    "a curve over two": (ValueOutOfRange, lambda: characteristic(model(), {}), """\
A characteristic curve varies one quantity, not 0."""),
    "a curve over nothing": (ValueOutOfRange, lambda: characteristic(model(), {"mass.J": []}), """\
mass.J: no values are given."""),
    "a sweep over nothing": (ValueOutOfRange, lambda: swept(over={}), """\
A sweep needs at least one parameter."""),
    "a sweep of nothing": (ValueOutOfRange, lambda: swept(outputs=[]), """\
A sweep needs at least one output, and positive numbers of processes and runs in a chunk."""),
    "no values": (ValueOutOfRange, lambda: swept(over={"mass.J": []}), """\
mass.J: a sweep needs at least one value, not []."""),
    "no bounds": (ValueOutOfRange, lambda: swept(over={"mass.J": [2.0, 1.0]}, sampling=LatinHypercube(4)), """\
mass.J: a sweep needs a lower and an upper bound, not [2.0, 1.0]."""),
    "an output that is varied": (ValueOutOfRange, lambda: sweep(model(), {"mass.J": [2.0]}, ["mass.w", "mass.J"], until=1.0), """\
mass.J is varied, and cannot be an output, too.
Its values stand beside every output."""),
    "one value of what is varied": (ValueOutOfRange, lambda: swept(parameters={"mass.J": 2.0}), """\
mass.J is varied, and has a value for all runs.
Leave out one of the two."""),
    "no samples": (ValueOutOfRange, lambda: Sobol(-3), """\
-3 samples are too few: a sweep needs at least 1."""),
    "one sample of a scatter": (ValueOutOfRange, lambda: importance(model(), {"mass.J": (1.0, 2.0)}, ["mass.w"], samples=1), """\
samples = 1 must be at least 2: one sample has no scatter."""),
    "a parameter of a sweep": (UnknownName, lambda: swept(over={"mass.j": [2.0]}), """\
Accelerated has no input or parameter 'mass.j'; did you mean 'mass.J'?"""),
    "a formula in a compiled model": (LanguageError, lambda: sweep(build(GEARED), {"gear.ratio": [0.2]}, ["table.s"]), """\
gear.ratio follows from other parameters.
Vary those, or sweep the netlist itself."""),
    "no scheduler": (WorkersLost, lambda: swept(scheduler="nowhere://127.0.0.1:1"), """\
There is no Dask scheduler at nowhere://127.0.0.1:1.
An address looks like tcp://host:8786."""),
    "no values of the output": (ValueOutOfRange, lambda: importance(model(), {"mass.J": (-1.0, 1.0)}, ["mass.w"], samples=4, until=1.0), """\
mass.w has no value in 6 of 12 runs: mass.J = -0.09687008894979954 is out of range: it must be at least 0 kg.m2.
Narrow the ranges until most runs succeed."""),
    "a measure with one name": (UnknownName, lambda: importance(model(), {"mass.J": (1.0, 2.0)}, ["mass.w"], samples=4, until=0.1)["S1"], """\
This result has three names, of a measure, an output and a parameter, not 'S1'.
Write result["S1", "…", "…"]."""),
    "a method": (UnknownName, lambda: importance(model(), {"mass.J": (1.0, 2.0)}, ["mass.w"], method="fast"), """\
There is no method 'fast'. There are sobol and morris."""),
    "SALib": (MissingExtra, lambda: missing("SALib.sample.sobol", lambda: importance(model(), {"mass.J": (1.0, 2.0)}, ["mass.w"])), """\
SALib is not installed.
Install it with: pip install "modelica-like[analyse]\""""),
    "no data": (ValueOutOfRange, lambda: fitted([]), """\
A calibration needs data, at least one parameter, and at least one start.
Write calibrate(drive, [Trajectories("meas.csv")], {"clutch.mu": (0.1, 0.5)}), or on the command line --data meas.csv --free clutch.mu=0.1:0.5."""),
    "bounds the wrong way round": (ValueOutOfRange, lambda: fitted(Numbers({"mass.w": 1.0}, until=1.0), {"mass.J": (2.0, 1.0)}), """\
mass.J: the lower bound 2 is not below the upper bound 1."""),
    "no uncertainty": (ValueOutOfRange, lambda: fitted(Numbers({"mass.w": 0.0}, until=1.0)), """\
mass.w: the uncertainty of a measurement must be positive, not 0.
State it, e.g. uncertainty={"mass.w": …}."""),
    "no column of times": (UnknownName, lambda: fitted(Trajectories({"mass.w": [1.0]})), """\
Measured trajectories need a column 'time'."""),
    "columns of different length": (ValueOutOfRange, lambda: read_table({"time": [1.0], "mass.w": [1.0, 2.0]}), """\
Measured columns must have the same length, and at least one row."""),
    "two columns of one name": (DuplicateName, lambda: read_table({"mass.w [rpm]": [1.0], "mass.w [rad/s]": [1.0]}), """\
Two columns are called 'mass.w'.
Rename one of them."""),
    "a column of words": (ValueOutOfRange, lambda: read_table({"time": [1.0], "mass.w": ["fast"]}), """\
The column 'mass.w' is no list of numbers."""),
    "a gap": (ValueOutOfRange, lambda: fitted(Trajectories({"time": [1.0, 2.0], "mass.w": [1.0, float("nan")]})), """\
mass.w in row 2 is nan, no finite number.
Leave the row out; variables with gaps at other times are measurements of their own."""),
    "nothing is measured": (ValueOutOfRange, lambda: fitted(OperatingPoints({"torque.tau_constant": [1.0]}, given=["torque.tau_constant"])), """\
A measurement has nothing that is measured."""),
    "no such column is given": (UnknownName, lambda: fitted(OperatingPoints({"torque.tau_constant": [1.0], "mass.w": [1.0]}, given=["torque.tau"])), """\
The table of operating points has no column 'torque.tau'; did you mean 'torque.tau_constant'?"""),
    "a text in the place of names": (ValueOutOfRange, lambda: OperatingPoints({"mass.w": [1.0]}, given="mass.w"), """\
OperatingPoints: given = 'mass.w' is no list of texts.
Give one, such as ["…"]."""),
    "an uncertainty of nothing": (UnknownName, lambda: fitted(Numbers({"mass.w": 1.0}, uncertainty={"mas.w": 0.1}, until=1.0)), """\
The uncertainty of 'mas.w' belongs to nothing measured; did you mean 'mass.w'?"""),
    "a speed of an order that is no number": (ValueOutOfRange, lambda: order_response(excited(), {1.0: 1.0}, [1.0, float("nan")]), """\
Speeds of an order response must be finite, and at least one."""),
    "no speed of an order": (ValueOutOfRange, lambda: order_response(excited(), {1.0: 1.0}, []), """\
Speeds of an order response must be finite, and at least one."""),
    "an order that is no number": (ValueOutOfRange, lambda: order_response(excited(), {float("nan"): 1.0}, [1.0]), """\
Orders of an excitation must be above zero, and finite."""),
    "an amplitude of an order that is no number": (ValueOutOfRange, lambda: order_response(excited(), {1.0: float("nan")}, [1.0]), """\
Amplitudes of an excitation must be finite."""),
    "a measurement sets what is to be found": (ValueOutOfRange, lambda: fitted(Numbers({"mass.w": 1.0}, until=1.0, parameters={"mass.J": 2.0})), """\
mass.J is to be found, and a measurement sets it.
Leave it out at one of the two places."""),
    "a column that does not exist": (UnknownName, lambda: fitted(Trajectories({"time": [1.0], "mass.v": [1.0]})), """\
Accelerated has no variable or parameter 'mass.v'; did you mean 'mass.w'?"""),
    "a model that cannot be computed": (CalibrationFailed, lambda: fitted(OperatingPoints({"torque.tau_constant": [1.0], "mass.w": [1.0]}, given=["torque.tau_constant"])), """\
Accelerated could not be calibrated: No steady state was found at t = 0 s: mass.w keeps changing.
Give a guess for which the model can be solved, or narrower bounds."""),
    "a value that was not calibrated": (UnknownName, lambda: fitted(Numbers({"mass.w": 2.0}, until=1.0))["mass.phi"], """\
'mass.phi' was not calibrated: mass.J."""),
    "no assignment": (ValueOutOfRange, lambda: read_assignment("motor.w"), """\
'motor.w' is not NAME=VALUE.
Write for example 'motor.w=4000 rpm'."""),
    "no range": (ValueOutOfRange, lambda: read_range("load=0:x:3"), """\
'load=0:x:3': '0:x:3' is neither FIRST:LAST:COUNT nor a list of numbers.
Write for example 'load=0:0.25:26 N.m' or 'load=0,0.1,0.2 N.m'."""),
    "a range given twice": (DuplicateName, lambda: by_name(map(read_range, ["J=0.4", "m=1,2", "J=0.5"]), "--over"), """\
--over gives J twice.
Give all its values at once: --over J=0.1,0.2."""),
    "a variable held twice": (DuplicateName, lambda: by_name(map(read_assignment, ["a.w=4 rpm", "a.w=5 rpm"]), "--hold"), """\
--hold gives a.w twice.
Leave out one of them."""),
    "a sweep as a picture": (NetlistError, lambda: write_dataset(swept(), Path("found.png")), """\
'found.png': a table can be .csv, .parquet, .nc.
`-` is standard output, as .csv."""),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_message(check_message, name):
    check_message(*CASES[name])


def test_a_checkpoint_of_another_sweep(tmp_path):
    swept(checkpoint=tmp_path / "runs.zarr")
    with pytest.raises(CheckpointMismatch) as caught:
        swept(over={"mass.J": [1.0, 3.0]}, checkpoint=tmp_path / "runs.zarr")
    assert str(caught.value) == (
        "runs.zarr is from another sweep: the model, its values, the points or the outputs differ.\n"
        "Name another file, or delete this one to start again."
    )


def test_a_folder_that_is_no_checkpoint(tmp_path):
    (tmp_path / "mine.txt").touch()
    with pytest.raises(CheckpointMismatch) as caught:
        swept(checkpoint=tmp_path)
    assert str(caught.value) == f"{tmp_path.name} exists and is not the checkpoint of a sweep."


def test_a_table_that_is_none(tmp_path):
    file = tmp_path / "measured.csv"
    for text, told in (
        ("time,mass.w\n0,abc\n", "measured.csv:2: 'abc' is not a number."),
        ("time,mass.w\n0,1,2\n", "measured.csv:2: 3 values under 2 names."),
    ):
        file.write_text(text)
        with pytest.raises(NetlistError) as caught:
            read_table(file)
        assert str(caught.value) == told


def test_pictures_that_cannot_be_drawn(tmp_path):
    run = simulate(model(), 0.1, points=5)
    measured = tmp_path / "bench.csv"
    measured.write_text("time,mass.w [mm]\n0,1\n")
    for draw, told in (
        (lambda: run.plot("2*mas.w"), "'2.0 * mas.w': Accelerated has no variable 'mas.w'; did you mean 'mass.w'?"),
        (lambda: run.plot("mass.w + mass.phi"), "'mass.w + mass.phi' mixes rad/s and rad."),
        (lambda: overlay({"run": run, "bench": measured}), "mass.w expects rad/s; '0 m' is m."),
        (lambda: overlay({"bench": measured}, "mass.a"), "bench has no variable 'mass.a'; did you mean 'mass.w'?"),
        (
            lambda: open_loop(model(), "mass.w"),
            "A compiled drive has no loop to open.\nGive the component or the netlist.",
        ),
        (lambda: open_loop(Accelerated(), "mass.w"), "Accelerated has no connected signal 'mass.w'."),
    ):
        with pytest.raises(ModelicaLikeError) as caught:
            draw()
        assert str(caught.value) == told


@pytest.mark.slow
def test_workers_that_die_again_and_again(monkeypatch):
    monkeypatch.setattr("modelica_like.analyse.sweeps.workers.run_chunk", dies)
    job = Job.of(model(), ["mass.J"], ["mass.w"], {"until": 1.0})
    with pytest.raises(WorkersLost) as caught:
        list(in_processes(job, [(0, [[1.0], [2.0]])], 1))
    assert str(caught.value) == (
        "2 runs of the sweep were not done: worker processes of this machine died 3 times.\n"
        "Finished runs are in the checkpoint, if there is one: start the sweep again with it. If they died at startup: "
        'put the work of a script under if __name__ == "__main__":, or set processes=1.'
    )
