"""Draw the pictures of these pages: python docs/examples/draw.py."""

from pathlib import Path

from modelica_like import simulate

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "examples"

PICTURES: dict[str, tuple[str, ...]] = {
    "fan": ("motor.w", "impeller.w", "clutch.tau", "air.tau"),
    "machine_table_direct": ("motor.w", "spindle.w", "clutch.tau", "table.v", "table.s"),
    "machine_table_geared": ("motor.w", "spindle.w", "clutch.tau", "table.v", "table.s"),
    "machine_tool_startup": ("J1.w", "J2.w", "J3.w", "J4.w", "shaft1.tau", "shaft2.tau", "clutch.tau"),
    "ravigneaux": ("small_sun.w", "carrier.w", "machine.w", "clutch_small.tau", "brake_large.tau"),
    "lepelletier": (
        "crankshaft.w",
        "car.w",
        "box.clutch_a.tau",
        "box.clutch_b.tau",
        "box.brake_c.tau",
        "box.clutch_e.tau",
        "selector.gear",
    ),
    "dc_bench": ("motor.w", "clutch_pulley.w", "flywheel.w", "motor.ia", "generator.v", "clutch.tau"),
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
}

END = {"fan": "4 s", "ravigneaux": "20 ms"}


def main() -> None:
    """Run every example and save its picture."""
    for netlist, shown in PICTURES.items():
        run = simulate(EXAMPLES / f"{netlist}.toml", END.get(netlist))
        picture = run.plot(*shown)
        target = HERE / "pictures" / f"{Path(netlist).name}.png"
        picture.savefig(target, dpi=60, pil_kwargs={"optimize": True})


if __name__ == "__main__":
    main()
