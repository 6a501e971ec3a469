"""Compile the C sources of an FMU with this machine's compiler, or with zig for any platform."""

from __future__ import annotations

import os
import platform as machine
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from modelica_like.errors import ExportError, MissingExtra, unknown_name
from modelica_like.writing import replacing


@dataclass(frozen=True)
class Platform:
    """A platform that FMUs have binaries for.

    Attributes:
        name: FMI 3.0's name, the folder of its binaries there.
        fmi2: the folder of its binaries in FMI 2.0.
        target: name for zig; glibc 2.17 is older than any Linux in use, macOS 11 the first on arm64.
        suffix: of shared libraries.
    """

    name: str
    fmi2: str
    target: str
    suffix: str


PLATFORMS = {
    platform.name: platform
    for platform in (
        Platform("x86_64-linux", "linux64", "x86_64-linux-gnu.2.17", ".so"),
        Platform("aarch64-linux", "aarch64-linux", "aarch64-linux-gnu.2.17", ".so"),
        Platform("x86_64-windows", "win64", "x86_64-windows-gnu", ".dll"),
        Platform("aarch64-windows", "aarch64-windows", "aarch64-windows-gnu", ".dll"),
        Platform("x86_64-darwin", "darwin64", "x86_64-macos.11.0", ".dylib"),
        Platform("aarch64-darwin", "aarch64-darwin", "aarch64-macos.11.0", ".dylib"),
    )
}
"""All platforms by FMI 3.0's names."""
BROWSER = Platform("wasm32", "", "wasm32-wasi", ".wasm")
"""WebAssembly, for pages; FMUs have no binaries for it."""
RUNTIMES = {**PLATFORMS, BROWSER.name: BROWSER}
"""What the run-time is compiled for."""

# Runs take a tenth less time than with -O1; compiling takes 3.6 s of CPU instead of 2.0 s. Changed flags make zig
# compile its C runtime again, which takes minutes for Windows. Unrolled loops make a library of zig a fifth larger, and
# no run faster (gcc unrolls none at -O2).
_FLAGS = (
    "-std=c99", "-O2", "-fno-unroll-loops", "-ffp-contract=off", "-fvisibility=hidden", "-s", "-Wall", "-Wextra",
    "-DOLD_GLIBC",
)  # fmt: skip
_LINKING = {
    # The caller's buffers are in the module's memory; it imports nothing.
    ".wasm": ("-mexec-model=reactor", "-Wl,--export-dynamic,--export=realloc"),
    ".dll": ("-shared",),  # Windows has the mathematical functions in its C runtime
}
# C throws nothing, so tables for unwinding the stack would only add a tenth to the size of each FMU.
_SHARED = ("-shared", "-fPIC", "-fno-asynchronous-unwind-tables", "-fno-unwind-tables")
_COMPILERS = ("cc", "gcc", "clang")
_SYSTEMS = {"Linux": "linux", "Windows": "windows", "Darwin": "darwin"}
_MACHINES = {"x86_64": "x86_64", "AMD64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64", "ARM64": "aarch64"}


def flags(platform: str) -> tuple[str, ...]:
    """Return the compiler's flags for a platform, a key of `RUNTIMES`."""
    return (*_FLAGS, *_LINKING.get(RUNTIMES[platform].suffix, _SHARED))


def native_platform() -> str:
    """Return the name of this machine's platform.

    Raises:
        ExportError: FMUs have no binaries for it.
    """
    name = f"{_MACHINES.get(machine.machine(), machine.machine())}-{_SYSTEMS.get(machine.system(), machine.system())}"
    if name not in PLATFORMS:
        raise ExportError(
            f"There are no FMU binaries for this machine ({name}).", advice=f"Choose from {', '.join(PLATFORMS)}."
        )
    return name


def chosen_platforms(platforms: Sequence[str] | str, there: Iterable[str] = PLATFORMS) -> tuple[str, ...]:
    """Return the requested platforms among the available ones: names, `native` or `all`.

    Raises:
        UnknownName: there is no such platform.
        ExportError: FMUs have no binaries for this machine.
    """
    result: list[str] = []
    for platform in (platforms,) if isinstance(platforms, str) else platforms:
        _check_known(platform, ["native", "all", *there])
        result += there if platform == "all" else [native_platform() if platform == "native" else platform]
    return tuple(dict.fromkeys(result))


def _check_known(platform: str, names: Collection[str]) -> None:
    if platform not in names:
        raise unknown_name(
            f"There is no platform '{platform}'", platform, names, advice=f"There are {', '.join(names)}."
        )


def build(sources: Mapping[str, str], platform: str, output_dir: Path, identifier: str = "model") -> Path:
    """Compile sources to a shared library, which is returned and exports the FMI functions only.

    `$CC`, cc, gcc or clang compiles for this machine, or zig if none of these is found; zig compiles for all other
    platforms.

    Args:
        sources: file name to text, as `generate` returns them.
        platform: a key of `RUNTIMES`.
        output_dir: folder of the library.
        identifier: name of the library without suffix.

    Raises:
        UnknownName: there is no such platform.
        MissingExtra: zig is needed and not installed.
        ExportError: there is no compiler, or the compiler failed.
    """
    _check_known(platform, RUNTIMES)
    chosen = RUNTIMES[platform]
    library = Path(output_dir) / f"{identifier}{chosen.suffix}"
    command = compiler_command(platform)
    with tempfile.TemporaryDirectory(prefix="modelica_like_") as folder:
        for name, content in sources.items():
            (Path(folder) / name).write_text(content, encoding="utf-8")
        wholes = _wholes(name for name in sources if name.endswith(".c"))
        for name, content in wholes.items():
            (Path(folder) / name).write_text(content, encoding="utf-8")
        libraries = [] if chosen.suffix in _LINKING else ["-lm"]
        built = Path(folder) / f"{identifier}{chosen.suffix}"
        _run([*command, *flags(platform), "-o", str(built), *wholes, *libraries], folder, platform)
        with replacing(library) as draft:
            shutil.copyfile(built, draft)
    return library


def _wholes(names: Iterable[str]) -> dict[str, str]:
    """Join C files, so that common headers are read once; FMI 2, FMI 3 and compiled equations stay separate."""
    wholes: dict[str, str] = {}
    for name in names:
        group = name[:4] if name.startswith(("fmi2", "fmi3", "code_")) else ""
        wholes[f"whole{group}.c"] = wholes.get(f"whole{group}.c", "") + f'#include "{name}"\n'
    return wholes


def compiler_command(platform: str) -> list[str]:
    """Return the command that compiles for a platform.

    Raises:
        MissingExtra, ExportError: there is none.
    """
    native = platform == native_platform()
    if native:
        given = shlex.split(os.environ.get("CC", ""))
        if given and shutil.which(given[0]) is None:
            raise ExportError(f"The compiler '{given[0]}' was not found.", why="The environment variable CC names it.")
        compiler = next((path for name in _COMPILERS if (path := shutil.which(name))), None)
        if given or compiler:
            return given or [str(compiler)]
    if find_spec("ziglang") is not None:
        return [sys.executable, "-m", "ziglang", "cc", "-target", RUNTIMES[platform].target]
    if native:
        raise ExportError(
            "There is no C compiler.", advice="Install cc, gcc or clang, or zig by `pip install modelica-like[cross]`."
        )
    raise MissingExtra(f"Binaries for {platform} need zig.", advice="Install it by `pip install modelica-like[cross]`.")


def _run(command: list[str], folder: str, platform: str) -> None:
    # A library compiled on a Mac also runs on older ones, as its wheel says.
    environment = {**os.environ, "MACOSX_DEPLOYMENT_TARGET": "11.0"}
    result = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        lines = [line for line in result.stderr.splitlines() if "error" in line] or result.stderr.splitlines()
        raise ExportError(
            f"The C compiler failed for {platform}: {(lines or ['it said nothing'])[0].strip()}",
            why=f"The command was {shlex.join(command)}.",
        )
