"""Errors of runs that would take too long, or more memory than there is."""

from collections.abc import Callable
from typing import Any

import pytest

from modelica_like import Options, options, simulate
from modelica_like.errors import ExportError, ModelicaLikeError, NotEnoughMemory, StepFailed, ValueOutOfRange
from modelica_like.language import Component, Equations, Variable, der, sin, var, where
from modelica_like.native import buffers, model

Check = Callable[[type[ModelicaLikeError], Callable[[], object], str], None]


class Swing(Component):
    """It swings with 10^7 rad/s: a step is about 10^-8 s long."""

    units_checked = False
    x: Variable = var("1", "amplitude", state="always", default=1.0)
    v: Variable = var("1/s", "its rate", state="always", default=0.0)

    def equations(self) -> Equations:
        yield der(self.x) == self.v
        yield der(self.v) == -1e14 * self.x


class Stopping(Component):
    """It stops after a second."""

    units_checked = False
    x: Variable = var("1", "position", state="always", default=0.0)

    def equations(self) -> Equations:
        yield der(self.x) == where(self.time < 1, 1.0, 0.0)


class Ticking(Component):
    """It starts and stops 300 times in a second."""

    units_checked = False
    x: Variable = var("1", "position", state="always", default=0.0)

    def equations(self) -> Equations:
        yield der(self.x) == where(sin(1000 * self.time) > 0, 1.0, 0.0)


def test_steps_of_a_native_run_are_limited(check_message: Check) -> None:
    text = (
        "The run-time gave up at about t = 0 s: it took more than 20,000 steps (max_steps) for 1 s.\n"
        "v changes fastest relative to its tolerance.\n"
        "Look for a stiff spring, a vanishing mass or a speed without bound; then try other tolerances."
    )
    limited = Options(max_steps=20_000)
    check_message(StepFailed, lambda: simulate(Swing(), 100.0, options=limited, solver="native"), text)


def test_the_limit_of_steps_is_not_one_of_the_whole_run() -> None:
    run = simulate(Swing(), 1e-3, options=Options(max_steps=10_000), solver="native")
    assert run.statistics.steps > 10_000
    assert run.time[-1] == pytest.approx(1e-3)


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_results_that_do_not_fit_are_told_before_the_run(
    solver: Any, check_message: Check, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(options, "memory", lambda: 1e8)
    text = (
        "10,000,000 results of 2 states and implicit unknowns take 0.32 GB, and this machine has 0.1 GB.\n"
        "Take fewer points; `readings` are read off every step, whatever is written."
    )
    check_message(ValueOutOfRange, lambda: simulate(Swing(), 1e-6, points=10_000_000, solver=solver), text)


def test_results_at_events_that_do_not_fit(check_message: Check, monkeypatch: pytest.MonkeyPatch) -> None:
    # How many there are is not known before the run.
    monkeypatch.setattr(buffers, "memory", lambda: 1e4)
    text = (
        "By 0.0408407 s there are 27 results, two of them at every event; more of them need room of 1.64e-05 GB, and "
        "this machine has 1e-05 GB.\n"
        "Run a shorter time, or a part of the drive."
    )
    check_message(ValueOutOfRange, lambda: simulate(Ticking(), 1.0, points=10, solver="native"), text)


def test_an_instance_without_memory(check_message: Check, monkeypatch: pytest.MonkeyPatch) -> None:
    loaded = model.library()

    class Full:
        def __getattr__(self, name: str) -> Any:
            return (lambda _: None) if name == "new" else getattr(loaded, name)

    monkeypatch.setattr(model, "library", Full)
    text = "There is not enough memory for an instance of Swing."
    check_message(NotEnoughMemory, lambda: simulate(Swing(), 1e-6, solver="native"), text)


def test_without_a_library_nothing_runs(check_message: Check, monkeypatch: pytest.MonkeyPatch) -> None:
    def none() -> None:
        raise ExportError("There is no C compiler.", advice="Install cc.")

    monkeypatch.setattr(model, "library", none)
    check_message(ExportError, lambda: simulate(Stopping(), 2.0), "There is no C compiler.\nInstall cc.")
