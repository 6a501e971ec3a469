"""What words of the command line mean, what is told about wrong ones, and what a call loads."""

import inspect
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from calls import called

from modelica_like import cli
from modelica_like.cli.reader import parameters, reader

DRIVE = Path(__file__).parents[2] / "examples" / "two_mass.toml"
CALLS = tomllib.loads(Path(__file__).with_name("calls.toml").read_text(encoding="utf-8"))


def read(call: str):
    name, *words = call.split()
    return reader(name, cli.command(name)).read(words)


@pytest.mark.parametrize("call", CALLS)
def test_a_call_is_read(call):
    command = cli.command(call.split()[0])
    defaults = {name: one.default for name, one in inspect.signature(command).parameters.items()}
    values = read(call)
    assert set(values) == set(defaults)
    # Without a value, a list is empty or None: the commands treat both alike.
    given = {name: value for name, value in values.items() if value != defaults[name] and value != []}
    told = {name: str(value) if isinstance(value, Path) else value for name, value in given.items()}
    assert repr(sorted(told.items())) == repr(sorted(CALLS[call].items()))  # nan is not equal to itself
    kinds = {one.name: one.kind for one in parameters(command) if not (one.many or one.choices)}
    assert all(isinstance(value, kinds.get(name, object)) for name, value in given.items())


def test_all_commands_have_calls_here():
    assert {call.split()[0] for call in CALLS} == set(cli.HOMES)


SIMULATE = "Usage: modelica-like simulate [OPTIONS] NETLIST\nMore about it: modelica-like simulate --help\n"
OVERVIEW = "Usage: modelica-like [OPTIONS] COMMAND …\nMore about it: modelica-like --help\n"
WRONG = {
    "simulat a.toml": f"No such command 'simulat'; did you mean 'simulate'?\n{OVERVIEW}",
    "--debug check a.toml": f"No such option '--debug'.\n{OVERVIEW}",
    "--versoin": f"No such option '--versoin'; did you mean '--version'?\n{OVERVIEW}",
    "simulate": f"Missing: NETLIST.\n{SIMULATE}",
    "simulate a.toml b.toml c": f"Unexpected: b.toml c.\n{SIMULATE}",
    "simulate a.toml --unti 2s": f"No such option '--unti'; did you mean '--until'?\n{SIMULATE}",
    "simulate a.toml -x": f"No such option '-x'.\n{SIMULATE}",
    "simulate a.toml --until": f"Option '--until' requires a value.\n{SIMULATE}",
    "simulate a.toml --units=yes": f"Option '--units' does not take a value.\n{SIMULATE}",
    "simulate a.toml --points 1e3": f"Invalid value for --points: '1e3' is not a whole number.\n{SIMULATE}",
    "simulate a.toml --rtol small": f"Invalid value for --rtol: 'small' is not a number.\n{SIMULATE}",
    "simulate a.toml --start never": (
        f"Invalid value for --start: 'never' is not one of 'given', 'rest', 'steady'.\n{SIMULATE}"
    ),
    "sweep a.toml --over a=1:2:3": (
        "Missing: --of.\nUsage: modelica-like sweep [OPTIONS] NETLIST\nMore about it: modelica-like sweep --help\n"
    ),
    "runtimes all": (
        "Unexpected: all.\nUsage: modelica-like runtimes [OPTIONS]\nMore about it: modelica-like runtimes --help\n"
    ),
    "docs": (
        "Missing: --output/-o.\n"
        "Usage: modelica-like docs [OPTIONS] [TYPE …]\nMore about it: modelica-like docs --help\n"
    ),
    "new car": (
        "Invalid value for winch|launch|servo|blank: 'car' is not one of 'winch', 'launch', 'servo', 'blank'.\n"
        "Usage: modelica-like new [OPTIONS] winch|launch|servo|blank\nMore about it: modelica-like new --help\n"
    ),
}


@pytest.mark.parametrize("call", WRONG)
def test_wrong_words_are_told_with_the_usage(call):
    result = called(call.split())
    assert (result.exit_code, result.stdout, result.stderr) == (2, "", WRONG[call])


def test_a_value_of_a_wrong_form_is_told():
    result = called(["simulate", str(DRIVE), "--set", "foo"])
    assert (result.exit_code, result.stderr) == (2, "Invalid value for --set: 'foo' is not PATH=VALUE.\n")


@pytest.mark.parametrize("name", cli.HOMES)
def test_help_fits_a_terminal_and_has_all(name, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    result = called([name, "--help"])
    assert result.exit_code == 0
    assert max(map(len, result.stdout.splitlines())) <= 80
    text = " ".join(result.stdout.split())
    for one in parameters(cli.command(name)):
        written = f"{', '.join(one.words())} {'' if one.kind is bool else one.value}" if one.option else one.value
        required = " Required." if one.option and one.required else ""
        default = f" Default: {one.shown}." if one.shown else ""
        assert f"{written.strip()} {one.declared.help}{required}{default}" in text


def test_an_ordinary_run_loads_nothing_that_only_other_commands_need():
    code = (
        "import sys; from modelica_like.cli import run\n"
        f"run(['simulate', {str(DRIVE)!r}])\n"
        "print('loaded:', *{name.partition('.')[0] for name in sys.modules})"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(done.stdout.rpartition("loaded: ")[2].split())
    assert {"casadi", "rich", "components"} <= loaded
    assert not loaded & {"pydantic", "pint", "fmpy", "lxml", "matplotlib", "scipy", "xarray", "pandas"}


@pytest.mark.skipif(os.name != "posix", reason="POSIX pipes")
def test_a_closed_pipe_ends_a_command_quietly():
    read_end, write_end = os.pipe()
    os.close(read_end)
    words = [sys.executable, "-m", "modelica_like", "schema"]
    done = subprocess.run(words, stdout=write_end, stderr=subprocess.PIPE, text=True, check=False)
    os.close(write_end)
    assert (done.returncode, done.stderr) == (1, "")
