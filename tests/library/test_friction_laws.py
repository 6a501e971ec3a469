"""Laws of friction: coefficients from tables, their scales, and that of the multi-plate clutch."""

from math import log

import pytest
from scipy.integrate import solve_ivp

from components import BearingFriction, Brake, Clutch, ConstantSpeed, ConstantTorque, Inertia, MultiPlateClutch
from modelica_like import Assembly, Component, simulate

TIGHT = {"rtol": 1e-10, "atol": 1e-12}


def shaft(**parts: Component) -> Assembly:
    return Assembly("drive", parts=parts, series={"shaft": list(parts)})


def still(w: float = 0.0, J: float = 1.0) -> Inertia:
    return Inertia(J=J, phi=0.0, w=w)


MU = ((0.0, 0.5), (5.0, 0.3), (20.0, 0.4))


def mu_linear(v: float) -> float:
    return 0.5 - 0.04 * v if v < 5 else 0.3 + 0.1 * (v - 5) / 15


@pytest.mark.parametrize("kind", [Clutch, Brake])
def test_coefficient_from_a_table(kind: type[Component]) -> None:
    brake = kind(fn_max=2.0, cgeo=1.5, mu_pos=MU, extrapolate="linear")
    parts = {"mass": still(30.0), "brake": brake}
    run = simulate(shaft(**parts, **({"wall": ConstantSpeed(w_fixed=0.0)} if kind is Clutch else {})), "40 s", **TIGHT)
    stop = run.events[-1].time
    reference = solve_ivp(
        lambda t, w: [-3.0 * mu_linear(w[0])],
        (0, stop),
        [30.0],
        rtol=1e-11,
        atol=1e-12,
        max_step=0.01,
        t_eval=[0.3 * stop, 0.9 * stop],
    )
    for t, w in zip(reference.t, reference.y[0], strict=True):
        assert run.at(t)["mass.w"] == pytest.approx(w, abs=1e-6)
    # Both pieces are exponentials: from 30 to 5 rad/s, and from 5 to 0.
    assert stop == pytest.approx(50 * log(mu_linear(30.0) / 0.3) + log(0.5 / 0.3) / 0.12, abs=1e-6)


def test_smooth_table_meets_its_rows_without_overshoot() -> None:
    for speed, mu in MU:
        run = simulate(
            shaft(motor=ConstantSpeed(w_fixed=speed + 1e-9), brake=Brake(fn_max=1.0, mu_pos=MU, smooth=True)), "1 ms"
        )
        assert run["brake.tau"][0] == pytest.approx(mu, abs=1e-9)
    between = simulate(shaft(motor=ConstantSpeed(w_fixed=4.0), brake=Brake(fn_max=1.0, mu_pos=MU, smooth=True)), "1 ms")
    assert 0.3 < between["brake.tau"][0] < 0.5


def test_scales_of_tables() -> None:
    run = simulate(
        shaft(
            motor=ConstantSpeed(w_fixed="500 rpm"),
            bearing=BearingFriction(tau_pos=((0, 10), (1000, 30)), w_scale="1 rpm", tau_scale="0.01 N.m"),
        ),
        "1 ms",
    )
    assert run["bearing.tau"][0] == pytest.approx(0.2, rel=1e-12)


def test_law_of_the_multi_plate_clutch() -> None:
    clutch = {
        "mu_min": 0.04,
        "w_min": 12.57,
        "curvature": 3.023e-5,
        "slope": 1.55e-4,
        "mu_static": 0.133,
        "fn_max": 1000.0,
        "cgeo": 2.0,
    }
    for slip, mu in ((1.0, 3.023e-5 * 11.57**3 + 0.04), (12.57, 0.04), (32.57, 0.04 + 1.55e-4 * 20)):
        run = simulate(
            shaft(
                motor=ConstantSpeed(w_fixed=slip),
                clutch=MultiPlateClutch(**clutch, tau_drag=2.5),
                wall=ConstantSpeed(w_fixed=0.0),
            ),
            "1 ms",
        )
        assert -run["clutch.tau"][0] == pytest.approx(2000.0 * mu + 2.5, rel=1e-12)
    # What sticks bears no less than what slips.
    for factor, static, mu in ((0.999, 0.133, 0.133), (1.001, 0.133, 0.133), (0.999, 0.0, 0.04 + 3.023e-5 * 12.57**3)):
        moves, clutch["mu_static"] = factor > 1, static
        run = simulate(
            shaft(
                torque=ConstantTorque(tau_constant=factor * 2000.0 * mu),
                mass=still(),
                clutch=MultiPlateClutch(**clutch),
                wall=ConstantSpeed(w_fixed=0.0),
            ),
            "1 ms",
        )
        assert (run.final["mass.w"] > 0) == moves
