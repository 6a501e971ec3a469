"""What the page asks for, without a browser: files, trust, places of parts, and how soon a picture is there."""

from pathlib import Path

import pytest

from modelica_like.errors import ModelicaLikeError
from modelica_like.page import Session
from modelica_like.page.placing import unused

TWO = """[parts]
a = { is = "Inertia", J = 1, w = 1, phi = 0 }
b = { is = "Inertia", J = 2 }

[series]
line = ["a", "b"]
"""
OWN = """from components import Inertia
from pathlib import Path
Path(__file__).with_name("has_run").touch()

class Hub(Inertia):
    pass
"""


@pytest.fixture
def session(tmp_path: Path) -> Session:
    (tmp_path / "drive.toml").write_text(TWO)
    return Session(tmp_path / "drive.toml", folder=tmp_path)


def refused(session: Session, what: str, **request: object) -> str:
    with pytest.raises(ModelicaLikeError) as caught:
        getattr(session, what)(request)
    return str(caught.value)


def test_files_outside_the_folder_are_refused(session: Session, tmp_path: Path) -> None:
    (tmp_path.parent / "elsewhere.toml").write_text(TWO)
    (tmp_path / "link.toml").symlink_to(tmp_path.parent / "elsewhere.toml")
    for name in ("../elsewhere.toml", str(tmp_path.parent / "elsewhere.toml"), "link.toml", "..", "drive.py"):
        assert "is no netlist of the folder" in refused(session, "open", file=name)
        assert "is no netlist of the folder" in refused(session, "save", name=name)
    session.save({"name": "other.toml"})
    assert (tmp_path / "other.toml").read_text() == TWO
    assert "exists already" in refused(session, "save", name="drive.toml")


def test_modules_run_only_when_it_was_said(tmp_path: Path) -> None:
    (tmp_path / "hub_of_page.py").write_text(OWN)
    (tmp_path / "drive.toml").write_text(TWO.replace('"Inertia", J = 2', '"hub_of_page:Hub", J = 2'))
    session = Session(tmp_path / "drive.toml")
    state = session.state({})
    assert (state["valid"], [one["kind"] for one in state["problems"]]) == (False, ["UntrustedModule"])
    assert session.kind({"kind": "hub_of_page:Hub"}) is None
    assert {"kind": "hub_of_page:Hub", "group": "this folder", "about": "class of this folder", "symbol": ""} in (
        session.palette({"words": "hub"})["entries"]
    )
    assert not (tmp_path / "has_run").exists()
    assert session.trust({})["valid"]
    assert (tmp_path / "has_run").exists()


def test_a_part_goes_onto_a_line_an_end_the_sheet(session: Session) -> None:
    part = {"op": "place", "name": "s", "kind": "SpringDamper", "values": {"c": 10, "d": 1}}
    state = session.apply({"request": {**part, "at": {"line": ["b.flange_a", "a.flange_b"]}}})
    assert state["data"]["series"]["line"] == ["a", "s", "b"]
    state = session.apply({"request": {"op": "place", "name": "c", "kind": "Inertia", "at": {"end": "b.flange_b"}}})
    assert state["data"]["series"]["line"] == ["a", "s", "b", "c"]
    state = session.apply(
        {"request": {"op": "place", "name": "m", "kind": "ConstantTorque", "at": {"end": "a.flange_b"}}}
    )
    assert state["data"]["connect"] == {"a_m": ["a.flange_b", "m.flange"]}
    state = session.apply({"request": {"op": "place", "name": "r", "kind": "Ramp", "at": {}}})
    assert state["data"]["parts"]["r"] == {"is": "Ramp"}
    said = refused(
        session, "apply", request={"op": "place", "name": "q", "kind": "Resistor", "at": {"end": "a.flange_b"}}
    )
    assert said.startswith("connect(a.flange_b, q.p): a Flange (rad, N.m) cannot join a Pin (V, A).")
    for _ in range(4):
        state = session.undo({})
    assert (state["text"], state["saved"], state["undo"], state["redo"]) == (TWO, True, 0, 4)


def test_parts_are_copied_and_pasted_as_text(session: Session) -> None:
    text = session.copy({"names": ["a", "b"]})
    assert text == TWO
    state = session.apply({"request": {"op": "paste", "text": text}})
    assert state["data"]["series"] == {"line": ["a", "b"], "line_2": ["a_2", "b_2"]}
    assert state["data"]["parts"]["b_2"] == {"is": "Inertia", "J": 2}
    assert session.undo({})["text"] == TWO
    assert refused(session, "apply", request={"op": "paste", "text": "name = 'x'"}).startswith(
        "What is pasted has no parts."
    )


@pytest.mark.parametrize(
    ("name", "taken", "new"),
    [("m007", "m007", "m008"), ("J1", "J1", "J2"), ("J1", "J1 J2 J3", "J4"), ("J1", "J2", "J1"),
     ("shaft", "shaft", "shaft_2"), ("shaft_2", "shaft shaft_2", "shaft_3"), ("J09", "J09", "J10"),
     ("J09", "J09 J10 J11", "J12"), ("J", "J J1", "J_2")],
)  # fmt: skip
def test_the_next_name_is_the_one_that_a_user_expects(name: str, taken: str, new: str) -> None:
    assert unused(name, taken.split()) == new


def test_only_ends_that_fit_are_offered(session: Session) -> None:
    session.apply({"request": {"op": "add", "name": "r", "kind": "Ramp"}})
    fits = session.fits({"end": "a.flange_a"})
    assert [end for end, why in fits.items() if not why] == ["a.flange_b", "b.flange_a", "b.flange_b"]
    assert "b.flange_a" not in session.fits({"end": "a.flange_b"}), "they follow each other"
    assert fits["r.y"] == "connect joins the signal r.y with the connector a.flange_a."


def test_the_last_valid_picture_stays(session: Session) -> None:
    picture = session.state({})["picture"]
    state = session.text({"text": TWO.replace("Inertia", "Inertai")})
    assert (state["valid"], state["picture"]) == (False, picture)
    assert state["problems"][0]["suggestion"]["new"] == "Inertia"
    assert session.text({"text": TWO + "x = = 1"})["problems"]
    assert session.undo({})["problems"]
    assert session.undo({})["valid"]


def test_an_assembly_is_made_opened_and_seen_from_outside(session: Session, tmp_path: Path) -> None:
    session.apply({"request": {"op": "group", "names": ["b"], "name": "tail"}})
    assert refused(session, "open", file="./tail.toml").startswith("'tail.toml' is not written yet.")
    session.save({})
    inner = session.open({"file": "./tail.toml"})
    assert (inner["trail"], inner["data"]["parts"]) == (["drive.toml", "tail.toml"], {"b": {"is": "Inertia", "J": 2}})
    session.apply({"request": {"op": "set", "path": "b.J", "value": "5 kg.m2"}})
    outer = session.back({})
    assert outer["valid"]
    assert outer["saved"]
    assert session.desk.drive is not None
    assert session.desk.drive.find("tail").find("b").value("J").number == 5.0  # type: ignore[union-attr]


def test_another_editor_writes_the_file(session: Session, tmp_path: Path) -> None:
    theirs = TWO.replace("J = 2", "J = 3")
    (tmp_path / "drive.toml").write_text(theirs)
    assert session.watch({})["conflict"] is None
    assert session.state({})["text"] == theirs
    session.apply({"request": {"op": "set", "path": "b.J", "value": 4}})
    (tmp_path / "drive.toml").write_text(TWO)
    assert session.watch({})["conflict"] == TWO
    assert "has been changed by another program" in refused(session, "save")
    mine = session.take({"theirs": False})
    assert mine["data"]["parts"]["b"]["J"] == 4
    assert session.watch({})["conflict"] is None
    session.save({})
    assert "J = 4" in (tmp_path / "drive.toml").read_text()


def many(count: int) -> str:
    """A chain of inertias and springs with a brake at every fifth inertia."""
    names = [f"{'s' if k % 2 else 'j'}{k}" for k in range(count - count // 10)]
    brakes = [(f"q{k}", names[8 * k]) for k in range(count // 10)]
    lines = [f'{n} = {{ is = "SpringDamper", c = 1e4, d = 1 }}' if n[0] == "s" else f'{n} = {{ is = "Inertia", J = 1 }}'
             for n in names] + [f'{q} = {{ is = "ConstantTorque", tau_constant = 1 }}' for q, _ in brakes]  # fmt: skip
    joined = [f'{q} = ["{q}.flange", "{j}.flange_b"]' for q, j in brakes]
    return "\n".join(["[parts]", *lines, "[series]", f"x = {names}".replace("'", '"'), "[connect]", *joined, ""])


@pytest.mark.parametrize("count", [25, pytest.param(100, marks=pytest.mark.slow)])
def test_edits_of_a_long_drive_give_valid_ones(tmp_path: Path, count: int) -> None:
    session = Session(tmp_path / "drive.toml")
    session.text({"text": many(count)})
    back = {"op": "rename", "old": "wheel", "new": "j4"}
    for k in range(6):
        for request in (
            {"op": "set", "path": "j2.J", "value": f"{k + 2} kg.m2"}, {"op": "rename", "old": "j4", "new": "wheel"},
            {"op": "place", "name": "new", "kind": "Inertia", "values": {"J": 1}, "at": {"line": ["j2", "s3"]}},
            {"op": "together", "steps": [{"op": "remove", "name": "new"}, back]},
        ):  # fmt: skip
            assert session.apply({"request": request})["valid"]
