"""Symbols of the machine elements, as in kinematic diagrams and circuit diagrams."""

from __future__ import annotations

from dataclasses import replace

from modelica_like.language import Icon, Stroke

SHAFT = Stroke("shaft", "#1f2937", "#d7dde6", 3.5, weight=10)
SLIDE = Stroke("slide", "#15803d", "#4ade80", 3.5, weight=10)
CIRCUIT = Stroke("circuit", "#1d4ed8", "#7aa2ff", 1.75, weight=4)
HEAT = Stroke("heat", "#c2410c", "#fb923c", 1.75, weight=2)


def _circle(x: float, y: float, r: float) -> str:
    return f"M{x - r:g} {y:g} a{r:g} {r:g} 0 1 0 {2 * r:g} 0 a{r:g} {r:g} 0 1 0 {-2 * r:g} 0 Z"


def _rect(half_x: float, half_y: float, x: float = 0.0, y: float = 0.0) -> str:
    return f"M{x - half_x:g} {y - half_y:g} h{2 * half_x:g} v{2 * half_y:g} h{-2 * half_x:g} Z"


def _hatch(x: float, y: float, width: float, down: int = 1) -> str:
    """A fixed edge with its hatching."""
    strokes = " ".join(f"M{x + k:g} {y:g} l-4 {5 * down}" for k in range(4, int(width) + 1, 5))
    return f"M{x:g} {y:g} h{width:g} {strokes}"


# -- shafts ----------------------------------------------------------------------------------------------------------

FIXED = Icon(22, 14, lines=f"M0 0 V6 {_hatch(-10, 6, 20)}", at_ports=True)
INERTIA = Icon(16, 52, solid=_rect(8, 26), key=("J",))
DISC = Icon(10, 44, solid=_rect(5, 22))
_COIL = "l3 -9 l6 18 l6 -18 l6 18 l6 -18 l3 9"
SPRING = Icon(50, 20, lines=f"M-25 0 h10 {_COIL} h10", key=("c",))
DAMPER = Icon(50, 20, lines="M-25 0 h17 M12 -9 h-20 v18 h20 M2 -6 v12 M2 0 h23", key=("d",))
SPRING_DAMPER = Icon(
    50, 36,
    lines=f"M-25 0 h6 M-19 -10 v20 M-19 -10 h4 {_COIL} h4 v20 h-16 M-19 10 h12 M5 3 h-12 v14 h12 M3 5 v10 M19 0 h6",
    key=("c",),
)  # fmt: skip
BACKLASH = Icon(50, 36, lines=f"M-25 0 h10 {_COIL} M15 0 M15 -8 v16 M20 -8 v16 M20 0 h5", key=("b", "c"))
PLAY = Icon(
    50,
    36,
    lines="M-25 0 h15 M10 0 h15",
    heavy="M-10 -12 v24 M-10 -12 h14 M-10 12 h14 M10 -4 h-14 M10 4 h-14",
    key=("b",),
)
CLUTCH = Icon(30, 48, lines="M-15 0 h9 M6 0 h9", heavy="M-6 -23 v46 M6 -23 v46", ports={"f_normalized": "N"},
              key=("capacity", "fn_max"))  # fmt: skip
THERMAL_CLUTCH = replace(CLUTCH, lines="M-15 0 h9 M6 0 h9 M-2 10 v6 M2 10 v6 M-2 20 v6 M2 20 v6")
MULTI_PLATE = Icon(36, 48, lines="M-18 0 h8 M10 0 h8 M-10 -23 h8 M-10 23 h8 M10 -17 h-8 M10 17 h-8",
                   heavy="M-10 -23 v46 M10 -17 v34 M-3 -23 v8 M-3 23 v-8 M3 -17 v9 M3 17 v-9",
                   ports={"f_normalized": "N"}, key=("capacity", "fn_max"))  # fmt: skip
BRAKE = Icon(44, 56, lines="M-22 0 h44 M-9 -19 v-6 h18 v6 M0 -25 v-3 M-9 19 v6 h18 v-6 M0 25 v3", heavy="M0 -20 v40",
             ports={"f_normalized": "N"}, key=("capacity", "fn_max"))  # fmt: skip
BEARING = Icon(44, 36, lines=f"M-22 0 h44 {_hatch(-11, -12, 22, -1)} {_hatch(-11, 12, 22)}",
               heavy="M-11 -8 h22 M-11 8 h22")  # fmt: skip
FREEWHEEL = Icon(44, 40, paper=_circle(0, 0, 19), solid="M-6 -8 L8 0 L-6 8 Z", lines="M-22 0 h16 M8 0 h14 M8 -8 v16")
DOGS = replace(
    CLUTCH, heavy="M-6 -20 v40 M6 -20 v40 M-6 -12 h6 M-6 12 h6 M6 0 h-6", ports={"engage": "N"}, key=("w_max",)
)
ONE_WAY_CLUTCH = replace(CLUTCH, solid="M-4 -6 L5 0 L-4 6 Z")
LIMITER_CLUTCH = Icon(44, 48, lines="M-22 0 h12 M2 0 h3 l2 -6 l4 12 l4 -12 l2 6 h3",
                      heavy="M-10 -23 v46 M2 -23 v46")  # fmt: skip
ELASTIC_COUPLING = Icon(40, 44, lines="M-20 0 h10 M10 0 h10 M-10 -12 q10 -8 20 0 M-10 12 q10 8 20 0",
                        heavy="M-10 -21 v42 M10 -21 v42")  # fmt: skip
DUAL_MASS = Icon(44, 52, solid=f"{_rect(5, 25, -12)} {_rect(5, 25, 12)}", key=("J_1",),
                 lines="M-22 0 h5 M17 0 h5 M-7 0 l2 -6 l3 12 l3 -12 l3 12 l3 -6")  # fmt: skip
RUPTURE = Icon(40, 44, lines="M-20 0 h14 M6 0 h14 M-6 -12 h4 l4 4 h4 M-6 12 h4 l4 4 h4", heavy="M-6 -20 v40 M6 -20 v40",
               key=("tau_break",))  # fmt: skip
OLDHAM = Icon(48, 44, lines="M-24 -4 h12 M12 4 h12", heavy="M-12 -20 v32 M12 -12 v32", paper=_rect(6, 14),
              key=("offset",))  # fmt: skip
CENTRIFUGAL = replace(CLUTCH, heavy="M-6 -10 v20 M6 -23 v46", ports={},
                      solid=f"{_circle(-6, -15, 5)} {_circle(-6, 15, 5)}", key=("m",))  # fmt: skip
VISCOUS = replace(CLUTCH, lines="M-15 0 h9 M6 0 h9 M-3 -16 h6 M-3 -8 h6 M-3 8 h6 M-3 16 h6", ports={"fill": "N"},
                  key=("tau_nominal",))  # fmt: skip
OPEN_PLATES = replace(VISCOUS, key=("n", "h"))
SYNCHRO = replace(CLUTCH, heavy="M-6 -23 l-4 46 M2 -23 l-4 46 M8 -12 v24", lines="M-15 0 h5 M8 0 h7")
ABSORBER = Icon(40, 48, solid=_rect(6, 22, 10), lines="M-20 0 h6 l3 -7 l5 14 l5 -14 l3 7 h2", key=("f",))
PENDULUM = Icon(44, 52, paper=_circle(0, 6, 18), lines="M-22 6 h22 M0 6 v-16 l6 -10",
                solid=f"{_circle(0, 6, 3)} {_circle(6, -20, 6)}", key=("m",))  # fmt: skip
_PAIR, _HUBS = f"{_circle(-11, 0, 9)} {_circle(9, 0, 11)}", f"{_circle(-11, 0, 2.5)} {_circle(9, 0, 2.5)}"
GEAR = Icon(48, 38, paper=_PAIR, solid=_HUBS, lines="M-24 0 h4 M20 0 h4", key=("ratio",))
WORM = replace(GEAR, lines="M-24 0 h4 M20 0 h4 M-17 -5 l4 10 M-12 -7 l4 12 M-7 -6 l3 8")
GEAR_MESH = replace(GEAR, lines="M-24 0 h4 M20 0 h4 M-6 -16 l2 4 l2 -8 l2 8 l2 -4", key=("c",))
CHURNING = replace(BEARING, paper=_circle(0, 0, 14), lines=f"M-22 0 h44 {_hatch(-16, 8, 32)}", heavy="", key=("R",))
GEARBOX = Icon(56, 46, paper=f"{_rect(28, 23)} {_PAIR}", solid=_HUBS, key=("ratio",))
BELT = Icon(60, 34, paper=f"{_circle(-18, 0, 9)} {_circle(13, 0, 14)}",
            solid=f"{_circle(-18, 0, 2)} {_circle(13, 0, 2)}",
            lines="M-19.5 -9 L11 -14 M-19.5 9 L11 14 M-30 0 h3 M27 0 h3", key=("ratio",))  # fmt: skip
VARIABLE_GEAR = Icon(
    56, 40, paper="M-22 -14 l8 8 v12 l-8 8 Z M22 -14 l-8 8 v12 l8 8 Z", key=("efficiency",), ports={"u": "N"},
    lines="M-28 0 h6 M22 0 h6 M-14 -6 L14 -6 M-14 6 L14 6 M-6 16 L8 -16 l-5 2 M8 -16 l1 5",
)  # fmt: skip
CHAIN = replace(BELT, lines=BELT.lines + " M-8 -13 v3 M-2 -14 v3 M4 -15 v3 M-8 10 v3 M-2 11 v3 M4 12 v3", key=("z_a",))
_SET = f"{_circle(0, 0, 26)} {_circle(0, 0, 22)}"
_WHEELS = f"{_circle(0, 0, 8)} {_circle(0, -15, 7)} {_circle(-13, 7.5, 7)} {_circle(13, 7.5, 7)}"
PLANETARY = Icon(54, 54, paper=_SET, solid=_WHEELS, lines="M0 -15 L-13 7.5 L13 7.5 Z",
                 ports={"ring": ("W", -14), "sun": ("W", 14), "carrier": "E"}, named=True,
                 key=("ratio", "i0"))  # fmt: skip
DIFFERENTIAL = Icon(48, 48, paper=_rect(24, 24), solid="M-8 -16 h16 l-4 8 h-8 Z M-8 16 h16 l-4 -8 h-8 Z",
                    lines="M-24 0 h12 M-12 -12 v24", ports={"flange": "W", "left": ("E", -14), "right": ("E", 14)},
                    named=True)  # fmt: skip
RAVIGNEAUX = Icon(
    64, 92, paper=f"{_rect(32, 46)} {_circle(0, -17, 25)}", solid=f"{_circle(0, -17, 8)} {_circle(0, -33, 7)} "
    f"{_circle(-14, -9, 7)} {_circle(14, -9, 7)} {_circle(0, 29, 6)} {_circle(-11, 29, 5)} {_circle(11, 29, 5)}",
    ports={"small_sun": ("W", -30), "large_sun": "W", "carrier": ("W", 30), "ring": "E"}, named=True,
)  # fmt: skip
CONVERTER = Icon(48, 48, paper=_circle(0, 0, 23), lines="M-24 0 h11 M13 0 h11 M0 -23 v46",
                 solid="M-3 -14 a14 14 0 0 0 0 28 Z M3 -14 a14 14 0 0 1 0 28 Z")  # fmt: skip
JOINT = Icon(48, 30, lines="M-24 0 h10 M-14 -12 v24 M-14 -12 h10 M-14 12 h10 M14 -12 v24 M14 -12 h-10 M14 12 h-10 "
             "M14 0 h10", solid=_circle(0, 0, 4))  # fmt: skip
LONG_SHAFT = Icon(64, 18, solid=_rect(26, 6), lines="M-32 0 h6 M26 0 h6 M-12 -6 v12 M0 -6 v12 M12 -6 v12", key=("n",))
BALL_SCREW = Icon(60, 34, solid=_rect(12, 15), lines="M-30 0 h60 M-26 -5 l6 10 M-20 -5 l6 10 M14 -5 l6 10 M20 -5 l6 10",
                  key=("lead", "h"))  # fmt: skip
RACK = Icon(48, 44, paper=_circle(0, -4, 15), solid=_circle(0, -4, 2.5),
            lines="M-24 13" + " l4 -4 l4 4" * 6, key=("r", "radius", "ratio"),
            ports={"flange_t": "E", "support_r": "S", "support_t": ("S", 10)})  # fmt: skip
SLIDER_CRANK = Icon(56, 40, paper=_circle(-14, 0, 13), lines="M-14 0 L-6 -10 L18 0", solid=_rect(7, 6, 21, 0),
                    heavy="M10 9 h18", key=("r",))  # fmt: skip
CAM = Icon(48, 44, paper="M-22 6 a14 14 0 1 0 28 0 q0 -10 -8 -18 q-6 -6 -12 0 q-8 8 -8 18 Z", key=("h",),
           lines="M10 -10 h14 M10 -16 v12", solid=_circle(-8, 6, 3))  # fmt: skip
FOUR_BAR = Icon(56, 40, lines="M-22 12 L-14 -4 L14 -14 L22 12 M-28 14 h12 M16 14 h12",
                solid=f"{_circle(-22, 12, 3)} {_circle(22, 12, 3)}", key=("crank",))  # fmt: skip
WHEEL = replace(RACK, lines=_hatch(-22, 12, 44), heavy="M-22 12 h44", solid=_circle(0, -4, 4))
TYRE = replace(WHEEL, ports={"flange_t": "E", "F_z": "N"}, key=("mu",))

DRUM = replace(RACK, paper=_circle(-4, -4, 15), lines="M-24 0 h5 M-4 11 h28", key=("radius",),
               solid=_circle(-4, -4, 2.5), ports={**RACK.ports, "flange_t": ("E", 11)})  # fmt: skip
HOLDING_BRAKE = replace(
    BRAKE, lines=f"{BRAKE.lines} M-5 -19 l10 -6 M-5 25 l10 -6 M-17 -28 v5 h8 M17 -28 v5 h-8", key=("capacity",),
    ports={"p": ("N", -17), "n": ("N", 17)},
)  # fmt: skip

# -- slides ----------------------------------------------------------------------------------------------------------

MASS = Icon(44, 34, solid=_rect(22, 17), key=("m",))
TABLE = Icon(52, 40, solid=_rect(26, 11, 0, -7), lines=_hatch(-26, 13, 52), heavy="M-26 13 h52", key=("m",))
ROD = Icon(44, 12, heavy="M-22 0 h44", key=("L",))
STOP = Icon(50, 36, lines="M-25 0 h15 M25 0 h-15 M-10 -12 v24 M10 -12 v24 M-10 -12 l6 3 M10 -12 l-6 3", key=("s_rel0",))
SLIDEWAY = Icon(48, 30, lines=f"M-24 -2 h48 {_hatch(-20, 8, 40)}", heavy="M-20 4 h40")
SLIDE_BRAKE = replace(SLIDEWAY, solid=_rect(10, 5, 0, -12), ports={"f_normalized": "N"})
VEHICLE = Icon(64, 36, paper="M-31 6 v-8 l8 -3 l8 -10 h22 l9 10 l14 3 v8 Z",
               solid=f"{_circle(-17, 8, 7)} {_circle(17, 8, 7)}", key=("m",),
               ports=dict.fromkeys(("Cr", "inclination", "v_wind"), "N"))  # fmt: skip
AXLES = Icon(64, 30, paper="M-31 2 v-8 l8 -3 l8 -6 h22 l9 6 l14 3 v8 Z",
             lines="M-17 15 v-10 l-3 4 m3 -4 l3 4 M17 15 v-10 l-3 4 m3 -4 l3 4",
             ports={"flange": "W", "inclination": "N", "F_rear": ("E", -7), "F_front": ("E", 7)})  # fmt: skip

ROPE = Icon(50, 14, lines="M-25 0 h4 q4 -6 8 0 q4 6 8 0 q4 -6 8 0 q4 6 8 0 q4 -6 8 0 h6", key=("c",))

# -- actuators -------------------------------------------------------------------------------------------------------

MAGNET = Icon(48, 44, paper=_rect(14, 20, -8), solid=_rect(4, 20, 16), lines="M-22 -12 l28 24 M-22 12 l28 -24 M8 0 h4",
              ports={"p": ("W", -12), "n": ("W", 12), "y": "E"}, key=("R",))  # fmt: skip
PISTON = Icon(52, 34, paper=_rect(26, 14), solid=_rect(4, 14), lines="M4 0 h3 l2 -7 l4 14 l4 -14 l4 14 l2 -7 h3",
              ports={"p_in": "W", "y": "E"}, key=("A",))  # fmt: skip

# -- sources and loads -----------------------------------------------------------------------------------------------

_SOURCE = Icon(44, 44, paper=_circle(0, 0, 21), ports={
    "flange": "E", "tau": "N", "f": "N", "w_ref": "N", "v_ref": ("N", 8), "phi_ref": ("N", -8), "s_ref": ("N", -8),
    "a_ref": ("N", 16), "excitation": "N",
})  # fmt: skip
TORQUE = replace(_SOURCE, text="τ", key=("tau_constant", "tau", "height"))
FORCE = replace(_SOURCE, text="F", key=("f_constant", "f", "height"))
SPEED = replace(_SOURCE, text="ω", key=("w_fixed",))
VELOCITY = replace(_SOURCE, text="v", key=("v_fixed",))
ANGLE = replace(_SOURCE, text="φ")
POSITION = replace(_SOURCE, text="s")
BETWEEN_TORQUE = Icon(44, 44, paper=_circle(0, 0, 21), text="τ", ports={"tau": "N"})
BETWEEN_FORCE = replace(BETWEEN_TORQUE, text="F", ports={"f": "N"})
LOAD = Icon(42, 42, paper=_rect(21, 21), lines="M-14 14 h28 M-14 14 v-28 M-14 12 q20 -2 26 -22", ports={"flange": "W"},
            key=("tau_nominal", "f_nominal", "tau_0"))  # fmt: skip
EDDY = replace(LOAD, lines="M-14 14 h28 M-14 14 v-28 M-14 12 q8 -30 14 -18 q5 8 14 10",
               ports={"flange": "W", "excitation": "N"})  # fmt: skip
CUTTING = replace(LOAD, lines="M-14 6 h20 M10 14 l-6 -8 h14 l-2 8 Z M-14 -4 q10 -8 22 4", key=("k_c11",),
                  ports={"flange": "W", "depth": "N"})  # fmt: skip
PUMP = Icon(42, 42, paper=_circle(0, 0, 20), solid="M-10 -12 L14 0 L-10 12 Z", ports={"flange": "W"}, key=("H_0",))
CONVEYOR = Icon(60, 30, paper=f"{_circle(-20, 4, 8)} {_circle(20, 4, 8)}", ports={"flange": "W"}, key=("L",),
                lines="M-20 -4 h40 M-20 12 h40 M-8 -4 v-8 h14 v8")  # fmt: skip
START = Icon(30, 30, paper=_circle(0, 0, 14), text="0", ports={"flange": "W"})
STATES = Icon(44, 20, lines="M-22 0 h6 M16 0 h6 M-16 -6 h32 M-16 6 h32 M-16 -6 v12 M16 -6 v12")
BOUNDARY = Icon(36, 30, paper="M-18 -15 h24 l12 15 l-12 15 h-24 Z")

# -- sensors ---------------------------------------------------------------------------------------------------------

ENGINE = Icon(52, 52, paper=_rect(24, 24), solid=_circle(6, 6, 4), heavy="M-12 -16 h24", key=("J",),
              lines="M24 0 h2 M-12 -24 v12 h24 v-12 M-10 -12 v-8 M10 -12 v-8 M0 -12 L6 6",
              ports={"flange": "E", "pedal": "W"})  # fmt: skip
_NEEDLE = "M-10 4 a11 11 0 0 1 20 0 M0 6 L6 -6"
SENSOR = Icon(36, 36, paper=_circle(0, 0, 17), lines=_NEEDLE)
BETWEEN_SENSOR = Icon(40, 36, paper=_circle(0, 0, 17), lines=f"M-20 0 h3 M17 0 h3 {_NEEDLE}", ports=dict.fromkeys(
    ("w", "tau", "power", "phi_rel", "w_rel", "a_rel", "s_rel", "v_rel", "f", "v", "i"), "S",
))  # fmt: skip

# -- circuits --------------------------------------------------------------------------------------------------------

GROUND = Icon(20, 16, lines="M0 0 V6 M-9 6 h18 M-6 10 h12 M-3 14 h6", at_ports=True)
RESISTOR = Icon(48, 16, paper=_rect(15, 7), lines="M-24 0 h9 M15 0 h9", key=("R",))
VARIABLE_RESISTOR = replace(RESISTOR, height=30, lines="M-24 0 h9 M15 0 h9 M-10 12 L12 -13 l-6 1 M12 -13 l-1 6",
                            ports={"R": "N"})  # fmt: skip
INDUCTOR = Icon(48, 18, lines="M-24 0 h8 a4 5 0 0 1 8 0 a4 5 0 0 1 8 0 a4 5 0 0 1 8 0 a4 5 0 0 1 8 0 h8", key=("L",))
CAPACITOR = Icon(40, 30, lines="M-20 0 h16 M4 0 h16", heavy="M-4 -13 v26 M4 -13 v26", key=("C",))
BATTERY = Icon(34, 44, lines="M17 -16 h-20 v8 M-15 -8 h24 M-9 8 h12 M-3 8 v8 h20 M-16 -16 h6 M-13 -19 v6",
               ports={"p": ("E", -16), "n": ("E", 16)}, key=("V",))  # fmt: skip
VOLTAGE = Icon(44, 44, paper=_circle(0, 0, 18), lines="M22 -16 h-22 v-2 M22 16 h-22 v2 M-4 -8 h8 M0 -12 v8 M-4 9 h8",
               ports={"p": ("E", -16), "n": ("E", 16), "v_ref": "N"})  # fmt: skip
CURRENT = Icon(44, 44, paper=_circle(0, 0, 18), lines="M22 -16 h-22 v-2 M22 16 h-22 v2 M0 11 v-22 M-5 -5 L0 -12 L5 -5",
               ports={"p": ("E", -16), "n": ("E", 16), "i_ref": "N"}, key=("I",))  # fmt: skip
SWITCH = Icon(48, 24, lines="M-24 0 h12 L10 -11 M12 0 h12", solid=f"{_circle(-12, 0, 2.5)} {_circle(12, 0, 2.5)}",
              ports={"closed": "N"})  # fmt: skip
DIODE = Icon(40, 22, lines="M-20 0 h12 M8 0 h12", solid="M-8 -9 L8 0 L-8 9 Z", heavy="M8 -10 v20")
THYRISTOR = Icon(40, 26, lines="M-20 0 h12 M8 0 h12 M8 0 L14 -12", solid="M-8 -9 L8 0 L-8 9 Z", heavy="M8 -10 v20",
                 ports={"fire": "N"})  # fmt: skip
CONTACTOR = Icon(
    52, 44, paper=_rect(14, 8, 0, -11), lines="M-26 12 h14 L8 2 M12 12 h14 M-2 6 v-8 M-26 -11 h12 M14 -11 h12",
    solid=f"{_circle(-12, 12, 2.5)} {_circle(12, 12, 2.5)}",
    ports={"p": ("W", 12), "n": ("E", 12), "cp": ("W", -11), "cn": ("E", -11)},
)  # fmt: skip
BRIDGE = Icon(56, 52, paper=_rect(28, 26), lines="M-10 -14 v28 M10 -14 v28 M-10 0 h20 M-14 -14 h8 M6 -14 h8 M-14 14 h8 "
              "M6 14 h8", ports={
    "p": ("W", -15), "n": ("W", 15), "p_out": ("E", -15), "n_out": ("E", 15), "u": "N",
})  # fmt: skip
MOTOR = Icon(52, 50, paper=_circle(0, 0, 24), lines="M-26 -14 h6.5 M-26 14 h6.5 M24 0 h2", text="M", ports={
    "ap": ("W", -14), "an": ("W", 14), "ep": "N", "en": "S", "flange": "E",
})  # fmt: skip
EMF = replace(MOTOR, key=("k",), ports={"p": ("W", -14), "n": ("W", 14), "flange": "E"})
VOLTMETER = Icon(36, 36, paper=_circle(0, 0, 17), text="V", ports={"v": "S"})
AMMETER = Icon(40, 36, paper=_circle(0, 0, 17), lines="M-20 0 h3 M17 0 h3", text="A", ports={"i": "S"})

# -- heat ------------------------------------------------------------------------------------------------------------

THERMAL_MASS = Icon(36, 36, solid=_rect(18, 18), text="C", key=("C",))
WATTMETER = Icon(40, 36, paper=_circle(0, 0, 17), lines="M-20 0 h3 M17 0 h3", text="W",
                 ports={"pc": "W", "nc": "E", "pv": "N", "nv": ("S", -8), "power": ("S", 8)})  # fmt: skip
SERVO = replace(MOTOR, text="SM", lines="M24 0 h2", ports={"flange": "E"}, key=("I_max",))
TEMPERATURE = Icon(36, 36, paper=_circle(0, 0, 17), text="T", key=("T",), ports={"T": "N"})
HEAT_SOURCE = replace(TEMPERATURE, text="Q", key=("Q_flow",))
CONDUCTOR = Icon(
    48, 24, paper=_rect(16, 12), lines="M-24 0 h8 M16 0 h8 M-9 -5 l5 10 M-2 -5 l5 10 M5 -5 l5 10", key=("G",)
)

# -- signals ---------------------------------------------------------------------------------------------------------


def block(curve: str, *, key: tuple[str, ...] = (), text: str = "") -> Icon:
    """Return a block with a curve in a field of 28 by 24."""
    return Icon(44, 38, paper=_rect(22, 19), lines=curve, key=key, text=text)


CONSTANT = block("M-14 0 h28", key=("k",))
STEP = block("M-14 10 h12 v-20 h16", key=("height",))
RAMP = block("M-14 10 h8 l14 -20 h6", key=("height",))
SINE = block("M-14 0 q7 -20 14 0 q7 20 14 0", key=("amplitude",))
PULSE = block("M-14 9 h5 v-18 h8 v18 h8 v-18 h7", key=("amplitude",))
TRAPEZOID = block("M-14 9 h4 l5 -18 h8 l5 18 h6", key=("amplitude",))
SAW = block("M-14 9 l14 -18 v18 l14 -18 v18", key=("amplitude",))
RISE = block("M-14 10 h4 q3 -18 24 -19")
DECAY = block("M-14 0 q4 -24 8 0 q4 16 8 0 q4 -10 8 0 q2 4 4 0")
TABLE_BLOCK = block(f"{_rect(13, 11)} M-13 -4 h26 M-13 4 h26 M0 -11 v22")
FORMULA = block("", text="f(t)")
GAIN = Icon(40, 38, paper="M-20 -19 L20 0 L-20 19 Z", key=("k",))
SUM = Icon(30, 30, paper=_circle(0, 0, 15), lines="M-7 0 h14 M0 -7 v14", ports={"u1": "W", "u2": "S"})
DIFFERENCE = Icon(30, 30, paper=_circle(0, 0, 15), lines="M-7 0 h14", ports={"u1": "W", "u2": "S"})
PRODUCT = Icon(30, 30, paper=_circle(0, 0, 15), lines="M-6 -6 l12 12 M-6 6 l12 -12", ports={"u1": "W", "u2": "S"})
LIMITER = block("M-14 9 h7 l14 -18 h7")
INTEGRATOR = block("", text="∫")
DERIVATIVE = block("", text="d/dt")
TRANSFER = block("", text="b/a", key=("k",))
DEAD_ZONE = block("M-14 10 l8 -10 h12 l8 -10", key=("u_max",))
HYSTERESIS = block("M-14 8 h20 v-16 M14 -8 h-20 v16")
NOISE = block("M-14 2 l3 -8 l3 12 l3 -7 l3 9 l3 -14 l3 10 l3 -4 l3 6 l4 -9")
_CONTROL = {"u_s": ("W", 0.0), "u_m": ("S", 0.0), "u_ff": ("N", 0.0)}
CONTROL_P = replace(block("", text="P", key=("k",)), ports=_CONTROL)
CONTROL_PI = replace(block("", text="PI", key=("k",)), ports=_CONTROL)
CONTROL_PID = replace(block("", text="PID", key=("k",)), ports=_CONTROL)
PATH = block("M-14 10 q8 0 12 -10 q4 -10 16 -10")
SCHEDULE = block("M-14 11 h7 v-7 h7 v-7 h7 v-8 h7")
DRIVER = block("M-12 8 a12 12 0 1 1 24 0 M-9 -2 h18 M0 -2 v10")
ASYNCHRONOUS = replace(MOTOR, text="M 3~", lines="M24 0 h2", key=("tau_k",),
                       ports={"flange": "E", "v": "W", "f": "N", "v_rel": "W"})  # fmt: skip
SYNCHRONOUS = replace(MOTOR, text="MS", lines="M24 0 h2", ports={"flange": "E", "v_d": ("W", -10), "v_q": ("W", 10)})
DRIVE = replace(MOTOR, text="MS", ports={"p_dc": ("W", -14), "n_dc": ("W", 14), "flange": "E", "tau_ref": "N"})
STATE_SPACE = block("", text="A B")
