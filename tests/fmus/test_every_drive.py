"""Every drive of examples/ as FMU: in docs/importers.md, as this test run finds it, and in its first instant."""

import importlib.util
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import fmpy
import pytest

from modelica_like import build, simulate
from modelica_like.compile.soon import TIME_RESOLUTION
from modelica_like.fmi.validate import validate_fmu
from modelica_like.native.start import initialize

SCRIPT = Path(__file__).parents[2] / "docs" / "importers.py"
INSTANT = 1e-9


def load_page() -> ModuleType:
    spec = importlib.util.spec_from_file_location("importers_page", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


page: Any = load_page()
REGENERATE = "the page is out of date: python docs/importers.py"


def test_what_fails_is_told_and_only_that() -> None:
    failing = {line.split(" | ")[0][2:] for part in page.SECTIONS for line in page.rows(part) if "fails" in line}
    section = page.PAGE.read_text(encoding="utf-8").partition("## What fails\n")[2].partition("\n## ")[0]
    assert failing == set(re.findall(r"^- `([^`]+)`", section, re.MULTILINE))


def test_has_every_drive_in_both_versions() -> None:
    listed = [line.strip("| ").split(" | ")[:2] for line in page.rows("exports")]
    assert listed == [[drive, version] for drive in page.drives() for version in page.VERSIONS], REGENERATE


@pytest.mark.slow
def test_reference_fmus(tmp_path: Path) -> None:
    assert page.reference_rows(tmp_path) == page.rows("reference"), REGENERATE


Export = Callable[[str], Path]


@pytest.fixture(scope="module", params=page.drives())
def drive(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def exported(drive: str, tmp_path_factory: pytest.TempPathFactory) -> Export:
    """Path of the drive as FMU, by version of the standard."""
    folder = tmp_path_factory.mktemp("fmus")
    return cache(lambda version: page.export(drive, version, folder))


@pytest.fixture(scope="module")
def version(drive: str) -> str:
    """The version of the standard whose turn it is."""
    return page.VERSIONS[page.drives().index(drive) % 2]


@pytest.mark.slow
def test_importers_find_what_the_page_says(drive: str, exported: Export) -> None:
    expected = [line for line in page.rows("exports") if line.startswith(f"| {drive} |")]
    assert [page.row(drive, one, validate_fmu(exported(one))) for one in page.VERSIONS] == expected, REGENERATE


@pytest.mark.slow
def test_starts_in_the_states_and_modes_of_a_simulation(
    drive: str, version: str, exported: Export, tmp_path: Path
) -> None:
    model = build(page.EXAMPLES / f"{drive}.toml")
    point = initialize(model, start=model.settings.get("start", "given"))
    run = simulate(model, INSTANT)

    folder = fmpy.extract(str(exported(version)), str(tmp_path))
    description: Any = fmpy.read_model_description(folder)
    references = {variable.name: variable.valueReference for variable in description.modelVariables}
    states = {name: x for name, x in zip(model.states, point.x, strict=True) if name in references}
    modes = {one.path: one.names for one in model.flat_discretes if one.names and not one.hidden}
    fmu = started(description, folder)
    values = (fmu.getReal if version == "2.0" else fmu.getFloat64)([references[name] for name in states])
    assert values == pytest.approx([*states.values()], rel=1e-9, abs=1e-9)
    # Before its events the mode of two parts at the same speed hangs on the last bit of that speed.
    (fmu.newDiscreteStates if version == "2.0" else fmu.updateDiscreteStates)()
    settled = (fmu.getInteger if version == "2.0" else fmu.getInt64)([references[path] for path in modes])
    for (path, names), mode in zip(modes.items(), settled, strict=True):
        # Events that are closer are at one instant in one of the two, and follow each other in the other.
        assert names[mode] in {names[int(k)] for k in run[path][run.time <= TIME_RESOLUTION]}, path
    fmu.terminate()
    fmu.freeInstance()


def started(description: Any, folder: str) -> Any:
    """An instance for Model Exchange at the end of its initialization."""
    fmu: Any = fmpy.instantiate_fmu(folder, description, "ModelExchange")
    if description.fmiVersion == "2.0":
        fmu.setupExperiment(tolerance=1e-8)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    return fmu
