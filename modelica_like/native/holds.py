"""What modes hold at a point: shares and impacts, asked of the run-time for derivatives of runs."""

from __future__ import annotations

import ctypes
from collections.abc import Collection
from dataclasses import dataclass
from math import inf
from threading import get_ident

import numpy as np

from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae
from modelica_like.native.model import Instance, NativeModel
from modelica_like.options import Options
from modelica_like.solve.initialize import Point


@dataclass(frozen=True)
class Struck:
    """An impact.

    Attributes:
        point: behind it.
        knocked: positions of the holds that it knocks loose.
    """

    point: Point
    knocked: tuple[int, ...]


def share(model: CompiledDae, point: Point) -> None:
    """Let elements that hold the same motion at a point share its reaction; equations of ideal elements follow, too."""
    if model.held.circuits or model.held.ideal:
        instance = _at(model, point)
        instance.at(instance.library.share, point)
        point.d = instance.present().d


def is_hard(model: CompiledDae, point: Point, entering: Collection[int]) -> bool:
    """Whether it is an impact that motions, given by their holds, have begun to be held at a point."""
    return _strike(model, point, entering, None)[1]


def strike(model: CompiledDae, point: Point, entering: Collection[int]) -> Struck:
    """Stop motions that have begun to be held at a point, by an impulse that all other components transmit."""
    knocked = np.zeros(len(model.held.motions), np.uint8)
    instance, _ = _strike(model, point, entering, knocked)
    return Struck(instance.present(), tuple(np.flatnonzero(knocked).tolist()))


def _strike(
    model: CompiledDae, point: Point, entering: Collection[int], knocked: np.ndarray | None
) -> tuple[Instance, bool]:
    instance, hard = _at(model, point), ctypes.c_int()
    marks = np.isin(np.arange(len(model.held.motions)), list(entering)).astype(np.uint8)
    out = None if knocked is None else knocked.ctypes.data
    code = instance.at(instance.library.strike, point, marks.ctypes.data, out, ctypes.addressof(hard))
    instance.check(code)
    return instance, bool(hard.value)


def _at(model: CompiledDae, point: Point) -> Instance:
    """Return this thread's instance with the parameters of a model, at the time of a point."""
    instance = model.once((Cached.INSTANCE, get_ident()), lambda: Instance(model, NativeModel.any_start(model)))
    instance.model = model
    instance.reset(point.t, inf, Options.rtol, Options.atol)
    return instance
