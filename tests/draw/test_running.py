"""What a run adds to schematics: powers of branches, modes as looks, and what cannot be shown."""

from itertools import combinations
from pathlib import Path

import pytest
from calls import called

from modelica_like import load, schematic, simulate
from modelica_like.errors import ValueOutOfRange
from modelica_like.show.draw import layout
from modelica_like.show.draw.labels import meet
from modelica_like.show.draw.running import energy_notes, running, spelled
from modelica_like.show.draw.sheet import Line, Placed, texts

EXAMPLES = Path(__file__).parents[2] / "examples"


def powers(name: str, at: float | None = None) -> dict[str, list[float]]:
    """Largest and smallest power on the lines at each part's ports."""
    drive = load(EXAMPLES / f"{name}.toml")
    drawn = layout(drive)
    found = running(drawn, simulate(drive), at=at, flow=True).powers
    return {
        f"{port.node.name}.{port.name}": sorted(abs(power) for *_, power in pieces)
        for line, pieces in found.items()
        for port in line.ports
    }


def test_mean_power_is_the_energy_over_the_time() -> None:
    run = simulate(EXAMPLES / "dc_bench.toml")
    found, span = powers("dc_bench"), run.time[-1] - run.time[0]
    motor = run.energy()["motor"]
    # What the battery brings in, and the motor does not lose or store, leaves it at its shaft.
    shaft = (run.energy()["battery"].source - motor.lost - motor.stored) / span
    assert found["motor.flange"][-1] == pytest.approx(shaft, rel=2e-3)
    assert found["clutch.flange_b"][-1] < found["clutch.flange_a"][-1], "it has slipped"


def test_a_branch_shows_what_goes_there() -> None:
    found = powers("lepelletier", at=1.4)
    # In gear 1 all goes through the ring, and clutch_e is free.
    assert found["clutch_e.flange_a"][0] < 1e-3 * found["clutch_e.flange_a"][-1]
    assert found["front.ring"][-1] == pytest.approx(found["clutch_a.flange_a"][-1], rel=1e-3)


def test_a_sensor_takes_no_power() -> None:
    drive = load(EXAMPLES / "dc_bench.toml")
    drawn = layout(drive)
    found = running(drawn, simulate(drive), flow=True).powers
    line = next(line for line in found if any(port.node.name == "clutch_speed" for port in line.ports))
    sensor = next(tip for port, tip in line.tips.items() if port.node.name == "clutch_speed")
    at_sensor = [power for a, b, power in found[line] if sensor in (a, b)]
    assert at_sensor == [0.0]
    assert max(abs(power) for *_, power in found[line]) > 1.0


def test_power_at_a_time_is_torque_times_speed() -> None:
    run = simulate(EXAMPLES / "lepelletier.toml")
    found, now = powers("lepelletier", at=1.4), run.at(1.4)
    assert found["car.flange_b"][-1] == pytest.approx(abs(now["resistance.flange.tau"] * now["car.w"]), rel=1e-3)


def test_modes_have_looks() -> None:
    drive = load(EXAMPLES / "machine_tool_startup.toml")
    run = simulate(drive)
    looks = {
        at: {node.name: shown[-1][1:] for node, shown in running(layout(drive), run, at=at).modes.items()}
        for at in (0.0, 0.1, 0.5)
    }
    assert [looks[at]["clutch"] for at in looks] == [("slides", "backward"), ("slides", "backward"), ("held", "stuck")]
    assert [looks[at]["load"] for at in looks] == [("held", "stuck"), ("slides", "forward"), ("slides", "forward")]
    moving = running(layout(drive), run, moving=True).modes
    (clutch,) = (shown for node, shown in moving.items() if node.name == "clutch")
    assert [look for _, look, _ in clutch] == ["slides", "held"]
    assert clutch[1][0] == pytest.approx(0.265473, abs=1e-6), "document 003"


def test_what_carries_nothing_is_open() -> None:
    drive = load(EXAMPLES / "lepelletier.toml")
    shown = running(layout(drive), simulate(drive), at=1.4).modes
    looks = {node.name: looks[-1][1] for node, looks in shown.items()}
    # Gear 1: clutch A and brake D hold.
    names = ("clutch_a", "clutch_b", "clutch_e", "brake_c", "brake_d")
    assert [looks[name] for name in names] == ["held", "open", "open", "open", "held"]


def test_an_animation_switches_all_modes_once_per_cycle() -> None:
    drive = load(EXAMPLES / "machine_tool_startup.toml")
    text = schematic(drive, run=simulate(drive), moving=True)
    assert 'values="visible;hidden" keyTimes="0;0.27"' in text
    assert text.count("<g ") == text.count("</g>")


@pytest.mark.parametrize(("power", "text"), [
    (12345.0, "12.3 kW"), (0.0123, "12.3 mW"), (2.5e6, "2.5 MW"), (999.0, "999 W"), (0.0, "0 mW"),
])  # fmt: skip
def test_powers_have_a_suitable_unit(power: float, text: str) -> None:
    assert spelled(power) == text


def test_what_cannot_be_shown_is_told(tmp_path: Path) -> None:
    drive = load(EXAMPLES / "machine_tool_startup.toml")
    with pytest.raises(ValueOutOfRange, match=r"There is nothing at 7 s: the run goes from 0 s to 1 s\."):
        schematic(drive, run=simulate(drive), at=7.0)
    told = called(["draw", str(EXAMPLES / "lepelletier.toml"), "--animate", "-o", str(tmp_path / "a.png")])
    assert told.exit_code == 2
    assert "'a.png': only SVG moves." in told.stderr


def test_the_command_runs_the_drive(tmp_path: Path) -> None:
    for words in (["--at", "0.3s"], ["--flow"], ["--animate"]):
        path = tmp_path / "drive.svg"
        told = called(["draw", str(EXAMPLES / "machine_tool_startup.toml"), *words, "-o", str(path)])
        assert told.exit_code == 0, told.stderr
        text = path.read_text("utf-8")
        assert "stuck" in text
        assert ("animate" in text) == (words == ["--animate"])
        assert (" W<" in text) == (words != ["--animate"])


@pytest.mark.parametrize("name", ["winch", "launch", "components/h_bridge"])
def test_energies_stand_where_nothing_else_does(name: str) -> None:
    drive = load(EXAMPLES / f"{name}.toml")
    run = simulate(drive)
    balance = run.energy()
    drawn = layout(drive, notes=energy_notes(balance))
    found = running(drawn, run, flow=True, balance=balance)
    everything = list(drawn.everything())
    told = [(at, text) for at, item in everything if isinstance(item, Line) for text in found.said.get(item, ())]
    told += [((at[0] + item.at[0], at[1] + item.at[1]), text) for at, item in everything
             if isinstance(item, Placed) for text in texts(item)]  # fmt: skip
    boxes = [(text.text, tuple(side + at[k % 2] for k, side in enumerate(text.box))) for at, text in told]
    assert len(found.said) > 3
    for (first, a), (second, b) in combinations(boxes, 2):
        assert not meet(a, b), (first, second)


def test_energies_of_the_parts_are_those_of_the_balance() -> None:
    drive = load(EXAMPLES / "lepelletier.toml")
    balance = simulate(drive).energy()
    told = {name: energy_notes(balance)(part) for name, part in drive.parts.items()}
    lost = sum(row.lost for row in balance if row.component.startswith("box."))
    assert f"lost {spelled(lost, 'J')}, {lost / balance.supply:.1%}" in told["box"], "all that is inside"
