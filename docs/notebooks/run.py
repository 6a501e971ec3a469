"""Run the notebooks of this folder and write their outputs: python docs/notebooks/run.py [NAME ...].

Their cells need no Jupyter: they run in one namespace, in their order. Outputs are kept light: what is printed, the
schematic of a drive, pictures in low resolution.
"""

from __future__ import annotations

import ast
import base64
import contextlib
import io
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from modelica_like import schematic
from modelica_like.language import Component
from modelica_like.show.plot import picture_bytes
from modelica_like.writing import write_text

HERE = Path(__file__).resolve().parent
DPI = 70


def read(path: Path) -> dict[str, Any]:
    """Return a notebook."""
    return json.loads(path.read_text(encoding="utf-8"))


def written(notebook: dict[str, Any]) -> str:
    """Return the text of its file."""
    return json.dumps(notebook, indent=1, ensure_ascii=False) + "\n"


def executed(notebook: dict[str, Any]) -> dict[str, Any]:
    """Return a notebook with the outputs of its cells; they run in an empty folder."""
    names: dict[str, Any] = {"__name__": "notebook"}
    cells: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as work, contextlib.chdir(work):
        for cell in notebook["cells"]:
            if cell["cell_type"] == "code":
                count = 1 + sum(one["cell_type"] == "code" for one in cells)
                cell = cell | {"execution_count": count, "outputs": _run("".join(cell["source"]), names, count)}
            cells.append(cell)
    return notebook | {"cells": cells}


def _run(code: str, names: dict[str, Any], count: int) -> list[dict[str, Any]]:
    """Run a cell; its last line, if it is an expression, is shown."""
    body = ast.parse(code).body
    last = ast.Expression(body.pop().value) if body and isinstance(body[-1], ast.Expr) else None
    with contextlib.redirect_stdout(io.StringIO()) as stream:
        exec(compile(ast.Module(body, []), "cell", "exec"), names)
        shown = None if last is None else eval(compile(last, "cell", "eval"), names)
    printed = [{"name": "stdout", "output_type": "stream", "text": stream.getvalue().splitlines(keepends=True)}]
    data = [] if shown is None else [_data(shown, count)]
    return (printed if stream.getvalue() else []) + data


def _data(shown: Any, count: int) -> dict[str, Any]:
    data: dict[str, Any] = {"text/plain": repr(shown).splitlines(keepends=True)}
    if isinstance(shown, Figure):
        data = {
            "image/png": base64.b64encode(picture_bytes(shown, "png", dpi=DPI)).decode(),
            "text/plain": ["<Figure>"],
        }
    elif isinstance(shown, Component):
        data = {"image/svg+xml": schematic(shown).splitlines(keepends=True), "text/plain": [type(shown).__name__]}
    return {"data": data, "execution_count": count, "metadata": {}, "output_type": "execute_result"}


def main(chosen: list[str]) -> None:
    """Run the named notebooks, or all, and write them."""
    for path in sorted(HERE.glob("*.ipynb")):
        if not chosen or path.stem in chosen:
            write_text(path, written(executed(read(path))))


if __name__ == "__main__":
    main(sys.argv[1:])
