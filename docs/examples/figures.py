"""Pictures of the examples that no single run shows; draw.py draws them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from components.sizing import DcMotor, commutated, dc_motor_point
from modelica_like import load, simulate
from modelica_like.analyse.sizing import size
from modelica_like.style import COLOURS, picture

EXAMPLES = Path(__file__).parents[2] / "examples"
TURNING = {"speed": "rpm"}
RPM = 30 / pi
SET_A = {"k": 0.04668892, "R": 0.7943932, "friction": 0.04949025}
WEIGHTS = (0.0133, 0.0255, 0.0349, 0.0484, 0.0559, 0.0647, 0.0842, 0.0986)
SET_C = {"k": 0.04768, "R": 0.7291, "friction": 0.04457}
DASHED = {"printed lines": (0, (4, 4)), "separately excited": (0, (4, 4)), "shunt": (0, (1, 3))}
READINGS: dict[str, dict[str, Any]] = {
    "S: the netlist": {},
    "literal": {"force": "5257.7001 N", "coil.start_current": "1 - 1/72.51"},
    "µ = 0.133": {"clutch.mu_min": 0.133, "clutch.curvature": 0, "clutch.slope": 0},
    "B: 725 N": {"force": "725 N"},
    "S, R = 0.13 m": {"radius": "0.13 m"},
    "B, load with w²": {"force": "725 N", "load_exponent": 2},
    "A, E: 72.5 N": {"force": "72.5 N"},
}


@dataclass(frozen=True)
class Curve:
    """A named curve."""

    name: str
    x: Any
    y: Any


def panels(title: str, xlabel: str, rows: Mapping[str, Sequence[Curve]]) -> Figure:
    """Draw curves in rows, one per quantity; those of one name have one colour."""
    names = list(dict.fromkeys(curve.name for row in rows.values() for curve in row))
    colours = dict(zip(names, cycle(COLOURS), strict=False))
    with picture(title, len(rows), 0.8 + 1.7 * len(rows)) as (figure, grid):
        told: set[str] = set()
        for axes, (label, row) in zip(grid, rows.items(), strict=True):
            for curve in row:
                style = DASHED.get(curve.name, "-")
                axes.plot(curve.x, curve.y, linestyle=style, label=curve.name, color=colours[curve.name])
            axes.set_ylabel(label)
            if {curve.name for curve in row} != told:
                axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
            told = {curve.name for curve in row}
        grid[-1].set_xlabel(xlabel)
        figure.align_ylabels(grid)
    return figure


def characteristic_rows(curves: Mapping[str, tuple[Any, Any, Any, Any]]) -> dict[str, list[Curve]]:
    """Return speed, current and efficiency over torque; each curve is (torque in N.m, 1/min, A, efficiency)."""
    rows: dict[str, list[Curve]] = {"speed n in 1/min": [], "current I in A": [], "efficiency": []}
    for name, (torque, *values) in curves.items():
        for row, value in zip(rows.values(), values, strict=True):
            row.append(Curve(name, torque, value))
    return rows


def characteristic(netlist: str, machine: str, **values: float) -> tuple[Any, Any, Any, Any]:
    """Run a slowly growing load; only where the machine drives it has it an efficiency."""
    run = simulate(EXAMPLES / netlist, parameters=values)
    supplies = [name for name in ("battery", "exciter") if f"{name}.v" in run]
    power = sum(run[f"{name}.source_power"] for name in supplies)
    efficiency = np.where(run["shaft.tau"] > 0, run["shaft.power"] / power, np.nan)
    return run["shaft.tau"], run[f"{machine}.w"] * RPM, -run["battery.i"], efficiency


def motor_curves() -> Figure:
    """The motor of the bench: sets A and C, and the lines that the document prints."""
    torque = np.linspace(0, 0.25, 100)
    speed, current = 4736.5 - 3480 * torque, 1.06 + 20 * torque
    curves = {
        "set A": characteristic("dc_bench_motor.toml", "motor"),
        "set C": characteristic("dc_bench_motor.toml", "motor", **SET_C),
        "printed lines": (torque, speed, current, torque * speed / RPM / (24 * current)),
    }
    return panels("dc_bench_motor", "torque M in N·m", characteristic_rows(curves))


def machine_curves() -> Figure:
    """The four types of DC machine, and one with a weaker field."""
    curves = {
        "permanent magnet": characteristic("dc_machines/permanent_magnet.toml", "machine"),
        "separately excited": characteristic("dc_machines/separately_excited.toml", "machine"),
        "… with half the field": characteristic("dc_machines/separately_excited.toml", "machine", excitation=12.0),
        "shunt": characteristic("dc_machines/shunt.toml", "machine"),
        "series": characteristic("dc_machines/series.toml", "machine", first_load=0.4),
    }
    return panels("dc_machines", "torque M in N·m", characteristic_rows(curves))


def startups() -> Figure:
    """Both halves of the clutch and the torques, with the two values of damping."""
    rows: dict[str, list[Curve]] = {}
    for h1 in (10.0, 1.2):
        run = simulate(EXAMPLES / "machine_tool_startup.toml", "0.8 s", parameters={"h1": h1}, points=1600)
        for label, names, sign in (
            (f"speed in rad/s, h1 = {h1:g}", {"ω2, motor side": "J2.w", "ω3, load side": "J3.w"}, 1),
            (
                f"torque in N·m, h1 = {h1:g}",
                {"shaft 1": "shaft1.tau", "clutch": "clutch.tau"},
                -1,
            ),
        ):
            rows[label] = [Curve(name, run.time, sign * run[path]) for name, path in names.items()]
    return panels("machine_tool_startup", "time in s", rows)


def disengaging() -> Figure:
    """The coil is switched off after 3 s."""
    drive = load(EXAMPLES / "machine_tool_startup.toml")
    drive.set("coil.stop_time", "3 s")
    drive.set("coil.T_off", "20 ms")
    run = simulate(drive, "9 s", points=9000)
    rows = {
        "speed in rad/s": {"ω2, motor side": "J2.w", "ω3, load side": "J3.w"},
        "torque in N·m": {"clutch": "clutch.tau", "shaft 2": "shaft2.tau"},
    }
    late = run.time >= 2.9
    signs = {"speed in rad/s": 1, "torque in N·m": -1}
    return panels(
        "machine_tool_startup, switched off at 3 s",
        "time in s",
        {
            label: [Curve(name, run.time[late], signs[label] * run[path][late]) for name, path in names.items()]
            for label, names in rows.items()
        },
    )


def backlash() -> Figure:
    """The torque of the second shaft, with several plays."""
    rows: dict[str, list[Curve]] = {"torque of shaft 2 in N·m": [], "speed ω4 in rad/s": []}
    for play in (0.0, 0.5, 2.0):
        netlist = "machine_tool_backlash" if play else "machine_tool_startup"
        values = {"backlash": play * pi / 180} if play else {}
        run = simulate(EXAMPLES / f"{netlist}.toml", "0.7 s", parameters=values, points=2000)
        part = run.time > 0.25
        for row, path, sign in zip(rows.values(), ("shaft2.tau", "J4.w"), (-1, 1), strict=True):
            row.append(Curve(f"{play:g}° play", run.time[part], sign * run[path][part]))
    return panels("machine_tool_backlash", "time in s", rows)


def readings() -> Figure:
    """The load side's speed and the clutch's torque, for each reading of the document's formulas."""
    rows: dict[str, list[Curve]] = {"speed ω3 in rad/s": [], "clutch torque in N·m": []}
    for name, values in READINGS.items():
        drive = load(EXAMPLES / "machine_tool_startup.toml")
        for path, value in values.items():
            drive.set(path, value)
        run = simulate(drive, "2 s", points=2000)
        for row, value in zip(rows.values(), (run["J3.w"], -run["clutch.tau"]), strict=True):
            row.append(Curve(name, run.time, value))
    return panels("machine_tool_startup, other readings", "time in s", rows)


def release() -> Figure:
    """The bench's clutch is switched off again after 2 s."""
    run = simulate(EXAMPLES / "dc_bench.toml", "4.5 s", parameters={"on_time": 2.0})
    return run.plot("motor.w", "generator.w", "motor.ia", "clutch.tau", display=TURNING)


def overload() -> Figure:
    """The bench's generator is loaded until the clutch slips."""
    drive = {"overload": 4.0, "overload_start": 1.0, "overload_time": 4.0}
    run = simulate(EXAMPLES / "dc_bench.toml", "4.6 s", parameters=drive)
    return run.plot("motor.w", "generator.w", "motor.ia", "sink.i", "clutch.tau", display=TURNING)


def direct_switch_on() -> Figure:
    """The bench's motor is switched on from rest."""
    values = {"motor_start": 0.0, "switch_on": 10.0}
    run = simulate(EXAMPLES / "dc_bench.toml", "0.3 s", parameters=values)
    return run.plot("motor.w", "motor.ia", "motor.tau_electrical", display=TURNING)


def sections() -> Figure:
    """Figure 13 of document 002: shear forces, bending moments and torque of both shafts, as published."""
    made = size(EXAMPLES / "sizing" / "test_bench.toml")
    first, second = made["shaft_I_sections"].diagram, made["shaft_II"].diagram
    place = [*(1e3 * cut.at for cut in first), np.nan, *(100 + 1e3 * cut.at for cut in second)]

    def curve(name: str, line: str, scale: float) -> Curve:
        values = (scale * np.array([getattr(cut, line) for cut in shaft]) for shaft in (first, second))
        return Curve(name, place, np.concatenate([next(values), [np.nan], next(values)]))

    rows = {
        "shear force in N": [curve("in y", "shear_y", 1), curve("in z", "shear_z", 1)],
        "bending moment in N·mm": [
            curve("in y", "bending_y", 1e3),
            curve("in z", "bending_z", 1e3),
            curve("resultant", "bending", 1e3),
        ],
        "torque in N·mm": [curve("torque", "torque", 1e3)],
    }
    return panels("test_bench: both shafts", "position in mm; shaft II begins at 100", rows)


def ripples() -> Figure:
    """Figure 3 of document 002, for rotors of one to eight loops."""
    turn = np.linspace(0, 2 * pi, 721)
    curves = [Curve(f"{n} loops" if n > 1 else "one loop", 180 / pi * turn, commutated(turn, n)) for n in (1, 2, 4, 8)]
    return panels("Torque or voltage of commutated loops", "electrical angle in degrees", {"over the largest": curves})


def families() -> Figure:
    """Diagrams 01 to 03 and 06 of document 002: set A over the supply, beside the points whose values are printed."""
    motor = DcMotor(SET_A["k"], SET_A["R"], SET_A["friction"], 0.0)
    supply = np.linspace(0.1, 24, 240)
    with picture("dc_bench: families of curves", 3, 8.0, sharex=False) as (figure, (voltage, current, bench)):
        for load_torque in (0.0, *WEIGHTS):
            made = dc_motor_point(motor, supply, load_torque)
            turns = made.speed > 0
            colour = COLOURS[0] if load_torque == 0 else COLOURS[1]
            voltage.plot(supply[turns], made.speed[turns] * RPM, color=colour, linewidth=1)
            current.plot(made.speed[turns] * RPM, made.current[turns], color=colour, linewidth=1)
        torque = np.array((0.0, *WEIGHTS))
        speed, amperes = 4736.5 - 3480 * torque, 1.06 + 20 * torque
        voltage.plot(0 * torque + 24, speed, "k.", label="printed lines at 24 V")
        current.plot(speed, amperes, "k.", label="printed lines at 24 V")
        turning = dc_motor_point(motor, supply, SET_A["friction"]).speed * RPM
        bench.plot(supply, np.maximum(turning, 0), label="motor = generator, set A", color=COLOURS[0])
        bench.plot((21.5, 24), (4000, 4550), "k.", label="document: motor")
        bench.plot(24, 4550 * 0.98, "kx", label="document: generator with 2 % slip")
        for axes, x, y, title in (
            (voltage, "supply in V", "n in 1/min", "01, 02: speed, no load and M1 to M8"),
            (current, "n in 1/min", "I in A", "03: current, no load and M1 to M8"),
            (bench, "supply in V", "n in 1/min", "06: speed on the bench"),
        ):
            axes.set_xlabel(x)
            axes.set_ylabel(y)
            axes.set_title(f"Diagram {title}", loc="left", fontsize=10)
            axes.legend(loc="upper left")
        current.set_ylim(0.8, 4.2)
    return figure


def servo() -> Figure:
    """The servo axis: what the drive does, and where the table is that the encoder does not see."""
    run = simulate(EXAMPLES / "servo_axis.toml")
    behind = run["table.s"] - run["servo.motor.phi"] * 0.01 / (4 * pi)
    rows = {
        "motor in 1/min": [Curve("speed", run.time, run["servo.motor.w"] * RPM)],
        "current in A": [Curve("current", run.time, run["servo.motor.ia"])],
        "position in µm": [Curve("table less motor", run.time, 1e6 * behind)],
    }
    return panels("servo_axis: 100 mm forth and back", "time in s", rows)


def shifts() -> Figure:
    """The shift diagram: engine speed over the speed of the car, along the lines of the gears."""
    run = simulate(EXAMPLES / "lepelletier.toml")
    # The inertia of the car is that of 1600 kg on wheels of this radius.
    radius = float(np.sqrt(run["car.J"][0] / 1600))
    engine, car, gear = run["crankshaft.w"] * RPM, 3.6 * radius * run["car.w"], run["selector.gear"]
    at_rest = np.abs(run["selector.stage"] - run["selector.stage"][-1]) < 0.5
    with picture("lepelletier: shift diagram", 1, 4.2) as (figure, (axes,)):
        for number in range(1, 7):
            some = at_rest & (gear == number) & (car > 0)
            ratio = float(np.median(engine[some] / car[some]))
            reach = np.array([0.0, min(7000 / ratio, 1.05 * car[-1])])
            axes.plot(reach, ratio * reach, color="#bbbbbb", linewidth=0.8, zorder=1)
            axes.annotate(
                f"{number}", (reach[1], ratio * reach[1]), xytext=(3, 1), textcoords="offset points", fontsize=8
            )
            axes.plot(car, np.where(gear == number, engine, np.nan), color=COLOURS[number % 6], label=f"gear {number}")
        axes.set(xlabel="speed of the car in km/h", ylabel="engine speed in rpm", xlim=(0, None), ylim=(0, 7500))
        axes.legend(loc="center left", bbox_to_anchor=(1.02, 0.5))
    return figure


FIGURES: dict[str, Callable[[], Figure]] = {
    "servo_axis": servo,
    "lepelletier_shifts": shifts,
    "dc_bench_motor": motor_curves,
    "dc_bench_release": release,
    "dc_bench_overload": overload,
    "dc_bench_direct": direct_switch_on,
    "dc_bench_families": families,
    "dc_bench_ripple": ripples,
    "test_bench_sections": sections,
    "dc_machines": machine_curves,
    "machine_tool_damping": startups,
    "machine_tool_release": disengaging,
    "machine_tool_backlash": backlash,
    "machine_tool_readings": readings,
}
