"""Files are whole or not touched: every writer runs out of space for real, by a limit on the size of files."""

import contextlib
import json
import os
import re
import stat
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest
import xarray

from modelica_like import Solution, build, load, simulate
from modelica_like.analyse.sweeps.sweep import sweep
from modelica_like.fmi.build import build as compile_library
from modelica_like.fmi.build import native_platform
from modelica_like.fmi.cosimulation.files import write_system
from modelica_like.fmi.cosimulation.ssp import write_ssp
from modelica_like.fmi.cosimulation.ssp_document import ssd
from modelica_like.fmi.cosimulation.system import System, Unit
from modelica_like.fmi.export import export_fmu
from modelica_like.netlist import save
from modelica_like.show.plot import save_plot
from modelica_like.show.report.component_pages.library import write_component_pages
from modelica_like.show.report.files import write_dataset, write_solution
from modelica_like.writing import check_writable, replacing

resource = pytest.importorskip("resource", reason="there are limits on POSIX only")

EXAMPLES = Path(__file__).parents[2] / "examples"
DRIVE = EXAMPLES / "two_mass.toml"
LIMIT = 300


@contextlib.contextmanager
def full_disk() -> Iterator[None]:
    """No file becomes longer than some bytes; Python ignores the signal, so that writing fails as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.fixture(scope="module")
def run() -> Solution:
    return simulate(DRIVE, 0.01, points=20)


@pytest.fixture(scope="module")
def swept():
    return sweep(DRIVE, {"J1.J": np.linspace(0.01, 0.02, 40)}, ["J2.w"], until=0.001)


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("fmu") / "drive.fmu"
    export_fmu(DRIVE, path, platforms=(), check=False)
    return path


def system(fmu: Path) -> System:
    return System("many", tuple(Unit(f"drive_number_{k}", fmu, {}) for k in range(20)), (), ())


def export(path: Path) -> None:
    """The C sources go to the folder for temporary files: space ends behind them, when the checks are done."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    free = (resource.RLIM_INFINITY, limits[1])

    def tell(what: str) -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits if what == "checking" else free)

    export_fmu(DRIVE, path, platforms=(), check=False, report=tell)


def write_systems(path: Path, fmu: Path) -> None:
    """The description of an FMU is read from temporary files: there is space for these."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, limits[1]))
    with pytest.MonkeyPatch.context() as patch:

        def described(*arguments: object) -> bytes:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
            return ssd(*arguments)

        patch.setattr("modelica_like.fmi.cosimulation.ssp.ssd", described)
        write_ssp(system(fmu), path)


C_SOURCE = {"a.c": "int a;", "b.c": "int b;"}
WRITERS: dict[str, Callable[[Path, Solution, object, Path], object]] = {
    "run.csv": lambda path, run, swept, fmu: write_solution(run, path),
    "run.nc": lambda path, run, swept, fmu: write_solution(run, path),
    "sweep.csv": lambda path, run, swept, fmu: write_dataset(swept, path),
    "sweep.nc": lambda path, run, swept, fmu: write_dataset(swept, path),
    "run.png": lambda path, run, swept, fmu: save_plot(run.plot("J2.w"), path),
    "run.jpg": lambda path, run, swept, fmu: save_plot(run.plot("J2.w"), path),
    "run.svg": lambda path, run, swept, fmu: save_plot(run.plot("J2.w"), path),
    "run.pdf": lambda path, run, swept, fmu: save_plot(run.energy().sankey("two masses"), path),
    "drive.toml": lambda path, run, swept, fmu: save(load(EXAMPLES / "machine_tool_startup.toml"), path),
    "system.toml": lambda path, run, swept, fmu: write_system(system(fmu), path),
    "drive.fmu": lambda path, run, swept, fmu: export(path),
    "system.ssp": lambda path, run, swept, fmu: write_systems(path, fmu),
    "inertias/Inertia.md": lambda path, run, swept, fmu: write_component_pages(path.parents[1], types=["Inertia"]),
}


@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_leaves_the_old_file_and_is_told_by_its_name(
    name: str, run: Solution, swept: object, fmu: Path, tmp_path: Path
) -> None:
    path = tmp_path / name
    WRITERS[name](path, run, swept, fmu)
    length = path.stat().st_size
    assert length > LIMIT
    written = sorted(path.parent.iterdir())
    path.write_text("old")
    with pytest.raises(OSError, match="File too large") as caught, full_disk():
        WRITERS[name](path, run, swept, fmu)
    assert caught.value.filename == str(path)
    assert path.read_text() == "old"
    assert sorted(path.parent.iterdir()) == written
    WRITERS[name](path, run, swept, fmu)
    assert path.stat().st_size > LIMIT


def test_a_library_is_whole_or_not_there(tmp_path: Path) -> None:
    """The compiler is told by its own words; the library that was there stays."""
    library = compile_library(C_SOURCE, native_platform(), tmp_path)
    before = library.read_bytes()
    with pytest.raises(Exception, match=r"failed|File too large"), full_disk():
        compile_library(C_SOURCE, native_platform(), tmp_path)
    assert library.read_bytes() == before


def test_a_checkpoint_goes_on_after_a_full_disk(tmp_path: Path) -> None:
    model = build(DRIVE)
    over = {"J1.J": np.linspace(0.01, 0.02, 200)}
    path, done = tmp_path / "sweep.zarr", []
    with contextlib.ExitStack() as stack:

        def full(count: int, total: int) -> None:
            done.append(count)
            stack.enter_context(full_disk())

        with pytest.raises(OSError, match="File too large"):
            sweep(model, over, ["J2.w"], until=0.001, chunk=100, checkpoint=path, progress=full, processes=1)
    assert done == [100]
    done.clear()
    found = sweep(
        model, over, ["J2.w"], until=0.001, chunk=100, checkpoint=path, processes=1,
        progress=lambda count, total: done.append(count),
    )  # fmt: skip
    assert done == [200]
    assert np.all(np.isfinite(found["J2.w"]))


def test_a_checkpoint_is_begun_whole_or_not_at_all(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="File too large"), full_disk():
        sweep(DRIVE, {"J1.J": [0.01]}, ["J2.w"], until=0.001, checkpoint=tmp_path / "sweep.zarr")
    assert not list(tmp_path.iterdir())


WRITES = re.compile(r"\.write_(text|bytes)\(|\.savefig\((?!content|buffer)|shutil\.copy\w*\((?!built, draft)")


def test_nothing_else_writes_files() -> None:
    """But for folders that are temporary, and the module that writes."""
    root = EXAMPLES.parent / "modelica_like"
    found = [
        f"{path.name}: {line.strip()}"
        for path in root.rglob("*.py")
        if path.name != "writing.py"
        for line in path.read_text().splitlines()
        if WRITES.search(line) and "folder" not in line
    ]
    assert found == []


KILLED = """
import os, sys
from modelica_like.writing import replacing
with replacing(sys.argv[1]) as draft:
    draft.write_text("half")
    os.kill(os.getpid(), 9)
"""


def test_a_kill_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("old")
    assert subprocess.run([sys.executable, "-c", KILLED, str(path)], check=False).returncode == -9
    assert path.read_text() == "old"


def test_links_permissions_and_pipes_stay(tmp_path: Path) -> None:
    path, link, pipe = tmp_path / "a.txt", tmp_path / "link.txt", tmp_path / "pipe"
    path.write_text("old")
    path.chmod(0o640)
    link.symlink_to(path)
    with replacing(link) as draft:
        draft.write_text("new")
    assert link.is_symlink()
    assert path.read_text() == "new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    os.mkfifo(pipe)
    with subprocess.Popen(["cat", str(pipe)], stdout=subprocess.PIPE) as reader:
        with replacing(pipe) as draft:
            draft.write_text("through")
        assert reader.communicate()[0] == b"through"
    assert stat.S_ISFIFO(pipe.stat().st_mode)


def test_an_interrupt_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt), replacing(path) as draft:  # noqa: PT012
        draft.write_text("half")
        raise KeyboardInterrupt
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_what_cannot_be_written_is_known_before(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for path, named, kind in (
        (tmp_path, tmp_path, IsADirectoryError),
        (tmp_path / "file" / "a.csv", tmp_path / "file", NotADirectoryError),
        (Path("/proc/a.csv"), Path("/proc"), FileNotFoundError),
    ):
        with pytest.raises(kind) as caught:
            check_writable(path)
        assert caught.value.filename == str(named)
    check_writable(tmp_path / "new" / "folder" / "a.csv")
    assert [one.name for one in tmp_path.iterdir()] == ["file"]


def test_the_command_names_the_file(tmp_path: Path) -> None:
    code = (
        "import resource, sys; from modelica_like.cli import main; "
        "resource.setrlimit(resource.RLIMIT_FSIZE, (300, 300)); main()"
    )
    (tmp_path / "run.csv").write_text("old")
    words = [sys.executable, "-c", code, "simulate", str(DRIVE), "--until", "0.01", "--csv", "run.csv"]
    result = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=60)
    assert (result.returncode, result.stderr) == (2, "run.csv: File too large.\n")
    assert "The energy balance closes to" in result.stdout
    assert (tmp_path / "run.csv").read_text() == "old"


def test_tables_by_their_ending(run: Solution, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_solution(run, tmp_path / "run.nc")
    with xarray.open_dataset(tmp_path / "run.nc") as read:
        np.testing.assert_array_equal(read["J2.w"], run["J2.w"])
        assert read["J2.w"].attrs["units"] == "rad/s"
    write_solution(run, tmp_path / "run.csv")
    write_solution(run, Path("-"))
    assert capsys.readouterr().out == (tmp_path / "run.csv").read_bytes().decode()
    write_solution(run, tmp_path / "run.parquet")
    np.testing.assert_array_equal(parquet.read_table(tmp_path / "run.parquet")["J2.w"], run["J2.w"])


def test_json_of_failures_is_whole(tmp_path: Path) -> None:
    """A failed run's sentence that is longer than the space: the chunk is not done."""
    over = {"J1.J": [0.01, -1.0]}
    path = tmp_path / "sweep.zarr"
    sweep(DRIVE, over, ["J2.w"], until=0.001, checkpoint=path)
    told = json.loads((path / "told-0.json").read_text())["failures"]
    assert told == {"1": "J1.J = -1.0 is out of range: it must be at least 0 kg.m2."}
