"""Binaries for Windows and macOS: what they export, read from the files themselves."""

import re
import struct
from pathlib import Path

import pytest

from modelica_like import build as build_model
from modelica_like.fmi.build import build
from modelica_like.fmi.interface import interface
from modelica_like.fmi.model_file import generate

EXAMPLES = Path(__file__).parents[2] / "examples"
X86_64, ARM64 = 0x8664, 0x0100000C
EXTERNAL, SECTION, DEBUGGING = 0x01, 0x0E, 0xE0
SYMBOLS = 2


def text_at(data: bytes, offset: int) -> str:
    return data[offset : data.index(b"\0", offset)].decode()


def windows_exports(data: bytes) -> tuple[int, set[str]]:
    """Machine and exported names of a DLL (PE32+)."""
    head = struct.unpack_from("<I", data, 0x3C)[0]
    assert data[head : head + 4] == b"PE\0\0"
    machine, count = struct.unpack_from("<HH", data, head + 4)
    optional = head + 24
    size = struct.unpack_from("<H", data, head + 20)[0]
    sections = [struct.unpack_from("<8x4I", data, optional + size + 40 * k) for k in range(count)]

    def place(address: int) -> int:
        """Where in the file an address of the loaded library stands."""
        return next(raw + address - begin for _, begin, length, raw in sections if begin <= address < begin + length)

    exports = place(struct.unpack_from("<I", data, optional + 112)[0])
    names, table = struct.unpack_from("<I4xI", data, exports + 24)[0], struct.unpack_from("<I", data, exports + 32)[0]
    addresses = struct.unpack_from(f"<{names}I", data, place(table))
    return machine, {text_at(data, place(address)) for address in addresses}


def macos_exports(data: bytes) -> tuple[int, set[str]]:
    """Machine and exported names of a dynamic library (Mach-O, 64 bit)."""
    magic, machine, _, _, commands = struct.unpack_from("<5I", data)
    assert magic == 0xFEEDFACF
    position, found = 32, set[str]()
    for _ in range(commands):
        kind, length = struct.unpack_from("<II", data, position)
        if kind == SYMBOLS:
            first, count, strings = struct.unpack_from("<III", data, position + 8)
            for k in range(count):
                name, flags = struct.unpack_from("<IB", data, first + 16 * k)
                if flags & EXTERNAL and not flags & DEBUGGING and flags & SECTION == SECTION:
                    found.add(text_at(data, strings + name).removeprefix("_"))
        position += length
    return machine, found - {"_mh_dylib_header", "__dso_handle"}  # the linker's own marks, in every library


@pytest.mark.slow
@pytest.mark.parametrize(
    ("platform", "read", "machine"),
    [("x86_64-windows", windows_exports, X86_64), ("aarch64-darwin", macos_exports, ARM64)],
)
def test_only_declared_functions_are_exported(platform, read, machine, tmp_path):
    model = build_model(EXAMPLES / "fan.toml")
    sources = generate(model, interface(model), "3.0", token="{t}")
    library = build(sources, platform, tmp_path)
    declared = set(re.findall(r"FMI3_Export \w+\s+(fmi\w+);", sources["fmi3Functions.h"]))
    declared |= set(re.findall(r"EXPORTED \w+ (modelica_like_\w+)\(", sources["modelica_like.h"]))
    assert read(library.read_bytes()) == (machine, declared)
