"""Derivatives of a whole run from an exported FMU alone: what docs/fmu.md shows, through FMPy and ctypes."""

import ctypes
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.simulation import instantiate_fmu

from modelica_like import build, export_fmu

CLUTCHES = Path(__file__).parents[2] / "examples" / "msl" / "rotational" / "CoupledClutches.toml"
END, OF, BY = 1.5, ["J3.w", "J4.phi"], ["J1.J", "clutch1.fn_max", "f"]


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("gradients")
    paths = {}
    for version, embed in (("2.0", False), ("3.0", False), ("3.0", True)):
        paths[version, embed] = folder / f"drive{version[0]}{embed}.fmu"
        export_fmu(CLUTCHES, paths[version, embed], version, check=False, embed=embed)
    return paths


def opened(path, kind="CoSimulation"):
    said = []
    description = fmpy.read_model_description(str(path))
    # FMPy keeps the last logger of FMI 2.0 in a global variable, and calls it when it is gone.
    logger = (lambda *told: said.append(str(told[-1]))) if description.fmiVersion == "3.0" else None
    fmu = instantiate_fmu(fmpy.extract(str(path)), description, kind, logger=logger)
    numbers = {one.name: one.valueReference for one in description.modelVariables}
    return fmu, lambda names: (ctypes.c_uint32 * len(names))(*(numbers[name] for name in names)), said


def functions(fmu):
    start, read = fmu.dll.modelica_like_gradient_start, fmu.dll.modelica_like_gradient
    start.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t]
    read.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p]
    return start, read


def gradient_of(path, version):
    """By 30 communication steps."""
    fmu, references, said = opened(path)
    start, read = functions(fmu)
    if version == "2.0":
        fmu.setupExperiment(tolerance=1e-8, startTime=0.0, stopTime=END)
        fmu.enterInitializationMode()
    else:
        fmu.enterInitializationMode(tolerance=1e-8, startTime=0.0, stopTime=END)
    assert start(fmu.component, references(BY), len(BY)) == 0
    fmu.exitInitializationMode()
    for k in range(30):
        fmu.doStep(currentCommunicationPoint=END * k / 30, communicationStepSize=END / 30)
    found = np.zeros((len(OF), len(BY)))
    assert read(fmu.component, references(OF), len(OF), found.ctypes.data) == 0, said
    fmu.terminate()
    fmu.freeInstance()
    return found


@pytest.mark.slow
def test_an_fmu_gives_what_a_handle_gives(fmus):
    handle = build(CLUTCHES).native(outputs=OF, by=BY, rtol=1e-8)
    handle.reset(until=END)
    for k in range(1, 31):
        handle.step(END * k / 30)
    found = {key: gradient_of(path, key[0]) for key, path in fmus.items()}
    assert np.array_equal(found["3.0", False], found["3.0", True])
    assert np.array_equal(found["2.0", False], found["3.0", False])
    np.testing.assert_allclose(found["2.0", False], handle.gradient(), rtol=1e-6)


def test_wrong_calls_are_told(fmus):
    fmu, references, said = opened(fmus["3.0", False])
    start, read = functions(fmu)
    room = np.zeros(1)
    assert start(None, references(BY), 3) == 1
    assert start(fmu.component, references(BY), 3) == 1
    assert "not allowed now: the instance is not initialized" in said[-1]
    fmu.enterInitializationMode()
    assert start(fmu.component, None, 1) == 1
    assert "null pointer" in said[-1]
    assert start(fmu.component, references(["clutch1.mode"]), 1) == 1
    assert "not of type Real" in said[-1]
    assert start(fmu.component, references(["clutch1.tau"]), 1) == 1
    assert "Derivatives with respect to clutch1.tau are not available" in said[-1]
    assert start(fmu.component, references(["J1.w"]), 1) == 0
    fmu.exitInitializationMode()
    assert read(fmu.component, references(["clutch1.mode"]), 1, room.ctypes.data) == 1
    assert read(fmu.component, references(["J1.w"]), 1, room.ctypes.data) == 0
    assert room[0] == pytest.approx(1.0, abs=1e-9)
    fmu.reset()
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    assert read(fmu.component, references(["J1.w"]), 1, room.ctypes.data) == 1
    assert "has not been called" in said[-1]
    fmu.freeInstance()


def test_model_exchange_is_the_importers(fmus):
    fmu, references, said = opened(fmus["3.0", False], "ModelExchange")
    fmu.enterInitializationMode()
    assert functions(fmu)[0](fmu.component, references(BY), 3) == 1
    assert "Co-Simulation" in said[-1]
    fmu.freeInstance()


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_what_a_touch_moves_has_no_derivative(tmp_path, version):
    """A freewheel that just closes at 1.5 s, or not: by an offset of its torque there is none, by its mass there is."""
    path = tmp_path / "drive.fmu"
    drive = CLUTCHES.with_name("OneWayClutch.toml")
    export_fmu(drive, path, version, check=False, embed=False)
    fmu, references, said = opened(path)
    start, read = functions(fmu)
    by, of, found = ["signalTorque.offset", "inertiaIn.J"], ["inertiaIn.w"], np.zeros((1, 2))
    times = {"tolerance": 1e-8, "startTime": 0.0, "stopTime": 2.0}
    if version == "2.0":
        fmu.setupExperiment(**times)
    fmu.enterInitializationMode(**({} if version == "2.0" else times))
    assert start(fmu.component, references(by), 2) == 0
    fmu.exitInitializationMode()
    fmu.doStep(currentCommunicationPoint=0.0, communicationStepSize=2.0)
    assert read(fmu.component, references(of), 1, found.ctypes.data) == 0, said
    fmu.terminate()
    fmu.freeInstance()
    handle = build(drive).native(outputs=of, by=by[1:], rtol=1e-8)
    handle.reset(until=2.0)
    handle.step(2.0)
    assert np.isnan(found[0, 0])
    assert found[0, 1] == handle.gradient()[0, 0]
