"""Curves and maps over signals, against SciPy."""

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator, RegularGridInterpolator

from components import Ramp, Sine, Table1D, Table2D
from modelica_like import Assembly, Component, ModelicaLikeError, Solution, simulate
from modelica_like.errors import LimitPassed
from modelica_like.show.report.run import notices

CURVE = ((-1.0, 2.0), (0.0, 3.0), (2.0, 3.0), (3.0, -1.0))
FIRST, SECOND = (0.0, 1.0, 3.0), (-2.0, 0.0, 1.0, 4.0)
MAP = ((1.0, 2.0, 0.0, 5.0), (4.0, -1.0, 2.0, 2.0), (0.0, 3.0, 6.0, 1.0))


def swept(table: Component, *inputs: str, **signals: Component) -> Solution:
    connect = {name: [f"{signal}.y", f"t.{name}"] for name, signal in zip(inputs, signals, strict=True)}
    return simulate(Assembly("d", parts={"t": table, **signals}, connect=connect), 4.0, points=200)


def test_a_curve() -> None:
    run = swept(Table1D(table=CURVE), "u", u=Ramp(offset=-1.0, height=4.0, duration=4.0))
    np.testing.assert_allclose(run["t.y"], np.interp(run["t.u"], *zip(*CURVE, strict=True)), atol=1e-12)
    assert notices(run) == []


def test_a_smooth_curve_keeps_between_its_rows() -> None:
    run = swept(Table1D(table=CURVE, smooth=True), "u", u=Ramp(offset=-1.0, height=4.0, duration=4.0))
    inner = (run["t.u"] >= 0) & (run["t.u"] <= 2)
    reference = PchipInterpolator(*zip(*CURVE, strict=True))(run["t.u"])
    np.testing.assert_allclose(run["t.y"][inner], reference[inner], atol=1e-12)
    assert run["t.y"].max() <= 3.0 + 1e-12


@pytest.mark.parametrize(("how", "expected"), [("hold", -1.0), ("linear", -5.0)])
def test_beyond_a_curve(how: str, expected: float) -> None:
    run = swept(Table1D(table=CURVE, extrapolate=how), "u", u=Ramp(offset=0.0, height=4.0, duration=4.0))
    assert run.final["t.y"] == pytest.approx(expected, abs=1e-12)
    assert notices(run) == (["At 3 s t leaves the rows of table: its last value holds."] if how == "hold" else [])


def test_a_map_is_bilinear_between_its_rows() -> None:
    signals = {"u1": Sine(amplitude=1.5, offset=1.5, f=0.7), "u2": Ramp(offset=-2.0, height=6.0, duration=4.0)}
    run = swept(Table2D(first=FIRST, second=SECOND, table=MAP), "u1", "u2", **signals)
    reference = RegularGridInterpolator((FIRST, SECOND), np.array(MAP), bounds_error=False, fill_value=None)
    inside = np.clip(run["t.u1"], 0, 3)
    np.testing.assert_allclose(run["t.y"], reference(np.column_stack([inside, run["t.u2"]])), atol=1e-9)


def test_a_map_holds_and_tells_which_argument_leaves_it() -> None:
    signals = {"u1": Ramp(offset=0.0, height=8.0, duration=4.0), "u2": Ramp(offset=0.0, height=1.0, duration=4.0)}
    run = swept(Table2D(first=FIRST, second=SECOND, table=MAP), "u1", "u2", **signals)
    assert run.final["t.y"] == pytest.approx(6.0, abs=1e-12)
    assert notices(run) == ["At 1.5 s t leaves the rows of first: its last value holds."]
    with pytest.raises(LimitPassed, match=r"At 1\.5 s t leaves the rows of first\."):
        swept(Table2D(first=FIRST, second=SECOND, table=MAP, extrapolate="error"), "u1", "u2", **signals)


def test_a_map_of_another_size_is_refused() -> None:
    with pytest.raises(ModelicaLikeError, match="3 rows and 4 columns, but there are 2 values for rows and 4"):
        swept(
            Table2D(first=FIRST[:2], second=SECOND, table=MAP), "u1", "u2", u1=Ramp(duration=1.0), u2=Ramp(duration=1.0)
        )
