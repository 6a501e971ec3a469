"""The functions of native.c, batch.c and modelica_like.h by ctypes, which lets other threads run."""

from __future__ import annotations

import ctypes as c
from functools import cache
from typing import Any

import numpy as np

from modelica_like.fmi.build import native_platform
from modelica_like.fmi.runtime import runtime_library

OK, FAILED, MORE, PAUSED = range(4)
"""Return codes; runs also report a full buffer, or the end of the allowed steps."""
MESSAGE_LENGTH = 512

_POINTER, _COUNT, _NUMBER, _CODE = c.c_void_p, c.c_int64, c.c_double, c.c_int


_ARRAYS = ("times", "states", "outputs", "modes", "firsts", "events", "impacts", "steps_taken", "references")


class Run(c.Structure):
    """`NativeRun` in native.c."""

    _fields_ = [
        *((name, _POINTER) for name in _ARRAYS),
        *((name, _COUNT) for name in ("n_outputs", "steps")),
        *((f"room_{name}", _COUNT) for name in ("points", "segments", "events", "impacts", "taken")),
        *((f"n_{name}", _COUNT) for name in ("points", "segments", "events", "impacts", "taken")),
        *((name, _COUNT) for name in ("next", "first")),
        ("begin", _NUMBER),
        ("last", _NUMBER),
    ]


class BatchArguments(c.Structure):
    """`NativeBatch` in batch.c."""

    _fields_ = [
        *((name, _NUMBER) for name in ("start", "end", "rtol", "atol")),
        *((name, _COUNT) for name in ("most_events", "n_runs", "n_readings")),
        *((name, _POINTER) for name in ("readings", "parameters", "inputs", "values", "failed")),
        ("stop", c.POINTER(c.c_int)),
    ]


class Failure(c.Structure):
    """`Failure` in types.h."""

    _fields_ = [("code", c.c_int), ("place", _NUMBER), ("numbers", 2 * _NUMBER)]


POINT = 5 * c.POINTER(_NUMBER)
"""What `failure` points to: states and implicit unknowns, d, d before the last change, parameters, inputs."""


class Panel(c.Structure):
    """`Panel` in types.h."""

    _fields_ = [
        *((name, _NUMBER) for name in ("begin", "longest", "soon")),
        *((name, _COUNT) for name in ("pieces", "number")),
        *((name, _POINTER) for name in ("ends", "knots")),
    ]


class Looks(c.Structure):
    """`Looks` in types.h."""

    _fields_ = [
        *((name, _POINTER) for name in ("x", "z", "shares")),
        *((name, _NUMBER) for name in ("span", "relative", "absolute")),
        *((name, _COUNT) for name in ("results", "precise")),
        *((name, _POINTER) for name in ("ends", "knots", "wishes", "errors")),
    ]


class Along(c.Structure):
    """`Along` in adjoint.h; its arrays have rows of `SEED` and `INTEGRAND`."""

    _fields_ = [
        *((name, _POINTER) for name in ("seeds", "integrands")),
        *((name, _COUNT) for name in ("n_seeds", "n_of")),
    ]


SEED = np.dtype([("of", np.int64), ("instant", np.int64), ("t", float), ("moving", float), ("by", np.uintp)])
INTEGRAND = np.dtype([("variable", np.int64), ("size", float)])
INTEGRATOR = c.CFUNCTYPE(c.c_int, _NUMBER, c.POINTER(Panel))
"""`Integrator` in types.h."""

_SIGNATURES: dict[str, tuple[Any, list[Any]]] = {
    "open": (_POINTER, [c.c_char_p, c.c_size_t, c.c_char_p]),
    "close": (None, [_POINTER]),
    "compiled": (None, 2 * [_POINTER]),
    "new": (_POINTER, [_POINTER]),
    "free": (None, [_POINTER]),
    "message": (c.c_char_p, [_POINTER]),
    "failure": (c.POINTER(Failure), [_POINTER, POINT]),
    "reset": (_CODE, [_POINTER, *4 * [_NUMBER]]),
    "limit": (None, [_POINTER, _NUMBER]),
    "integrate_by": (None, [_POINTER, INTEGRATOR, _POINTER]),
    "take_looks": (_COUNT, [_POINTER, c.POINTER(Looks)]),
    "set": (_CODE, [_POINTER, _COUNT, _POINTER, _POINTER]),
    "set_all": (None, 3 * [_POINTER]),
    "get": (_CODE, [_POINTER, _COUNT, _POINTER, _POINTER]),
    "begin": (_CODE, [_POINTER]),
    "start": (_CODE, [_POINTER]),
    **dict.fromkeys(("begin_at", "steady_near", "tick", "check_ticks"), (_CODE, 4 * [_POINTER])),
    "share": (None, 4 * [_POINTER]),
    "strike": (_CODE, 7 * [_POINTER]),
    "states": (_CODE, 3 * [_POINTER]),
    "time": (_NUMBER, [_POINTER]),
    "step": (_CODE, [_POINTER, _NUMBER, _COUNT, _POINTER, _POINTER, _COUNT, _POINTER, _POINTER]),
    "copy": (_CODE, [_POINTER, c.POINTER(_POINTER)]),
    "restore": (_CODE, 2 * [_POINTER]),
    "drop": (None, [_POINTER, c.POINTER(_POINTER)]),
    "counts": (None, 2 * [_POINTER]),
    "land": (None, [_POINTER]),
    "gradient_along": (_CODE, [_POINTER, c.POINTER(Along), _POINTER]),
    "run": (_CODE, [_POINTER, _NUMBER, _COUNT, c.POINTER(Run)]),
    "batch": (_COUNT, [_POINTER, c.POINTER(BatchArguments)]),
    "instance": (_POINTER, [_POINTER]),
}
_GRADIENTS = {
    "gradient_start": [_POINTER, _POINTER, c.c_size_t],
    "gradient": [_POINTER, _POINTER, c.c_size_t, _POINTER],
}
"""Of modelica_like.h."""


@cache
def library() -> Any:
    """Load the run-time of this machine; its functions have the names of these files without the prefix.

    Raises:
        ExportError: it must be compiled, but there is no compiler, or the compiler failed.
    """
    return declared(c.CDLL(str(runtime_library(native_platform()))))


def declared(loaded: c.CDLL) -> Any:
    """Declare the functions of a library."""
    native = [(f"native_{name}", name, *types) for name, types in _SIGNATURES.items()]
    gradients = [(f"modelica_like_{name}", name, _CODE, arguments) for name, arguments in _GRADIENTS.items()]
    for exported, name, result, arguments in [*native, *gradients]:
        function = getattr(loaded, exported)
        function.restype, function.argtypes = result, arguments
        setattr(loaded, name, function)
    return loaded
