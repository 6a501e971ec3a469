"""Whatever is done to a netlist: the text is TOML, what is wrong is told, and everything can be undone.

`RANDOM_EDITS=5000 pytest tests/edit` does more sequences; the slow suite has 200.
"""

import os
import random
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from random_edits import Chooser

from modelica_like.edit import Document, apply
from modelica_like.errors import ModelicaLikeError

EXAMPLES = Path(__file__).parents[2] / "examples"
NETLISTS = sorted(path for path in EXAMPLES.rglob("*.toml") if "sizing" not in path.parts)
SLOW = int(os.environ.get("RANDOM_EDITS", "200"))
STEPS = 30


def named(data: dict[str, Any]) -> set[str]:
    """Return the parts that ends, series and paths of start values name."""
    lines = [*data.get("series", {}).values(), *data.get("connect", {}).values(), data.get("free", [])]
    texts = [text for line in lines for text in (line if isinstance(line, list) else [])]
    texts += data.get("expose", {}).values()
    texts += [f"{path}." for path, value in data.get("start", {}).items() if "." in path or isinstance(value, dict)]
    return {re.split(r"[.\[]", text)[0] for text in texts if isinstance(text, str)}


def edited(path: Path, seed: int) -> int:
    """Do random operations, undo and do them again; return how many were not refused."""
    document = Document(path)
    chooser, texts = Chooser(document, seed), [document.text]
    for _ in range(STEPS):
        request = chooser.request()
        refusal = ""
        try:
            document.apply(request)
        except ModelicaLikeError as error:
            refusal = str(error)
        else:
            texts.append(document.text)
        # A refusal for the text that an operation would write is a fault of the operation.
        assert not any(words in refusal for words in ("is not TOML", "declared twice")), request
        assert document.text == texts[-1]
        data = tomllib.loads(document.text)
        if not refusal and request["op"] in ("remove", "rename"):
            assert request.get("name", request.get("old")) not in named(data), request
        assert all(isinstance(problem, ModelicaLikeError) and str(problem) for problem in document.problems())
    for text in reversed(texts[:-1]):
        assert document.undo().text == text
    for text in texts[1:]:
        assert document.redo().text == text
    assert path.read_bytes().decode() == texts[0]
    return len(texts) - 1


@pytest.mark.parametrize(
    "seeds",
    [range(12), *(pytest.param(range(k, min(k + 50, SLOW)), marks=pytest.mark.slow) for k in range(12, SLOW, 50))],
)
def test_random_edits(seeds: range) -> None:
    order = random.Random(1).sample(NETLISTS, len(NETLISTS))
    done = sum(edited(order[seed % len(order)], seed) for seed in seeds)
    assert done > 0.3 * STEPS * len(seeds)


def spaced(text: str, chooser: random.Random) -> str:
    """Return a text with blanks, comments and line breaks where they mean nothing."""
    data = tomllib.loads(text)
    for _ in range(8):
        place = text.find(chooser.choice(",=[]{}.\n "), chooser.randrange(len(text)))
        added = chooser.choice([" ", "  ", "\t", "\n", " # x\n", ","])
        other = text[:place] + added + text[place:] if place > 0 else text
        try:
            text = other if tomllib.loads(other) == data else text
        except tomllib.TOMLDecodeError:
            continue
    return text


def outcome(text: str, request: dict[str, Any], path: Path) -> Any:
    """Return the content that an operation leaves, or the first line of its refusal."""
    try:
        return tomllib.loads(apply(text, request, file=path).text)
    except ModelicaLikeError as error:
        return error.what


@pytest.mark.parametrize(
    "seeds",
    [pytest.param(range(100), id="some"), pytest.param(range(100, 10 * SLOW), id="all", marks=pytest.mark.slow)],
)
def test_layout_has_no_meaning(seeds: range) -> None:
    for seed in seeds:
        chooser, path = random.Random(seed), NETLISTS[seed % len(NETLISTS)]
        request = Chooser(Document(path), seed).request()
        text = path.read_bytes().decode()
        assert outcome(spaced(text, chooser), request, path) == outcome(text, request, path), (path, request)
