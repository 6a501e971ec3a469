"""Libraries of components: what they offer, and that only what is used is loaded."""

import ast
import importlib
import os
import subprocess
import sys
import tomllib
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

import components
import modelica_like
from components import Clutch
from modelica_like.errors import NetlistError, UnknownName
from modelica_like.language import Component
from modelica_like.netlist import find_type, library_types, load, registry, type_name
from modelica_like.trust import trusting


def test_the_stub_tells_type_checkers_what_the_library_has():
    assert components.__file__ is not None
    stub = ast.parse(Path(components.__file__).with_suffix(".pyi").read_text())
    told = {alias.name: node.module for node in stub.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    homes = {name: f"components.{module}" for module, names in components._NAMES.items() for name in names.split()}  # type: ignore[attr-defined]
    assert told == homes
    assert sorted(told) == components.__all__
    assert set(components.__all__) <= set(dir(components))
    assert all(getattr(components, name).__name__ == name for name in components.__all__)


def test_the_contract_of_libraries_forbids_all_but_the_language():
    root = Path(modelica_like.__file__).parent
    contracts = tomllib.loads((root.parent / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    forbidden = next(one for one in contracts if one["name"] == "libraries use the language only")["forbidden_modules"]
    every = {file.stem for file in root.iterdir() if file.suffix == ".py" or (file / "__init__.py").is_file()}
    assert {f"modelica_like.{name}" for name in every - {"__init__", "__main__", "former", "language"}} == set(
        forbidden
    )


def test_a_name_or_module_that_the_library_has_not_is_an_attribute_error():
    assert components.clutches.friction.Clutch is Clutch
    with pytest.raises(AttributeError, match="module 'components' has no attribute 'Cluch'"):
        assert components.Cluch  # type: ignore[attr-defined]


def test_a_netlist_loads_only_the_modules_of_its_parts():
    code = (
        "import sys; from modelica_like.netlist import loads;"
        "loads('[parts]\\nm = { is = \"Inertia\", J = 1.0 }');"
        "print(*sorted(name for name in sys.modules if name.startswith('components.')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [
        "components.icons", "components.interfaces", "components.mechanics", "components.mechanics.inertias",
    ]  # fmt: skip


@pytest.mark.parametrize("name", sorted(components._FORMER))  # type: ignore[attr-defined]
def test_a_module_is_found_by_the_name_it_had_before_there_were_folders(name: str) -> None:
    """The names of three modules are folders now, which have their classes."""
    now = importlib.import_module(components._FORMER[name])  # type: ignore[attr-defined]
    then = importlib.import_module(name)
    short = name.partition(".")[2]
    assert getattr(components, short) is then
    if hasattr(then, "__path__"):
        own = {one: kind for one, kind in vars(now).items() if getattr(kind, "__module__", "") == now.__name__}
        assert own.items() <= vars(then).items()
    else:
        assert then is now
    assert now.__spec__ is not None
    assert now.__spec__.name == now.__name__ == components._FORMER[name]  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("former", "now"),
    [
        ("cosimulation.ssp", "fmi.cosimulation.ssp"),
        ("explorer", "page"),
        ("show.explorer", "page"),
        ("report.run", "show.report.run"),
        ("report.tables", "show.report.tables"),
        ("sizing", "analyse.sizing"),
        ("solve.plot", "show.plot"),
        ("solve.solution", "runs.solution"),
        ("units", "language.units"),
        ("units.unit", "language.units.unit"),
    ],
)
def test_documented_modules_of_the_framework_are_found_by_former_names(former: str, now: str) -> None:
    """Once, not twice: a class of two modules would be two classes."""
    module = importlib.import_module(f"modelica_like.{former}")
    assert module is importlib.import_module(f"modelica_like.{now}")
    assert module.__name__ == f"modelica_like.{now}"


def test_a_netlist_may_name_classes_by_former_modules() -> None:
    for name in ("components.friction:Clutch", "components.clutches.friction:Clutch"):
        assert find_type(name) is Clutch
    assert find_type("components.gears:IdealGear") is components.IdealGear
    with pytest.raises(NetlistError, match=r"No module named 'components\.frictions'"):
        find_type("components.frictions:Clutch")


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


OWN = """
from components import Inertia
from modelica_like.language import Component
from {helper} import BASE


class Disc(Inertia):
    BASE = BASE
"""


@pytest.fixture
def imports(monkeypatch):
    """Let modules and the path be as they were."""
    monkeypatch.setattr(sys, "path", list(sys.path))
    known = set(sys.modules)
    yield
    for name in set(sys.modules) - known:
        if not name.startswith(("components", "modelica_like")):
            del sys.modules[name]


def _drive(folder: Path, module: str, helper: str) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / f"{module}.py").write_text(OWN.format(helper=helper))
    (folder / f"{helper}.py").write_text("BASE = 3\n")
    netlist = folder / "drive.toml"
    netlist.write_text(f'[parts]\nd = {{ is = "{module}:Disc", J = 1 }}\n')
    return netlist


@pytest.mark.usefixtures("imports")
def test_own_modules_are_found_beside_the_netlist_wherever_one_works(tmp_path, monkeypatch):
    netlist = _drive(tmp_path / "drives", "own_discs", "own_helper")
    monkeypatch.chdir(tmp_path)
    kind = type(load(netlist, trust=True).d)
    assert kind.BASE == 3
    assert type_name(kind) == "own_discs:Disc"
    assert sys.path[0] != str(tmp_path / "drives")  # nothing there hides what is imported later
    assert type(load(netlist).d) is kind
    _drive(tmp_path, "near_discs", "near_helper")
    with trusting():
        assert find_type("near_discs:Disc").BASE == 3


@pytest.mark.usefixtures("imports")
def test_a_module_of_another_netlist_is_not_taken_for_ones_own(tmp_path):
    first, second = (_drive(tmp_path / name, "same_name", f"help_{name}") for name in "ab")
    load(first, trust=True)
    with pytest.raises(NetlistError, match=r"The module 'same_name' of '.*b' cannot be used: '.*same_name.py' is load"):
        load(second, trust=True)


@pytest.mark.usefixtures("imports")
def test_a_mistake_in_an_own_module_is_told_with_its_line(tmp_path):
    netlist = _drive(tmp_path, "wrong_discs", "wrong_helper")
    (tmp_path / "wrong_helper.py").write_text("\nBASE = tree\n")
    with pytest.raises(NetlistError) as caught:
        load(netlist, trust=True)
    assert str(caught.value).splitlines() == [
        "The module 'wrong_discs' cannot be imported: NameError: name 'tree' is not defined (wrong_helper.py:2).",
        '  in drive.toml:2 `d = { is = "wrong_discs:Disc", J = 1 }`',
    ]


@pytest.mark.parametrize("name", ["components", "modelica_like"])
def test_no_folder_of_a_user_hides_the_library(tmp_path, name):
    """Neither where the command runs nor beside the netlist."""
    _drive(tmp_path / name, "__init__", "own_helper")
    _drive(tmp_path, "own_discs", "own_helper")
    (tmp_path / "drive.toml").write_text(
        '[parts]\na = { is = "Inertia", J = 1 }\nb = { is = "own_discs:Disc", J = 1 }\n[series]\nab = ["a", "b"]\n'
        '[simulate]\nstart = "rest"\nuntil = 1\n'
    )
    command = (
        "import sys; from modelica_like.cli import main; sys.argv[1:] = ['check', 'drive.toml', '--trust']; main()"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(components.__file__).parents[1])}
    script = tmp_path.parent / f"run_{name}.py"
    script.write_text(command)
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, cwd=tmp_path, env=environment, check=False
    )
    assert (done.stderr, done.returncode) == ("", 0)
    assert "Inertia, Disc" in done.stdout


def test_a_program_that_took_the_name_of_the_library_is_told(libraries):
    taken = ModuleType("components")
    taken.__file__ = "/home/me/components.py"
    libraries(components=taken)
    with pytest.raises(NetlistError, match=r"The library 'components' is hidden by '/home/me/components\.py', which"):
        find_type("Wheel")
