"""The command line without a command: help by task, version, completion in shells."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from modelica_like import __version__
from modelica_like.cli import COMPLETE, HOMES, TASKS, command
from modelica_like.cli.reader import Parameter, Reader, paragraphs, parameters, reader
from modelica_like.cli.shared import BAD_INPUT, say, told
from modelica_like.errors import did_you_mean
from modelica_like.writing import write_bytes

_ABOUT = (
    "Acausal drive-train models: check, simulate, analyse and export netlists.",
    "Exit codes: 0 done; 1 the model cannot be solved, or a check failed; 2 the input is wrong, or a file cannot be "
    "read or written; 130 stopped by Ctrl-C.",
    "`--trust`, with any command, runs Python modules beside the netlists; `--library PATH` names a library of "
    "Modelica text, as often as needed.",
)
# Files of the user that shells read, and what they need there: it asks this program with the words up to the cursor.
_SHELLS = {
    "bash": (".bashrc", """
_modelica_like() {
    local IFS=$'\\n'
    COMPREPLY=($(COMPLETE=1 modelica-like "${COMP_WORDS[@]:1:COMP_CWORD}" | cut -f 1))
}
complete -o default -F _modelica_like modelica-like
"""),
    "zsh": (".zshrc", """
_modelica_like() {
    local -a found=("${(@f)$(COMPLETE=1 modelica-like "${(@)words[2,CURRENT]}")}")
    found=("${(@)found//$'\\t'/:}")
    if [[ -n $found ]]; then _describe value found; else _files; fi
}
(( $+functions[compdef] )) || { autoload -Uz compinit && compinit; }
compdef _modelica_like modelica-like
"""),
    "fish": (".config/fish/completions/modelica-like.fish", """
function __modelica_like
    set -lx COMPLETE 1
    set -l now (commandline -ct)
    set -l found (modelica-like (commandline -opc)[2..-1] "$now")
    set -q found[1]; and printf '%s\\n' $found; or __fish_complete_path "$now"
end
complete -c modelica-like -f -a '(__modelica_like)'
"""),
}  # fmt: skip


def overview(words: Sequence[str]) -> None:
    """Do what stands without a command, or tell that there is no such command.

    Raises:
        SystemExit: all is shown, or the words are wrong (2).
    """
    overall = _reader()
    if words and not words[0].startswith("-"):
        overall.error(f"No such command '{words[0]}'{did_you_mean(words[0], HOMES) or '.'}")
    wanted = [] if "--help" in words else [name for name, given in overall.read(words).items() if given]
    if wanted:
        _completion(overall, install=wanted == ["install_completion"])
        return
    for task, names in TASKS.items():
        group = overall.add_argument_group(task)
        for name in names:
            group.add_argument(name, help=paragraphs(command(name))[0])
    overall.print_help()
    raise SystemExit(0 if words else BAD_INPUT)


def _reader() -> Reader:
    parser = Reader("", "[OPTIONS] COMMAND …", _ABOUT)
    options = parser.add_argument_group("Options")
    options.add_argument("--version", action="version", version=f"modelica-like {__version__}", help="Show it.")
    options.add_argument("--install-completion", action="store_true", help="Complete words in the shell, $SHELL.")
    options.add_argument("--show-completion", action="store_true", help="Show what that adds to the shell's files.")
    options.add_argument("--help", action="help", help="Show this page.")
    return parser


def _completion(overall: Reader, *, install: bool) -> None:
    shell = Path(os.environ.get("SHELL", "")).name
    if shell not in _SHELLS:
        overall.error(f"The shell, $SHELL, is '{shell}', not one of {', '.join(_SHELLS)}.")
    name, text = _SHELLS[shell]
    text = text.replace("COMPLETE", COMPLETE)
    if not install:
        sys.stdout.write(text)
        return
    with told(debug=False):
        file = Path.home() / name
        before = file.read_bytes() if file.exists() else b""
        if text.encode() not in before:
            write_bytes(file, before + text.encode())
        say(f"{file}: a new shell completes the words of modelica-like.")


def complete(words: Sequence[str]) -> None:
    """Print what can stand for the last word, each with a tabulator and its meaning.

    Args:
        words: of the command line up to the cursor, without the program.
    """
    *before, now = words or [""]
    now = "" if now == "=" else now  # Bash splits words there
    candidates = _candidates([word for word in before if word != "="], now)
    sys.stdout.writelines(f"{word}\t{meaning}".strip() + "\n" for word, meaning in candidates if word.startswith(now))


def _candidates(before: list[str], now: str) -> Iterable[tuple[str, str]]:
    of = _reader() if not before else reader(before[0], command(before[0])) if before[0] in HOMES else None
    if of is None:
        return ()
    name, equals, _ = now.partition("=")
    action = of._option_string_actions.get(name if equals else (before or [""])[-1])
    parameters_of_command = parameters(command(before[0])) if before else []
    if action and action.nargs != 0:
        begin = f"{name}=" if equals else ""
        return ((begin + value, "") for p in parameters_of_command if p.name == action.dest for value in _values(p))
    if now.startswith("-"):
        return [(word, action.help or "") for word, action in of._option_string_actions.items()]
    if not before:
        return [(name, paragraphs(command(name))[0]) for name in HOMES]
    return ((value, "") for parameter in parameters_of_command if not parameter.option for value in _values(parameter))


def _values(parameter: Parameter) -> Iterable[str]:
    return parameter.declared.choices() if parameter.declared.choices else parameter.choices
