"""Libraries of components: what they offer, and that only what is used is loaded."""

import ast
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

import components
from components import Clutch
from modelica_like.errors import NetlistError, UnknownName
from modelica_like.language import Component
from modelica_like.netlist import find_type, library_types, registry, type_name


def test_the_stub_tells_type_checkers_what_the_library_has():
    assert components.__file__ is not None
    stub = ast.parse(Path(components.__file__).with_suffix(".pyi").read_text())
    told = {alias.name: node.module for node in stub.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    homes = {name: f"components.{module}" for module, names in components._NAMES.items() for name in names.split()}  # type: ignore[attr-defined]
    assert told == homes
    assert sorted(told) == components.__all__
    assert set(components.__all__) <= set(dir(components))
    assert all(getattr(components, name).__name__ == name for name in components.__all__)


def test_a_name_or_module_that_the_library_has_not_is_an_attribute_error():
    assert components.friction.Clutch is Clutch
    with pytest.raises(AttributeError, match="module 'components' has no attribute 'Cluch'"):
        assert components.Cluch  # type: ignore[attr-defined]


def test_a_netlist_loads_only_the_modules_of_its_parts():
    code = (
        "import sys; from modelica_like.netlist import loads;"
        "loads('[parts]\\nm = { is = \"Inertia\", J = 1.0 }');"
        "print(*sorted(name for name in sys.modules if name.startswith('components.')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["components.inertias", "components.interfaces"]


@pytest.fixture
def libraries(monkeypatch):
    """Replace the installed libraries by modules of the test."""

    def install(**modules):
        entries = [SimpleNamespace(name=name, value=name) for name in modules]
        monkeypatch.setattr(registry, "entry_points", lambda group: entries)
        for name, module in modules.items():
            monkeypatch.setitem(sys.modules, name, module)
        registry.library_types.cache_clear()
        registry._libraries.cache_clear()

    yield install
    registry.library_types.cache_clear()
    registry._libraries.cache_clear()


def _library(name, **members):
    module = ModuleType(name)
    module.__dict__.update(members, __all__=list(members))
    return module


class Wheel(Component):
    pass


class Rim(Component, partial=True):
    pass


def test_two_libraries_may_share_a_type_but_not_a_name(libraries):
    libraries(first=_library("first", Wheel=Wheel, Rim=Rim), second=_library("second", Wheel=Wheel, number=1))
    assert dict(library_types()) == {"Wheel": Wheel}
    assert type_name(Wheel) == "Wheel"
    with pytest.raises(UnknownName, match="There is no component type 'Rim'"):
        find_type("Rim")
    other = type("Wheel", (Component,), {"__module__": "other"})
    libraries(first=_library("first", Wheel=Wheel, Rim=Rim), second=_library("second", Wheel=other))
    with pytest.raises(NetlistError, match="Two libraries have a component 'Wheel'"):
        find_type("Rim")


def test_a_library_that_fails_where_it_is_used_is_named(libraries):
    def missing(name):
        raise ImportError("No module named 'gone'")

    broken = ModuleType("broken")
    broken.__dict__.update(__all__=["Wheel"], __getattr__=missing)
    libraries(broken=broken)
    with pytest.raises(NetlistError, match="The library 'broken' cannot be imported: No module named 'gone'"):
        find_type("Wheel")
