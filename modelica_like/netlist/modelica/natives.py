"""Functions of the standard library that are written in other languages, as far as a text can need them here."""

from __future__ import annotations

import math
import secrets
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.curves import CONSTANT, LINEAR, NEVER, Axis, Table, read_rows
from modelica_like.netlist.modelica.fold import Unfit
from modelica_like.netlist.modelica.tree import ClassText, Expr
from modelica_like.netlist.modelica.xorshift import NAMES, draw

if TYPE_CHECKING:
    from modelica_like.netlist.modelica.classes import Classes

_LAST = 1e60
"""Modelica.Constants.inf: no further event of time, because edges of the curves make their own."""
Arguments = Mapping[str, Expr]
Native = Callable[["Classes", Arguments, int], Expr]


def _numbers(value: Expr) -> np.ndarray[Any, np.dtype[np.float64]]:
    if any(item.kind != "number" for item in fold.elements(value)):
        raise Unfit("A table needs numbers that are known before the run")
    shape = [len(value.args)] if value.kind == "array" else []
    if shape and value.args and value.args[0].kind == "array":
        shape.append(len(value.args[0].args))
    return np.array([item.args[0] for item in fold.elements(value)]).reshape(shape)


def _choice(value: Expr) -> int:
    return int(fold.numbered(value).args[0])


def _table(of_time: bool, axes: int) -> Native:
    def make(classes: Classes, given: Arguments, line: int) -> Expr:
        name, file = given["tableName"].args[0], given["fileName"].args[0]
        if file != "NoName" and name != "NoName":
            path = Path(classes.file.parent, file)
            rows = read_rows(path, name, given["delimiter"].args[0], int(given["nHeaderLines"].args[0]))
        elif name != "NoName":
            raise Unfit(f"The table {name} of a function usertab in C is not supported: give its numbers, or a file")
        else:
            rows = _numbers(given["table"])
        if rows.ndim != 2 or not rows.size or (axes == 2 and min(rows.shape) < 2):
            raise Unfit("A table needs rows and columns")
        smoothness, beyond = _choice(given["smoothness"]), _choice(given["extrapolation"])
        jumps = of_time and smoothness in (LINEAR, CONSTANT)
        points = [rows[1:, 0], rows[0, 1:]] if axes == 2 else [rows[:, 0]]
        for axis in points:
            steps = np.diff(axis)
            if np.any(steps < 0) or (not jumps and np.any(steps == 0)):
                raise Unfit("The abscissae of a table rise")
        columns = tuple(int(c) for c in _numbers(given["columns"])) if axes == 1 else ()
        start, shift = (given[key].args[0] if of_time else 0.0 for key in ("startTime", "shiftTime"))
        made = tuple(Axis(axis, smoothness, beyond, True if jumps else None) for axis in points)
        return Expr("object", (Table(rows, made, columns, start if of_time else -math.inf, shift),), line)

    return make


def _value(*inputs: str) -> Native:
    def make(classes: Classes, given: Arguments, line: int) -> Expr:
        table = given["tableID"].args[0]
        if not isinstance(table, Table):
            raise Unfit("This is no table")
        if NEVER in [axis.beyond for axis in table.axes]:
            raise Unfit("A table without extrapolation is not supported: choose what holds beyond its ends")
        output = int(given["icol"].args[0]) if "icol" in given else 0
        curve, values = table.curve(output), [given[name] for name in inputs]
        return fold.native(curve, tuple(values), line)

    return make


def _end(end: int) -> Native:
    return lambda classes, given, line: fold.number(float(given["tableID"].args[0].axes[0].points[end]), line)


def _path(classes: Classes, given: Arguments, line: int) -> Expr:
    """Return the path of a resource: `modelica://Package/Resources/…` is in the package's folder."""
    text = _text(next(iter(given.values())))
    package, _, rest = text.removeprefix("modelica://").partition("/")
    if not text.startswith("modelica://"):
        return Expr("string", (text,), line)
    top = classes.full(package)
    if not isinstance(top, ClassText):
        raise Unfit(f"There is no package {package}, in whose folder '{rest}' should be")
    return Expr("string", (str(Path(top.file).resolve().parent / rest),), line)


def _text(value: Expr) -> str:
    if value.kind != "string":
        raise Unfit("This text is not known before the run")
    return value.args[0]


def _of_texts(compute: Callable[..., Any]) -> Native:
    def make(classes: Classes, given: Arguments, line: int) -> Expr:
        if any(value.kind not in fold.KNOWN for value in given.values()):
            raise Unfit("This text is not known before the run")
        result = compute(**{name: value.args[0] for name, value in given.items()})
        kind = {bool: "boolean", str: "string"}.get(type(result), "number")
        return Expr(kind, (result if kind != "number" else float(result),), line)

    return make


def _drawn(name: str) -> Native:
    return lambda classes, given, line: draw(name, next(iter(given.values())), line)


def _hidden(classes: Classes, given: Arguments, line: int) -> Expr:
    raise Unfit(
        "Random numbers whose state is hidden are not supported: "
        "draw them by Modelica.Math.Random.Generators.Xorshift1024star.random, with a state of your own"
    )


def _hash(string: str) -> int:
    """Return the hash of a text after Partow (2002), as a whole number of 32 bits with a sign."""
    value = 0xAAAAAAAA
    for k, byte in enumerate(string.encode()):
        mixed = ~((value << 11) + (byte ^ value >> 5)) if k % 2 else value << 7 ^ byte * (value >> 3)
        value = (value ^ mixed) & 0xFFFFFFFF
    return value - (value >> 31 << 32)


def _seed(classes: Classes, given: Arguments, line: int) -> Expr:
    """Return a seed that differs from reading to reading."""
    return fold.number(1 + secrets.randbelow(2**31 - 1), line)


def _cased(text: str, caseSensitive: bool) -> str:
    return text if caseSensitive else text.lower()


_STRINGS = "Modelica.Utilities.Strings."
_TABLES = "ModelicaStandardTables_"
_RANDOM = "ModelicaRandom_"
NATIVE: dict[str, Native] = {
    f"{_TABLES}CombiTimeTable_init3": _table(True, 1),
    f"{_TABLES}CombiTable1D_init3": _table(False, 1),
    f"{_TABLES}CombiTable2D_init3": _table(False, 2),
    f"{_TABLES}CombiTimeTable_getValue": _value("timeIn"),
    f"{_TABLES}CombiTable1D_getValue": _value("u"),
    f"{_TABLES}CombiTable2D_getValue": _value("u1", "u2"),
    f"{_TABLES}CombiTimeTable_nextTimeEvent": lambda classes, given, line: fold.number(_LAST, line),
    f"{_TABLES}CombiTimeTable_minimumTime": _end(0), f"{_TABLES}CombiTimeTable_maximumTime": _end(-1),
    f"{_TABLES}CombiTable1D_read": lambda classes, given, line: fold.number(1.0, line),  # has been read already
    f"{_TABLES}CombiTable1D_minimumAbscissa": _end(0), f"{_TABLES}CombiTable1D_maximumAbscissa": _end(-1),
    **{f"{_RANDOM}{name}": _drawn(name) for name in NAMES},
    f"{_RANDOM}setInternalState_xorshift1024star": lambda classes, given, line: Expr("tuple", (), line),
    f"{_RANDOM}impureRandom_xorshift1024star": _hidden, f"{_RANDOM}automaticGlobalSeed": _seed,
    "ModelicaStrings_hashString": _of_texts(_hash),
    "Modelica.Utilities.Files.loadResource": _path,
    "ModelicaServices.ExternalReferences.loadResource": _path,
    f"{_STRINGS}length": _of_texts(lambda string: len(string)),
    f"{_STRINGS}isEmpty": _of_texts(lambda string: not string.strip()),
    f"{_STRINGS}substring": _of_texts(lambda string, startIndex, endIndex: string[int(startIndex) - 1 : int(endIndex)]),
    f"{_STRINGS}isEqual": _of_texts(
        lambda string1, string2, caseSensitive: _cased(string1, caseSensitive) == _cased(string2, caseSensitive)
    ),
    f"{_STRINGS}findLast": _of_texts(
        lambda string, searchString, startIndex, caseSensitive:
        _cased(string, caseSensitive).rfind(_cased(searchString, caseSensitive)) + 1
    ),
}  # fmt: skip
"""By the name in the other language, or the path of the function."""
