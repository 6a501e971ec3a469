"""`from-modelica --flat`: the flat equations, read again, run as the drive they come from."""

from pathlib import Path
from typing import Any

import pytest
from calls import called

from modelica_like import build, export_fmu, load, simulate
from modelica_like.netlist.modelica.flat_text import flat_text

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "examples"


@pytest.mark.parametrize(
    "drive", ["drives.mo:Chain", "drives.mo:Coupled", "drives.mo:Ball", "drives.mo:Clocked", "machines.mo:Start"]
)
def test_the_flat_equations_give_the_same_run(tmp_path: Path, drive: str) -> None:
    (tmp_path / "flat.mo").write_text(flat_text(load(f"{HERE / drive}")))
    before, after = (
        simulate(load(model), 1.2, rtol=1e-10, atol=1e-12) for model in (f"{HERE / drive}", tmp_path / "flat.mo")
    )
    assert {*before.final} == {*after.final}
    for time in (0.0, 0.3, 0.77, 1.2):
        for name in before.final:
            assert after.at(time)[name] == pytest.approx(before.at(time)[name], rel=1e-9, abs=1e-9)


def test_the_command_shows_declarations_and_equations_with_full_names(tmp_path: Path) -> None:
    words = ["from-modelica", str(HERE / "drives.mo"), "--class", "Chain", "--flat"]
    shown = called(words)
    assert shown.exit_code == 0, shown.stdout + shown.stderr
    assert "  Damper_1 damper(d = 1.0);\n" in shown.stdout
    assert '    parameter Real d(unit = "N.m.s/rad") "damping coefficient";\n' in shown.stdout
    assert "  k.flange_b.tau = - load[2].flange_a.tau;\n" in shown.stdout
    assert "  der(load[1].phi) = load[1].w;\n" in shown.stdout
    assert called([*words, "-o", str(tmp_path / "flat.mo")]).exit_code == 0
    assert (tmp_path / "flat.mo").read_text() == shown.stdout


def test_variables_of_a_record_have_their_equations_where_it_is(tmp_path: Path) -> None:
    """y = 1 + t^2 / 2 from der(y) = t; n counts once, at t = 1."""
    (tmp_path / "a.mo").write_text(
        "model A\nrecord R Real x; Real y(start = 1, fixed = true); Integer n(start = 0); end R; R r;\n"
        "equation\nr.x = time; der(r.y) = r.x; when r.y > 1.5 then r.n = pre(r.n) + 1; end when;\nend A;\n"
    )
    final = simulate(load(tmp_path / "a.mo"), 2.0, rtol=1e-10, atol=1e-12).final
    assert final["r.y"] == pytest.approx(3.0, rel=1e-9)
    assert final["r.n"] == 1


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_a_speed_may_be_a_state_of_a_position_that_is_none(tmp_path: Path, solver: Any) -> None:
    """The spring's length is the state, and the speed is that of its end."""
    drive = EXAMPLES / "msl" / "translational" / "InitialConditions.toml"
    assert called(["to-modelica", str(drive), "-o", str(tmp_path / "a.mo")]).exit_code == 0
    (tmp_path / "flat.mo").write_text(flat_text(load(tmp_path / "a.mo")))
    model = build(load(tmp_path / "flat.mo"))
    assert "der(s2.flange_b.s)" in model.states
    assert "s2.flange_b.s" not in model.states
    before, after = (simulate(m, 1.0, rtol=1e-10, atol=1e-12, solver=solver) for m in (drive, model))
    largest = max(abs(value) for value in before.final.values())
    for name in {*before.final} & {*after.final}:
        assert after.final[name] == pytest.approx(before.final[name], abs=1e-8 * largest)
    export_fmu(model, tmp_path / "flat.fmu")  # which runs it and compares
