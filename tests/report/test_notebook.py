"""What notebooks show and complete."""

import re
from pathlib import Path

import numpy as np
import pytest

import components.mechanics.inertias
from modelica_like import compare, linearize, load, sensitivities, simulate, steady, sweep
from modelica_like.analyse.sizing import size
from modelica_like.flatten import flatten
from modelica_like.runs.solution import Solution
from modelica_like.show.report.notebook import html

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def run() -> Solution:
    return simulate(EXAMPLES / "machine_tool_startup.toml")


def test_variables_are_attributes(run: Solution) -> None:
    assert np.array_equal(run.clutch.tau, run["clutch.tau"])
    assert np.array_equal(run.clutch.flange_a.phi, run["clutch.flange_a.phi"])
    assert {"tau", "w_rel", "flange_a"} <= {*dir(run.clutch)}
    assert "clutch" in dir(run)
    assert "clutch.tau" in run._ipython_key_completions_()
    assert repr(run.J1).startswith("<J1: ")


def test_a_name_that_is_not_there_has_a_suggestion(run: Solution) -> None:
    with pytest.raises(AttributeError, match=r"has no 'clutch\.taw'; did you mean 'tau'\?"):
        _ = run.clutch.taw
    with pytest.raises(AttributeError, match=r"has no 'cluch'; did you mean 'clutch'\?"):
        _ = run.cluch
    assert not hasattr(run, "_repr_mimebundle_")


def test_a_run_is_a_picture_and_its_events(run: Solution) -> None:
    text = run._repr_html_()
    assert "data:image/png;base64," in text
    assert re.search(r"0\.26547\d+", text), "document 003: the clutch locks"
    assert "slip reached zero" in re.sub(r"<.*?>", "", text)


def test_results_are_their_tables(run: Solution) -> None:
    assert "Hz" in html(linearize(run).modes())
    assert "J1.w" in html(sensitivities(run, ["J1.w"], ["h1"]))
    assert "rad/s" in steady(EXAMPLES / "lepelletier_gears.toml")._repr_html_()


def test_other_results_are_their_tables_too(run: Solution) -> None:
    balance = run.energy()
    assert "clutch" in balance._repr_html_()
    assert f"closes to {balance.closure:.1e}" in re.sub(r"<.*?>", "", balance._repr_html_())
    assert "largest deviation" in compare(run, run)._repr_html_()
    assert "spindle_behind_gear" in size(EXAMPLES / "sizing" / "machine_table.toml")._repr_html_()
    assert "8 states" in linearize(run, 0.0)._repr_html_()
    swept = sweep(run.model, {"k1": [5000.0, 6000.0]}, ["max(shaft2.tau)"], processes=1)
    assert "max(shaft2.tau)" in swept._repr_html_(), "xarray shows it"


def test_a_flat_model_is_mathematics() -> None:
    text = flatten(load(EXAMPLES / "machine_tool_startup.toml"))._repr_markdown_()
    inertias = text.partition("### Inertia: `J1`, `J2`, `J3`, `J4`\n")[2].partition("###")[0]
    assert r"J \cdot \dot{\omega} &= \tau_{\text{flange a}} + \tau_{\text{flange b}}" in inertias
    line = next(k for k, one in enumerate(Path(components.inertias.__file__).read_text("utf-8").split("\n"), 1)
                if "yield self.J * der(self.w) ==" in one)  # fmt: skip
    assert f"inertias.py:{line}." in inertias
    netlist = (EXAMPLES / "machine_tool_startup.toml").read_text("utf-8").split("\n")
    series = next(k for k, one in enumerate(netlist, 1) if one.startswith("drive = ["))
    assert f"| J4.flange_b – load.flange | machine_tool_startup.toml:{series} |" in text
    assert "if" not in text.partition("### Damper")[2].partition("where")[0], "nothing is connected to the heat port"


def test_a_drive_is_its_schematic_and_its_parameters() -> None:
    text = load(EXAMPLES / "machine_table_direct.toml")._repr_html_()
    assert text.startswith("<svg ")
    assert "<td>motor_speed</td><td>6000 rpm</td>" in text
    assert "<td>hub.J</td><td>hub_inertia</td><td>moment of inertia</td>" in text
