"""Compiled models, made once per run of the tests, and FMPy's faces to them."""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.fmi3 import FMU3Model, FMU3Slave

from modelica_like import build
from modelica_like.compile import CompiledDae
from modelica_like.fmi.build import PLATFORMS, native_platform
from modelica_like.fmi.interface import Interface, interface
from modelica_like.fmi.model_file import MODEL, model_file
from modelica_like.fmi.runtime import runtime_library
from modelica_like.fmi.tables import make_tables

EXAMPLES = Path(__file__).parents[2] / "examples"
TOKEN = "{a-token}"


@dataclass(frozen=True)
class Exported:
    """A model with the compiled run-time, as FMPy finds it."""

    model: CompiledDae
    face: Interface
    folder: Path
    version: str

    def ref(self, name: str) -> int:
        return self.face.by_name[name].reference

    def instance(self, kind: str = "cs", **instantiate: Any) -> Any:
        """An instance that is not initialized yet."""
        classes = {"cs2.0": FMU2Slave, "me2.0": FMU2Model, "cs3.0": FMU3Slave, "me3.0": FMU3Model}
        fmu = classes[kind + self.version](
            guid=TOKEN, unzipDirectory=str(self.folder), modelIdentifier="model", instanceName="one"
        )
        fmu.instantiate(**instantiate)
        return fmu

    def started(self, kind: str = "cs", *, until: float | None = None, tolerance: float = 1e-8, **values: Any) -> Any:
        """An instance at the end of its initialization, with some start values."""
        fmu = self.instance(kind)
        self.initialize(fmu, until=until, tolerance=tolerance, **values)
        return fmu

    def initialize(self, fmu: Any, *, until: float | None = None, tolerance: float = 1e-8, **values: Any) -> None:
        references = [self.ref(name) for name in values]
        numbers = list(values.values())
        if self.version == "2.0":
            fmu.setupExperiment(tolerance=tolerance, startTime=0.0, stopTime=until)
            fmu.enterInitializationMode()
            fmu.setReal(references, numbers)
        else:
            fmu.enterInitializationMode(tolerance=tolerance, startTime=0.0, stopTime=until)
            fmu.setFloat64(references, numbers)
        fmu.exitInitializationMode()

    def states(self, fmu: Any) -> list[float]:
        references = [self.ref(name) for name in self.model.states if name in self.face.by_name]
        return list(fmu.getReal(references) if self.version == "2.0" else fmu.getFloat64(references))


@pytest.fixture(scope="session")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Exported]:
    """Lay out a netlist of examples/ or a component as an unpacked FMU, once per run of the tests."""

    @cache
    def make(drive: Any, version: str = "2.0", fixed_step: float = 0.0) -> Exported:
        model = build(EXAMPLES / drive if isinstance(drive, str) else drive)
        face = interface(model)
        folder = tmp_path_factory.mktemp("fmu")
        native = PLATFORMS[native_platform()]
        place = folder / "binaries" / (native.fmi2 if version == "2.0" else native.name)
        place.mkdir(parents=True)
        shutil.copy(runtime_library(native.name), place / f"model{native.suffix}")
        (folder / MODEL).parent.mkdir()
        (folder / MODEL).write_bytes(model_file(make_tables(model), face.variables, TOKEN, 1e-7, fixed_step))
        return Exported(model, face, folder, version)

    return make


@pytest.fixture
def example() -> Path:
    """The drive that the demands on size are about."""
    return EXAMPLES / "msl" / "rotational" / "CoupledClutches.toml"
