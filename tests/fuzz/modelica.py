"""Mutated Modelica texts: words, lines, brackets and numbers of texts that are read."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

from files import folder

from modelica_like import build, simulate
from modelica_like.errors import ModelicaLikeError
from modelica_like.netlist import load
from modelica_like.netlist.modelica.netlist_form import netlist_text
from modelica_like.netlist.modelica.read import read_modelica
from modelica_like.netlist.modelica.write import modelica_text

HERE = Path(__file__).parent
SHARED = next((up / "shared" for up in HERE.parents if (up / "shared").is_dir()), HERE.parents[2] / "shared")
LARGEST = 30_000
"""Characters of the texts that are mutated."""
WORDS = (
    *"""model block class connector record function package type extends equation algorithm initial end when elsewhen if
    then else elseif for loop while in der pre sample edge change reinit noEvent smooth homotopy sum size fill zeros
    linspace identity transpose cross product max min abs sign floor mod div sqrt log Real Integer Boolean String
    parameter constant flow stream input output inner outer replaceable redeclare constrainedby each final public
    protected import within annotation connect assert terminate time true false and or not enumeration external
    operator partial discrete StateSelect.prefer start fixed unit displayUnit Clock previous hold delay initial()
    connectorSizing scalar vector ones
    expandable semiLinear integer ceil rem cardinality terminal() delay(x,1)""".split(),  # noqa: SIM905
    "Icon", "Placement", "visible", "extent", "points", "xorshift128plus",
    "0", "1", "-1", "2.5", "1e400", "1e-400", "100000000", "1:0:2", "1:3", "[1]", "[end]", "[:]", "[1, 2; 3]", "{}",
    "{1}", "{1, {2}}", "{i for i in 1:3}", "(", ")", "((((", "{", "}", "[", "]", ";", ",", ".", "=", ":=", "+", "-",
    "*", "/", "^", ".*", "<", "<=", "==", "<>", '"', '"x"', "'", "'q'", "/*", "//", "*/", "\\", "$", "é", "\0", "\r",
)  # fmt: skip
_TOKEN = re.compile(r"\s+|[\w.]+|.", re.DOTALL)


@cache
def texts() -> list[str]:
    """Return texts of this repository, of written examples, and of the standard library where it is at hand."""
    found = [path.read_text(encoding="utf-8") for path in sorted((HERE.parent / "modelica_text").rglob("*.mo"))]
    found += [path.read_text(encoding="utf-8") for path in sorted((SHARED / "repros").glob("*.mo"))]
    library = sorted((SHARED / "modelica_text" / "Modelica" / "Mechanics").rglob("*.mo"))
    found += [text for path in library if len(text := path.read_text(encoding="utf-8")) < LARGEST][::3]
    for path in sorted((HERE.parents[1] / "examples").rglob("*.toml"))[::5]:
        try:
            found.append(modelica_text(load(path)))
        except ModelicaLikeError:
            continue  # no netlist, or without a counterpart in Modelica
    pieces = [
        f"{piece}\n"
        for text in found[:2]
        for piece in re.findall(r"^  (?:model|block) \w+.*?^  end \w+;", text, re.DOTALL | re.MULTILINE)
    ]
    return [text for text in [*found, *pieces] if len(text) < LARGEST]


def mutated(chance: random.Random, text: str) -> str:
    """Change some words of a text."""
    words = _TOKEN.findall(text)
    for _ in range(chance.choice((1, 1, 1, 2, 3, 8))):
        at, other = chance.randrange(len(words) or 1), chance.randrange(len(words) or 1)
        match chance.randrange(9):
            case 0:
                del words[at : at + chance.choice((1, 1, 2, 10))]
            case 1:
                words[at:at] = [" ", chance.choice(WORDS), " "]
            case 2:
                words[at : at + 1] = [f" {chance.choice(WORDS)} "]
            case 3:
                words[at : at + 1] = words[other : other + 1]
            case 4:
                words[at:at] = words[other : other + chance.randrange(1, 40)]
            case 5:
                words[at:at] = [
                    chance.choice(("(", "{", "[", "if true then ", "-", "model M\n", "a.")) * chance.choice((5, 300))
                ]
            case 6:
                del words[at:]
            case _:
                names = [k for k, word in enumerate(words) if word[0].isalnum()]
                if names:
                    words[chance.choice(names)] = chance.choice((*WORDS, words[chance.choice(names)]))
    return "".join(words)


def modelica(chance: random.Random) -> tuple[str, Callable[[], object]]:
    """Read a mutated Modelica text; some are written as netlists, compiled, and run."""
    text = mutated(chance, chance.choice(texts()))
    if chance.random() < 0.1:
        text = mutated(chance, text + chance.choice(texts()))
    depth = chance.random()

    def run() -> None:
        file = folder() / "mutated.mo"
        file.write_text(text, encoding="utf-8", errors="surrogatepass", newline="")
        model, notes = read_modelica(file)
        if depth < 0.1:
            netlist_text(model, folder(), notes)
        elif depth < 0.4:
            made = build(model)
            if depth < 0.15:
                simulate(made, 1e-4, points=5)

    return text, run
