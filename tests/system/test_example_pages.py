"""Every example has a page, a picture that is small, and runs."""

import importlib.util
import re
from math import atanh, pi, sqrt
from pathlib import Path
from typing import Any

import pytest

from modelica_like import simulate

ROOT = Path(__file__).parents[2]
PAGES = ROOT / "docs" / "examples"
OURS = [
    ROOT / "examples" / f"{name}.toml"
    for name in (
        "fan",
        "winch",
        "launch",
        "servo_axis",
        "machine_table_direct",
        "machine_table_geared",
        "machine_tool_startup",
        "dc_bench",
    )
] + [ROOT / "examples" / "dc_bench_motor.toml", *(ROOT / "examples" / "dc_machines").glob("*.toml")]


def drawing() -> Any:
    spec = importlib.util.spec_from_file_location("draw", PAGES / "draw.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(PAGES)  # as if it were run
        spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("netlist", OURS, ids=lambda path: path.stem)
def test_example_has_a_page(netlist: Path) -> None:
    assert any(netlist.name in page.read_text(encoding="utf-8") for page in PAGES.glob("*.md"))


@pytest.mark.parametrize("page", sorted(PAGES.glob("*.md")), ids=lambda path: path.stem)
def test_links_of_a_page_lead_somewhere(page: Path) -> None:
    for link in re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8")):
        # `make site` generates the pages of components, and checks what points there.
        generated = (page.parent / link).resolve().is_relative_to(ROOT / "docs" / "components")
        assert generated or (page.parent / link).exists(), link


def test_pictures_are_drawn_and_small() -> None:
    draw = drawing()
    pictures = {picture.stem: picture for picture in (PAGES / "pictures").glob("*.png")}
    assert {Path(netlist).name for netlist in draw.PICTURES} | set(draw.FIGURES) == set(pictures)
    assert all(picture.stat().st_size < 120_000 for picture in pictures.values())


def test_fan_locks_when_the_closed_form_says() -> None:
    run = simulate(ROOT / "examples" / "fan.toml", "4 s", rtol=1e-9)
    J, w0, M, b = 0.3, 50 * pi, 40.0, 25.0
    assert run.events[0].time == pytest.approx(J * w0 / sqrt(M * b) * atanh(sqrt(b / M)), rel=1e-8)
    assert run.final["impeller.w"] == pytest.approx(w0, rel=1e-9)
    assert -run.final["clutch.tau"] == pytest.approx(b, rel=1e-9)
