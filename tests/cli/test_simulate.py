"""The commands check and simulate: what they print and write, and their exit codes."""

import csv
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from calls import called

from modelica_like import simulate

EXAMPLES = Path(__file__).parents[2] / "examples"
DIRECT = str(EXAMPLES / "machine_table_direct.toml")

PENDULUM = """
[parts]
wall = { is = "Fixed" }
spring = { is = "SpringDamper", c = "100 N.m/rad", d = "0.5 N.m.s/rad" }
mass = { is = "Inertia", J = "1 kg.m2", w = 1 }
[series]
chain = ["wall", "spring", "mass"]
[start]
"mass.phi" = 0.1
[simulate]
until = "1 s"
"""


@pytest.fixture
def pendulum(tmp_path: Path) -> str:
    (tmp_path / "pendulum.toml").write_text(PENDULUM)
    return str(tmp_path / "pendulum.toml")


def test_a_table_is_set(pendulum: str, tmp_path: Path) -> None:
    """An angle of 0.1 rad is at rest under the torque of the table: 100 N·m/rad · 0.1 rad."""
    netlist = tmp_path / "held.toml"
    netlist.write_text(
        Path(pendulum).read_text("utf-8").replace("w = 1 }", "w = 0 }\ntorque = { is = 'Torque' }\n"
        "table = { is = 'Table', table = [[0, 0], [1, 0]], scale = '1 N.m' }")
        .replace("[start]", "[connect]\nload = ['torque.flange', 'mass.flange_b']\n"
        "value = ['table.y', 'torque.tau']\n[start]"), "utf-8",
    )  # fmt: skip
    file = tmp_path / "held.csv"
    result = called(["simulate", str(netlist), "--set", "table.table=[[0, 10], [1, 10]]", "--csv", str(file)])
    assert result.exit_code == 0, result.stderr
    with file.open(encoding="utf-8") as lines:
        assert {round(float(row["mass.phi"]), 9) for row in csv.DictReader(lines)} == {0.1}
    spoilt = called(["simulate", str(netlist), "--set", "table.table=[[0, 10], [1, 10]"])
    assert spoilt.exit_code == 2
    assert "table = '[[0, 10], [1, 10]' must be" in spoilt.stderr


def test_check_tells_the_structure() -> None:
    result = called(["check", DIRECT])
    assert result.exit_code == 0
    rows = {line.split("  ")[0]: line.split() for line in result.stdout.splitlines() if line}
    assert rows["equations"][1] == rows["unknowns"][1]
    assert rows["states"][1:] == ["3", "motor.phi,", "clutch.phi_rel,", "clutch.w_rel"]
    assert rows["modes"][1:] == ["2", "clutch.mode,", "clutch.command"]
    assert rows["index"][1] == "3"
    assert rows["stored"][1:] == ["hub,", "spindle,", "table"]
    assert rows["dissipated"][1:] == ["clutch"]
    assert "states kept: motor.phi, clutch.phi_rel, clutch.w_rel" in result.stdout.replace("\n", " ")


STARTS = """
[parts]
a = { is = "Inertia", J = 1, w = "300 rpm" }
spring = { is = "SpringDamper", c = 200, d = 1 }
b = { is = "Inertia", J = 2 }
brake = { is = "Clutch", capacity = 3 }
[parts.c]
is = "Inertia"
J = 3
w = 2
[series]
shaft = ["a", "spring", "b", "brake", "c"]
[start]
"a.phi" = "180 deg"
[simulate]
until = 1
start = "rest"
"""


def test_check_tells_where_start_values_come_from(tmp_path: Path) -> None:
    (tmp_path / "drive.toml").write_text(STARTS)
    result = called(["check", "--start-values", str(tmp_path / "drive.toml")])
    lines = result.stdout.partition("start values (rest)")[2].splitlines()[2:]
    assert [re.split(r"  +", line.strip()) for line in lines if line.strip()] == [
        ["a.phi", "3.14159265", "rad", "given in drive.toml:14"],
        ["a.w", "31.4159265", "rad/s", "given in drive.toml:3"],
        ["brake.phi_rel", "0", "rad", "default"],
        ["c.w", "2", "rad/s", "given in drive.toml:10"],
        ["spring.w_rel", "0", "rad/s", "rest"],
        ["spring.phi_rel", "0", "rad", "rest"],
        ["brake.w_rel", "-29.4159265", "rad/s", "follows from c.w, a.w"],
    ]


def test_check_tells_starts_that_are_missing(tmp_path: Path) -> None:
    (tmp_path / "drive.toml").write_text(STARTS.replace('start = "rest"', ""))
    result = called(["check", "--start-values", str(tmp_path / "drive.toml")])
    assert result.exit_code == 2
    assert "Initialization (not the model) lacks" in result.stdout + result.stderr
    result = called(["check", str(tmp_path / "drive.toml")])
    assert result.exit_code == 0
    assert re.match(
        r"Please look at this:\n- Initialization \(not the model\) lacks \w+ equations: give ", result.stderr
    )
    (tmp_path / "drive.toml").write_text(STARTS)
    assert called(["check", str(tmp_path / "drive.toml")]).stderr == ""


def test_simulate_tells_events_and_energy() -> None:
    result = called(["simulate", DIRECT])
    assert result.exit_code == 0
    assert "1 mode change\n" in "\n".join(line.rstrip() for line in result.stdout.splitlines())
    rows = {line.split()[0]: line.split() for line in result.stdout.splitlines() if line}
    assert rows["0.2"][1:4] == ["clutch.mode", "backward", "stuck"]
    assert " ".join(rows["0.2"][4:]) == "slip reached zero"
    assert float(rows["clutch"][4]) == pytest.approx(5452.8196, rel=1e-6)
    assert "The energy balance closes to" in result.stdout
    assert result.stderr == ""


def test_the_energy_balance_can_be_left_out(pendulum: str) -> None:
    assert "energy balance" in called(["simulate", pendulum]).stdout
    assert "energy balance" not in called(["simulate", pendulum, "--no-energy"]).stdout


def test_set_and_until_change_the_run() -> None:
    result = called(
        ["simulate", DIRECT, "--set", "clutch.capacity=50 N.m", "--set", "load_torque=0", "--until", "100 ms"]
    )
    assert result.exit_code == 0
    assert "0 s to 0.1 s" in result.stdout
    assert "mode change" not in result.stdout.replace("0 mode changes in", "")


def test_the_table_has_one_column_per_variable_and_both_sides_of_events(tmp_path: Path) -> None:
    file = tmp_path / "out.csv"
    assert called(["simulate", DIRECT, "--csv", str(file)]).exit_code == 0
    with file.open(newline="") as stream:
        rows = list(csv.reader(stream))
    solution = simulate(DIRECT)
    assert rows[0] == ["time", *solution.names]
    values = np.array(rows[1:], float)
    assert values.shape == (len(solution.time), 1 + len(solution.names))
    times = values[:, 0]
    assert {*np.linspace(0, 0.4, 501).round(12)} <= {*times.round(12)}
    repeated = np.flatnonzero(np.diff(times) == 0)
    torque = values[:, rows[0].index("clutch.tau")]
    assert [(torque[k], torque[k + 1]) for k in repeated] == [pytest.approx((-86.784324, -15.0), rel=1e-6)]
    assert np.array_equal(torque, solution["clutch.tau"])


def test_units_stand_in_a_second_header_line_if_asked_for(pendulum: str, tmp_path: Path) -> None:
    file = tmp_path / "out.csv"
    assert called(["simulate", pendulum, "--csv", str(file), "--units", "--points", "7"]).exit_code == 0
    with file.open(newline="") as stream:
        names, units, *rows = list(csv.reader(stream))
    by_name = dict(zip(names, units, strict=True))
    assert (by_name["time"], by_name["mass.w"], by_name["spring.tau"]) == ("s", "rad/s", "N.m")
    assert len(rows) == 8


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_the_picture_is_written(pendulum: str, tmp_path: Path, ending: str) -> None:
    file = tmp_path / "new" / f"out.{ending}"
    assert called(["simulate", pendulum, "--plot", str(file), "--show", "mass.*"]).exit_code == 0
    assert file.read_bytes()[:4] in (b"\x89PNG", b"<?xm", b"%PDF")


def test_formulas_are_told_and_written(pendulum: str, tmp_path: Path) -> None:
    table = tmp_path / "out.csv"
    words = ["--show", "mass.w", "--show", "0.5*mass.J*mass.w**2", "--csv", str(table), "--units"]
    result = called(["simulate", pendulum, *words])
    names, units, *rows = csv.reader(table.read_text().splitlines())
    assert (names[-1], units[-1]) == ("0.5*mass.J*mass.w**2", "J")
    speed = float(rows[-1][names.index("mass.w")])
    told = next(line.split() for line in result.stdout.splitlines() if line.startswith("0.5*mass"))
    assert float(rows[-1][-1]) == pytest.approx(0.5 * speed**2, rel=1e-12)
    assert (told[1], float(told[3])) == ("J", pytest.approx(float(rows[-1][-1]), rel=1e-5))


def test_a_measurement_and_a_family_are_drawn_beside_the_run(pendulum: str, tmp_path: Path) -> None:
    measured, picture = tmp_path / "measured.csv", tmp_path / "both.svg"
    measured.write_text("time [ms],mass.w [rpm]\n0,0\n50,-2\n")
    words = ["simulate", pendulum, "--plot", str(picture), "--compare", str(measured), "--compare", "mass.J=1,2 kg.m2"]
    result = called(words)
    assert result.exit_code == 0, result.stderr
    drawn = picture.read_text()
    for label in ("as given", "mass.J = 1.0 kg.m2", "mass.J = 2.0 kg.m2", "measured.csv", "mass.w in rad/s"):
        assert f"<!-- {label} -->" in drawn, label


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["check", "nowhere.toml"], 2, "The netlist 'nowhere.toml' does not exist."),
        (["simulate", "PENDULUM", "--set", "mass.K=1"], 2, "Inertia has no parameter or variable 'K'"),
        (
            ["simulate", "PENDULUM", "--set", "mass.J=-1"],
            2,
            "Inertia.J = -1 is out of range: it must be at least 0 kg.m2.",
        ),
        (["simulate", "PENDULUM", "--set", "mass.J=1 kg"], 2, "Inertia.J expects kg.m2; '1 kg' is kg."),
        (["simulate", "PENDULUM", "--set", "mass.J"], 2, "'mass.J' is not PATH=VALUE"),
        (["simulate", "PENDULUM", "--until", "2 m"], 2, "until expects s; '2 m' is m."),
        (["simulate", "PENDULUM", "--until", "-1"], 2, "The end time -1 s is not after the start time 0 s."),
        (["simulate", "PENDULUM", "--points", "0"], 2, "points = 0 is out of range"),
        (["simulate", "PENDULUM", "--plot", "x.doc"], 2, "'x.doc': a picture can be"),
        (["simulate", "PENDULUM", "--plot", "x.png", "--compare", "nix.csv"], 2, "nix.csv: No such file"),
        (["simulate", "PENDULUM", "--compare", "mass.J=2"], 2, "it is drawn into the picture of --plot"),
        (
            ["simulate", "PENDULUM", "--plot", "x.png", "--show", "mas.w"],
            2,
            "has no variable 'mas.w'; did you mean 'mass.w'?",
        ),
        (
            ["simulate", "PENDULUM", "--csv", "pendulum.toml/x.csv"],
            2,
            "pendulum.toml: Not a directory.",
        ),
        (["simulate"], 2, "Missing: NETLIST."),
        (["simulat", "x"], 2, "No such command 'simulat'"),
    ],
    ids=lambda value: " ".join(value[2:]) or " ".join(value) if isinstance(value, list) else None,
)
def test_wrong_input_is_told_without_a_traceback(
    pendulum: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    code: int,
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    result = called([pendulum if argument == "PENDULUM" else argument for argument in arguments])
    assert result.exit_code == code
    assert message in result.stderr
    assert "Traceback" not in result.stderr


def test_the_module_is_the_command() -> None:
    result = subprocess.run(
        [sys.executable, "-m", "modelica_like", "describe", "Nothing"], capture_output=True, text=True, check=False
    )
    assert result.returncode == 2
    assert result.stderr.startswith("There is no component type 'Nothing'.")


def test_the_native_solver(tmp_path: Path) -> None:
    table = tmp_path / "run.csv"
    result = called(["simulate", DIRECT, "--solver", "native", "--compiled", "--csv", str(table)])
    assert result.exit_code == 0
    assert "1 mode change" in result.stdout + result.stderr
    rows = list(csv.DictReader(table.read_text().splitlines()))
    final = simulate(DIRECT, solver="native").final
    assert float(rows[-1]["table.s"]) == final["table.s"]
    refused = called(["simulate", DIRECT, "--solver", "euler"])
    assert refused.exit_code == 2
