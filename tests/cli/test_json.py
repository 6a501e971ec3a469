"""Every command that prints tables prints them as JSON, with all digits and all rows."""

import inspect
import json
from pathlib import Path

import pytest
from calls import called
from rich.console import Group

from modelica_like import cli, simulate
from modelica_like.show.report.tables import Shown, as_data, table

EXAMPLES = Path(__file__).parents[2] / "examples"
DRIVE = str(EXAMPLES / "machine_tool_startup.toml")
TABLES = {
    "check": ([DRIVE, "--start-values"], {"sizes", "energy", "start values"}),
    "simulate": ([DRIVE], {"events", "energy balance"}),
    "modes": ([DRIVE, "--at", "0.4s"], {"modes"}),
    "steady": ([str(EXAMPLES / "dc_bench_motor.toml")], {"powers", "values"}),
    "sweep": ([DRIVE, "--over", "h1=5,10", "--of", "clutch.lock_time", "--processes", "1"], {"extremes"}),
    "sensitivity": ([DRIVE, "--of", "clutch.lock_time", "--to", "h1"], {"clutch.lock_time"}),
    "optimize": ([str(EXAMPLES / "design" / "gear_and_flywheel.toml")], {"free", "outputs"}),
    "tolerance": ([DRIVE, "--of", "shaft1.tau", "--scatter", "h1=±5 %"], {"outputs", "shares to first order"}),
    "runtimes": ([], {"run-times"}),
    "describe": (["Clutch"], {"connectors", "parameters", "modes", "equations", "events", "where"}),
    "library": ([], {"types"}),
    "compare": ([DRIVE, DRIVE, "--until", "0.1s"], {"deviations", "events"}),
    "size": ([str(EXAMPLES / "sizing" / "clutch_heat.toml")], set()),
}
SLOW = {"validate", "cosim", "demo", "calibrate"}
"""Commands tested elsewhere, or the same in `Page.print`."""


def said(*words: str) -> dict:
    result = called([*words, "--json"])
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)


def test_all_commands_with_the_option_are_here():
    known = {name for name in cli.HOMES if "json" in inspect.signature(cli.command(name)).parameters}
    assert known == {*TABLES, *SLOW}


@pytest.mark.parametrize("command", TABLES)
def test_a_command_says_it_as_json(command):
    words, names = TABLES[command]
    found = said(command, *words)
    assert set(found) == {"problems", "tables", "text"}
    assert {problem["kind"] for problem in found["problems"]} <= {"note"}
    assert names <= set(found["tables"])
    assert all(rows and isinstance(rows, list) for rows in found["tables"].values())


def test_numbers_have_all_digits():
    run = simulate(DRIVE)
    tables = said("simulate", DRIVE)["tables"]
    assert [row["time in s"] for row in tables["events"]] == [event.time for event in run.events]
    (clutch,) = (row for row in tables["energy balance"] if row["component"] == "clutch")
    assert clutch["lost"] == run.energy()["clutch"].lost
    (lock,) = said("sensitivity", DRIVE, "--of", "clutch.lock_time", "--to", "h1")["tables"]["clutch.lock_time"]
    assert lock["parameter"] == "h1"
    assert lock["value"] == 10.0


def test_rows_that_are_not_printed_are_told():
    made = table("numbers in m", "n>", "m>.2g", rows=[(k, k / 3) for k in range(9)], total=("all", 12.0), most=4)
    found = as_data(Group("[bold]nine[/] of them", "", made))
    assert made.row_count == 6
    assert found["text"] == ["nine of them"]
    assert [row["m"] for row in found["tables"]["numbers"]] == [*(k / 3 for k in range(9)), 12.0]


def test_what_json_does_not_know_is_null():
    rows = [(float("nan"), Shown("–", None), "0.25", "x")]
    assert as_data(table("t", "a>", "b>", "c>", "d>", rows=rows))["tables"]["t"] == [
        {"a": None, "b": None, "c": 0.25, "d": "x"}
    ]


def test_a_check_that_fails_says_it_too(tmp_path):
    wrong = tmp_path / "drive.toml"
    wrong.write_text('[parts]\na = { is = "Inertja" }\n', encoding="utf-8")
    result = called(["simulate", str(wrong), "--json"])
    assert result.exit_code == 2
    (problem,) = json.loads(result.stdout)["problems"]
    assert problem["what"] == "There is no component type 'Inertja'; did you mean 'Inertia'?"
    assert "Inertia" in result.stderr
