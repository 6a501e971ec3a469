"""What the page refuses, and the sentence that tells why."""

from pathlib import Path
from typing import Any

import pytest

from modelica_like.errors import DuplicateName, ModelicaLikeError, NetlistError, WrongConnection
from modelica_like.language import Assembly, Component, Equations
from modelica_like.page import Session

TEXT = """[parts]
a = { is = "Inertia", J = 1, w = 1, phi = 0 }
b = { is = "Inertia", J = 2 }

[series]
line = ["a", "b"]
"""
CASES: dict[str, tuple[type[ModelicaLikeError], str, dict[str, Any], str]] = {
    "another folder": (
        NetlistError, "open", {"file": "../drive.toml"},
        "'../drive.toml' is no netlist of the folder '{folder}'.\n"
        "The page opens and writes files of this folder only, with names that end with .toml.",
    ),
    "a name in use": (
        DuplicateName, "save", {"name": "other.toml"}, "'other.toml' exists already.\nChoose another name.",
    ),
    "an older model": (NetlistError, "starts", {"revision": 1}, "The netlist has changed since."),
    "nothing to paste": (
        NetlistError, "apply", {"request": {"op": "paste", "text": "name = 'x'"}},
        'What is pasted has no parts.\nCopy parts, or lines such as `a = { is = "Inertia" }` in [parts].',
    ),
    "an end of another kind": (
        WrongConnection, "apply",
        {"request": {"op": "place", "name": "r", "kind": "Resistor", "at": {"end": "b.flange_b"}}},
        "connect(b.flange_b, r.p): a Flange (rad, N.m) cannot join a Pin (V, A). Join connectors of one kind.\n"
        "Put it on another end, or on the sheet.",
    ),
}  # fmt: skip


class Own(Component):
    def equations(self) -> Equations:
        return iter(())


@pytest.fixture
def session(tmp_path: Path) -> Session:
    for name in ("drive", "other"):
        (tmp_path / f"{name}.toml").write_text(TEXT)
    return Session(tmp_path / "drive.toml")


def refused(session: Session, what: str, request: dict[str, Any]) -> ModelicaLikeError:
    with pytest.raises(ModelicaLikeError) as caught:
        getattr(session, what)(request)
    return caught.value


@pytest.mark.parametrize("case", CASES)
def test_refusals(session: Session, tmp_path: Path, case: str) -> None:
    kind, what, request, told = CASES[case]
    error = refused(session, what, request)
    assert (type(error), str(error)) == (kind, told.replace("{folder}", str(tmp_path.resolve())))
    assert session.state({})["text"] == TEXT


def test_another_program_has_written(session: Session, tmp_path: Path) -> None:
    session.apply({"request": {"op": "set", "path": "b.J", "value": 4}})
    (tmp_path / "drive.toml").write_text(TEXT + "\n")
    assert str(refused(session, "save", {})) == (
        "'drive.toml' has been changed by another program.\nChoose which of the two texts stays."
    )


def test_a_new_assembly_is_not_written_yet(session: Session) -> None:
    session.apply({"request": {"op": "group", "names": ["b"], "name": "tail"}})
    assert str(refused(session, "open", {"file": "./tail.toml"})) == (
        "'tail.toml' is not written yet.\nSave the netlist first, and then open it."
    )


def test_a_drive_that_no_netlist_can_contain() -> None:
    drive = Assembly("made")
    drive.part = type("Inner", (Own,), {"__module__": __name__, "__qualname__": "f.<locals>.Inner"})()
    session = Session(drive)
    assert session.state({})["fixed"]
    assert str(refused(session, "apply", {"request": {"op": "remove", "name": "part"}})) == (
        "This drive was made in Python, and no netlist can contain it."
    )
