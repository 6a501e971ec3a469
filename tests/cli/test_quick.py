"""Ordinary calls are read without Typer; what is read is what Typer reads, and all else is left to it."""

import inspect
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from modelica_like import cli
from modelica_like.cli.complete import application
from modelica_like.cli.quick import read

CALLS = [
    "new winch",
    "new blank -o a.toml",
    "check a.toml",
    "check --start-values --set a.b=1 a.toml --set c=2 --debug",
    "simulate a.toml",
    "simulate a.toml --until 2s --start rest --csv=out.csv --points 7 --units --show x --show=y.*",
    "simulate a.toml --rtol 1e-8 --json --solver native --on-chattering slide",
    "simulate --no-energy a.toml --points=250 --energy --no-energy --sankey s.svg --plot p.png",
    "simulate a.toml --plot p.png --compare measured.csv --compare gear.ratio=2,3 --show 2*pi*a.w",
    "draw a.toml -o a.svg --depth 2",
    "draw a.toml --at 1s --flow --animate --until 2s",
    "report a.toml -o a.html --until 1s --show *.w",
    "explore a.toml --until 1s --show *.w -o folder --no-browser",
    "modes a.toml --at=0.5s --input u --response a.w --response b.w --shapes m.png --bode b.svg --draw d.svg",
    "modes a.toml --open pi.y --bode b.svg --nyquist n.svg",
    "steady a.toml --hold motor.w=4000 --by load --over load=0:0.25:26 --after 2s",
    "sweep a.toml --over a=1:2:3 --of max(x) --of b -o out.csv --plot p.png --processes 4 --checkpoint folder",
    "sensitivity a.toml --of max(a.tau) --to b.J --tornado t.png --start steady",
    "export a.toml -o a.fmu --fmi 3.0 --kind me --platform none --show *.w --open J.flange_b --no-check",
    "export a.toml --takes potential --output=b.fmu",
    "from-modelica a.mo",
    "from-modelica a.mo --class Drive -o a.toml",
    "to-modelica a.toml --set a.b=2 --output=a.mo",
    "split a.toml --at shaft --at gear.flange_a -o folder --name one --name two --ssp 2.0",
    "cosim a.ssp --set f.k=1 --step 0.1ms --rtol 1e-5 --master gauss-seidel --inputs hold --timeout 60",
    "draw a.toml --output a.svg --depth 2 --set J.J=2",
    "report a.toml -o a.html --until 2s --show *.w --show b.x",
    "describe Clutch",
    "schema sizing -o a.json",
    "library gear worm --group gears",
    "runtimes --platform all",
    "docs -o pages",
    "trust drives --remove",
    "docs Clutch Gear --output pages --examples folder",
    "validate a.fmu --timeout 2.5s --json",
    "compare a.csv b.csv --until 2 --points 10 --rtol 1e-7 --signal *.w",
    "size",
    "size a.toml",
    "demo --pictures folder",
]
UNUSUAL = [
    "new",
    "new car",
    "simulate",
    "simulate a.toml b.toml",
    "simulate a.toml --help",
    "simulate a.toml --unti 2s",
    "simulate a.toml --until",
    "simulate a.toml --until --units",
    "simulate a.toml --units=yes",
    "simulate a.toml --points 1e3",
    "simulate a.toml --start never",
    "simulate -- a.toml",
    "export a.toml -oa.fmu",
    "sweep a.toml --over a=1:2:3",
    "compare a b --rtol nan",
]


def _read_by_typer(words):
    name = words[0]
    told = {}
    command = cli.command(name)

    def record(**values):
        told.update(values)

    record.__signature__ = inspect.signature(command, eval_str=True)
    record.__annotations__ = {key: one.annotation for key, one in record.__signature__.parameters.items()}
    result = CliRunner().invoke(application({"task": {name: record, "other": cli.command("library")}}), words)
    assert result.exit_code == 0, result.output
    return told


@pytest.mark.parametrize("call", CALLS)
def test_a_call_is_read_as_typer_reads_it(call):
    words = call.split()
    values = read(cli.command(words[0]), words[1:])
    # Without a value, a list is empty or None: the commands treat both alike.
    assert values is not None
    known = {name: value or None if isinstance(value, list) else value for name, value in values.items()}
    told = {name: value or None if isinstance(value, list) else value for name, value in _read_by_typer(words).items()}
    assert known == told
    assert {name: type(value) for name, value in known.items()} == {name: type(value) for name, value in told.items()}


@pytest.mark.parametrize("call", UNUSUAL)
def test_help_and_mistakes_are_left_to_typer(call):
    words = call.split()
    assert read(cli.command(words[0]), words[1:]) is None


def test_all_commands_have_calls_here():
    assert {call.split()[0] for call in CALLS} == set(cli._HOME)
    assert isinstance(cli.app, typer.Typer)


def test_an_ordinary_run_loads_neither_typer_nor_what_only_other_commands_need():
    drive = Path(__file__).parents[2] / "examples" / "two_mass.toml"
    code = (
        "import sys; from modelica_like.cli import main\n"
        f"sys.argv = ['modelica-like', 'simulate', {str(drive)!r}]\n"
        "main()\n"
        "print('loaded:', *{name.partition('.')[0] for name in sys.modules})"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(done.stdout.rpartition("loaded: ")[2].split())
    assert {"casadi", "rich", "components"} <= loaded
    assert not loaded & {"typer", "pydantic", "pint", "fmpy", "lxml", "matplotlib", "scipy", "xarray", "pandas"}


def test_an_assignment_without_a_value_is_told_with_the_usage():
    drive = Path(__file__).parents[2] / "examples" / "two_mass.toml"
    words = [sys.executable, "-m", "modelica_like", "simulate", str(drive), "--set", "foo"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "Usage: python -m modelica_like simulate" in done.stderr
    assert "Invalid value for --set: 'foo' is not PATH=VALUE." in done.stderr
