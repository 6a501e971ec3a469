"""Tables whose numbers are parameters: the same results, other ones without compiling again, arrays in FMI 3."""

import re
import zipfile

import casadi as ca
import fmpy
import numpy as np
import pytest
from fmpy.fmi3 import FMU3Slave

from components.blocks.signals import Table
from components.clutches.friction import BearingFriction
from components.gears.gearboxes import Gearbox
from components.gears.shift_schedule import ShiftSchedule
from components.mechanics.inertias import Inertia
from modelica_like import Assembly, build, export_fmu, sensitivities, simulate
from modelica_like.errors import ExportError, LanguageError, ModelicaLikeError, UnknownName, ValueOutOfRange
from modelica_like.fmi.run import run_fmu
from modelica_like.language import interpolate

ROWS = [[0.0, 1.0], [10.0, 1.5], [20.0, 4.0]]
SPEED, INERTIA, END = 25.0, 2.0, 3.0
CELLS = [f"bearing.tau_pos[{i},{j}]" for i in (1, 2, 3) for j in (1, 2)]


def drive(rows=ROWS, smooth: bool = False) -> Assembly:
    parts = {"J": Inertia(J=INERTIA, w=SPEED, phi=0.0), "bearing": BearingFriction(tau_pos=rows, smooth=smooth)}
    return Assembly("coasting", parts=parts, connect={"shaft": ["J.flange_b", "bearing.flange_a"]})


def constant(torque: float) -> dict[str, float]:
    """Values of a table with one torque at all speeds, under which the speed falls on a straight line."""
    return {name: torque for name in CELLS if name.endswith(",2]")}


def flat(torque: float) -> list[float]:
    """The same as the numbers of an array."""
    return [number for w, _ in ROWS for number in (w, torque)]


def speed(torque: float, time: float) -> float:
    return SPEED - torque / INERTIA * time


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("solver", ["idas", "native"])
def test_numbers_as_parameters_change_nothing(smooth, solver):
    plain = simulate(drive(smooth=smooth), END, solver=solver, rtol=1e-9)
    tuned = simulate(build(drive(smooth=smooth), tables=["*"]), END, solver=solver, rtol=1e-9)
    assert [one.path for one in build(drive(), tables=["bearing.tau_pos"]).flat_parameters if "[" in one.path] == CELLS
    assert tuned["J.w"][-1] == pytest.approx(plain["J.w"][-1], rel=1e-9)


@pytest.mark.parametrize("ys", [(1, 2, 5, 5.5), (1, 2, 2, 5), (3, 1, 4, 0.5), (0, 0, 0, 0)])
def test_a_smooth_table_of_symbols_is_that_of_numbers(ys):
    xs = (0.0, 1.0, 3.0, 4.0)
    x, symbols = ca.SX.sym("x"), ca.SX.sym("table", 8)
    cells = ca.vertsplit(symbols)
    both = [interpolate(x, xs, ys, smooth=True), interpolate(x, cells[:4], cells[4:], smooth=True)]
    compare = ca.Function("compare", [x, symbols], [*both, ca.jacobian(both[1], symbols)])
    for at in (-1.0, 0.0, 0.3, 1.0, 2.2, 3.0, 3.9, 5.0):
        first, second, slopes = compare(at, [*xs, *ys])
        assert float(second) == pytest.approx(float(first), rel=1e-14, abs=1e-14)
        assert np.all(np.isfinite(np.array(slopes)))


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_other_numbers_take_the_same_model(solver):
    model = build(drive(), tables=["bearing.tau_pos"])
    run = simulate(model, END, parameters=constant(2.5), solver=solver)
    assert run["J.w"][-1] == pytest.approx(speed(2.5, END), rel=1e-6)
    moved = simulate(model, END, parameters={CELLS[2]: 5.0, CELLS[3]: 2.0}, solver=solver, rtol=1e-9)
    rows = [ROWS[0], [5.0, 2.0], ROWS[2]]
    assert moved["J.w"][-1] == pytest.approx(simulate(drive(rows), END, rtol=1e-9)["J.w"][-1], rel=1e-7)


def test_gradients_by_numbers_of_a_table():
    """Where one torque holds at all speeds, its numbers together have the slope -t/J."""
    run = simulate(build(drive(), tables=["*"]), END, parameters=constant(2.5), rtol=1e-9)
    found = sensitivities(run, "J.w", [name for name in CELLS if name.endswith(",2]")])
    assert np.sum(found.derivatives) == pytest.approx(-END / INERTIA, rel=1e-6)


FALLS = "bearing.tau_pos[2,1] = -1 is not above bearing.tau_pos[1,1] = 0: this column of the table must rise."


def test_columns_must_go_on_rising():
    model = build(drive(), tables=["*"])
    with pytest.raises(ValueOutOfRange, match=re.escape(FALLS)):
        simulate(model, END, parameters={CELLS[2]: -1.0})
    handle = model.native(outputs=["J.w"])
    with pytest.raises(ModelicaLikeError, match=re.escape(FALLS)):
        handle.reset({CELLS[2]: -1.0}, until=END)


def test_times_of_a_table_are_parameters():
    rows = [[0.0, 0.0], [1.0, 2.0], [2.0, 0.0]]
    model = build(Assembly("signal", parts={"source": Table(table=rows), "J": Inertia(J=1, w=0, phi=0)}), tables=["*"])
    run = simulate(model, 3.0, parameters={"source.table[2,1]": 1.5})
    assert run.at(1.5)["source.y"] == pytest.approx(2.0, abs=1e-12)
    assert run.at(1.75)["source.y"] == pytest.approx(1.0, abs=1e-9)


def test_what_cannot_be_tuned_is_told():
    with pytest.raises(UnknownName, match=re.escape("has no table 'bearing.tau_po'; did you mean 'bearing.tau_pos'?")):
        build(drive(), tables=["bearing.tau_po"])
    gearbox = Assembly("g", parts={"box": Gearbox(ratio=2, c=1e3, d=1.0)})
    with pytest.raises(LanguageError, match=r"box\.loss_table cannot be parameters: its parts are made from it"):
        build(gearbox, tables=["box.loss_table"])
    schedule = Assembly("s", parts={"shifts": ShiftSchedule(shifts=[[0, "N", 1], [2, "1", 0.5]])})
    with pytest.raises(LanguageError, match=r"shifts\.shifts cannot be parameters: it has texts"):
        build(schedule, tables=["shifts.shifts"])
    with pytest.raises(LanguageError, match="Tables of a compiled model cannot change"):
        build(build(drive()), tables=["*"])
    with pytest.raises(ExportError, match="A compiled model has no tables"):
        export_fmu(build(drive()), "x.fmu", tables=["*"])


# -- FMUs --------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tables")
    paths = {version: folder / f"coasting{version[0]}.fmu" for version in ("2.0", "3.0")}
    for version, path in paths.items():
        export_fmu(drive(), path, version, tables=["bearing.tau_pos"], check=False)
    return paths


def test_fmi3_has_an_array_and_fmi2_scalars(fmus):
    third = {one.name: one for one in fmpy.read_model_description(str(fmus["3.0"]), validate=True).modelVariables}
    second = {one.name: one for one in fmpy.read_model_description(str(fmus["2.0"]), validate=True).modelVariables}
    table = third["bearing.tau_pos"]
    assert (table.shape, table.variability, table.causality) == ((3, 2), "tunable", "parameter")
    assert np.array_equal(np.array(table.start.split(), float), np.ravel(ROWS))
    assert "rows of speed, friction torque" in table.description
    assert not third.keys() & set(CELLS)
    assert "bearing.tau_pos" not in second
    assert [float(second[name].start) for name in CELLS] == [*np.ravel(ROWS)]
    with zipfile.ZipFile(fmus["3.0"]) as archive:
        assert b"Dimension" in archive.read("modelDescription.xml")


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_importers_set_arrays_and_scalars(fmus, kind):
    starts = {"3.0": {"bearing.tau_pos": flat(2.5)}, "2.0": constant(2.5)}
    for version, values in starts.items():
        run = fmpy.simulate_fmu(
            str(fmus[version]),
            stop_time=END,
            start_values=values,
            output=["J.w"],
            fmi_type=kind,
            relative_tolerance=1e-8,
        )
        assert run["J.w"][-1] == pytest.approx(speed(2.5, END), rel=1e-5)


@pytest.mark.parametrize("rows", [flat(2.5), np.reshape(flat(2.5), (3, 2)), [[w, 2.5] for w, _ in ROWS]])
def test_run_fmu_sets_arrays(fmus, rows):
    run = run_fmu(fmus["3.0"], parameters={"bearing.tau_pos": rows, "J.J": 2 * INERTIA}, stop=END, outputs=["J.w"])
    assert run["J.w"][-1] == pytest.approx(SPEED - 2.5 / (2 * INERTIA) * END, rel=1e-5)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        (
            "bearing.tau_pos",
            [[0, 10, 20], [2, 2, 2]],
            "'bearing.tau_pos' takes an array of 3 x 2, not an array of 2 x 3.",
        ),
        ("bearing.tau_pos", [0, 1, 2, 3], "'bearing.tau_pos' takes an array of 3 x 2, not an array of 4."),
        ("bearing.tau_pos", 2.5, "'bearing.tau_pos' takes an array of 3 x 2, not a number."),
        ("J.J", [2.0], "'J.J' takes a number, not an array of 1."),
        ("bearing.tau_pos", [[0, 1], [2]], "'bearing.tau_pos' must be a number or an array of numbers."),
        ("bearing.tau_pos", [["a", "b"]] * 3, "'bearing.tau_pos' must be a number or an array of numbers."),
    ],
)
def test_run_fmu_refuses_arrays_of_other_shapes(fmus, name, value, said):
    with pytest.raises(ValueOutOfRange, match=re.escape(said)):
        run_fmu(fmus["3.0"], parameters={name: value}, stop=END)


@pytest.fixture
def instance(fmus, tmp_path):
    description = fmpy.read_model_description(str(fmus["3.0"]))
    fmpy.extract(str(fmus["3.0"]), str(tmp_path))
    fmu = FMU3Slave(
        guid=description.guid, unzipDirectory=str(tmp_path), instanceName="one",
        modelIdentifier=description.coSimulation.modelIdentifier,
    )  # fmt: skip
    said: list[str] = []
    fmu.instantiate(logMessage=lambda *given: said.append(given[-1].decode()))
    yield fmu, {one.name: one.valueReference for one in description.modelVariables}, said
    fmu.freeInstance()


def test_an_array_is_tuned_during_a_run(instance):
    fmu, references, _ = instance
    table, wheel = references["bearing.tau_pos"], references["J.w"]
    fmu.enterInitializationMode(stopTime=2 * END)
    fmu.setFloat64([table], flat(2.5))
    fmu.exitInitializationMode()
    fmu.doStep(0.0, END)
    assert fmu.getFloat64([wheel])[0] == pytest.approx(speed(2.5, END), rel=1e-6)
    fmu.setFloat64([table], flat(1.0))
    assert fmu.getFloat64([wheel, table], nValues=7)[1:] == [0, 1, 10, 1, 20, 1]
    fmu.doStep(END, END)
    assert fmu.getFloat64([wheel])[0] == pytest.approx(speed(2.5, END) - END / INERTIA, rel=1e-6)


def test_an_array_that_does_not_rise_is_an_error_with_a_sentence(instance):
    fmu, references, said = instance
    fmu.enterInitializationMode()
    fmu.setFloat64([references["bearing.tau_pos"]], [0.0, 1.0, -1.0, 1.5, 20.0, 4.0])
    with pytest.raises(fmpy.fmi1.FMICallException):
        fmu.exitInitializationMode()
    assert said == [FALLS]
    with pytest.raises(fmpy.fmi1.FMICallException):
        fmu.setFloat64([references["bearing.tau_pos"]], [0.0, 1.0])
    assert said[1:] == ["fmi3SetFloat64 is not allowed now: an earlier call failed: reset or free the instance."]
