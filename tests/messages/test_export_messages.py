"""What the export of FMUs says when it cannot do what it was asked for; nothing is written then."""

from pathlib import Path
from typing import Any

import pytest

import components
from components import Clutch, Inertia
from modelica_like import build, export_fmu
from modelica_like.errors import ExportError, UnknownName
from modelica_like.fmi import export
from modelica_like.fmi.check import compare_with_idas
from modelica_like.language import Assembly

TWO_MASS = Path(__file__).parents[2] / "examples/two_mass.toml"


def flywheel() -> Assembly:
    drive = Assembly("flywheel", parts={"J": Inertia(J="2 kg.m2", phi=0.0, w="3 rad/s")})
    drive.simulate["until"] = "2 s"
    return drive


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
        ({"path": "nowhere/drive.fmu"}, ExportError, "There is no folder 'nowhere' for drive.fmu.\nMake it first."),
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
        "The FMU does not pass its checks: line 3 is wrong; line 4 too.\nThis is a fault of the export."
    )
    assert list(tmp_path.iterdir()) == []


def test_disagreement_with_idas_is_told(tmp_path: Path) -> None:
    export_fmu(flywheel(), tmp_path / "d.fmu", check=False)
    faster = flywheel()
    faster.set("J.w", "4 rad/s")
    with pytest.raises(ExportError) as caught:
        compare_with_idas(tmp_path / "d.fmu", build(faster), "cs")
    # The speed is 1 rad/s too low. It is constant, so that a thousandth of it counts as its range.
    assert str(caught.value) == (
        "The FMU does not agree with IDAS: J.w differs by 2.5e+02 of its range until t = 0.2 s.\n"
        "Export without the check to look at it, and report this."
    )
