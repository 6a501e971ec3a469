"""Where a drive is cut, what its parts are, and that they start where the whole does."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from modelica_like import load, simulate
from modelica_like.fmi.cosimulation.cut import cut_netlist, part_of
from modelica_like.fmi.cosimulation.files import load_system, write_system
from modelica_like.fmi.cosimulation.run import cosim
from modelica_like.fmi.cosimulation.split import Split, split
from modelica_like.fmi.cosimulation.system import Bond, Link, Port, find_bonds
from modelica_like.language import Component, Terminal
from modelica_like.netlist import loads, registry
from modelica_like.show.report.compare import compare

EXAMPLES = Path(__file__).parents[2] / "examples"


@given(st.integers(1, 6), st.data())
def test_every_part_and_wire_is_in_one_group_or_cut(count: int, data: st.DataObject) -> None:
    """A chain of inertias and shafts falls into one group more than there are cuts."""
    shafts = [f"shaft{k}" for k in range(count)]
    chain = [name for k in range(count) for name in (f"J{k}", shafts[k])] + [f"J{count}"]
    kinds = {"J": '{ is = "Inertia", J = 1 }', "s": '{ is = "Spring", c = 1 }'}
    parts = "\n".join(f"{name} = {kinds[name[0]]}" for name in data.draw(st.permutations(chain)))
    drive = loads(f'name = "chain"\n[parts]\n{parts}\n[series]\nmain = {chain}')
    places = data.draw(st.lists(st.sampled_from(shafts), min_size=1, unique=True))
    found = cut_netlist(drive, places)
    assert sorted(name for group in found.groups for name in group) == sorted(chain)
    assert len(found.groups) == len(places) + 1
    assert len(found.wires) == 2 * count - len(places)
    assert all(found.group_of(wire.ends[0]) == found.group_of(wire.ends[1]) for wire in found.wires)
    for cut, place in zip(found.cuts, places, strict=True):
        assert part_of(cut.near) == place
        assert found.group_of(cut.near) != found.group_of(cut.far[0])


@pytest.mark.parametrize("place", ["shaft", "shaft.flange_b", "J2.flange_a", "J2"])
def test_one_place_has_several_names(place: str) -> None:
    found = cut_netlist(load(EXAMPLES / "two_mass.toml"), [place])
    assert found.groups == (("motor", "J1", "shaft"), ("J2",))


def test_the_inertia_takes_the_torque_and_the_shaft_the_motion(oscillator: Split) -> None:
    assert oscillator.ends == {"shaft.flange_b": "potential", "J2.flange_a": "flow"}


def test_the_file_is_the_system(oscillator: Split, tmp_path: Path) -> None:
    assert load_system(oscillator.path, tmp_path) == oscillator.system
    write_system(oscillator.system, tmp_path / "again.toml")
    again = load_system(tmp_path / "again.toml", tmp_path)
    assert [unit.file.resolve() for unit in again.units] == [unit.file.resolve() for unit in oscillator.system.units]


def test_bonds_follow_from_names(oscillator: Split) -> None:
    (given_bond,) = oscillator.system.bonds
    (found,) = find_bonds(oscillator.system.links)
    assert (found.flow, found.rate) == (given_bond.flow, given_bond.rate)


def test_a_library_declares_which_signals_make_a_power(monkeypatch: pytest.MonkeyPatch) -> None:
    class PressureToFlow(Component):
        terminal = Terminal("org.my_company.pipe", takes="potential", power=("q", "p"))

    links = [
        Link("q", Port("a", "pipe.q"), (Port("b", "in.q"),)), Link("p", Port("b", "in.p"), (Port("a", "pipe.p"),)),
    ]  # fmt: skip
    assert find_bonds(links) == ()
    monkeypatch.setattr(registry, "library_types", lambda: {"PressureToFlow": PressureToFlow})
    assert find_bonds(links) == (Bond("pipe", "q", "p"),)


def test_a_system_is_compared_with_its_drive(oscillator: Split) -> None:
    """A thousandth of 0.1 s is a four-hundredth of the period: an error of second order is far below 1e-3."""
    comparison = compare(EXAMPLES / "two_mass.toml", oscillator.path, signals=["J?.w"], until=0.1)
    assert comparison.labels == ("two_mass.toml", "system.toml")
    assert {row.signal for row in comparison.deviations} == {"J1.w", "J2.w"}
    assert comparison.largest < 1e-3


def test_the_netlists_of_the_parts_are_netlists(oscillator: Split) -> None:
    wheel = load(oscillator.path.parent / "wheel.toml")
    assert list(wheel.parts) == ["J2", "J2_flange_a"]
    assert wheel.parts["J2"].start("w") is not None


@pytest.mark.slow
def test_parts_start_where_the_whole_does(tmp_path: Path) -> None:
    """Document 003: the drag of the open clutch twists the shafts before anything moves."""
    netlist = EXAMPLES / "machine_tool_startup.toml"
    run = cosim(split(netlist, "shaft2", tmp_path, check=False).path, until=1e-3, step=1e-4)
    whole = simulate(netlist, 1e-3)
    for name in ("J1.w", "J4.phi", "shaft1.phi_rel", "shaft2.tau", "clutch.w_rel"):
        assert run[name][0] == pytest.approx(whole[name][0], rel=1e-9, abs=1e-12), name


def test_a_slide_is_cut_like_a_shaft(tmp_path: Path) -> None:
    """The mass on the belt sticks and slides; against IDAS, whose modes have nothing to do with FMUs."""
    parts = split(EXAMPLES / "stick_slip.toml", "spring", tmp_path, check=False)
    run = cosim(parts.path, step=1e-3, master="gauss-seidel", outputs=["mass.s"])
    whole = simulate(EXAMPLES / "stick_slip.toml", rtol=1e-9, points=5000)
    expected = np.interp(run.time, whole.time, whole["mass.s"])
    assert np.abs(run["mass.s"] - expected).max() < 1e-3 * np.ptp(expected)


def test_a_signal_is_cut_at_its_output(tmp_path: Path) -> None:
    """Both parts are exact for a constant: y = 2·3."""
    drive = loads(
        'name = "signals"\n[parts]\nsource = { is = "Constant", k = 3 }\ndouble = { is = "Gain", k = 2 }\n'
        '[connect]\nwire = ["source.y", "double.u"]\n[simulate]\nuntil = "1 s"'
    )
    run = cosim(split(drive, "wire", tmp_path, check=False).path, step=0.5)
    assert run["double.y"] == pytest.approx([6.0, 6.0, 6.0])


def test_a_folder_that_cannot_be_written_is_told_before_anything_is_compiled(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("here already")
    told: list[str] = []
    with pytest.raises(NotADirectoryError):
        split(EXAMPLES / "two_mass.toml", "shaft", tmp_path / "file", report=told.append)
    assert told == []
