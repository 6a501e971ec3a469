"""The section of a page about the search whose best design it shows: values, limits, and curves before and after."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from html import escape
from typing import TYPE_CHECKING

from modelica_like.analyse.optimize.result import Measured, Optimum
from modelica_like.analyse.optimize.terms import split
from modelica_like.errors import ModelicaLikeError
from modelica_like.runs.calls import call_of
from modelica_like.runs.signals import read_signals
from modelica_like.show.plot import picture_bytes
from modelica_like.show.report.overlay import overlay
from modelica_like.show.report.page.tables import details, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def best_design(optimum: Optimum) -> str:
    """Return the section as HTML."""
    values = [
        (p.name, f"{p.before:.6g}", f"{p.value:.6g}", p.unit_text, f"{p.low:.6g}", f"{p.high:.6g}")
        for p in optimum.parameters
    ]
    values += [(path, "", str(label), "", "", "") for path, label in optimum.chosen.items()]
    rows = [_row(measured) for measured in (*optimum.objectives, *optimum.limits)]
    outputs = table(("output", "before>", "best>", "unit", "limit", "load case", "verdict!"), rows)
    said = "".join(f"<p>{escape(sentence)}</p>" for sentence in optimum.sentences())
    return "".join([
        table(("free", "before>", "best>", "unit", "from>", "to>"), values), "<p></p>", outputs, said,
        _before_and_after(optimum), details(_image(optimum.plot(), "The way to the optimum"), "the way to it"),
        f'<p class="hint">{optimum.runs} runs.</p>',
    ])  # fmt: skip


def _row(measured: Measured) -> tuple[str, ...]:
    limited = measured.limit == measured.limit
    verdict = "" if not limited else "exceeded" if measured.broken else "ok"
    return (
        measured.name, f"{measured.before:.6g}", f"{measured.value:.6g}", measured.unit_text,
        measured.text if limited else "", measured.case, verdict,
    )  # fmt: skip


def _before_and_after(optimum: Optimum) -> str:
    """Draw what the objective and the limits read, in a run before and in one of the best design."""
    try:
        runs = {"before": optimum.simulate(before=True), "best": optimum.simulate()}
        figure = overlay(runs, *dict.fromkeys(_signals(optimum)), title="Before and after")
    except ModelicaLikeError as error:
        return f"<p>{escape(str(error))}</p>"
    return _image(figure, "Before and after")


def _signals(optimum: Optimum) -> Iterator[str]:
    """Yield the variables and formulas of which objectives and limits read a number."""
    names = [measured.name for measured in (*optimum.objectives, *optimum.limits)]
    while names:
        name = names.pop(0)
        called = call_of(name)
        inner = [] if called is None else split(called[1])
        if any(call_of(text) is not None for text in inner):  # the largest of several
            names = [*inner, *names]
            continue
        text = inner[0] if inner else name
        try:
            read_signals(optimum.model, [text])
        except ModelicaLikeError:  # a time, an energy, a mode: no curve shows it
            continue
        yield text


def _image(figure: Figure, title: str) -> str:
    text = base64.b64encode(picture_bytes(figure, "svg")).decode("ascii")
    return f'<p><img alt="{escape(title)}" style="max-width:100%" src="data:image/svg+xml;base64,{text}"></p>'
