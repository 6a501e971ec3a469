"""What notebooks show and complete."""

import re
from pathlib import Path

import numpy as np
import pytest

from modelica_like import linearize, sensitivities, simulate, steady
from modelica_like.report.notebook import html
from modelica_like.solve.solution import Solution

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
