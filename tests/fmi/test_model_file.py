"""The file of a model: the same sections in Python and C, and nothing but a sentence where it is damaged."""

import ctypes
import re
import shutil
import struct
import subprocess
import zlib
from pathlib import Path

import pytest

from modelica_like import build
from modelica_like.fmi.interface import interface
from modelica_like.fmi.model_file import SECTIONS, model_file
from modelica_like.fmi.sources import RUNTIME, runtime_sources
from modelica_like.fmi.tables import make_tables

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "examples"
SANITIZE = ["-g", "-O1", "-std=c99", "-Wall", "-Wextra", "-Werror", "-Wvla", "-fsanitize=address,undefined"]


def written(netlist: str) -> bytes:
    model = build(EXAMPLES / netlist)
    return model_file(make_tables(model), interface(model).variables, "{t}", 1e-7)


def test_both_sides_know_the_same_sections():
    text = runtime_sources(())["model.c"]
    table = re.search(r"\} tables\[\] = \{(.*?)\};", text, re.DOTALL)
    assert table is not None
    parts = {
        kind: re.search(rf"#define {kind}\((\w+)\)(.*?)\n\n?(?=#|static)", text, re.DOTALL) for kind in ("QR", "TAPE")
    }
    found: list[str] = []
    for kind, name in re.findall(r"(TABLE|QR|TAPE)\(([\w.]+)", table[1]):
        part = parts.get(kind)
        if part is None:
            found.append(name)
        else:
            found += [re.sub(rf"\b{part[1]}\b", name, one) for one in re.findall(r"TABLE\(([\w.]+),", part[2])]
    assert found == list(SECTIONS)


@pytest.fixture(scope="module")
def reader(tmp_path_factory) -> ctypes.CDLL:
    folder = tmp_path_factory.mktemp("reader")
    return ctypes.CDLL(str(compiled(folder, ["-shared", "-fPIC", "-O1", "-std=c99"], folder / "reader.so")))


def compiled(folder: Path, options: list[str], target: Path, *more: Path) -> Path:
    for name, text in runtime_sources(("2.0",)).items():
        (folder / name).write_text(text)
    compiler = shutil.which("gcc") or shutil.which("clang")
    assert compiler, "this test needs gcc or clang"
    command = [compiler, *options, "-I.", "-o", str(target), *map(str, more)]
    subprocess.run([*command, "model_data.c", *RUNTIME, "-lm"], cwd=folder, check=True)
    return target


def told(reader: ctypes.CDLL, data: bytes) -> str:
    """What is said about a file; nothing if it is accepted."""
    libc = ctypes.CDLL(None)
    message = ctypes.create_string_buffer(512)
    reader.model_read.restype = ctypes.c_void_p
    words = (ctypes.c_uint64 * (len(data) // 8 + 1)).from_buffer_copy(data + bytes(8 - len(data) % 8))
    model = reader.model_read(words, ctypes.c_size_t(len(data)), libc.calloc, libc.free, message)
    if model:
        reader.model_free(ctypes.c_void_p(model))
    assert bool(model) != bool(message.value)
    return message.value.decode()


def checked(data: bytes) -> bytes:
    """The same with a checksum and a size that are right."""
    return data[:16] + struct.pack("<II", zlib.crc32(data[24:]), len(data)) + data[24:]


AGAIN = "Export the model again."


def test_damage_is_told(reader):
    data = written("two_mass.toml")
    assert told(reader, data) == ""
    assert told(reader, b"") == f"The model file is damaged (it is truncated). {AGAIN}"
    assert told(reader, data[:-8]) == f"The model file is damaged (it is truncated). {AGAIN}"
    assert told(reader, b"PK" + data[2:]) == f"The model file is damaged (it is another kind of file). {AGAIN}"
    assert told(reader, data[:-1] + b"\x01") == f"The model file is damaged (its checksum is wrong). {AGAIN}"
    count = len(SECTIONS)
    newer = data[:8] + struct.pack("<i", 99) + data[12:]
    assert told(reader, newer) == (
        f"The model file has format 99 with {count} tables, but this library reads format 11 with {count}. {AGAIN}"
    )
    number = list(SECTIONS).index("variables")
    offset = struct.unpack_from("<4i", data, 24 + 16 * number)[2]
    wrong = bytearray(data)
    struct.pack_into("<i", wrong, offset + 8, 99)
    assert told(reader, checked(bytes(wrong))) == f"The model file is damaged (variables.kind). {AGAIN}"


DRIVES = [
    "msl/rotational/CoupledClutches.toml",
    "lepelletier.toml",
    "dc_bench.toml",
    "msl/rotational/OneWayClutch.toml",
    "elements/drill_string.toml",
]


@pytest.fixture(scope="module")
def fuzzer(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("fuzz")
    return compiled(folder, [*SANITIZE, "-fno-sanitize-recover=undefined"], folder / "fuzz", HERE / "fuzz.c")


@pytest.mark.parametrize("netlist", DRIVES)
@pytest.mark.slow
@pytest.mark.parametrize("count", [100, 5000])
def test_damaged_files_with_a_right_checksum_do_no_harm(fuzzer, netlist, count, tmp_path):
    (tmp_path / "model.bin").write_bytes(written(netlist))
    command = [str(fuzzer), str(tmp_path / "model.bin"), str(count), "1"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=1200)
    assert result.returncode == 0, f"{result.stdout}\n{result.stderr}"
    tried, refused = map(int, result.stdout.split())
    assert tried == count
    assert 0.2 * count < refused < 0.9 * count
