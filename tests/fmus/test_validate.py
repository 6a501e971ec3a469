"""`validate_fmu`: sound FMUs pass with every importer, broken ones are told what is wrong with them."""

import shutil
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType

import pytest

from modelica_like.errors import FmuCrashed
from modelica_like.fmi import importers, validate
from modelica_like.fmi.validate import ABSENT, FAILED, PASSED, validate_fmu

Built = Mapping[tuple[str, str], Path]


def edited(source: Path, target: Path, edit: Callable[[str], str]) -> Path:
    """Copy an FMU with another model description."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            new.writestr(name, edit(content.decode()) if name == "modelDescription.xml" else content)
    return target


def replaced(old: str, new: str) -> Callable[[str], str]:
    def edit(text: str) -> str:
        assert old in text
        return text.replace(old, new)

    return edit


def test_importers_are_installed() -> None:
    """The tests mean something only where the other importers are there: they belong to the extra `dev`."""
    assert all(importers.installed(importer) for importer in importers.PACKAGES)


def test_a_sound_fmu_passes_every_check(reference_fmus: Built) -> None:
    validation = validate_fmu(reference_fmus["stick_slip", "2.0"])
    assert validation.passed
    verdicts = {check.name: check.verdict for check in validation.checks}
    assert verdicts == {
        "archive": PASSED, "schema of model description": PASSED, "schema of terminals and icons": ABSENT,
        "schema of build description": ABSENT, "fmpy validate_fmu": PASSED, "FMPy ME CVode": PASSED,
        "FMPy ME Euler": PASSED, "FMPy CS": PASSED, "ecos CS": PASSED, "libcosim CS": PASSED,
    }  # fmt: skip
    assert str(validation).startswith("stick_slip_fmi2.fmu\narchive ")
    assert validation["ecos CS"].sentence == "It runs to 5 s and ends with the same values."


def test_libcosim_crashes_on_fmi_3_of_whatever_origin(reference_fmus: Built) -> None:
    """An importer's fault, shown with a reference FMU: it is no reason to refuse an FMU."""
    validation = validate_fmu(reference_fmus["stick_slip", "3.0"])
    assert validation.passed
    assert validation["ecos CS"].verdict == PASSED
    assert validation["libcosim CS"].sentence == (
        "stick_slip_fmi3.fmu in libcosim crashed with SIGSEGV before the end of its first step. "
        "It does so with every FMU of FMI 3.0: the importer is at fault."
    )
    subject = validate._Subject(reference_fmus["machine_table", "3.0"], _description("3.0", reference_fmus), 60)
    with pytest.raises(FmuCrashed, match="SIGSEGV"):
        validate._run_importer("libcosim", subject, ["table.v"])


def _description(version: str, reference_fmus: Built) -> object:
    import fmpy

    return fmpy.read_model_description(str(reference_fmus["machine_table", version]))


def test_what_is_missing_is_told(reference_fmus: Built) -> None:
    validation = validate_fmu(reference_fmus["ravigneaux", "2.0"])
    assert validation["FMPy ME CVode"].verdict == ABSENT
    assert validation["FMPy ME CVode"].sentence == "It has no Model Exchange."
    assert validation["schema of terminals and icons"].sentence == "It has none."


def test_an_importer_that_is_not_installed_is_told(reference_fmus: Built, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importers, "installed", lambda importer: False)
    check = validate_fmu(reference_fmus["ravigneaux", "2.0"])["ecos CS"]
    assert (check.verdict, check.sentence) == (
        ABSENT,
        'It is not installed: pip install "modelica-like[importers]".',
    )


BROKEN = {
    "an unknown attribute": (
        replaced('variability="fixed"', 'variability="fixed" colour="red"'),
        "schema of model description",
        "line 29: Element 'ScalarVariable', attribute 'colour': The attribute 'colour' is not allowed.",
    ),
    "a unit that is not defined": (
        replaced('unit="N.m"', 'unit="parsec"'),
        "fmpy validate_fmu",
        'The unit "parsec" of variable "clutch.capacity" (line 30) is not defined.',
    ),
    "a version of which nothing is known": (
        replaced('fmiVersion="2.0"', 'fmiVersion="7.0"'),
        "schema of model description",
        "It does not state its version of the standard.",
    ),
    "no XML": (replaced("</fmiModelDescription>", ""), "schema of model description", "It is not XML: "),
    "another token": (replaced('guid="{machine_table}"', 'guid="{other}"'), "FMPy CS", "machine_table"),
}


@pytest.mark.parametrize("fault", BROKEN)
def test_tells_what_is_wrong(fault: str, reference_fmus: Built, tmp_path: Path) -> None:
    edit, name, sentence = BROKEN[fault]
    broken = edited(reference_fmus["machine_table", "2.0"], tmp_path / "machine_table.fmu", edit)
    validation = validate_fmu(broken)
    assert not validation.passed
    assert validation[name].verdict == FAILED
    assert validation[name].sentence.startswith(sentence)


def test_no_archive(tmp_path: Path) -> None:
    (tmp_path / "text.fmu").write_text("no archive")
    validation = validate_fmu(tmp_path / "text.fmu")
    assert [check.sentence for check in validation.checks] == ["text.fmu is not an FMU: it is not a valid zip archive."]
    assert not validation.passed


def hostile_from_the_start(builder: ModuleType, misdeed: int, target: Path) -> Path:
    """Build an FMU whose own start value is the misdeed: no importer has to set it."""
    folder = target / "hostile"
    shutil.copytree(Path(__file__).parent / "hostile", folder)
    text = (folder / "model.toml").read_text()
    (folder / "model.toml").write_text(text.replace("start = 0.0", f"start = {misdeed}.0"))
    return builder.build_one(folder, "2.0", target)


def test_values_that_are_not_finite(builder: ModuleType, tmp_path: Path) -> None:
    check = validate_fmu(hostile_from_the_start(builder, 6, tmp_path))["FMPy CS"]
    assert check.verdict == FAILED
    assert check.sentence.startswith("hostile_fmi2.fmu: x is not finite at t = 0.5 s.")


def test_crashes_in_every_importer_are_told(builder: ModuleType, tmp_path: Path) -> None:
    validation = validate_fmu(hostile_from_the_start(builder, 1, tmp_path))
    failed = {check.name: check.sentence for check in validation.checks if check.verdict == FAILED}
    crashed = "crashed with SIGSEGV before the end of its first step."
    assert failed["ecos CS"] == f"hostile_fmi2.fmu in ecos {crashed}"
    assert failed["libcosim CS"] == f"hostile_fmi2.fmu in libcosim {crashed}"
    assert failed["FMPy CS"].startswith("hostile_fmi2.fmu crashed with SIGSEGV after t = 0.49")
    assert len(failed) == 3
