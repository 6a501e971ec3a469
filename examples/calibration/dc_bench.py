"""Document 002: the constants of the bench's motor, identified from what was measured on it.

Two lines were fitted to the measurements of 6.1: n = 4736.5/min - 3.48/min/mN.m·M and I = 0.02 A/mN.m·M + 1.06 A.
Each of them alone fits a permanent-magnet machine exactly, but not the same one: its torque constant and its voltage
constant would differ by 7 %, which would create energy. The rotor's inertia follows from the 0.7 s that the generator
takes to its final voltage.
"""

from pathlib import Path

import numpy as np

from modelica_like import build
from modelica_like.analyse.calibration.calibrate import Calibration, Numbers, OperatingPoints, calibrate

HERE = Path(__file__).parent
MOTOR, BENCH = HERE.parent / "dc_bench_motor.toml", HERE.parent / "dc_bench.toml"
BOUNDS = {"k": (0.03, 0.07), "R": (0.1, 2.0), "friction": (0.01, 0.1)}

TORQUES = np.linspace(0.0, 250.0, 26)
TORQUE = {"first_load [mN.m]": TORQUES}
SPEED_LINE = {"motor.w [rpm]": 4736.5 - 3.48 * TORQUES}
CURRENT_LINE = {"motor.ia [A]": 0.02 * TORQUES + 1.06}
NO_LOAD = OperatingPoints({"first_load": [0.0], "motor.ia": [1.06]}, given=["first_load"])


def identify() -> dict[str, Calibration]:
    """Identify the motor from either line, and from both."""
    motor = build(MOTOR)
    columns = {"current": CURRENT_LINE, "speed": SPEED_LINE, "both": SPEED_LINE | CURRENT_LINE}
    tables = {name: OperatingPoints(TORQUE | lines, given=["first_load"]) for name, lines in columns.items()}
    data = {"current": [tables["current"]], "speed": [tables["speed"], NO_LOAD], "both": [tables["both"]]}
    return {name: calibrate(motor, measured, BOUNDS) for name, measured in data.items()}


def rotor_inertia() -> Calibration:
    """Identify the rotor: the generator has 98 % of its final voltage 0.7 s after switching on."""
    voltage = Numbers({"at(generator.v, 0.7 s)": 0.98 * 22.316}, until="0.75 s")
    return calibrate(BENCH, voltage, {"rotor": (1e-5, 2e-4)})


def main() -> None:
    found = identify()
    for name, calibration in found.items():
        print(f"{name} line{'s' if name == 'both' else ''}:\n{calibration}\n")
    ratio = found["current"]["k"] / found["speed"]["k"]
    print(
        f"The two lines contradict one machine by {100 * (ratio - 1):.1f} %: k_t = {found['current']['k']:.5f} N.m/A,"
    )
    print(f"k_e = {found['speed']['k']:.5f} V.s/rad.\n")
    print(rotor_inertia())


if __name__ == "__main__":
    main()
