"""A small drive for each class of the table: its ends bear loads, its inputs waves, its parameters are no defaults.

Loads and waves are written here with equations of their own, so a drive has one class of the library only.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

from library_references import LIBRARY

from modelica_like.netlist.modelica.classes import Classes, with_libraries
from modelica_like.netlist.modelica.instance import Given, Instance
from modelica_like.netlist.modelica.library import known_classes
from modelica_like.netlist.modelica.members import exists, part_of
from modelica_like.netlist.modelica.parse import parse_modelica
from modelica_like.netlist.modelica.tree import ClassText

LOADS = """
  model Rotor
    Modelica.Mechanics.Rotational.Interfaces.Flange_a flange;
    parameter Real J = 0.6; parameter Real d = 0.3; parameter Real A = 4; parameter Real f = 1; parameter Real w0 = 2;
    parameter Boolean given = true;
    Real phi(start = 0.1, fixed = given); Real w(start = w0, fixed = given);
  equation
    phi = flange.phi; w = der(phi);
    J*der(w) = flange.tau - d*w + A*sin(6.283185307179586*f*time);
  end Rotor;
  model Slide
    Modelica.Mechanics.Translational.Interfaces.Flange_a flange;
    parameter Real m = 0.6; parameter Real d = 0.3; parameter Real A = 4; parameter Real f = 1; parameter Real v0 = 2;
    parameter Boolean given = true;
    Real s(start = 0.1, fixed = given); Real v(start = v0, fixed = given);
  equation
    s = flange.s; v = der(s);
    m*der(v) = flange.f - d*v + A*sin(6.283185307179586*f*time);
  end Slide;
  model Wire
    Modelica.Electrical.Analog.Interfaces.Pin pin;
    parameter Real R = 2; parameter Real A = 12; parameter Real f = 1;
  equation
    pin.v = R*pin.i + A*sin(6.283185307179586*f*time + 0.3);
  end Wire;
  model Wall
    Modelica.Thermal.HeatTransfer.Interfaces.HeatPort_a port;
    parameter Real G = 3; parameter Real A = 10; parameter Real f = 1;
  equation
    port.Q_flow = G*(port.T - 320 - A*sin(6.283185307179586*f*time));
  end Wall;
  block Wave
    Modelica.Blocks.Interfaces.RealOutput y;
    parameter Real A = 1; parameter Real b = 0; parameter Real f = 1; parameter Real p = 0.2;
  equation
    y = b + A*sin(6.283185307179586*f*time + p);
  end Wave;
  block Motion "a wave, its rate and the rate of that"
    Modelica.Blocks.Interfaces.RealOutput y[3];
    parameter Real A = 0.3; parameter Real f = 1;
  equation
    y = A*{sin(6.283185307179586*f*time), 6.283185307179586*f*cos(6.283185307179586*f*time),
      -(6.283185307179586*f)^2*sin(6.283185307179586*f*time)};
  end Motion;
  block Pulses
    Modelica.Blocks.Interfaces.BooleanOutput y;
    parameter Real f = 1;
  equation
    y = sin(6.283185307179586*f*time + 0.2) > 0;
  end Pulses;
"""
ENDS = {
    "Modelica.Mechanics.Rotational": ("Rotor", "flange"), "Modelica.Mechanics.Translational": ("Slide", "flange"),
    "Modelica.Electrical.Analog": ("Wire", "pin"), "Modelica.Thermal.HeatTransfer": ("Wall", "port"),
}  # fmt: skip
FREQUENCIES = (1.0, 1.7, 2.3, 0.7, 1.3, 2.9)
VALUES: dict[str, str] = {
    "phi0": "0.3", "J": "0.7", "deltaPhi": "0.2", "c": "80", "d": "0.8", "phi_rel0": "0.15", "b": "0.1",
    "tau_pos": "[0, 1; 2, 1.5; 4, 1.2]", "mu_pos": "[0, 0.4; 2, 0.5; 5, 0.3]", "f_pos": "[0, 1; 2, 1.5; 4, 1.2]",
    "peak": "1.2", "cgeo": "0.6", "fn_max": "5", "ratio": "2.5",
    "lossTable": "[0, 0.9, 0.8, 0.1, 0.2; 5, 0.85, 0.75, 0.15, 0.3]", "radius": "0.4", "f_crit": "8",
    "tau_constant": "1.5", "stepTorque": "2", "offsetTorque": "0.4", "startTime": "0.23", "w_fixed": "1.7",
    "tau_nominal": "3", "w_nominal": "4", "w0": "1.5", "TRef": "300", "alpha20": "0.004", "constantExcitation": "0.7",
    "s0": "0.3", "m": "0.7", "L": "0.5", "s_rel0": "0.1", "s_ref": "0.9", "n": "1.4", "smax": "3",
    "smin": "-0.9", "F_prop": "0.8", "F_Coulomb": "1.1", "F_Stribeck": "0.9", "fexp": "1.6", "fWeight": "20",
    "CrConstant": "0.03", "inclinationConstant": "0.02", "v0": "3", "g": "9.7", "R": "0.35", "A": "0.9", "Cd": "0.4",
    "rho": "1.1", "vWindConstant": "3", "vReg": "0.02", "f_constant": "1.5", "stepForce": "2", "offsetForce": "0.4",
    "v_fixed": "1.7", "f_nominal": "3", "v_nominal": "4", "k": "1.3", "height": "2.2", "offset": "0.4",
    "duration": "0.4", "amplitude": "1.6", "f": "1.9", "phase": "0.6", "damping": "0.9", "width": "30",
    "period": "0.37", "nperiod": "2", "rising": "0.05", "falling": "0.07", "w": "9", "D": "0.4", "Ti": "0.3",
    "Td": "0.05", "yMax": "1.4", "yMin": "-0.9", "wp": "0.8", "wd": "0.3", "Ni": "0.7", "Nd": "8", "uMax": "0.6",
    "uMin": "-0.4", "C": "40", "G": "2.4", "Q_flow": "35", "T_ref": "290", "Ron": "0.05", "Goff": "0.002",
    "Vknee": "0.6", "V": "9", "I": "1.2",
}  # fmt: skip
"""Of parameters by their names; classes where others are needed are below."""
_PTP = "q_begin = {0.1}, q_end = {1.4}, qd_max = {2.1}, qdd_max = {9}, startTime = 0.13"
_TABLE = "table = [0, 1, 2; 0.3, 2, 0.5; 0.7, 0.4, 1], timeScale = 1.2, startTime = 0"
_INIT = "Modelica.Blocks.Types.Init"
_MACHINE = (
    "VaNominal = 90, IaNominal = 8, wNominal = 140, TaNominal = 370, Ra = 0.5, La = 0.02, Jr = 0.15, TaRef = 295, "
    "alpha20a = 0.0039, TaOperational = 350, frictionParameters(PRef = 40, wRef = 140, power_w = 1.8), "
    "strayLoadParameters(PRef = 20, IRef = 8, wRef = 140), brushParameters(V = 1.1, ILinear = 0.2)"
)
OWN: dict[str, tuple[str, ...]] = {
    "Rotational.Components.Gearbox": ("b = 0", ""),
    "Rotational.Components.InitializeFlange": ("use_a_start = false",),
    "Rotational.Sources.Position": ("exact = true", ""), "Rotational.Sources.Speed": ("exact = true", ""),
    "Translational.Sources.Position": ("exact = true", ""), "Translational.Sources.Speed": ("exact = true", ""),
    **{f"{domain}.Sources.{law}SpeedDependent{what}": (start, f"{start}, {what}Direction = false".lstrip(", "))
       for domain, what, w in (("Rotational", "Torque", "w"), ("Translational", "Force", "v"))
       for law, start in (("Linear", ""), ("Quadratic", ""), ("Inverse", f"{w}0 = 4"))},
    **{f"{path}": tuple(f"reg = Modelica.Blocks.Types.Regularization.{r}" for r in ("Exp", "Sine", "Linear", "Cosine"))
       for path in ("Rotational.Sources.SignTorque", "Translational.Sources.SignForce",
                    "Translational.Components.RollingResistance")},
    "Translational.Components.Vehicle": ("", "useWindInput = false"),
    "Sources.Trapezoid": ("width = 0.11",), "Sources.KinematicPTP2": (_PTP,),
    "Sources.CombiTimeTable": tuple(
        f"{_TABLE}, extrapolation = Modelica.Blocks.Types.Extrapolation.{e}"
        for e in ("LastTwoPoints", "HoldLastPoint")),
    "Continuous.FirstOrder": ("T = 0.2", f"T = 0.2, initType = {_INIT}.InitialOutput"),
    "Continuous.SecondOrder": ("", f"initType = {_INIT}.InitialOutput"),
    "Continuous.Derivative": ("T = 0.05",),
    "Continuous.LimPID": (
        "", *(f"controllerType = Modelica.Blocks.Types.SimpleController.{c}" for c in ("P", "PI", "PID"))),
    "Continuous.TransferFunction": ("b = {2, 3}, a = {0.02, 0.3, 1}",),
    "DCMachines.DC_PermanentMagnet": (_MACHINE,),
    "DCMachines.DC_ElectricalExcited": (f"{_MACHINE}, IeNominal = 1.2, Re = 60, TeRef = 295, Le = 0.9, sigmae = 0",),
    "Celsius.FixedTemperature": ("T = 40",), "HeatTransfer.Sources.FixedTemperature": ("T = 330",),
    **{f"Sources.EddyCurrent{w}": ("T = 330",) for w in ("Torque", "Force")},
    "Basic.Resistor": ("R = 3, alpha = 0.004",), "Basic.Capacitor": ("C = 0.02",),
}  # fmt: skip
"""Values of single classes, in one drive each; they stand before those of `VALUES`."""
RIGID = re.compile(
    r"Inertia|Disc|Mass|Rod|Gear(box|R2T)?|RollingWheel|Planetary|BearingFriction|Brake|SupportFriction|TorqueSensor"
    r"|ForceSensor|PowerSensor|MultiSensor|Position|Speed|Accelerate|Move|ConstantSpeed|Vehicle"
    r"|(Lossy|Ideal)Gear\w*|IdealRollingWheel|IdealPlanetary|MassWithStopAndFriction|Fixed|\w*To(Torque|Force)Adaptor"
    r"|InitializeFlange"
)
"""Classes that move, or join their flanges rigidly: the first load starts as they say."""


_OFFSETS = {"limit1": "b = 1.5", "limit2": "b = -1.5", "u": "A = 2"}
_MOTION = {"phi": 1, "s": 1, "p": 1, "w": 2, "v": 2, "pder": 2, "a": 3, "pder2": 3}
"""Inputs of classes that take a motion and its rates."""


@dataclass(frozen=True)
class Drive:
    """A drive with one class.

    Attributes:
        path: of the class.
        own: the values that stand first.
        ends: whether all conditional ends are there, such as supports and heat ports.
    """

    path: str
    own: str
    ends: bool

    def __str__(self) -> str:
        return f"{self.path.removeprefix('Modelica.')}({self.own}{'; ends' if self.ends else ''})"


@cache
def _classes() -> Classes:
    with with_libraries([LIBRARY]):
        return Classes(LIBRARY / "Modelica" / "package.mo", table=False)


def drives() -> list[Drive]:
    """Return the drives of all classes of the table."""
    result: list[Drive] = []
    for path in known_classes() if LIBRARY.is_dir() else ():
        own = next((values for end, values in OWN.items() if path.endswith(f".{end}")), ("",))
        used = any(re.match("use(?!_fder)", name) for name in _instance(path).members)
        result += [Drive(path, values, ends) for values in own for ends in (False, True)[: 1 + used]]
    return result


def _instance(path: str, values: str = "") -> Instance:
    classes = _classes()
    text = classes.full(path)
    assert isinstance(text, ClassText), path
    drive = parse_modelica(f"model Drive\n  {path} dut({values});\nend Drive;\n", "drive.mo")[0]
    part = part_of(whole := Instance(classes, drive, Given()), whole.members["dut"])
    assert isinstance(part, Instance)
    return part


def _values(drive: Drive) -> str:
    """Return the modification of the class."""
    values, given = [drive.own] if drive.own else [], set(re.findall(r"(\w+) =", drive.own))
    for name, member in _instance(drive.path).members.items():
        prefixes = member.declaration.prefixes
        if "parameter" not in prefixes or {"final", "protected"} & prefixes or name in given:
            continue
        if name in VALUES and not (member.declaration.dimensions and not VALUES[name].startswith(("[", "{"))):
            values.append(f"{name} = {VALUES[name]}")
        elif member.declaration.type == "Boolean" and re.match("use(?!_fder)", name) and drive.ends:
            values.append(f"{name} = true")
    return ", ".join(values)


def drive_text(drive: Drive) -> str:
    """Return the text of a drive; its class is the part `dut`."""
    values = _values(drive)
    instance = _instance(drive.path, values)
    lines, joints, flanges = list[str](), list[str](), 0
    rigid = RIGID.fullmatch(drive.path.rpartition(".")[2]) is not None
    motion = {"a", "pder2"} & instance.members.keys()
    for name, member in instance.members.items():
        kind = instance.find(member.declaration.type, member.text)
        hidden = {"protected", "parameter"} & member.declaration.prefixes
        if hidden or not isinstance(kind, ClassText) or kind.kind != "connector" or not exists(instance, member):
            continue
        f = f"f = {FREQUENCIES[len(joints) % len(FREQUENCIES)]}"
        load, end = next((load for package, load in ENDS.items() if kind.path.startswith(f"{package}.")), ("", ""))
        if load:
            free = ", given = false" if end == "flange" and rigid and not flanges else ""
            flanges += end == "flange"
            lines.append(f"  {load} at_{name}({f}{free});")
            joints.append(f"  connect(at_{name}.{end}, dut.{name});")
        elif kind.path.endswith("Input"):
            whole, order = bool(member.declaration.dimensions), _MOTION.get(name, 0) if motion else 0
            block = "Motion" if whole or order else "Pulses" if kind.path.endswith("BooleanInput") else "Wave"
            values_of = "" if block == "Motion" else f"({', '.join(filter(None, (f, _OFFSETS.get(name, ''))))})"
            lines.append(f"  {block} for_{name}{values_of};")
            joints.append(f"  connect(for_{name}.y{f'[{order}]' if order else ''}, dut.{name});")
    return "\n".join([
        "model Drive", LOADS, f"  {drive.path} dut({values});", *lines, "equation", *joints,
        "  annotation(experiment(StopTime = 1));", "end Drive;",
    ])  # fmt: skip
