"""Tables of a sizing run and of the design checks."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, get_args, get_origin

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.text import Text

from modelica_like.analyse.sizing.checks import (
    Argument,
    Check,
    arguments_of,
    design_checks,
    find_check,
    meanings,
    unit_of_kind,
    without_none,
)
from modelica_like.analyse.sizing.run import CheckedResult, Sizing
from modelica_like.language.results import Line, beside, titled
from modelica_like.show.report.tables import Listed, table

_WIDE = 9


def sizing_report(sizing: Sizing) -> RenderableType:
    """Return all results with verdicts, the comparisons, and a summary."""
    parts: list[RenderableType] = [f"[bold]{escape(sizing.name)}[/]  {escape(sizing.description)}"]
    for check in sizing.checks:
        parts += ["", *_check_tables(check)]
    for heading, names in sizing.compare.items():
        parts += ["", _side_by_side(heading, "line", {name: sizing[name].lines() for name in names})]
    return Group(*parts, "", _whole(sizing))


def _check_tables(check: CheckedResult) -> Iterator[RenderableType]:
    columns = ["line*", "value>", "unit"]
    columns += ["published>", "deviation>"] if check.published else []
    cells: list[list[str | Text]] = []
    for line in check.result.lines(check.limits):
        published = _published(check, line.name) if check.published else []
        style = "red" if line.exceeded else "green" if line.verdict else "dim"
        cells.append([line.name, line.value, line.unit, *published, Text(line.verdict or "–", style), line.description])
    yield table(f"{check.name}: {check.check}", *columns, "verdict", "what it is", rows=cells)
    if check.note:
        yield f"[dim]{escape(check.note)}[/]"
    for title, rows in check.result.tables().items():
        yield ""
        tables = _rows(title, rows)
        tables.name = f"{check.name}: {title}"
        yield tables


def _published(check: CheckedResult, line: str) -> list[str]:
    if line not in check.published:
        return ["", ""]
    changed = dataclasses.replace(check.result, **{line: check.published[line]})
    shown = next(other.value for other in changed.lines() if other.name == line)
    return [shown, f"{100 * check.deviation(line):+.3f} %"]


def _rows(title: str, rows: tuple[Any, ...]) -> Listed:
    """Return results of one kind as rows, or as columns if they have many lines."""
    lines = [row.lines() for row in rows]
    if len(lines[0]) > _WIDE and len(rows) <= _WIDE:
        return _side_by_side(title, titled(lines[0][0]), {each[0].value: each[1:] for each in lines})
    first, *others = map(titled, lines[0])
    return table(title, first, *(f"{name}>" for name in others), rows=([line.value for line in each] for each in lines))


def _side_by_side(heading: str, corner: str, columns: Mapping[str, Sequence[Line]]) -> Listed:
    titles = f"{corner}*", *(f"{name}>" for name in columns), "unit", "what it is"
    return table(heading, *titles, rows=beside(columns.values()))


def _whole(sizing: Sizing) -> str:
    count = len(sizing.checks)
    checks = "1 check" if count == 1 else f"{count} checks"
    if not sizing.exceeded:
        return f"{checks}, no limit is exceeded."
    limits = "1 limit is" if sizing.exceeded == 1 else f"{sizing.exceeded} limits are"
    return f"{checks}, [red]{limits} exceeded[/]."


def checks_report(name: str = "") -> RenderableType:
    """Return the list of all design checks, or the page of one."""
    return check_page(name, find_check(name)) if name else checks_table(design_checks())


def checks_table(checks: Mapping[str, Check]) -> Listed:
    """Return all design checks with their first sentence."""
    rows = (
        (name, check.__module__.rpartition(".")[2], inspect.cleandoc(check.__doc__ or "").partition("\n")[0])
        for name, check in sorted(checks.items(), key=lambda item: (item[1].__module__, item[0]))
    )
    return table(f"{len(checks)} design checks", "check*", "module", "what it does", rows=rows, name="design checks")


def check_page(name: str, check: Check) -> RenderableType:
    """Return a page about one design check: text and arguments."""
    text = inspect.cleandoc(check.__doc__ or "").partition("\nArgs:")[0].rstrip()
    described = dict(meanings(inspect.cleandoc(check.__doc__ or "")))
    rows = (
        (
            argument.name,
            _kind(argument),
            "" if argument.required else str(argument.default),
            described.get(argument.name, ""),
        )
        for argument in arguments_of(check).values()
    )
    tables = table("arguments", "name*", "unit", "default", "meaning", rows=rows)
    return Group(f"[bold]{name}[/]", escape(text), "", tables)


def _kind(argument: Argument) -> str:
    kind = without_none(argument.kind)
    unit = unit_of_kind(kind)
    if unit is not None:
        return str(unit)
    if get_origin(kind) is not None:
        inner = get_args(kind)[0]
        return f"list of {unit_of_kind(inner) or inner.__name__}"
    return {str: "text", bool: "true or false", int: "number"}.get(kind, getattr(kind, "__name__", ""))
