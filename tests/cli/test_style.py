"""One style for all commands, help by task, the version, and completion in the shell."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import get_args, get_type_hints

import pytest
from calls import called

from modelica_like import __version__, cli
from modelica_like.cli.overview import complete
from modelica_like.cli.reader import Option

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
    for name in cli.HOMES:
        for key, hint in get_type_hints(cli.command(name), include_extras=True).items():
            if key != "return":
                kind, told = get_args(hint)
                names = told.names or (f"--{key.replace('_', '-')}",)
                yield name, names if isinstance(told, Option) else (key,), kind, told


def test_helps_are_sentences():
    for name, names, _, told in declared():
        assert told.help[0].isupper() or told.help[0] == ".", (name, names)
        assert told.help.endswith("."), (name, names)
    assert all(cli.command(name).__doc__.partition("\n")[0].endswith(".") for name in cli.HOMES)


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


def test_the_help_lists_the_commands_by_task(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    text = called(["--help"]).stdout
    places = [text.index(f"\n{task}:\n") for task in cli.TASKS]
    assert places == sorted(places)
    for (_, commands), begin, end in zip(cli.TASKS.items(), places, [*places[1:], len(text)], strict=True):
        assert all(f"\n  {name} " in text[begin:end] for name in commands)
    assert max(map(len, text.splitlines())) <= 80
    nothing = called([])
    assert (nothing.exit_code, nothing.stdout) == (2, text)


def test_the_version():
    result = called(["--version"])
    assert (result.exit_code, result.stdout) == (0, f"modelica-like {__version__}\n")


ASKED = {
    "bash": 'COMP_WORDS=("$@"); COMP_CWORD=$(($#-1)); _modelica_like; printf "%s\\n" "${COMPREPLY[@]}"',
    "fish": 'complete -C "$argv"',
}
"""What a shell does at the tabulator."""
COMPLETED = {
    ("si",): {"simulate", "size"},
    ("--v",): {"--version"},
    ("new", "--he"): {"--help"},
    ("simulate", "a.toml", "--so"): {"--solver"},
    ("simulate", "a.toml", "--solver", ""): {"idas", "native"},
    ("describe", "ClutchA"): {"ClutchActuator"},
    ("new", "--output", "no"): set(),
    ("no", ""): set(),
}


def completed(shell: str, words: tuple[str, ...], tmp_path: Path) -> set[str]:
    """Return what a shell offers for the last word."""
    (tmp_path / "here").mkdir()
    program = tmp_path / "modelica-like"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -c "from modelica_like.cli import main; main()" "$@"\n')
    program.chmod(0o755)
    named = {**os.environ, "SHELL": f"/bin/{shell}", "PATH": f"{tmp_path}:{os.environ['PATH']}", "HOME": str(tmp_path)}
    subprocess.run([program, "--install-completion"], env=named, check=True, capture_output=True)
    file = {"bash": ".bashrc", "fish": ".config/fish/completions/modelica-like.fish"}[shell]
    code = f". '{tmp_path / file}'; {ASKED[shell]}"
    given = [shell, "-c", code, *(["bash"] if shell == "bash" else []), "modelica-like", *words]
    done = subprocess.run(given, env=named, cwd=tmp_path / "here", capture_output=True, text=True, check=True)
    return {line.split("\t")[0] for line in done.stdout.splitlines() if line}


@pytest.mark.skipif(os.name != "posix", reason="the shells of others")
@pytest.mark.parametrize("words", COMPLETED, ids=" ".join)
@pytest.mark.parametrize("shell", ASKED)
def test_a_shell_completes(shell: str, words: tuple[str, ...], tmp_path: Path) -> None:
    if shutil.which(shell) is None:
        (pytest.fail if "CI" in os.environ else pytest.skip)(f"{shell} is not installed: make shells")
    assert completed(shell, words, tmp_path) == COMPLETED[words]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["simulate", "--solver", "=", "i"], "idas\n"),  # as Bash splits them
        (["simulate", "--solver", "="], "idas\nnative\n"),
        (["simulate", "--solver=n"], "--solver=native\n"),
        (["simulate", "--on"], "--on-chattering\tWhere events never end: an error (stop), "),
        (["--ver"], "--version\tShow it.\n"),
    ],
)
def test_what_can_follow(words: list[str], expected: str, capsys: pytest.CaptureFixture[str]) -> None:
    complete(words)
    assert capsys.readouterr().out.startswith(expected)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_is_installed_once(shell: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHELL", f"/usr/bin/{shell}")
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    shown = called(["--show-completion"]).stdout
    (tmp_path / ".bashrc").write_text("umask 022\n")
    for _ in range(2):
        result = called(["--install-completion"])
        assert result.stdout.endswith(": a new shell completes the words of modelica-like.\n")
    file = Path(result.stdout.partition(": ")[0])
    assert file.read_text() == ("umask 022\n" if shell == "bash" else "") + shown


def test_other_shells_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHELL", "/bin/csh")
    result = called(["--install-completion"])
    assert result.exit_code == 2
    assert result.stderr.startswith("The shell, $SHELL, is 'csh', not one of bash, zsh, fish.\n")


@pytest.mark.parametrize("command", ["from-modelica", "to-modelica"])
@pytest.mark.parametrize("text", ["", ".", ".."])
def test_a_folder_is_no_text(command: str, text: str) -> None:
    """The empty text is this folder, which has no name to put an ending to."""
    result = called([command, text])
    assert result.exit_code == 2
    assert result.stderr == f"The netlist '{text or '.'}' is a folder.\n"
