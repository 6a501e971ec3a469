"""Draw the pictures of the documentation: python docs/examples/draw.py [NAME...].

A NAME is that of a picture of these pages, of a page of docs/ whose blocks draw pictures, such as analysis.md, or
`screens` for what Chromium shows of a report and of a page with sliders.
"""

import contextlib
import re
import runpy
import shutil
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import Any

from figures import EXAMPLES, FIGURES, TURNING
from matplotlib.figure import Figure
from PIL import Image

from modelica_like import load, save_report, sensitivities, simulate
from modelica_like.page import PageServer, Session
from modelica_like.show.plot import save_plot

HERE = Path(__file__).parent

PICTURES: dict[str, tuple[str, ...]] = {
    "fan": ("motor.w", "impeller.w", "clutch.tau", "air.tau"),
    "machine_table_direct": ("motor.w", "spindle.w", "clutch.tau", "table.v", "table.s"),
    "machine_table_geared": ("motor.w", "spindle.w", "clutch.tau", "table.v", "table.s"),
    "machine_tool_startup": ("J1.w", "J2.w", "J3.w", "J4.w", "shaft1.tau", "shaft2.tau", "clutch.tau"),
    "ravigneaux": ("small_sun.w", "carrier.w", "machine.w", "clutch_small.tau", "brake_large.tau"),
    "lepelletier": (
        "crankshaft.w",
        "car.w",
        *(f"box.{name}.tau" for name in ("clutch_a", "clutch_b", "brake_c", "brake_d", "clutch_e")),
        "selector.gear",
        *(f"box.{name}.mode" for name in ("clutch_a", "clutch_b", "brake_c", "brake_d", "clutch_e")),
    ),
    "dc_bench": ("motor.w", "clutch_pulley.w", "flywheel.w", "motor.ia", "generator.v", "clutch.tau"),
    "winch": ("motor.w", "load.v", "motor.ia", "rope.tension", "load.s"),
    "launch": ("engine.w", "input.w", "car.v", "clutch.T", "tyre.f", "tyre.F_z", "clutch.tau"),
    "dc_bench_cycles": ("clutch_pulley.w", "flywheel.w", "coil.i", "coil.y", "clutch.T"),
    "machine_tool_magnet": ("coil.i", "coil.f", "clutch.tau", "J2.w", "J3.w", "clutch.T"),
    "dc_bench_speed_control": ("motor.w", "converter.v", "motor.ia", "sink.i", "clutch.tau"),
    "dc_machines/series_runaway": ("machine.w", "machine.ia", "machine.tau_electrical"),
    "msl/rotational/First": ("inertia1.w", "inertia2.w", "inertia3.w", "torque.tau", "spring.tau"),
    "msl/rotational/Friction": ("inertia3.w", "inertia2.w", "inertia1.w", "clutch.tau", "brake.tau"),
    "msl/rotational/CoupledClutches": ("J1.w", "J2.w", "J3.w", "J4.w", "clutch1.tau", "clutch2.tau", "clutch3.tau"),
    "msl/rotational/ElasticBearing": ("shaft.w", "load.w", "spring.tau", "housing.phi"),
    "msl/rotational/Backlash": (
        "inertia1.phi",
        "inertia2.phi",
        "inertia3.phi",
        "elastoBacklash.tau",
        "elastoBacklash2.tau",
    ),
    "msl/rotational/OneWayClutch": ("inertiaIn.w", "inertiaOut.w", "oneWayClutch.tau"),
    "msl/rotational/LossyGearDemo2": ("Inertia1.w", "Inertia2.w", "bearingFriction.tau", "gear.tau_loss"),
    "msl/translational/ElastoGap": ("mass1.s", "mass2.s", "elastoGap1.f", "elastoGap2.f"),
    "msl/translational/PreLoad": ("spool.s", "innerContactA.f", "innerContactB.f", "force.f"),
    "msl/dcmachines/DCPM_Start": ("dcpm.ia", "dcpm.w", "dcpm.tau_electrical"),
    "msl/dcmachines/DCSE_Start": ("dcse.ia", "dcse.w", "dcse.tau_electrical"),
}

PAGES = ("plots.md", "analysis.md", "after_the_run.md")
"""Pages of docs/ whose blocks draw their pictures."""

DISPLAY: dict[str, dict[str, str]] = {
    "fan": TURNING,
    "machine_table_direct": TURNING,
    "machine_table_geared": TURNING,
    "ravigneaux": TURNING,
    "lepelletier": TURNING,
    "dc_bench": TURNING,
    "dc_bench_cycles": TURNING | {"temperature": "degC"},
    "machine_tool_magnet": {"force": "kN", "temperature": "degC"},
    "winch": {"force": "kN"},
    "dc_machines/series_runaway": TURNING,
    "msl/dcmachines/DCPM_Start": TURNING,
    "msl/dcmachines/DCSE_Start": TURNING,
}

END = {"fan": "4 s", "ravigneaux": "20 ms"}


def tornado() -> Figure:
    """The picture of docs/sensitivities.md."""
    return sensitivities(EXAMPLES / "machine_tool_startup.toml", ["clutch.lock_time"]).tornado("clutch.lock_time")


def readme() -> Figure:
    """The run of the README."""
    text = (EXAMPLES.parent / "README.md").read_text(encoding="utf-8")
    return run_blocks(text, Path())["run"].plot("*.w", "clutch.tau", "shaft.tau", "table.v", display=TURNING)


ELSEWHERE = {"tornado_lock_time": tornado, "spindle_drive": readme}
"""Pictures in docs/pictures that no block of a page draws."""


def run_blocks(text: str, folder: Path) -> dict[str, Any]:
    """Run the Python blocks of a page in a folder."""
    with tempfile.TemporaryDirectory() as place, contextlib.chdir(folder):
        (program := Path(place) / "page.py").write_text("\n".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL)))
        return runpy.run_path(str(program))


def small(picture: Path, place: Path) -> None:
    """Copy a picture with as many colours as it needs: a third of the bytes, and no visible difference."""
    with Image.open(picture) as full:
        full.convert("RGB").quantize(96, dither=Image.Dither.NONE).save(place, optimize=True)


def save(figure: Figure, name: str, folder: Path = HERE) -> None:
    """Write a picture."""
    save_plot(figure, place := folder / "pictures" / f"{name}.png", dpi=150)
    small(place, place)


def draw_page(page: Path) -> None:
    """Run the blocks of a page, and keep the pictures that it shows."""
    text = page.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "examples").symlink_to(EXAMPLES)
        run_blocks(text, Path(folder))
        for name in re.findall(r"\(pictures/(\w+\.png)\)", text):
            small(Path(folder) / name, page.parent / "pictures" / name)


def screen(address: str, height: int, place: Path, width: int = 1000) -> None:
    """Keep what Chromium shows at an address."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or "google-chrome"
    size = f"--window-size={width},{height}", "--force-device-scale-factor=1.5", "--hide-scrollbars"
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", *size, "--virtual-time-budget=4000"]
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "screen.png"
        subprocess.run([*command, f"--screenshot={picture}", address], check=True, capture_output=True)
        small(picture, place)


def screens() -> None:
    """The report of document 003, its page with sliders, and the page in which the winch is built."""
    drive, place = load(EXAMPLES / "machine_tool_startup.toml"), HERE.parent / "pictures"
    with tempfile.TemporaryDirectory() as folder:
        save_report(drive, simulate(drive), page := Path(folder) / "report.html")
        screen(page.as_uri(), 2420, place / "report.png")
    with PageServer(Session(drive, "0.6 s", show=["J?.w", "clutch.tau"]), folded=True) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        screen(server.address, 900, place / "explore.png")
        server.shutdown()
    with PageServer(Session(EXAMPLES / "winch.toml")) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        screen(server.address, 860, place / "edit.png", 1360)
        server.shutdown()


def main(*wanted: str) -> None:
    """Run every example and save its picture; with names only those pictures."""
    for netlist, shown in PICTURES.items():
        if not wanted or Path(netlist).name in wanted:
            run = simulate(EXAMPLES / f"{netlist}.toml", END.get(netlist))
            save(run.plot(*shown, display=DISPLAY.get(netlist)), Path(netlist).name)
    for name, figure in FIGURES.items():
        if not wanted or name in wanted:
            save(figure(), name)
    for name, figure in ELSEWHERE.items():
        if not wanted or name in wanted:
            save(figure(), name, HERE.parent)
    if not wanted or "screens" in wanted:
        screens()
    for page in PAGES:
        if not wanted or page in wanted:
            draw_page(HERE.parent / page)


if __name__ == "__main__":
    main(*sys.argv[1:])
