"""Random drives of the whole library: both solvers and FMUs of both kinds agree, or the run is refused in words.

`LIBRARY_DRIVES=500 pytest tests/properties/test_library_drives.py -m slow` looks at more of them.
"""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from library_drives import drive, kinds, stored

import components
from modelica_like import Assembly, Component, simulate
from modelica_like.errors import ModelicaLikeError
from modelica_like.fmi.export import export_fmu
from modelica_like.fmi.run import run_fmu
from modelica_like.language.inside import declarations
from modelica_like.runs.trajectories import Trajectories

RTOL = 1e-8
SAME = 1e-5
"""Largest difference, relative to the largest value of a kind, of runs that agree at once."""
CONVERGED = 5e-6
"""The same of runs at a hundredth of the tolerance: impacts and friction repeat errors."""
COUNT = int(os.environ.get("LIBRARY_DRIVES", "30"))


def ends(made: Assembly, run: Trajectories) -> np.ndarray:
    """Values at the end over the largest ones of their kind."""
    names = list(stored(made))
    largest = {name.rpartition(".")[2]: 1e-3 for name in names}
    for name in names:
        kind = name.rpartition(".")[2]
        largest[kind] = max(largest[kind], float(np.max(np.abs(run[name]))))
    return np.array([run[name][-1] / largest[name.rpartition(".")[2]] for name in names])


def results(seed: int, folder: Path | None, rtol: float = RTOL) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Return the ends of a drive by each engine, and the sentences of those that refuse it."""
    made = drive(seed)
    values, refused = dict[str, np.ndarray](), dict[str, str]()

    def attempt(name: str, run: Callable[[], Trajectories]) -> None:
        try:
            values[name] = ends(made, run())
        except ModelicaLikeError as error:
            refused[name] = str(error)

    attempt("idas", lambda: simulate(made, rtol=rtol, atol=rtol / 1000, points=20, solver="idas"))
    attempt("native", lambda: simulate(made, rtol=rtol, atol=rtol / 1000, points=20, solver="native"))
    if folder is not None and "native" in values and list(stored(made)):
        fmu = export_fmu(made, folder / "drive.fmu", "3.0", outputs=list(stored(made)), check=False).path
        attempt("cs", lambda: run_fmu(fmu, kind="cs", tolerance=rtol, points=20))
        attempt("me", lambda: run_fmu(fmu, kind="me", tolerance=rtol, points=20))
    return values, refused


def apart(values: dict[str, np.ndarray]) -> float:
    """Return the largest difference of two engines."""
    runs = list(values.values())
    return max((float(np.max(np.abs(one - runs[0]), initial=0.0)) for one in runs[1:]), default=0.0)


def check(seed: int, folder: Path | None = None) -> bool:
    """Check a drive; return whether it runs."""
    values, refused = results(seed, folder)
    assert all(len(text) > 20 for text in refused.values())
    first = apart(values)
    # Hundreds of impacts add up errors: what converges to the same is the same drive. It converges at this rate, in one
    # step or, where the first difference is small by chance, in two.
    if first > SAME and apart(results(seed, folder, RTOL / 100)[0]) >= max(CONVERGED, first / 20):
        assert apart(results(seed, folder, RTOL / 10_000)[0]) < max(CONVERGED, first / 400), f"seed {seed}: {values}"
    return bool(values)


def test_examples_give_values_for_nearly_all_types() -> None:
    exported = [getattr(components, name) for name in components.__all__]
    types = {kind.__name__ for kind in exported if issubclass(kind, Component) and not declarations(kind).partial}
    # Those that fix a start or choose states need a certain partner; a ground is in every circuit.
    assert len(types - set(kinds())) < 12, types - set(kinds())


def test_library_drives() -> None:
    assert sum(check(seed) for seed in range(12)) >= 6


def test_a_library_drive_as_fmu(tmp_path: Path) -> None:
    assert check(100, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(1000, 1000 + COUNT, 10))
def test_many_library_drives(first: int, tmp_path: Path) -> None:
    """Both solvers, and FMUs of both kinds by FMPy; nearly all drives run."""
    assert sum(check(seed, tmp_path) for seed in range(first, first + 10)) >= 4
