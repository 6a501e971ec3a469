"""Arguments of the wrong kind: every public function says which one it is, and nothing is raised by Python alone."""

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import matplotlib as mpl
import numpy as np
import pint
import pytest

import modelica_like
from modelica_like import Options, WoehlerLine, build, simulate
from modelica_like.analyse.after.spectra import LoadSpectrum
from modelica_like.errors import FmuRefused, LanguageError, ModelicaLikeError, ValueOutOfRange
from modelica_like.netlist import loads

mpl.use("Agg")
TEXT = """name = "two_mass"
[parts]
motor = { is = "Torque", tau = "5 N.m" }
J1 = { is = "Inertia", J = "0.02 kg.m2", w = 0, phi = 0 }
shaft = { is = "SpringDamper", c = "400 N.m/rad", d = "0.2 N.m.s/rad", phi_rel = 0, w_rel = 0 }
J2 = { is = "Inertia", J = "0.08 kg.m2" }
[series]
drive = ["motor", "J1", "shaft", "J2"]
[simulate]
until = "0.02 s"
"""
SPECTRUM = LoadSpectrum("shaft.tau", "N.m", np.array([2.0]), np.array([0.0]), np.array([1.0]))
WRONG = (None, 3, float("nan"), "x", b"x", [], {}, object(), [3], {"x": object()}, print)
"""Each is given to every argument; some are right for some."""


@pytest.fixture(scope="module")
def right() -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    """Public functions with right arguments where there is no default."""
    drive = loads(TEXT)
    model = build(drive)
    run = simulate(model)
    arguments: dict[str, dict[str, Any]] = {
        "Assembly": {}, "Bar": {}, "Native": {"model": model}, "Options": {},
        "WoehlerLine": {"amplitude": 1.0, "cycles": 1.0, "slope": 1.0},
        "build": {"drive": model}, "simulate": {"drive": model},
        "calibrate": {"drive": model, "data": [], "parameters": {}},
        "campbell": {"drive": model, "over": {"shaft.c": [100.0]}, "speed": "J1.w"},
        "characteristic": {"drive": model, "over": {"shaft.c": [100.0]}},
        "compare": {"a": run, "b": run},
        "cosim": {"system": "nothing.toml"},
        "duty": {"run": run, "torque": "shaft.tau", "speed": "J1.w"},
        "explore": {"drive": "nothing.toml"},
        "export_fmu": {"drive": model, "path": "drive.fmu", "platforms": [], "check": False},
        "export_html": {"drive": model, "path": "drive.html"},
        "importance": {"drive": model, "ranges": {"shaft.c": (1, 2)}, "outputs": ["J1.w"], "samples": 4},
        "linearize": {"drive": model},
        "load": {"path": "nothing.toml"},
        "load_spectrum": {"run": run, "load": "shaft.tau"},
        "open_loop": {"drive": drive, "signal": "motor.tau"},
        "optimize": {"drive": drive, "minimize": "shaft.tau", "free": {"shaft.c": [100, 900]}},
        "order_map": {"run": run, "signal": "shaft.tau", "angle": "J1.phi"},
        "order_response": {"linear": modelica_like.linearize(model), "excitation": {1.0: 1.0}, "speeds": [1.0, 2.0]},
        "overlay": {"runs": {"a": run}},
        "plot_sweep": {"found": None},
        "run_fmu": {"path": "nothing.fmu"},
        "save_report": {"drive": drive, "run": run, "path": "report.html"},
        "save_schematic": {"component": drive, "path": "drive.svg"},
        "schematic": {"component": drive},
        "tolerance": {"drive": drive, "of": "shaft.tau", "tolerances": {"shaft.c": "±5 %"}, "most": 2048},
        "sensitivities": {"drive": model, "of": "J1.w", "to": "shaft.c"},
        "simulation_function": {"drive": model, "inputs": "shaft.c", "outputs": "J1.w"},
        "split": {"drive": drive, "at": "shaft.flange_a", "folder": "parts", "check": False},
        "steady": {"drive": model},
        "step_metrics": {"run": run, "variable": "J1.w"},
        "sweep": {"drive": model, "over": {"shaft.c": [100.0]}, "outputs": ["J1.w"], "processes": 1},
        "validate_fmu": {"path": "nothing.fmu"},
    }  # fmt: skip
    return {name: (getattr(modelica_like, name), given) for name, given in arguments.items()}


NAMES = sorted({*modelica_like.__all__} - {"CompiledDae", "Component", "ModelicaLikeError", "Solution", "Trajectories"})


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", NAMES)
def test_no_public_function_ends_in_an_error_of_python(
    name: str, right: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    function, given = right[name]
    raw: list[str] = []
    for argument, parameter in inspect.signature(function).parameters.items():
        for wrong in (*WRONG, build(loads(TEXT))):
            try:
                if parameter.kind is parameter.VAR_POSITIONAL:
                    function(*given.values(), wrong)
                elif parameter.kind is not parameter.VAR_KEYWORD:
                    function(**{**given, argument: wrong})
            except ModelicaLikeError:
                pass
            except Exception as error:  # noqa: BLE001 -- all that are not ours
                raw.append(f"{argument} = {wrong!r}: {type(error).__name__}: {error}")
    assert not raw, "\n".join(raw)


SAID: dict[str, tuple[type[ModelicaLikeError], Callable[[], object], str]] = {
    "no list": (ValueOutOfRange, lambda: build(loads(TEXT), free=cast(Any, 3)), """\
build: free = 3 is no list of texts.
Give one, such as ["…"]."""),
    "one text for a list": (ValueOutOfRange, lambda: build(loads(TEXT), tables="clutch.mu_pos"), """\
build: tables = 'clutch.mu_pos' is no list of texts.
Give one, such as ["…"]."""),
    "no number": (ValueOutOfRange, lambda: simulate(loads(TEXT), t0=cast(Any, [])), """\
simulate: t0 = [] is no number.
Give one, such as 1.0."""),
    "no quantity": (ValueOutOfRange, lambda: simulate(loads(TEXT), cast(Any, {})), """\
simulate: until = {} is no number or text.
Give one, such as 1.0 or "…"."""),
    "no whole number": (ValueOutOfRange, lambda: Options(points=cast(Any, 2.5)), """\
points = 2.5 is no whole number.
Give one, such as 1."""),
    "no longest step": (ValueOutOfRange, lambda: Options(max_step=cast(Any, "1 ms")), """\
max_step = '1 ms' is no number.
Give one, such as 1.0."""),
    "no Woehler line": (ValueOutOfRange, lambda: WoehlerLine(cast(Any, "2 MPa"), 1e6, 5), """\
WoehlerLine: amplitude = '2 MPa' is no number.
Give one, such as 1.0."""),
    "a Woehler line without a number of cycles": (ValueOutOfRange, lambda: WoehlerLine(1.0, float("nan"), 5.0), """\
Amplitude, cycles and slope of a Wöhler line must be above zero, not WoehlerLine(amplitude=1.0, cycles=nan, slope=5.0, \
below='elementary')."""),
    "a Woehler line of no kind": (ValueOutOfRange, lambda: WoehlerLine(1.0, 1e6, 5.0, cast(Any, "haibac")), """\
WoehlerLine: below = 'haibac' must be elementary or haibach or original."""),
    "a Woehler line that rises": (ValueOutOfRange, lambda: WoehlerLine(1.0, 1e6, 0.4, "haibach"), """\
Haibach's line needs a Wöhler line of slope 1 or more, not 0.4."""),
    "no slope of an equivalent load": (ValueOutOfRange, lambda: SPECTRUM.equivalent(5.0, 0.0), """\
Slope and cycles must be above zero, not 5 and 0."""),
    "fewer repetitions than none": (ValueOutOfRange, lambda: SPECTRUM * -3, """\
A load spectrum cannot be repeated -3 times."""),
    "no dictionary": (ValueOutOfRange, lambda: modelica_like.characteristic(loads(TEXT), over=cast(Any, 3)), """\
characteristic: over = 3 is no dictionary.
Give one, such as {"…": …}."""),
    "no values in it": (
        ValueOutOfRange, lambda: modelica_like.characteristic(loads(TEXT), over=cast(Any, {"shaft.c": 3})), """\
characteristic: over['shaft.c'] = 3 is no list.
Give one, such as […]."""),
    "no names in it": (ValueOutOfRange, lambda: simulate(loads(TEXT), parameters=cast(Any, {3: 4})), """\
simulate: a name in parameters = 3 is no text.
Give one, such as "…"."""),
    "no run": (ValueOutOfRange, lambda: modelica_like.load_spectrum(cast(Any, object()), "shaft.tau"), """\
load_spectrum: run = something of type object is no run.
Give one, such as simulate(…)."""),
    "no result of a sweep": (ValueOutOfRange, lambda: modelica_like.plot_sweep(cast(Any, "x")), """\
plot_sweep: found = 'x' is no result of a sweep.
Give one, such as sweep(…)."""),
    "no component": (ValueOutOfRange, lambda: modelica_like.schematic(cast(Any, 3)), """\
schematic: component = 3 is no component or text or path.
Give one, such as load("…") or "…" or Path("…")."""),
    "no drive to export": (LanguageError, lambda: modelica_like.export_fmu(cast(Any, 3), "drive.fmu"), """\
Something of type int is no drive: write a component, a built model, or a netlist's path.
Parts become a drive as Assembly(parts={"motor": …, "load": …}, series={"shaft": ["motor", "load"]})."""),
    "a compiled drive to cut": (
        LanguageError, lambda: modelica_like.split(cast(Any, build(loads(TEXT))), "shaft", "parts"), """\
A compiled drive cannot be cut.
Give the component or the netlist."""),
    "no runs": (ValueOutOfRange, lambda: modelica_like.overlay({}), """\
There is no run to draw.
Give runs by name: overlay({"old": …, "new": …})."""),
    "an endless window": (
        ValueOutOfRange,
        lambda: modelica_like.order_map(simulate(loads(TEXT)), "shaft.tau", "J1.phi", revolutions=float("nan")), """\
The highest order and the length of a window must be positive and finite, not 10 and nan."""),
    "no response where a motion is free": (
        ValueOutOfRange, lambda: modelica_like.linearize(loads(TEXT), "rest").response([1.0, 0.0]), """\
two_mass has no response at 0 Hz: nothing holds or damps a motion there.
Leave that frequency out."""),
    "no ranges": (ValueOutOfRange, lambda: modelica_like.importance(loads(TEXT), {}, ["J1.w"]), """\
There is no parameter to rank.
Give bounds by path: importance(…, {"shaft.c": (300, 500)}, …)."""),
    "no file to run": (FmuRefused, lambda: modelica_like.run_fmu("nofile.fmu"), """\
The FMU 'nofile.fmu' does not exist.
Give the path of an FMU."""),
    "no file to check": (FmuRefused, lambda: modelica_like.validate_fmu("nofile.fmu"), """\
The FMU 'nofile.fmu' does not exist.
Give the path of an FMU."""),
    "a folder for an FMU": (FmuRefused, lambda: modelica_like.run_fmu("."), """\
The FMU '.' is a folder.
Give the path of an FMU."""),
}  # fmt: skip


@pytest.mark.parametrize(("kind", "make", "text"), SAID.values(), ids=SAID.keys())
def test_message(
    kind: type[ModelicaLikeError], make: Callable[[], object], text: str, check_message: Callable[..., None]
) -> None:
    check_message(kind, make, text)


def test_what_is_right_in_another_form_is_taken() -> None:
    """Numbers of NumPy, quantities of pint, generators, and lists for tuples."""
    drive = loads(TEXT)
    assert build(drive, free=(name for name in ("J1.J",))).name == "two_mass"
    assert simulate(drive, until=cast(Any, np.asarray(0.01)), points=np.int64(3), t0=np.float64(0)).time.shape == (4,)
    assert simulate(drive, until=cast(Any, pint.Quantity(10, "ms"))).time[-1] == 0.01
    assert modelica_like.sweep(drive, {"shaft.c": np.array([100.0])}, ["J1.w"]).sizes == {"shaft.c": 1}
