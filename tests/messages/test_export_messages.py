"""What the export of FMUs says when it cannot do what it was asked for; nothing is written then."""

from pathlib import Path
from typing import Any

import pytest

import components
from components import Clutch, Inertia, Spring
from modelica_like import build, export_fmu, simulate
from modelica_like.errors import ExportError, StepFailed, UnknownName
from modelica_like.fmi import check, export
from modelica_like.fmi.check import compare_with_idas
from modelica_like.language import Assembly

TWO_MASS = Path(__file__).parents[2] / "examples/two_mass.toml"


def flywheel() -> Assembly:
    drive = Assembly("flywheel", parts={"J": Inertia(J="2 kg.m2", phi=0.0, w="3 rad/s")})
    drive.simulate["until"] = "2 s"
    return drive


def test_names_with_letters_of_other_languages(tmp_path: Path) -> None:
    drive = Assembly("flywheel", parts={"Läufer": Inertia(J="2 kg.m2", phi=0.0, w="3 rad/s")})
    with pytest.raises(ExportError) as caught:
        export_fmu(drive, tmp_path / "drive.fmu")
    assert str(caught.value) == (
        "An FMU of flywheel cannot have the name 'Läufer.phi': the standard knows the letters a to z only.\n"
        "Rename the part or the variable."
    )
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("options", "error", "told"),
    [
        ({"version": "1.0"}, UnknownName, "FMI 1.0 is not supported.\nThere are 2.0 and 3.0."),
        (
            {"kind": ["xs"]},
            UnknownName,
            "There is no kind of FMU 'xs'.\nThere are me (Model Exchange) and cs (Co-Simulation).",
        ),
        ({"kind": []}, ExportError, "An FMU needs a kind.\nAsk for me (Model Exchange), cs (Co-Simulation) or both."),
        (
            {"platforms": "x86_64-linus"},
            UnknownName,
            "There is no platform 'x86_64-linus'; did you mean 'x86_64-linux'?",
        ),
        (
            {"outputs": ["J.v"]},
            UnknownName,
            "flywheel has no variable 'J.v' that could be an output; did you mean 'J.w'?",
        ),
        (
            {"ends": ["J.flange"]},
            UnknownName,
            "J has no connector 'flange'; did you mean 'flange_b'? It has flange_a, flange_b.",
        ),
        ({"path": "drive.zip"}, ExportError, "An FMU is a file with the ending .fmu, not 'drive.zip'."),
        ({"path": "nowhere/drive.fmu"}, ExportError, "There is no folder 'nowhere' for drive.fmu.\nCreate it first."),
    ],
)
def test_wrong_requests(
    options: dict[str, Any], error: type[Exception], told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(error) as caught:
        export_fmu(flywheel(), **{"path": "drive.fmu", **options})
    assert str(caught.value).startswith(told)
    assert list(tmp_path.iterdir()) == []


def test_an_open_end_needs_an_adaptor(tmp_path: Path) -> None:
    class Odd(components.Flange):
        """A connector that no library knows."""

    drive = Assembly("d", parts={"c": Clutch(fn_max=1.0, f_normalized=1.0)})
    drive.shaft = Odd("odd", free=True)
    with pytest.raises(ExportError) as caught:
        export_fmu(drive, tmp_path / "d.fmu")
    assert str(caught.value) == (
        "shaft cannot be opened: no library has an adaptor for a Odd that takes its flow.\n"
        "Write one: a component with that connector, inputs and outputs, and `terminal = Terminal(…)`."
    )


def test_a_compiled_model_has_no_ends(tmp_path: Path) -> None:
    model = build(TWO_MASS)
    with pytest.raises(ExportError) as caught:
        export_fmu(model, tmp_path / "d.fmu", ends=["J1.flange_a"])
    assert str(caught.value) == "A compiled model has no ends that could be opened.\nExport its netlist instead."


def test_a_fault_of_the_export_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(export, "problems", lambda path: ["line 3 is wrong", "line 4 too"])
    with pytest.raises(ExportError) as caught:
        export_fmu(flywheel(), tmp_path / "d.fmu", platforms=())
    assert str(caught.value) == (
        "The FMU does not pass its checks: line 3 is wrong; line 4 too.\nThis is an error of the exporter."
    )
    assert list(tmp_path.iterdir()) == []


def test_disagreement_with_idas_is_told(tmp_path: Path) -> None:
    export_fmu(flywheel(), tmp_path / "d.fmu", check=False)
    faster = flywheel()
    faster.set("J.w", "4 rad/s")
    found = compare_with_idas(tmp_path / "d.fmu", build(faster), "cs")
    # The speed is 1 rad/s too low. It is constant, so that a thousandth of it counts as its range.
    assert found.differs
    assert found.sentence == (
        "Until t = 0.2 s the FMU differs from IDAS by more than its tolerance explains: "
        "J.w by 2.5e+02, J.phi by 0.25 of the range."
    )


def test_an_fmu_that_differs_is_written_with_a_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    faster = flywheel()
    faster.set("J.w", "4 rad/s")
    monkeypatch.setattr(check, "simulate", lambda _, *rest, **given: simulate(faster, *rest, **given))
    with pytest.raises(ExportError, match=r"differs from IDAS by more than its tolerance explains: J\.w by"):
        export_fmu(flywheel(), tmp_path / "d.fmu", strict=True)
    assert list(tmp_path.iterdir()) == []
    done = export_fmu(flywheel(), tmp_path / "d.fmu")
    assert str(done).endswith(f" of the range. See {tmp_path / 'd_check.png'}.")
    assert (tmp_path / "d_check.png").read_bytes().startswith(b"\x89PNG")


def test_where_idas_gives_up_the_fmu_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def give_up(*_: object, **__: object) -> None:
        raise StepFailed("IDAS gave up at about t = 0.1 s.")

    monkeypatch.setattr(check, "simulate", give_up)
    done = export_fmu(flywheel(), tmp_path / "d.fmu", strict=True)
    assert str(done).splitlines()[1:] == [
        "The FMU runs, but nothing was compared, because IDAS gave up: IDAS gave up at about t = 0.1 s."
    ]
    assert done.path.exists()


@pytest.mark.slow
def test_a_drift_of_phase_is_what_tolerances_do(tmp_path: Path) -> None:
    """72 kHz for 0.2 s: 14,000 periods."""
    parts = {"a": Inertia(J=1e-6, phi=0.0, w=1.0), "spring": Spring(c=2e5, phi_rel=0.0), "b": Inertia(J=0.08, w=0.0)}
    drive = Assembly("fast", parts=parts, series={"shaft": ["a", "spring", "b"]})
    drive.simulate["until"] = "2 s"
    found = export_fmu(drive, tmp_path / "d.fmu").check
    assert not found.differs
    assert found.sentence.startswith("Until t = 0.2 s the FMU differs from IDAS as its tolerance 1e-07 lets it: ")
