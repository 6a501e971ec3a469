"""One style for all commands, help by task, the version, and completion in the shell."""

import os
import subprocess
import sys
from typing import get_args, get_type_hints

import pytest
from typer.testing import CliRunner

from modelica_like import __version__, cli
from modelica_like.cli.declare import Option

DIFFERENT = {
    "--output": {"FILE", "FOLDER"},
    "--set": {"PATH=VALUE", "FMU.PATH=VALUE"},
    "--at": {"WHEN", "TIME", "PLACE"},
    "--show": {"PATTERN", "NAME"},
    "--inputs": {"FILE", None},
    "--open": {"PATH", "SIGNAL"},
}
"""Names whose values are not the same for all commands, with what their values are."""


def declared():
    for name in cli._HOME:
        for key, hint in get_type_hints(cli.command(name), include_extras=True).items():
            if key != "return":
                kind, told = get_args(hint)
                names = told.names or (f"--{key.replace('_', '-')}",)
                yield name, names if isinstance(told, Option) else (key,), kind, told


def test_helps_are_sentences():
    for name, names, _, told in declared():
        assert told.help[0].isupper() or told.help[0] == ".", (name, names)
        assert told.help.endswith("."), (name, names)
    assert all(cli.command(name).__doc__.partition("\n")[0].endswith(".") for name in cli._HOME)


def test_an_option_means_the_same_everywhere():
    known: dict[str, set[str | None]] = {}
    for _, names, _, told in declared():
        if isinstance(told, Option):
            known.setdefault(names[0], set()).add(told.metavar)
    assert {name: kinds for name, kinds in known.items() if len(kinds) > 1} == DIFFERENT


def test_long_names_come_first_and_only_results_have_a_short_one():
    for _, names, _, told in declared():
        if isinstance(told, Option):
            assert names[0].startswith("--")
            assert names[1:] in ((), ("-o",))
            assert (names[0] == "--output") == (names[1:] == ("-o",))


def test_times_are_times_and_tolerances_are_relative():
    """No option takes seconds as a plain number, and no tolerance has another name."""
    for name, names, kind, told in declared():
        if told.metavar == "TIME":
            assert kind in (str, str | None), (name, names)
        assert not (kind in (float, float | None) and names[0] != "--rtol"), (name, names)


def test_the_help_lists_the_commands_by_task():
    text = CliRunner().invoke(cli.app, ["--help"]).stdout
    places = [text.index(f" {task} ") for task in cli.TASKS]
    assert places == sorted(places)
    for (_, commands), begin, end in zip(cli.TASKS.items(), places, [*places[1:], len(text)], strict=True):
        assert all(f"│ {name} " in text[begin:end] for name in commands)


def test_the_version():
    result = CliRunner().invoke(cli.app, ["--version"])
    assert (result.exit_code, result.stdout) == (0, f"modelica-like {__version__}\n")


@pytest.mark.parametrize(
    ("shell", "words", "count", "expected"),
    [
        ("bash", "modelica-like si", "1", {"simulate", "size"}),
        ("bash", "modelica-like simulate a.toml --so", "3", {"--solver"}),
        ("bash", "modelica-like simulate a.toml --solver ", "4", {"idas", "native"}),
        ("fish", "modelica-like describe ClutchA", "", {"ClutchActuator"}),
        ("bash", "modelica-like describe ClutchA", "2", {"ClutchActuator"}),
    ],
)
def test_a_shell_completes(shell, words, count, expected):
    told = {"_MODELICA_LIKE_COMPLETE": f"complete_{shell}", "COMP_WORDS": words, "COMP_CWORD": count}
    told |= {"_TYPER_COMPLETE_ARGS": words, "_TYPER_COMPLETE_FISH_ACTION": "get-args"}
    code = "import sys; sys.argv = ['modelica-like']; from modelica_like.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | told, capture_output=True, text=True, check=False
    )
    assert {line.split("\t")[0] for line in done.stdout.split("\n") if line.strip()} == expected


def test_completion_is_shown_for_the_shell():
    # Typer asks which shell has started it; under make that is one without completion.
    named = {**os.environ, "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
    command = [sys.executable, "-m", "modelica_like", "--show-completion", "bash"]
    done = subprocess.run(command, env=named, capture_output=True, text=True, check=False)
    assert "complete" in done.stdout


@pytest.mark.parametrize("command", ["from-modelica", "to-modelica"])
@pytest.mark.parametrize("text", ["", ".", ".."])
def test_a_folder_is_no_text(command: str, text: str) -> None:
    """The empty text is this folder, which has no name to put an ending to."""
    result = CliRunner().invoke(cli.app, [command, text])
    assert result.exit_code == 2
    assert result.stderr == f"The netlist '{text or '.'}' is a folder.\n"
