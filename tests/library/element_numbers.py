"""Closed forms of the netlists of examples/elements."""

from math import acos, atan, cos, cosh, exp, log, pi, radians, sin, sqrt, tan

import closed_forms
import numpy as np
import pytest
from closed_forms import close
from scipy.integrate import quad
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.special import ellipk

from modelica_like.runs.solution import Solution

numbers = closed_forms.numbers("elements")


def moment(run: Solution, mode: str, after: str) -> float:
    """Time at which a mode is first entered."""
    return next(event.time for event in run.events if (event.mode, event.after) == (mode, after))


@numbers
def magnetic_clutch(run: Solution) -> None:
    # At rest: half a gap, so two thirds of L_m; behind the open switch a little current flows already.
    shunt = 1 / (1 / 100 + 1e-5)
    L, leak, settled = 0.48 / 1.5, 24e-5 / (1 + 24 / shunt), 24 / (24 + 1e-5 * 1.24)
    leaves = sqrt(2 * 40 * 0.2e-3 / 0.48) * 1.5 - 0.02
    assert moment(run, "coil.stop", "leaving") == close(0.1 + L / 24 * log((settled - leak) / (settled - leaves)))
    assert run.at(1.0)["coil.y"] == close(0.5 * (settled + 0.02) ** 2 * 0.48 / 0.2e-3 - 40 - 5)
    # Afterwards both resistances carry the current of the coil, until the spring is as strong as the magnet.
    drops = sqrt(2 * 45 * 0.2e-3 / 0.48) - 0.02
    decay = 1.1 + 0.48 / (24 + shunt) * log((settled - leak) / (drops - leak))
    left = next(event.time for event in run.events if (event.mode, event.before) == ("coil.stop", "driven"))
    assert left == close(decay)
    # The brake's torque M·(1 - k·(T - T_0)) falls with the work done, W = C·(T - T_0), which stops all of J·w²/2.
    fading, work = 0.002 / 500, 0.5 * 2 * 100**2
    assert run.final["brake.T"] == close(293.15 + work / 500)
    assert run.final["wheel.phi"] == close(-log(1 - fading * work) / (200 * fading))
    assert run.final["clutch.wear"] == close(run.final["clutch.W"] * 1e-15 / 20e-4)


@numbers
def wet_clutch(run: Solution) -> None:
    filling = quad(lambda drop: 2e-13 * sqrt(1e5 * (drop + 1e3)) / (4e-3 / 60 * drop), 8e5 - 601 / 30e-4, 8e5)[0]
    assert moment(run, "piston.stop", "leaving") == close(0.1 + filling)
    assert moment(run, "air_piston.stop", "leaving") == close(0.1 + 1e-4 * 1e5 / (1e5 * 1e-8 * 7e5))
    assert [run.final["piston.y"], run.final["air_piston.y"]] == pytest.approx([1, 1], rel=1e-5)
    work = 0.5 * 0.8 * 100**2
    assert [run.final["clutch.W"], run.final["air_clutch.W"]] == close([work, work])
    assert run.final["air_clutch.T"] == close(293.15 + work / 600)
    cooling = exp(-40 * 1.5 / 600)
    assert (run.final["clutch.T"] - 333.15) / (run.at(1.0)["clutch.T"] - 333.15) == close(cooling)


@numbers
def couplings(run: Solution) -> None:
    # From 0.2 rad: 0.1 rad is reached at cos(20·t) = 0.025/0.125, then the first stage alone swings through zero.
    passing = 20 * sqrt(0.125**2 - 0.025**2)
    quarter = acos(0.2) / 20 + atan(10 * 0.1 / passing) / 10
    assert run.at(quarter)["flywheel.phi"] == pytest.approx(0, abs=0.2e-6)
    assert run.at(quarter)["flywheel.w"] == close(-sqrt(7))
    assert run.final["rubber.tau"] == close(50 * 0.2 + 4 * (1 - exp(-80 * 0.2 / 4)))
    stages = 10 * 180 / pi * 0.5 + 30 * 180 / pi * (0.5 - radians(20))
    assert run.final["two_masses.flange_b.tau"] == close(stages + 15 * (1 - exp(-300 * 0.5 / 15)))
    assert run.final["arc.tau"] == close(10 * 180 / pi * 0.5 + 5 * (1 - exp(-300 * 0.5 / 5)))
    assert moment(run, "pin.pin", "broken") == close(0.75)
    # 2·mu·offset/arm of the torque, times |sin| + |cos|.
    for t in (0.3, 0.7):
        assert run.at(t)["disc.tau_loss"] == close(0.025 * 20 * (abs(sin(10 * t)) + abs(cos(10 * t))))


@numbers
def speed_clutches(run: Solution) -> None:
    sliding = 3 * 0.4 * 0.07 * (0.05 * 0.05 * 300**2 - 100)
    assert run.at(0.2)["wheel.w"] == close(sliding / 0.02 * 0.2)
    assert run.at(0.2)["fan.w"] == close(300 * (1 - exp(-0.04 * 0.2 / 0.01)))


@numbers
def absorbers(run: Solution) -> None:
    # Shaft, absorber ahead of it, their speeds, and the sine with its cosine: a linear system.
    f, c, d = 40 * pi, 0.02 * (40 * pi) ** 2, 2 * 0.1 * 0.02 * 40 * pi
    shaft = np.array([-3000, c, 0, d, 10, 0]) / 0.1
    ahead = np.array([0, -c, 0, -d, 0, 0]) / 0.02 - shaft
    rows = [np.eye(6)[2], np.eye(6)[3], shaft, ahead, f * np.eye(6)[5], -f * np.eye(6)[4]]
    for t in (0.05, 0.2, 0.45):
        angles = (expm(np.array(rows) * t) @ np.eye(6)[5])[:2]
        found = [run.at(t)[name] for name in ("shaft.phi", "absorber.phi_rel")]
        assert found == pytest.approx(list(angles), rel=1e-5, abs=1e-9)
    quarter = ellipk(sin(0.5) ** 2) / (100 * 3)
    assert [run.at(k * quarter)["pendulum.theta"] for k in (1, 2, 3, 4)] == pytest.approx([0, -1, 0, 1], abs=1e-6)


@numbers
def synchroniser(run: Solution) -> None:
    # Cones: 0.35·0.1·F; the blunt chamfers turn with 0.45·0.045·F, the sharp ones with 1.7 times that and more.
    inertia = 0.05 * 200 / 200.05
    # The force rises in 0.1 s to 800 N; the cones take the difference of the speeds, and what brakes the input shaft.
    brake, slope = 2.0 * inertia / 0.05, 0.35 * 0.1 * 800 / 0.1
    lost = 80 + brake / inertia * 0.2
    full = (lost - 0.5 * slope * 0.1**2 / inertia) / ((slope * 0.1 - brake) / inertia)
    together = moment(run, "ring.mode", "stuck")
    assert together == close(0.2 + full)
    assert moment(run, "ring.sleeve", "in") == close(together + 0.02)
    assert run.at(0.59)["input_shaft.w"] == close(run.at(0.59)["car.w"])
    grinding = run.impacts[0]
    assert (grinding.component, grinding.time) == ("sharp", close(0.12))
    slip = 80 - 0.5 * slope * 0.02**2 / inertia
    assert grinding.energy == close(0.5 * inertia * slip**2)


@numbers
def hoists(run: Solution) -> None:
    g, reach = 9.80665, 5 / 2
    growth = sqrt(2 * g / (2 * 30 + 5 + 0.1 / 0.2**2))
    assert run.final["hook.s"] == close(3 + reach - (3 + reach) * cosh(growth))
    taut = sqrt(2 * 0.3 / g)
    assert moment(run, "rope.rope", "taut") == close(taut)
    swing = sqrt(20e3 / 50)
    lowest = taut + (pi - atan(sqrt(2 * g * 0.3) * swing / g)) / swing
    assert run.at(lowest)["rope.tension"] == close(50 * g * (1 + sqrt(1 + 2 * 0.3 * 20e3 / (50 * g))))
    # A load that would pull the self-locking worm backwards brakes it: the friction of the flanks takes more than that.
    rise, rho = tan(radians(3)), 0.06 / cos(radians(20))
    back = (rise - rho) / (rise * (1 + rise * rho)) * 100 / 60
    stopped = moment(run, "holds.mode", "stuck")
    assert (back < 0, stopped) == (True, close(20 * 0.01 / -back))
    assert [run.final["held_rotor.w"], run.final["rest_rotor.w"]] == close([0, 0])
    rise, rho = tan(radians(20)), 0.05 / cos(radians(20))
    back = tan(radians(20) - atan(rho)) / rise * 100 / 10
    assert run.final["running_rotor.w"] == close(-back / 0.01)
    assert [event.before for event in run.events if event.after == "told"] == ["locking", "starting"]
    assert [run.final[f"{name}.self_locking"] for name in ("holds", "at_rest", "runs")] == [1, 1, 0]


@numbers
def switching(run: Solution) -> None:
    # While the diode conducts: C·v' = (10·sin(w·t) - v)/1 - v/100; it blocks where the voltages are equal.
    w, a = 100 * pi, (1 + 1 / 100) / 1e-3

    def charged(t: float) -> float:
        return 1e4 / (a**2 + w**2) * (a * sin(w * t) - w * cos(w * t) + w * exp(-a * t))

    blocks = brentq(lambda t: 10 * sin(w * t) - charged(t), 0.005, 0.0099, xtol=1e-14)
    assert next(e.time for e in run.events if (e.mode, e.before) == ("rectifier.state", "conducting")) == close(blocks)
    assert run.at(0.015)["capacitor.v"] == close(charged(blocks) * exp(-(0.015 - blocks) / 0.1))
    assert moment(run, "contactor.contacts", "closed") == close(0.01 + 0.6 / 48 * log(0.5 / 0.2))
    full = 0.5 * (1 - exp(-0.05 * 48 / 0.6))
    assert moment(run, "contactor.contacts", "open") == close(0.06 + 0.6 / 48 * log(full / 0.1))


@numbers
def gears_and_losses(run: Solution) -> None:
    # A free pair: x = 10 µm·cos(w·t) for as long as the flanks touch; without backlash that is always.
    w = sqrt(200e6 * (0.03**2 / 0.001 + 0.06**2 / 0.008))
    period = 2 * pi / w
    assert run.at(7.25 * period)["mesh.x"] == pytest.approx(0, abs=1e-5 * 1e-5)
    assert run.at(8 * period)["mesh.f"] == pytest.approx(200e6 * 1e-5, rel=1e-5)
    # Across half the backlash, half a swing on the teeth, and back across the whole.
    gap, swing = 0.15e-3 / (0.03 * 5), pi / (0.03 * sqrt(200e6 / 0.001))
    contacts = [event.time for event in run.events if event.mode == "loose.contact"]
    assert contacts[:3] == close([gap, gap + swing, 3 * gap + swing])
    # SKF: R_1·d_m^1.96·F_r^0.54·(nu·n)^0.6 with both factors, and 0.05 to 0.15 of S_1·d_m^-0.26·F_r^(5/3).
    heating = 1 / (1 + 1.84e-9 * (3000 * 60) ** 1.28 * 20**0.64)
    starved = exp(-3e-8 * 20 * 3000 * 120 * sqrt(3.1 / 80))
    rolling = heating * starved * 3.9e-7 * 60**1.96 * 2000**0.54 * 60000**0.6
    mixed = exp(-2.6e-8 * 60000**1.4 * 60)
    sliding = (0.15 * mixed + 0.05 * (1 - mixed)) * 3.23e-3 * 60**-0.26 * 2000 ** (5 / 3)
    assert run.final["bearing.tau"] == close(1e-3 * (rolling + sliding))
    # Torque k·w^0.59: w^0.41 falls in a straight line.
    theta = pi / 3
    surface = 0.08**2 * (2 * theta - sin(2 * theta)) + 2 * 0.08 * 0.03 * theta
    k = 0.5 * 870 * 0.08**3 * surface * 1.5 * (0.08 / 9.80665) ** -0.6 * (0.08 * 0.03 / 50e-6) ** -0.21
    assert run.final["rotor.w"] ** 0.41 == close(200**0.41 - 0.41 * k / 0.05 * 0.02)


@numbers
def linkages(run: Solution) -> None:
    t, r, rod = 0.37, 0.05, 0.18
    phi, u = 10 * t, rod**2 - (r * sin(10 * t)) ** 2
    bent = r * cos(phi) + r**2 * cos(2 * phi) / sqrt(u) + (r**2 * sin(phi) * cos(phi)) ** 2 / u**1.5
    slope = -r * sin(phi) - r**2 * sin(phi) * cos(phi) / sqrt(u)
    at = run.at(t)
    assert [at["slide.s"], at["slide.v"]] == close([r * cos(phi) + sqrt(u), 10 * slope])
    assert at["crank.flange_r.tau"] == close(-slope * 2 * bent * 100)
    # The follower is accelerated most at a quarter of the rise, 2·pi·h/beta²·w², and fastest in the middle, 2·h/beta·w.
    beta, h, w = radians(120), 0.012, 20.0
    quarter, middle = run.at(beta / 4 / w), run.at(beta / 2 / w)
    assert quarter["follower.s"] == close(h * (0.25 - 1 / (2 * pi)))
    assert -quarter["cam.flange_t.f"] == close(0.5 * 2 * pi * h / beta**2 * w**2)
    assert middle["follower.v"] == close(2 * h / beta * w)
    resting, fallen = run.at(radians(140) / w + 2 * pi / w), run.at(radians(300) / w)
    assert [resting["follower.s"], fallen["follower.s"]] == close([h, 0])
    # The rocker at both stretched positions of crank and coupler, and the coupler's length in between.
    a, b, c, d = 0.03, 0.09, 0.07, 0.1
    for stretched in (b + a, b - a):
        crank = acos((d**2 + stretched**2 - c**2) / (2 * d * stretched)) + (pi if stretched < b else 0)
        rocker = pi - acos((d**2 + c**2 - stretched**2) / (2 * d * c))
        assert run.at(crank / 3)["rocker.phi"] == close(rocker)
        assert run.at(crank / 3)["rocker.w"] == pytest.approx(0, abs=1e-6)
    angle, swing = 3 * 1.3, run.at(1.3)["rocker.phi"]
    coupler = np.hypot(d + c * cos(swing) - a * cos(angle), c * sin(swing) - a * sin(angle))
    assert coupler == close(b)


@numbers
def press(run: Solution) -> None:
    # A trapezoid of 20 kN, 20 mm wide below and 12 mm above, and the velocity of the slide over the speed of the crank.
    phi = run.final["flywheel.phi"]
    rod = sqrt(0.3**2 - (0.06 * sin(phi)) ** 2)
    slope = -0.06 * sin(phi) * (1 + 0.06 * cos(phi) / rod)
    assert 0.355 < run.final["slide.s"] == close(0.06 * cos(phi) + rod)
    left = 0.5 * 20 * 12**2 - 20e3 * 0.5 * (20e-3 + 12e-3)
    assert run.final["flywheel.w"] == close(sqrt(2 * left / (20 + 80 * slope**2)))
    drag = 8 * pi * 0.04 * (0.09**4 - 0.06**4) / (2 * 0.2e-3)
    assert run.final["wheel.w"] == close(50 * exp(-drag / 0.4 * 0.25))


@numbers
def variable_drives(run: Solution) -> None:
    ratio = 1 + exp(-0.4 / 0.2)
    at, slower = run.at(0.5), -(1 - ratio) / 0.2
    assert [at["variator.ratio"], at["wheel.w"]] == close([ratio, 100 / ratio])
    torque = 20 + 0.5 * 100 / ratio**2 * slower
    assert -at["engine.flange.tau"] == close(torque / ratio / 0.9)
    # The chain's way on either polygon: pitch per tooth, and r·sin of what is left of it.
    ways = []
    for z, angle in ((11, 2 * 0.33), (22, 0.33)):
        teeth = round(angle * z / (2 * pi))
        ways.append(0.0127 * (teeth + sin(angle - 2 * pi / z * teeth) / (2 * sin(pi / z))))
    assert run.at(0.33)["chain.f"] == close(100e3 * (ways[0] - ways[1]))


@numbers
def converters(run: Solution) -> None:
    speed, rate = 12 / 0.05, 0.05**2 / (0.6 * 1e-4)
    assert run.at(0.03)["rotor.w"] == close(speed * (1 - exp(-0.03 * rate)))
    assert run.at(0.03)["armature.i"] == close(12 / 0.6 * exp(-0.03 * rate))
    assert run.final["slide.s"] == close(10 * 2 / 200 * (1 - cos(20 * 0.1)))
    assert run.final["coil.v"] == close(10 * 10 * 2 / 200 * 20 * sin(20 * 0.1))


@numbers
def machine_loads(run: Solution) -> None:
    thickness = 0.3 * sin(radians(75))
    force = 1700 * 3 / sin(radians(75)) * thickness**0.75
    assert run.at(0.2)["cut.tau"] == close(force * 0.04)
    assert moment(run, "cut.mode", "stuck") == close(0.4 * 100 / (force * 0.04))
    gas = 1e5 * 1.3 / 0.3 * (8 ** (0.3 / 1.3) - 1)
    assert run.final["compressor.tau"] == close(0.5e-3 * gas / (2 * pi * 0.9))
    assert run.final["oil_pump.tau"] == close(20e-6 * 100e5 / (2 * pi * 0.95))
    flow = sqrt((60 * (2 / 3) ** 2 - 10) / 3e5)
    head = 10 + 2e5 * flow**2
    assert run.final["pump.Q"] == pytest.approx(flow, rel=3e-6)  # the smooth beginning of the flow
    assert run.final["pump.tau"] == pytest.approx(9806.65 * head * flow / 0.75 / 100 + 5 * (2 / 3) ** 2, rel=1e-5)
    assert run.final["slide.v"] == close(sqrt(2.5**2 - 2 * 80e3 * 4e-3 / 200))
    pressing = 15 + (24 + 50) * cos(radians(10))
    torque = 3500 - 0.4 * 60 * 9.80665 * (1.6 * 0.025 * pressing + 50 * sin(radians(10)))
    assert run.final["conveyor.w"] == close(torque / (60 * (24 + 15 + 50) * 0.16) * 0.5)


@numbers
def drill_string(run: Solution) -> None:
    M, Z, T, tau = 5e3, 300.0, 0.94, 60 / 300
    moves, arrives, echo = 0.5, 0.5 + T, 0.5 + 2 * T
    # The matched bit sends nothing back, and brakes with all the power of the top.
    assert run.at(moves + 0.1)["string.w_a"] == close(M / Z)
    assert [run.at(arrives + sign * 1e-3)["string.w_b"] for sign in (-1, 1)] == close([0, M / Z])
    assert run.energy()["bit"].lost == close(M**2 / Z * (3.2 - arrives))
    # The collar begins as a wall, which sends the torque back, and ends as a free end.
    after = np.array([0.1, 0.5, 1.5])
    collar = [run.at(arrives + t)["collar.w"] for t in after]
    assert collar == close(2 * M / Z * (1 - np.exp(-after / tau)))
    top = [run.at(echo + t)["free_string.w_a"] for t in (1e-6, 0.5)]
    assert top == pytest.approx(M / Z * (3 - 4 * np.exp(-np.array([1e-6, 0.5]) / tau)), rel=1e-6)


@numbers
def full_turns(run: Solution) -> None:
    L, v, g = 1.5, 9.5, 9.81
    top = run.at(2 * ellipk(4 * g * L / v**2) * L / v)
    assert [top["pendulum.y"], top["pendulum.vx"]] == close([L, -sqrt(v**2 - 4 * g * L)])
    # Without forces from outside the moment of inertia at the crank times the square of its speed stays.
    x, y, s = (run[f"engine.{name}"] for name in "xys")
    slope = -y * s / (s - x)
    inertia = 0.5 * 0.1**2 + 0.8 * slope**2
    assert inertia * (x * run["engine.vy"] - y * run["engine.vx"]) ** 2 == close(np.full(len(x), 0.005 * 0.2**2))
    assert [s.max(), s.min()] == pytest.approx([0.4, 0.2], rel=1e-3)
    # The linkage closes, and keeps its energy.
    of = {name: (run[f"linkage.{name}"], run[f"linkage.{w}"]) for name, w in
          (("phi", "w"), ("beta", "w_beta"), ("psi", "w_psi"))}  # fmt: skip
    point = 0.1 * np.exp(1j * of["phi"][0]) + 0.25 * np.exp(1j * of["beta"][0])
    assert point == pytest.approx(0.28 + 0.2 * np.exp(1j * of["psi"][0]), abs=1e-12)
    energy = sum(J * w**2 for J, (_, w) in zip((0.01, 0.002, 0.02), of.values(), strict=True))
    assert energy == close(np.full(len(energy), energy[0]))
