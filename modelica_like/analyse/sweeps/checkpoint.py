"""A file in which a sweep stores finished runs, to resume where it stopped."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from modelica_like.analyse.sweeps.plan import Plan
from modelica_like.analyse.sweeps.workers import Chunk, Done, Job
from modelica_like.errors import CheckpointMismatch, extra_module
from modelica_like.writing import write_text


class Checkpoint:
    """Results of a sweep as arrays of a Zarr folder, one chunk of the arrays for each chunk of runs.

    A chunk counts as done only when all of it is written, so a sweep that is stopped while writing repeats the
    chunk.

    Args:
        path: the folder; created if it does not exist.
        job: the common part of all runs.
        plan: the points.
        size: runs in a chunk.

    Raises:
        CheckpointMismatch: the folder belongs to another sweep.
        MissingExtra: zarr is not installed.
    """

    def __init__(self, path: str | Path, job: Job, plan: Plan, size: int) -> None:
        zarr = extra_module("zarr", "analyse")
        self.path = Path(path)
        settings = sorted(str(item) for item in job.settings.items() if item[0] != "compiled")  # changes no result
        text = json.dumps([job.names, job.outputs, settings, size])
        key = hashlib.sha256(
            job.identity.encode() + text.encode() + np.ascontiguousarray(plan.points).tobytes()
        ).hexdigest()
        if (self.path / "zarr.json").exists():
            self._group = zarr.open_group(self.path, mode="r+")
            if self._group.attrs.get("sweep") != key:
                raise CheckpointMismatch(
                    f"{self.path.name} is from another sweep: the model, its values, the points or the outputs differ.",
                    advice="Name another file, or delete this one to start again.",
                )
        elif self.path.exists() and (not self.path.is_dir() or any(self.path.iterdir())):
            raise CheckpointMismatch(f"{self.path.name} exists and is not the checkpoint of a sweep.")
        else:
            # Complete or not at all, like files.
            with TemporaryDirectory(prefix=".", dir=_made(self.path.absolute().parent)) as draft:
                _begin(zarr.open_group(f"{draft}/sweep", mode="w"), len(plan), len(job.outputs), size, key)
                if self.path.exists():
                    self.path.rmdir()
                Path(draft, "sweep").rename(self.path)
            self._group = zarr.open_group(self.path, mode="r+")
        self._size = size

    def left(self, chunks: list[Chunk]) -> list[Chunk]:
        """Return the unfinished chunks."""
        done = self._group["done"][:]
        return [chunk for chunk in chunks if not done[chunk[0] // self._size]]

    def keep(self, done: Done) -> None:
        """Write the results of a chunk."""
        self._group["values"][done.first : done.first + len(done.values)] = done.values
        number = done.first // self._size
        record = {name: value for name, value in vars(done).items() if name not in ("first", "values")}
        write_text(self.path / f"told-{number}.json", json.dumps(record))
        self._group["done"][number] = True

    def results(self) -> Done:
        """Return all finished results."""
        results = Done(0, self._group["values"][:])
        for number in np.flatnonzero(self._group["done"][:]):
            record = json.loads((self.path / f"told-{number}.json").read_text(encoding="utf-8"))
            results.add(Done(0, None, **record))
        return results


def _made(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _begin(group: Any, runs: int, outputs: int, size: int, key: str) -> None:
    group.create_array("values", shape=(runs, outputs), chunks=(size, outputs), dtype="f8", fill_value=np.nan)
    group.create_array("done", shape=(-(-runs // size),), chunks=(1,), dtype="bool", fill_value=False)
    group.attrs["sweep"] = key
