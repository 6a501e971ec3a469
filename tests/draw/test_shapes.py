"""Mode shapes below schematics: deviations in closed form, and their places."""

from math import pi, sqrt
from pathlib import Path
from xml.etree import ElementTree

import pytest
from calls import called

from components import BallScrew, IdealGear, Inertia, Mass, Spring
from modelica_like import linearize, schematic
from modelica_like.language import Assembly
from modelica_like.show.draw import layout
from modelica_like.show.draw.shapes import Shape, shapes

EXAMPLES = Path(__file__).parents[2] / "examples"


def geared() -> Assembly:
    """Two inertias with a spring between them; the second one turns a gear, which turns a screw."""
    parts = {
        "a": Inertia(J=1.0, phi=0.0, w=0.0), "spring": Spring(c=100.0), "b": Inertia(J=2.0, phi=0.0, w=0.0),
        "gear": IdealGear(ratio=4.0), "screw": BallScrew(lead=2 * pi * 0.5), "table": Mass(m=8.0),
    }  # fmt: skip
    return Assembly("drive", parts=parts, series={"drive": [*parts]})


def levels(shape: Shape) -> list[float]:
    """Deviations of the shafts and slides from west to east."""
    rigid = sorted((one for one in shape.stretches if one.rigid), key=lambda one: one.begin[0])
    assert all(one.begin[1] == one.end[1] for one in rigid)
    return [one.end[1] for one in rigid]


def test_deviations_are_those_of_the_closed_form() -> None:
    drive = geared()
    found = shapes(layout(drive), linearize(drive).modes(), 4)
    assert len(found) == 1
    # The table adds m·(lead/2π/ratio)² = 8·0.125² = 0.125 kg.m2 to the second inertia; it moves J1/J2 as much.
    behind = 2.0 + 8.0 * (0.5 / 4.0) ** 2
    assert found[0].title.startswith(f"mode 1: {sqrt(100.0 * (1 + 1 / behind)) / (2 * pi):.4g} Hz, damping")
    angle = -1.0 / behind
    assert levels(found[0]) == pytest.approx([1.0, angle, angle, angle / 4.0, -1.0], abs=1e-9)


def test_shafts_are_joined_by_what_lies_between() -> None:
    drive = geared()
    (shape,) = shapes(layout(drive), linearize(drive).modes(), 4)
    ends = {one.begin for one in shape.stretches if one.rigid} | {one.end for one in shape.stretches if one.rigid}
    between = [one for one in shape.stretches if not one.rigid]
    assert len(between) == 4, "spring, second inertia, gear and screw"
    assert all(one.begin in ends and one.end in ends for one in between)


def test_what_does_not_move_has_no_shape() -> None:
    drive = geared()
    assert shapes(layout(drive), linearize(drive).modes(), 0) == []
    text = schematic(drive, modes=linearize(drive).modes())
    assert ElementTree.fromstring(text).get("height") == f"{layout(drive).height + 32 + 96:g}"


def test_the_command_draws_them(tmp_path: Path) -> None:
    file = tmp_path / "launch.svg"
    result = called(["modes", str(EXAMPLES / "launch.toml"), "--draw", str(file)])
    assert result.exit_code == 0, result.stdout + result.stderr
    assert "mode 1: " in file.read_text("utf-8")
    result = called(["modes", str(EXAMPLES / "launch.toml"), "--draw", str(tmp_path / "launch.gif")])
    assert "can be pdf, png, svg" in result.stdout + result.stderr
