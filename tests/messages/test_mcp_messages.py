"""What the tools for programs refuse, and the sentence that tells why."""

from pathlib import Path
from typing import Any

import pytest

from modelica_like import simulate
from modelica_like.errors import (
    Interrupted,
    MissingValue,
    ModelicaLikeError,
    NetlistError,
    UnknownName,
    ValueOutOfRange,
)
from modelica_like.mcp.tools import Tools, too_long, use
from modelica_like.trust import confined

CASES: dict[str, tuple[type[ModelicaLikeError], str, dict[str, Any], str]] = {
    "no tool": (
        UnknownName, "simulat", {},
        "There is no tool 'simulat'; did you mean 'simulate'? There are add, insert, connect, disconnect, remove, "
        "rename, replace, set, unset, duplicate, group, netlists, text, new, undo, apply, library, check, simulate, "
        "values, sensitivities, steady, export, draw.",
    ),
    "a file outside": (
        NetlistError, "text", {"file": "../drive.toml"},
        "'{folder}/../drive.toml' is outside of the folder '{folder}'.\nName a file in this folder.",
    ),
    "no name": (NetlistError, "text", {"file": "a\n.toml"}, r"'a\n.toml' is no name of a file."),
    "another ending": (
        NetlistError, "draw", {"file": "drive.toml", "output": "drive.bmp"},
        "'drive.bmp' must end in .svg or .png or .pdf.",
    ),
    "no run": (
        MissingValue, "values", {"file": "drive.toml", "readings": ["J.w"]},
        "There is no run of 'drive.toml' as it is now.\nUse simulate first.",
    ),
    "no text": (
        ValueOutOfRange, "remove", {"file": 3, "name": "J"}, 'remove: file = 3 is no text.\nGive one, such as "…".',
    ),
    "nothing is taken": (
        UnknownName, "netlists", {"file": "drive.toml"}, "netlists has no argument 'file'. It takes none.",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_message(case: str, tmp_path: Path) -> None:
    kind, tool, arguments, message = CASES[case]
    (tmp_path / "drive.toml").write_text('[parts]\nJ = { is = "Inertia", J = 1 }\n', encoding="utf-8")
    with confined(tmp_path), pytest.raises(kind) as caught:
        use(Tools(tmp_path), tool, arguments)
    assert str(caught.value) == message.format(folder=tmp_path.resolve())


def test_no_folder(tmp_path: Path) -> None:
    with pytest.raises(NetlistError) as caught:
        Tools(tmp_path / "nowhere")
    assert str(caught.value) == f"'{tmp_path / 'nowhere'}' is not a folder."


def test_a_call_that_was_stopped(tmp_path: Path) -> None:
    (tmp_path / "drive.toml").write_text('[parts]\nJ = { is = "Inertia", J = 1, phi = 0, w = 0 }\n', encoding="utf-8")
    run = simulate(tmp_path / "drive.toml", "0.5 s")
    assert str(too_long("simulate", 120.0, Interrupted.after(run))) == (
        "simulate took more than 120 s, and was stopped at t = 0.5 s.\nGive an earlier end as `until`."
    )
    assert str(too_long("steady", 120.0, KeyboardInterrupt())) == "steady took more than 120 s, and was stopped."
