"""`modelica-like export`: the file it writes and the line it prints."""

import json
import zipfile
from pathlib import Path

import fmpy
import pytest
from calls import called

from modelica_like.fmi.build import PLATFORMS, native_platform

EXAMPLES = Path(__file__).parents[2] / "examples"
NETLIST = str(EXAMPLES / "two_mass.toml")


def test_an_fmu_named_after_the_netlist(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    result = called(["export", NETLIST, "--platform", "none", "--set", "J1.w=5 rad/s"])
    assert result.exit_code == 0
    assert result.stdout.startswith("two_mass.fmu: FMI 2.0, Model Exchange and Co-Simulation, ")
    assert "sources only" in result.stdout
    variables = {one.name: one.start for one in fmpy.read_model_description("two_mass.fmu").modelVariables}
    assert float(variables["J1.w"]) == 5.0


def test_version_kind_and_outputs(tmp_path: Path) -> None:
    path = tmp_path / "x.fmu"
    options = ["-o", str(path), "--fmi", "3.0", "--kind", "cs", "--platform", "none", "--show", "J?.w"]
    assert called(["export", NETLIST, *options]).exit_code == 0
    description = fmpy.read_model_description(str(path))
    assert description.fmiVersion == "3.0"
    assert description.modelExchange is None
    assert {one.variable.name for one in description.outputs} == {"J1.w", "J2.w"}


def test_open_end(tmp_path: Path) -> None:
    path = tmp_path / "x.fmu"
    options = ["-o", str(path), "--platform", "none", "--open", "J2.flange_b"]
    assert called(["export", NETLIST, *options]).exit_code == 0
    inputs = [one.name for one in fmpy.read_model_description(str(path)).modelVariables if one.causality == "input"]
    assert inputs == ["J2_flange_b.tau"]


def test_mistakes_are_told(tmp_path: Path) -> None:
    result = called(["export", NETLIST, "-o", str(tmp_path / "x.fmu"), "--fmi", "1.0"])
    assert result.exit_code == 2
    assert result.stderr.startswith("Invalid value for --fmi: '1.0' is not one of '2.0', '3.0'.\n")


@pytest.mark.slow
def test_a_model_that_is_compiled_in(tmp_path: Path) -> None:
    path = tmp_path / "x.fmu"
    assert called(["export", NETLIST, "-o", str(path), "--embed", "--no-check"]).exit_code == 0
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
    assert "resources/model.bin" not in names
    assert [name for name in names if name.startswith("binaries/")]


@pytest.mark.slow
def test_run_times_are_listed_and_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MODELICA_LIKE_CACHE", str(tmp_path))
    monkeypatch.setattr("modelica_like.fmi.runtime.SHIPPED", tmp_path / "none")
    names = [*PLATFORMS, "wasm32"]
    before = [line.rstrip() for line in called(["runtimes"]).stdout.splitlines()[2:]]
    assert [line.split(maxsplit=1)[0] for line in before] == names
    assert all(line.endswith("not compiled") for line in before)
    after = called(["runtimes", "--platform", "native", "--json"]).stdout
    found = {row["platform"]: row["library"] for row in json.loads(after)["tables"]["run-times"]}
    assert found.pop(native_platform()).startswith(str(tmp_path))
    assert set(found.values()) == {"not compiled"}
    wrong = called(["runtimes", "--platform", "wasm64"])
    assert wrong.exit_code == 2
    assert wrong.stderr.startswith("There is no platform 'wasm64'; did you mean 'wasm32'?")
