"""Compilers: this machine's, zig for other platforms, and what is said where there is none."""

import re
import shutil
import subprocess

import pytest

import modelica_like.fmi.build as module
from modelica_like import build as build_model
from modelica_like.errors import ExportError, MissingExtra, ModelicaLikeError, UnknownName
from modelica_like.fmi.build import PLATFORMS, build, compiler_command, native_platform
from modelica_like.fmi.interface import interface
from modelica_like.fmi.model_file import generate
from modelica_like.fmi.sources import source_files

TINY = {"model.c": "double twice(double x) { return 2 * x; }\n"}
OTHER = next(name for name in PLATFORMS if name != native_platform())


def told(error: type[ModelicaLikeError], action) -> str:
    with pytest.raises(error) as caught:
        action()
    return str(caught.value)


def nothing_installed(monkeypatch, *present):
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(module.shutil, "which", lambda name: f"/usr/bin/{name}" if name in present else None)
    monkeypatch.setattr(module, "find_spec", lambda name: object() if name in present else None)


def test_the_order_of_compilers(monkeypatch):
    nothing_installed(monkeypatch, "cc", "gcc", "ziglang")
    assert compiler_command(native_platform()) == ["/usr/bin/cc"]
    nothing_installed(monkeypatch, "clang", "ziglang")
    assert compiler_command(native_platform()) == ["/usr/bin/clang"]
    monkeypatch.setenv("CC", "clang -m64")
    assert compiler_command(native_platform()) == ["clang", "-m64"]
    nothing_installed(monkeypatch, "ziglang")
    assert "ziglang" in compiler_command(native_platform())
    assert PLATFORMS[OTHER].target in compiler_command(OTHER)


def test_no_compiler_is_a_sentence(monkeypatch, tmp_path):
    nothing_installed(monkeypatch)
    assert told(ExportError, lambda: build(TINY, native_platform(), tmp_path)) == (
        "There is no C compiler.\nInstall cc, gcc or clang, or zig by `pip install modelica-like[cross]`."
    )
    assert told(MissingExtra, lambda: build(TINY, "aarch64-darwin", tmp_path)) == (
        "Binaries for aarch64-darwin need zig.\nInstall it by `pip install modelica-like[cross]`."
    )


def test_a_wrong_compiler_is_told(monkeypatch, tmp_path):
    monkeypatch.setenv("CC", "/nowhere/cc -O3")
    assert told(ExportError, lambda: build(TINY, native_platform(), tmp_path)) == (
        "The compiler '/nowhere/cc' was not found.\nThe environment variable CC names it."
    )


def test_an_unknown_platform_is_told(tmp_path):
    assert told(UnknownName, lambda: build(TINY, "x86_64-linus", tmp_path)) == (
        "There is no platform 'x86_64-linus'; did you mean 'x86_64-linux'?\n"
        "There are x86_64-linux, aarch64-linux, x86_64-windows, aarch64-windows, x86_64-darwin, aarch64-darwin, "
        "wasm32."
    )


def test_an_unknown_machine_is_told(monkeypatch):
    monkeypatch.setattr(module.machine, "machine", lambda: "riscv64")
    monkeypatch.setattr(module.machine, "system", lambda: "Linux")
    assert told(ExportError, native_platform) == (
        "There are no FMU binaries for this machine (riscv64-linux).\n"
        "Choose from x86_64-linux, aarch64-linux, x86_64-windows, aarch64-windows, x86_64-darwin, aarch64-darwin."
    )


def test_what_the_compiler_says_is_told(tmp_path):
    text = told(ExportError, lambda: build({"model.c": "#error no model\n"}, native_platform(), tmp_path))
    first, why = text.splitlines()
    assert re.fullmatch(rf"The C compiler failed for {native_platform()}: model\.c:1:2: error: .*no model", first)
    assert why.startswith("The command was ")


OWN = {"modelica_like_gradient_start", "modelica_like_gradient"}


def exported_names(library):
    tool = shutil.which("nm")
    assert tool
    lines = subprocess.run([tool, "-D", "--defined-only", library], capture_output=True, text=True, check=True).stdout
    return {line.split()[-1] for line in lines.splitlines()}


def newest_glibc(library):
    return max(tuple(map(int, m.split(b"."))) for m in re.findall(rb"GLIBC_(\d+\.\d+)", library.read_bytes()))


@pytest.mark.slow
@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_the_compiler_of_this_machine_does_so_too(tmp_path, version, example):
    """Also where its own glibc has newer versions of exp, log, pow and hypot."""
    model = build_model(example)
    sources = generate(model, interface(model), version, token="{t}")
    library = build(sources, native_platform(), tmp_path, "drive")
    header = sources[f"fmi{version[0]}Functions.h"]
    assert exported_names(library) == OWN | set(re.findall(rf"FMI{version[0]}_Export \w+\s+(fmi\w+);", header))
    assert newest_glibc(library) <= (2, 17)


@pytest.mark.slow
@pytest.mark.parametrize(("version", "count"), [("2.0", 44), ("3.0", 75)])
def test_zig_exports_the_fmi_functions_only_and_needs_an_old_glibc(monkeypatch, tmp_path, version, count, example):
    model = build_model(example)
    sources = generate(model, interface(model), version, token="{t}")
    assert set(source_files(version)) <= set(sources)
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(module.shutil, "which", lambda _: None)
    library = build(sources, "x86_64-linux", tmp_path, "drive")
    monkeypatch.undo()
    names = exported_names(library)
    header = sources[f"fmi{version[0]}Functions.h"]
    declared = set(re.findall(rf"FMI{version[0]}_Export \w+\s+(fmi\w+);", header))
    assert names == declared | OWN
    assert len(declared) == count
    assert newest_glibc(library) <= (2, 17)
    # Its compiler would unroll the solver of dense systems wherever it is used: 500 kB, and no run is faster.
    assert library.stat().st_size < 430_000


@pytest.mark.slow
def test_another_platform(tmp_path, example):
    model = build_model(example)
    library = build(generate(model, interface(model), token="{t}"), "aarch64-linux", tmp_path)
    head = library.read_bytes()[:20]
    assert head[:4] == b"\x7fELF"
    assert int.from_bytes(head[18:20], "little") == 183  # AArch64
