"""The code of docs/cosimulation.md runs, and its numbers are what comes out; the example agrees with the drive."""

import importlib.util
import re
import runpy
from pathlib import Path
from typing import Any

import pytest

from modelica_like import cosim, simulate
from modelica_like.fmi.cosimulation.files import load_system

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "cosimulation.md"


def measuring() -> Any:
    """docs/cosimulation.py"""
    spec = importlib.util.spec_from_file_location("measure_cosimulation", ROOT / "docs" / "cosimulation.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_what_is_printed_stands_on_the_page(page: tuple[str, dict[str, Any], Path]) -> None:
    text, names, _ = page
    assert f"```text\n{names['parts']}\n```" in text
    assert re.search(r"```text\nshaft2: 1125 J passed through, residual 0\.0002\d+ J", text)
    assert str(names["run"].couplings[0]).startswith("shaft2: 1125 J passed through, residual 0.0002")


def test_a_step_that_is_too_long_shows_in_the_energy(page: tuple[str, dict[str, Any], Path]) -> None:
    coarse, fine = page[1]["shares"]
    assert abs(coarse) > 1e-3
    assert abs(fine) < 1e-6


@pytest.mark.slow
def test_the_table_is_what_is_measured(page: tuple[str, dict[str, Any], Path]) -> None:
    """One row of it, against the monolith, which has nothing to do with FMUs: IDAS; and the step that keeps 1e-3."""
    text, names, folder = page
    measure = measuring()
    whole = simulate(ROOT / "examples" / "machine_tool_startup.toml", rtol=1e-10, points=20_000)
    printed = re.search(r"^\| 0\.2 ms \|(.*)\|$", text, re.MULTILINE)
    assert printed is not None
    told = [float(value) for value in printed[1].split("|")]
    jacobi = cosim(folder / names["parts"].path, step=2e-4, master="jacobi", outputs=("J4.w", "shaft2.tau"))
    errors = [measure.error(run, whole, name) for run in (jacobi, names["run"]) for name in ("J4.w", "shaft2.tau")]
    assert errors == pytest.approx(told, rel=0.05)
    for master, step in (("jacobi", 1.3e-4), ("gauss-seidel", 2.9e-4)):
        run = cosim(folder / names["parts"].path, step=step, master=master, outputs=("J4.w", "shaft2.tau"))
        assert max(measure.error(run, whole, name) for name in ("J4.w", "shaft2.tau")) < 1.05e-3


def test_the_system_file_of_the_page_can_be_read(page: tuple[str, dict[str, Any], Path], tmp_path: Path) -> None:
    block, _ = re.findall(r"```toml\n(.*?)```", page[0], re.DOTALL)
    (tmp_path / "page.toml").write_text(block)
    system = load_system(tmp_path / "page.toml", tmp_path)
    assert [link.name for link in system.links] == ["shaft2_tau", "shaft2_phi", "shaft2_w"]
    assert (system.settings.step, system.settings.until) == (2e-4, 1.0)


def test_the_picture_is_drawn_and_committed(page: tuple[str, dict[str, Any], Path]) -> None:
    (picture,) = re.findall(r"\(pictures/(.*?)\)", page[0])
    assert 5_000 < (ROOT / "docs" / "pictures" / picture).stat().st_size < 100_000


@pytest.mark.slow
def test_the_example_agrees_with_the_whole_drive(capsys: pytest.CaptureFixture[str]) -> None:
    deviation, share = runpy.run_path(str(ROOT / "examples" / "cosim" / "machine_tool.py"))["main"]()
    assert deviation < 1e-4
    assert abs(share) < 1e-6
    assert "deviates by" in capsys.readouterr().out
