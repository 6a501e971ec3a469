"""Archives that are no FMUs, or worse: refused before anything is unpacked."""

import stat
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from modelica_like.errors import FmuRefused
from modelica_like.fmi.run import run_fmu
from modelica_like.fmi.unpack import LIMITS, Limits, unpack

DESCRIPTION = "<fmiModelDescription/>"


def plain(archive: zipfile.ZipFile) -> None:
    archive.writestr("modelDescription.xml", DESCRIPTION)


def member(name: str, mode: int = 0) -> Callable[[zipfile.ZipFile], None]:
    def write(archive: zipfile.ZipFile) -> None:
        plain(archive)
        info = zipfile.ZipInfo("x")
        info.filename, info.external_attr = name, mode << 16
        archive.writestr(info, "/etc/passwd")

    return write


def bomb(archive: zipfile.ZipFile) -> None:
    plain(archive)
    archive.writestr("resources/zeros", bytes(20 * 1024**2))


def too_many(archive: zipfile.ZipFile) -> None:
    for k in range(LIMITS.members + 1):
        archive.writestr(f"resources/{k}", "")


def twice(archive: zipfile.ZipFile) -> None:
    plain(archive)
    with pytest.warns(UserWarning, match="Duplicate"):
        plain(archive)


def entities(archive: zipfile.ZipFile) -> None:
    archive.writestr("modelDescription.xml", f'<!DOCTYPE a [<!ENTITY b "c">]>{DESCRIPTION}')


DOCUMENT_TYPE = (
    "bad.fmu is refused: its modelDescription.xml declares a document type.\n"
    "A model description needs none; it can make a small file enormous, or read other files."
)


def entities_in_utf_16(archive: zipfile.ZipFile) -> None:
    text = f'<?xml version="1.0" encoding="UTF-16"?><!DOCTYPE a [<!ENTITY b "c">]>{DESCRIPTION}'
    archive.writestr("modelDescription.xml", text.encode("utf-16"))


REFUSED = {
    "a link": (member("resources/way_out", stat.S_IFLNK | 0o777), "bad.fmu is refused: 'resources/way_out' is a link."),
    "a device": (
        member("resources/null", stat.S_IFCHR | 0o666),
        "bad.fmu is refused: 'resources/null' is neither a file nor a folder.",
    ),
    "a path outside": (member("../outside"), "bad.fmu is refused: '../outside' leads out of the archive."),
    "a hidden path outside": (
        member("binaries/../../outside"),
        "bad.fmu is refused: 'binaries/../../outside' leads out of the archive.",
    ),
    "backslashes outside": (member(r"..\outside"), r"bad.fmu is refused: '..\outside' leads out of the archive."),
    "backslashes": (
        member(r"binaries\linux64"),
        r"bad.fmu is refused: 'binaries\linux64' has a backslash where the standard requires a slash.",
    ),
    "an absolute path": (member("/tmp/outside"), "bad.fmu is refused: '/tmp/outside' is an absolute path."),
    "a drive": (member("C:/outside"), "bad.fmu is refused: 'C:/outside' is an absolute path."),
    "control characters": (
        member("../\x1b[31mred"),
        "bad.fmu is refused: '../\N{REPLACEMENT CHARACTER}[31mred' leads out of the archive.",
    ),
    "a name twice": (twice, "bad.fmu is refused: 'modelDescription.xml' occurs twice."),
    "a bomb": (
        bomb,
        "bad.fmu is refused: 19.93 kB would unpack to 20 MB.\n"
        "A file that shrinks to less than 1/200 is more likely a zip bomb than an FMU.",
    ),
    "too many files": (too_many, "bad.fmu is refused: it holds 10001 files, more than 10000."),
    "no description": (
        lambda archive: archive.writestr("x", ""),
        "bad.fmu is not an FMU: it has no modelDescription.xml.",
    ),
    "a document type": (entities, DOCUMENT_TYPE),
    "a document type in UTF-16": (entities_in_utf_16, DOCUMENT_TYPE),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refuses(case: str, tmp_path: Path) -> None:
    write, sentence = REFUSED[case]
    path, target = tmp_path / "bad.fmu", tmp_path / "unpacked"
    target.mkdir()
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        write(archive)
    with pytest.raises(FmuRefused) as refusal:
        unpack(path, target)
    assert str(refusal.value) == sentence
    assert case.startswith("a document type") or not list(target.iterdir())
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bad.fmu", "unpacked"]
    with pytest.raises(FmuRefused):
        run_fmu(path)


def test_refuses_more_than_the_total(tmp_path: Path) -> None:
    path = tmp_path / "large.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        plain(archive)
        archive.writestr("resources/table", bytes(3000))
    with pytest.raises(FmuRefused) as refusal:
        unpack(path, tmp_path, Limits(total=2000))
    assert str(refusal.value) == "large.fmu is refused: it would unpack to 2.951 kB, more than 1.953 kB."


def test_refuses_an_encrypted_member(tmp_path: Path) -> None:
    path = tmp_path / "secret.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        plain(archive)
    content = bytearray(path.read_bytes())
    directory = content.index(b"PK\x01\x02")
    content[directory + 8] |= 1  # the flag bits of the only member
    path.write_bytes(content)
    with pytest.raises(FmuRefused, match=r"^secret.fmu is refused: 'modelDescription.xml' is encrypted\.$"):
        unpack(path, tmp_path)


@pytest.mark.parametrize("keep", [0, 10, 100, -30])
def test_refuses_what_is_no_archive(keep: int, reference_fmus: dict[tuple[str, str], Path], tmp_path: Path) -> None:
    path = tmp_path / "half.fmu"
    path.write_bytes(reference_fmus["two_mass", "2.0"].read_bytes()[:keep])
    with pytest.raises(FmuRefused) as refusal:
        run_fmu(path)
    assert str(refusal.value) == "half.fmu is not an FMU: it is not a valid zip archive.\nFile is not a zip file."


def test_refuses_damaged_content(reference_fmus: dict[tuple[str, str], Path], tmp_path: Path) -> None:
    path = tmp_path / "damaged.fmu"
    content = bytearray(reference_fmus["two_mass", "2.0"].read_bytes())
    content[200:260] = bytes(60)
    path.write_bytes(content)
    target = tmp_path / "unpacked"
    target.mkdir()
    with pytest.raises(FmuRefused, match=r"^damaged\.fmu is not an FMU: it is not a valid zip archive"):
        unpack(path, target)
