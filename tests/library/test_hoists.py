"""Drums of hoists: what of the rope hangs, and how much there is."""

import pytest

from components import ConstantSpeed, Mass, WinchDrum
from modelica_like import Assembly, Component, simulate
from modelica_like.show.report.run import notices

RADIUS, RHO, LENGTH, G, M = 0.1, 2.0, 20.0, 9.80665, 10.0


def hauling(speed: float, **rope: float) -> Assembly:
    parts: dict[str, Component] = {
        "motor": ConstantSpeed(w_fixed=speed), "part": WinchDrum(radius=RADIUS, **rope), "hook": Mass(m=M),
    }  # fmt: skip
    return Assembly("hoist", parts=parts, series={"s": list(parts)})


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize(
    ("speed", "hanging", "left", "told"),
    [
        (10.0, 8.0, 0.0, "At 8 s part has hauled in all of its rope."),
        (-10.0, 8.0, 18.0, None),
        (-10.0, 15.0, 25.0, "At 5 s part has let out more rope than it has."),
        (10.0, 30.0, 20.0, "At 0 s part has let out more rope than it has."),
    ],
)
def test_only_rope_that_hangs_weighs(speed: float, hanging: float, left: float, told: str | None, solver: str) -> None:
    """1 m/s for 10 s; the hook is on no slope, so that the motor carries the rope alone."""
    run = simulate(
        hauling(speed, rho=RHO, length=LENGTH, hanging=hanging), 10.0, start="rest", solver=solver, rtol=1e-9
    )
    assert run.final["motor.flange.tau"] == pytest.approx(-RADIUS * RHO * G * left, abs=1e-9)
    assert notices(run) == ([told] if told else [])
    # What the rope gains is what the motor gives: the sum over the lengths that hang.
    begin = 0.5 * RHO * G * hanging**2
    assert run.energy()["part"].stored == pytest.approx(begin - 0.5 * RHO * G * left**2, rel=1e-7)


def test_a_rope_without_mass_has_no_end() -> None:
    run = simulate(hauling(10.0), 10.0, start="rest")
    assert run.final["motor.flange.tau"] == pytest.approx(0.0, abs=1e-9)
    assert notices(run) == []
