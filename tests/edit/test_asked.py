"""Names in [optimize] and [tolerances] follow the parts that they mean."""

from __future__ import annotations

from modelica_like.edit import Document, apply

DRIVE = """
[parameters]
load = "15 N.m"
[parts]
motor = { is = "ConstantSpeed", w_fixed = "100 rad/s", phi = 0 }
clutch = { is = "Clutch", capacity = "50 N.m" }
hub = { is = "Inertia", J = 0.02 }
wheel = { is = "Inertia", J = 0.05, phi = 0, w = 0 }
[series]
drive = ["motor", "clutch", "hub", "wheel"]
[optimize]
minimize = "max(peak(clutch.tau), 2*hub.J*1 rad/s2)"
free = { "clutch.capacity" = [20, 80], load = [1, 20], "hub.J" = [0.01, 0.04] }   # bounds
choose.wheel = "wheels.csv"
subject_to = ["clutch.lock_time <= 0.4 s", "time(clutch.mode -> stuck) <= 1 s"]
for = [{ name = "clutch", load = "12 N.m" }]
[tolerances]
"hub.J" = "±5 %"
correlated = [{ of = ["hub.J", "wheel.J"], rho = 0.3 }]
"""


def edited(**request: object) -> tuple[str, tuple[str, ...]]:
    result = apply(DRIVE, request)
    return result.text, result.notes


def test_parts_and_parameters_get_names() -> None:
    text, _ = edited(op="rename", old="clutch", new="coupling")
    assert text == DRIVE.replace("clutch.", "coupling.").replace("clutch =", "coupling =").replace(
        '"clutch", "hub"', '"coupling", "hub"')  # fmt: skip
    text, _ = edited(op="rename", old="load", new="burden")
    assert text == DRIVE.replace("load =", "burden =")
    text, _ = edited(op="rename", old="hub", new="disc")
    assert text == DRIVE.replace("hub.", "disc.").replace("hub =", "disc =").replace('"hub"', '"disc"')
    text, _ = edited(op="rename", old="wheel", new="rim")
    assert text.count("wheel") == 1  # the file


def test_what_still_names_a_part_is_told() -> None:
    _, notes = edited(op="remove", name="hub")
    assert "[optimize] names hub: change that there." in notes
    assert "[tolerances] names hub: change that there." in notes
    assert "'max(peak(clutch.tau), 2*hub.J*1 rad/s2)' still uses hub: change that there." in notes


def test_grouped_parts_are_named_by_their_group(tmp_path) -> None:
    path = tmp_path / "drive.toml"
    path.write_text(DRIVE)
    document = Document(path).group(["hub", "wheel"], "rotor")
    assert '"rotor.hub.J" = [0.01, 0.04]' in document.text
    assert 'of = ["rotor.hub.J", "rotor.wheel.J"]' in document.text
    assert document.undo().text == DRIVE
