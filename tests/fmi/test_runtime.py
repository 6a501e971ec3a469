"""The compiled run-time: where it is found, where it finds its model, and the same results as with one compiled in."""

import ctypes
import os
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

import modelica_like.fmi.build as build_module
import modelica_like.fmi.runtime as module
from modelica_like import export_fmu
from modelica_like.errors import ExportError
from modelica_like.fmi.build import native_platform
from modelica_like.fmi.runtime import build_runtime, cache_folder, found_runtime, runtime_library
from modelica_like.fmi.sources import RUNTIME, runtime_sources

EXAMPLES = Path(__file__).parents[2] / "examples"
NATIVE = native_platform()


@pytest.mark.parametrize("drive", ["msl/rotational/CoupledClutches", pytest.param("dc_bench", marks=pytest.mark.slow)])
@pytest.mark.parametrize("version", [pytest.param("2.0", marks=pytest.mark.slow), "3.0"])
def test_both_ways_of_export_give_the_same_bits(drive, version, tmp_path):
    paths = [tmp_path / "shipped.fmu", tmp_path / "embedded.fmu"]
    for path, embed in zip(paths, (False, True), strict=True):
        export_fmu(EXAMPLES / f"{drive}.toml", path, version, embed=embed, check=False)
        with zipfile.ZipFile(path) as archive:
            assert ("resources/model.bin" in archive.namelist()) == (not embed)
    variables = fmpy.read_model_description(str(paths[0])).modelVariables
    names = [one.name for one in variables if one.type in ("Real", "Float64") and one.causality != "independent"]
    for kind in ("ModelExchange", "CoSimulation"):
        runs = [fmpy.simulate_fmu(str(path), fmi_type=kind, output=names) for path in paths]
        assert len(runs[0]) > 100
        assert runs[0].tobytes() == runs[1].tobytes()


@pytest.mark.parametrize(
    ("drive", "version"),
    [
        ("elements/switching", "2.0"),
        ("machine_tool_startup", "3.0"),
        pytest.param("winch", "2.0", marks=pytest.mark.slow),
    ],
)
def test_compiled_equations_give_the_same_bits(drive: str, version: str, tmp_path: Path) -> None:
    """Also in Model Exchange, and where the sources are compiled one by one, as an importer does."""
    paths = [tmp_path / "tapes.fmu", tmp_path / "compiled.fmu"]
    for path, compiled in zip(paths, (False, True), strict=True):
        export_fmu(EXAMPLES / f"{drive}.toml", path, version, compiled=compiled, check=False)
    with zipfile.ZipFile(paths[1]) as archive:
        assert "resources/model.bin" not in archive.namelist()
        assert b"run_0" in archive.read("sources/code_model.c")
        archive.extractall(tmp_path / "unpacked")
    described = fmpy.read_model_description(str(paths[1]))
    sources = tmp_path / "unpacked" / "sources"
    list_of_sources = sources.parent / "modelDescription.xml" if version == "2.0" else sources / "buildDescription.xml"
    assert '"code_model.c"' in list_of_sources.read_text()
    command = ["cc", "-std=c99", "-shared", "-fPIC", "-o", str(tmp_path / "own.so")]
    subprocess.run([*command, *map(str, sorted(sources.glob("*.c"))), "-lm"], check=True)
    names = [v.name for v in described.modelVariables if v.type in ("Real", "Float64") and v.causality != "independent"]
    for kind in ("ModelExchange", "CoSimulation"):
        runs = [fmpy.simulate_fmu(str(path), fmi_type=kind, output=names) for path in paths]
        assert len(runs[0]) > 100
        assert runs[0].tobytes() == runs[1].tobytes()


# -- where the model is ------------------------------------------------------------------------------------------------

PLACES = [
    ("file:///tmp/a%20b/resources", "/tmp/a b/resources/model.bin", "/tmp/a b/resources/model.bin"),
    ("file:/tmp/r/", "/tmp/r/model.bin", "/tmp/r/model.bin"),
    ("file://localhost/tmp/r", "/tmp/r/model.bin", "/tmp/r/model.bin"),
    ("FILE:///tmp/%C3%BC%e2%82%ac", "/tmp/ü€/model.bin", "/tmp/ü€/model.bin"),
    ("/tmp/100%/r/", "/tmp/100%/r/model.bin", "/tmp/100%/r/model.bin"),
    ("/tmp/r?x#y", "/tmp/r?x#y/model.bin", "/tmp/r?x#y/model.bin"),
    ("resources", "resources/model.bin", "resources/model.bin"),
    ("file:///C:/a%20b/resources", "/C:/a b/resources/model.bin", "C:/a b/resources/model.bin"),
    ("file:/C:/r", "/C:/r/model.bin", "C:/r/model.bin"),
    ("file://C:/r", None, "C:/r/model.bin"),
    ("file:///C|/r", "/C|/r/model.bin", "C:/r/model.bin"),
    ("C:\\r\\", "C:\\r\\/model.bin", "C:\\r\\model.bin"),
    ("\\\\server\\share\\r", "\\\\server\\share\\r/model.bin", "\\\\server\\share\\r/model.bin"),
    ("file://server/share/r", None, "//server/share/r/model.bin"),
    ("file:////server/share/r", "//server/share/r/model.bin", "//server/share/r/model.bin"),
    ("http://server/r", None, None),
    ("file:///tmp/%zz", None, None),
    ("file:///tmp/%00", None, None),
    ("file:///tmp/%4", None, None),
    ("file:", None, None),
    ("file:///" + 5000 * "a", None, None),
]


@pytest.fixture(scope="module")
def places(tmp_path_factory) -> Callable[[str, int], str | None]:
    folder = tmp_path_factory.mktemp("places")
    for name, text in runtime_sources(()).items():
        (folder / name).write_text(text)
    command = [*build_module.compiler_command(NATIVE), "-std=c99", "-shared", "-fPIC", "-o", "places.so"]
    subprocess.run([*command, "model_data.c", *RUNTIME, "-lm"], cwd=folder, check=True)
    library = ctypes.CDLL(str(folder / "places.so"))

    def place(location: str, windows: int) -> str | None:
        path = ctypes.create_string_buffer(4096)
        found = library.resource_path(location.encode(), windows, path, ctypes.c_size_t(len(path)))
        return path.value.decode() if found else None

    return place


@pytest.mark.parametrize(("location", "here", "windows"), PLACES)
def test_locations_of_resources(places, location, here, windows):
    assert places(location, 0) == here
    assert places(location, 1) == windows


def instantiated(version: str, folder: Path, token: str, location: bytes | None) -> tuple[Any, list[str]]:
    """An instance with resources somewhere, or none, and what it said."""
    said: list[str] = []
    kind = FMU2Slave if version == "2.0" else FMU3Slave
    fmu: Any = kind(guid=token, unzipDirectory=str(folder), modelIdentifier="two_mass", instanceName="one")
    if version == "2.0":
        logger: Any = fmpy.fmi2.fmi2CallbackLoggerTYPE(lambda e, n, s, c, message: said.append(message.decode()))
        callbacks = fmpy.fmi2.fmi2CallbackFunctions()
        callbacks.logger = logger
        made = fmu.fmi2Instantiate(b"one", 1, token.encode(), location, ctypes.byref(callbacks), 0, 0)
    else:
        logger = fmpy.fmi3.fmi3LogMessageCallback(lambda e, s, c, message: said.append(message.decode()))
        update = fmpy.fmi3.fmi3IntermediateUpdateCallback(0)
        make = fmu.fmi3InstantiateCoSimulation
        made = make(b"one", token.encode(), location, False, False, False, False, None, 0, None, logger, update)
    return made, said


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_what_is_missing_is_told(version, tmp_path):
    export_fmu(EXAMPLES / "two_mass.toml", tmp_path / "two_mass.fmu", version, check=False)
    folder = tmp_path / "a folder, unpäcked"
    fmpy.extract(str(tmp_path / "two_mass.fmu"), str(folder))
    token = fmpy.read_model_description(str(tmp_path / "two_mass.fmu")).guid
    made, said = instantiated(version, folder, token, (folder / "resources").as_uri().encode())
    assert made
    assert said == []
    made, said = instantiated(version, folder, token, None)
    assert not made
    assert said == [
        "The importer does not say where the FMU's resources are, so its model cannot be read. Export it with the "
        "model compiled in (--embed)."
    ]
    made, said = instantiated(version, folder, token, b"/no/where")
    assert not made
    assert said == ["The model file cannot be opened: '/no/where/model.bin'."]
    model = folder / "resources" / "model.bin"
    model.write_bytes(model.read_bytes()[:-100])
    made, said = instantiated(version, folder, token, str(model.parent).encode())
    assert not made
    assert said == ["The model file is damaged (it is truncated). Export the model again."]


# -- where the library is ----------------------------------------------------------------------------------------------


@pytest.fixture
def nothing_built(monkeypatch, tmp_path) -> Path:
    """Neither the package nor the cache has a library."""
    monkeypatch.setenv("MODELICA_LIKE_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(module, "SHIPPED", tmp_path / "shipped")
    return tmp_path


@pytest.mark.slow
def test_a_library_is_built_once(nothing_built):
    assert found_runtime(NATIVE) is None
    said: list[str] = []
    library = runtime_library(NATIVE, said.append)
    assert library.parent == nothing_built / "cache" / NATIVE == cache_folder() / NATIVE
    assert list(library.parent.iterdir()) == [library]
    assert runtime_library(NATIVE, said.append) == library
    assert said == [f"compiling the run-time for {NATIVE}, once"]
    assert library.stat().st_size < 330_000  # every FMU carries one


@pytest.mark.slow
def test_a_library_of_other_sources_is_not_used(nothing_built, monkeypatch):
    library = build_runtime(NATIVE, nothing_built / "shipped" / NATIVE)
    assert runtime_library(NATIVE) == library
    monkeypatch.setattr(module, "own_sources", lambda _: {"model.c": "/* changed */"})
    assert found_runtime(NATIVE) is None
    said: list[str] = []
    monkeypatch.setattr(module, "build", lambda sources, platform, folder: library)
    assert runtime_library(NATIVE, said.append).parent == cache_folder() / NATIVE
    assert said == [f"compiling the run-time for {NATIVE}, once: its sources have changed"]


def test_without_a_compiler_one_is_asked_for(nothing_built, monkeypatch):
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(build_module.shutil, "which", lambda _: None)
    monkeypatch.setattr(build_module, "find_spec", lambda _: None)
    with pytest.raises(ExportError) as caught:
        export_fmu(EXAMPLES / "two_mass.toml", nothing_built / "d.fmu")
    assert str(caught.value) == (
        "There is no C compiler.\nInstall cc, gcc or clang, or zig by `pip install modelica-like[cross]`."
    )


def test_instances_of_different_models_do_not_disturb_each_other(exported):
    """One library in one process, called in turns."""
    drives = ("two_mass.toml", "dc_bench.toml")
    alone: dict[str, list[float]] = {}
    for drive in drives:
        fmu = exported(drive).started(until=1.0)
        for k in range(5):
            fmu.doStep(0.1 * k, 0.1)
        alone[drive] = exported(drive).states(fmu)
    pairs = [(drive, exported(drive).started(until=1.0)) for drive in drives]
    for k in range(5):
        for _, fmu in pairs:
            fmu.doStep(0.1 * k, 0.1)
    for drive, fmu in pairs:
        np.testing.assert_array_equal(exported(drive).states(fmu), alone[drive])


def test_one_library_has_the_functions_of_both_versions_of_native_runs_and_gradients_only():
    library = runtime_library(NATIVE)
    listed = subprocess.run(["nm", "-D", "--defined-only", library], capture_output=True, text=True, check=True).stdout
    sources = runtime_sources(("2.0", "3.0", "native"))
    declared: set[str] = set()
    for v in "23":
        declared |= set(re.findall(rf"FMI{v}_Export \w+\s+(fmi\w+);", sources[f"fmi{v}Functions.h"]))
    assert len(declared) == 44 + 75
    for name in ("native.c", "batch.c", "modelica_like.h"):
        declared |= set(re.findall(r"^EXPORTED .*?\b((?:native|modelica_like)_\w+)\(", sources[name], re.MULTILINE))
    assert {line.split()[-1] for line in listed.splitlines()} == declared
    needed = re.findall(rb"GLIBC_(\d+)\.(\d+)", library.read_bytes())
    assert max((int(a), int(b)) for a, b in needed) <= (2, 17)


def wheel(folder: Path, **environment: str) -> list[str]:
    """Make a wheel of a copy of the sources, and return its name and what is in it."""
    root, copy = Path(__file__).parents[2], folder / "copy"
    copy.mkdir()
    for name in ("modelica_like", "components", "examples"):
        shutil.copytree(root / name, copy / name, ignore=shutil.ignore_patterns("__pycache__", "runtimes"))
    for name in ("pyproject.toml", "hatch_build.py", "README.md", "LICENSE"):
        shutil.copy(root / name, copy / name)
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(folder), str(copy)]
    without = {name: value for name, value in os.environ.items() if name != "CC"}
    subprocess.run(command, check=True, env={**without, **environment}, timeout=900)
    (made,) = folder.glob("*.whl")
    with zipfile.ZipFile(made) as archive:
        return [made.stem, *archive.namelist()]


@pytest.mark.slow
def test_a_wheel_without_a_library_is_pure_python(tmp_path):
    """With one: tests/wheel."""
    name, *files = wheel(tmp_path, MODELICA_LIKE_PLATFORMS="none")
    assert name.endswith("-py3-none-any")
    assert not [file for file in files if "/runtimes/" in file]


@pytest.mark.slow
def test_a_wheel_is_compiled_where_there_is_no_compiler(tmp_path):
    """By zig, which the build asks for there."""
    (tmp_path / "bin").mkdir()
    _, *files = wheel(tmp_path, PATH=str(tmp_path / "bin"))
    (library,) = [file for file in files if "/runtimes/" in file]
    assert f"/runtimes/{NATIVE}/" in library
