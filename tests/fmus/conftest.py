"""The reference FMUs, built once for all tests."""

import importlib.util
import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType

import pytest

HERE = Path(__file__).parent
FMUS = HERE.parents[1] / "fmus"

Built = Mapping[tuple[str, str], Path]


@pytest.fixture(scope="session")
def builder() -> ModuleType:
    """fmus/build.py"""
    spec = importlib.util.spec_from_file_location("build_reference_fmus", FMUS / "build.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    # Dataclasses look their module up.
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def reference_fmus(builder: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Built:
    """Path of each reference FMU, by name and version of the standard."""
    paths = builder.build(target=tmp_path_factory.mktemp("reference_fmus"))
    return {(path.stem[: -len("_fmi2")], f"{path.stem[-1]}.0"): path for path in paths}


@pytest.fixture(scope="session")
def hostile(builder: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An FMU that does what it is told to do wrong."""
    return builder.build_one(HERE / "hostile", "2.0", tmp_path_factory.mktemp("hostile"))
