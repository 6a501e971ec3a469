"""Pictures: what is drawn, and how it is labelled."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from components import Fixed, Inertia, SpringDamper
from modelica_like import Solution, simulate
from modelica_like.errors import NetlistError, UnknownName
from modelica_like.language import Assembly
from modelica_like.solve.plot import chosen, plot, save_plot

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def start_up() -> Solution:
    return simulate(EXAMPLES / "machine_table_direct.toml", points=50)


def test_the_usual_curves_are_speeds_torques_and_forces_once_each(start_up: Solution) -> None:
    names = chosen(start_up, ())
    assert {"motor.w", "clutch.w_rel", "clutch.tau", "table.v"} <= set(names)
    # hub and spindle turn together, so one curve shows both
    assert len({"hub.w", "spindle.w"} & set(names)) == 1
    for k, name in enumerate(names):
        assert not any(np.array_equal(start_up[name], start_up[other]) for other in names[:k])


def test_patterns_choose(start_up: Solution) -> None:
    assert chosen(start_up, ["table.v", "clutch.w*", "table.v"]) == ["table.v", "clutch.w_rel"]
    with pytest.raises(UnknownName, match=r"has no variable 'tabel\.v'; did you mean 'table\.v'\?"):
        chosen(start_up, ["tabel.v"])


def test_one_panel_per_unit_with_labels_and_events(start_up: Solution) -> None:
    figure = plot(start_up, ["motor.w", "hub.w", "clutch.tau", "clutch.mode"], title="Start-up")
    panels = figure.axes
    assert [axes.get_ylabel() for axes in panels] == ["speed in rad/s", "torque in N\u00b7m", "value"]
    assert panels[-1].get_xlabel() == "time in s"
    assert [line.get_label() for line in panels[0].lines[:2]] == ["motor.w", "hub.w"]
    assert np.array_equal(panels[1].lines[0].get_ydata(), start_up["clutch.tau"])
    assert [line.get_xdata()[0] for line in panels[1].lines[1:]] == [event.time for event in start_up.events]
    assert [text.get_text() for text in panels[0].texts] == ["clutch stuck"]


def test_a_run_at_rest_is_an_empty_picture(tmp_path: Path) -> None:
    assembly = Assembly(
        "rest", parts={"wall": Fixed(), "spring": SpringDamper(c=1, d=1), "mass": Inertia(J=1, phi=0, w=0)},
        series={"chain": ["wall", "spring", "mass"]},
    )  # fmt: skip
    save_plot(plot(simulate(assembly, 1.0)), tmp_path / "rest.png")
    assert (tmp_path / "rest.png").stat().st_size > 1000


def test_the_format_must_be_known(start_up: Solution, tmp_path: Path) -> None:
    with pytest.raises(NetlistError, match=r"^'x\.doc': a picture can be .*eps, .*png.*\.$"):
        save_plot(plot(start_up, ["table.v"]), tmp_path / "x.doc")


def test_no_window_system_is_touched() -> None:
    """In a process of its own: other packages of the tests do import pyplot."""
    program = "import sys, modelica_like as ml; ml.simulate(sys.argv[1], 0.1).plot('motor.w'); print(*sys.modules)"
    command = [sys.executable, "-c", program, str(EXAMPLES / "fan.toml")]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    modules = run.stdout.split()
    assert "matplotlib.figure" in modules
    assert "matplotlib.pyplot" not in modules
