"""Draw the pictures of these pages: python docs/examples/draw.py."""

from pathlib import Path

from modelica_like import simulate

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "examples"

PICTURES: dict[str, tuple[str, ...]] = {
    "fan": ("impeller.w", "motor.w", "clutch.tau", "air.tau"),
    "machine_table_direct": ("motor.w", "spindle.w", "clutch.tau", "table.v", "table.s"),
    "machine_table_geared": ("motor.w", "spindle.w", "clutch.tau", "table.v", "table.s"),
    "machine_tool_startup": ("J*.w", "shaft*.tau", "clutch.tau", "coil.y"),
    "msl/rotational/First": ("inertia*.w", "torque.tau", "spring.tau"),
    "msl/rotational/Friction": ("inertia*.w", "clutch.tau", "brake.tau"),
    "msl/rotational/CoupledClutches": ("J*.w", "clutch*.tau"),
    "msl/rotational/ElasticBearing": ("shaft.w", "load.w", "spring.tau", "housing.phi"),
    "msl/rotational/Backlash": ("inertia*.phi", "*acklash*.tau"),
}

END = {"fan": "4 s"}


def main() -> None:
    for netlist, shown in PICTURES.items():
        run = simulate(EXAMPLES / f"{netlist}.toml", END.get(netlist))
        picture = run.plot(*shown)
        target = HERE / "pictures" / f"{Path(netlist).name}.png"
        picture.savefig(target, dpi=60, pil_kwargs={"optimize": True})


if __name__ == "__main__":
    main()
