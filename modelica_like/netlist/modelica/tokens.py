"""Tokens of Modelica text."""

from __future__ import annotations

import re
from typing import NoReturn

from modelica_like.errors import ModelicaTextError, Source

_TOKEN = re.compile(
    r"""(?P<skip>\s+|//[^\n]*|/\*.*?\*/)|(?P<number>\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)
    |(?P<string>"(?:[^"\\]|\\.)*")|(?P<name>[^\W\d]\w*|'(?:[^'\\]|\\.)*')
    |(?P<open>/\*|["'])|(?P<sign>:=|<=|>=|==|<>|\.\*|\.\+|\.-|\./|\.\^|[-+*/^<>=(){}\[\],;:.])""",
    re.VERBOSE | re.DOTALL,
)
KINDS = {"model", "block", "connector", "record", "function", "package", "type", "class", "operator"}
SECTIONS = {"public", "protected", "equation", "algorithm", "initial", "end", "annotation", "external"}
_KEYWORDS = SECTIONS | {
    "then", "else", "elseif", "elsewhen", "loop", "for", "if", "when", "while", "connect", "or", "and",
}  # fmt: skip
_OPEN = {"/*": "comment", '"': "text", "'": "quoted name"}
_DEEPEST = 100
_RESERVED = frozenset(
    """algorithm and annotation block break class connect connector constant constrainedby der discrete each else elseif
    elsewhen encapsulated end enumeration equation expandable extends external false final flow for function if import
    impure in initial inner input loop model not operator or outer output package parameter partial protected public
    pure record redeclare replaceable return stream then true type when while within time""".split()  # noqa: SIM905
)
_PARTS = ("Icon", "Placement", "experiment")
"""Of annotations, that are read."""
Token = tuple[str, str, int]
"""Kind (a sign and a keyword are their own kind), text, line."""


def identifier(path: str) -> str:
    """Return a path with its reserved words in quotes."""
    return re.sub(r"(?<![\w'])\w+", lambda word: f"'{word[0]}'" if word[0] in _RESERVED else word[0], path)


class Tokens:
    """A text as tokens, and the place that is read.

    Args:
        text: Modelica.
        file: its path, for messages.
    """

    def __init__(self, text: str, file: str) -> None:
        self.file = file
        self.lines = text.split("\n")
        self.tokens = self._tokens(text)
        self.at = 0
        self.depth = self.brackets = 0

    def _tokens(self, text: str) -> list[Token]:
        tokens: list[Token] = []
        position, line = 0, 1
        while position < len(text):
            match = _TOKEN.match(text, position)
            if match is None:
                self.refuse(f"{text[position]!r} has no meaning in Modelica.", line)
            kind, word = match.lastgroup or "", match.group()
            if kind == "open":
                self.refuse(f"A {_OPEN[word]} has no end.", line)
            if (kind == "name" and (word in _KEYWORDS or word in KINDS)) or kind == "sign":
                tokens.append((word, word, line))
            elif kind != "skip":
                tokens.append((kind, word, line))
            line += word.count("\n")
            position = match.end()
        tokens.append(("end of file", "", line))
        return tokens

    def error(self, what: str, line: int) -> ModelicaTextError:
        """Return an error with its line."""
        text = self.lines[line - 1] if line <= len(self.lines) else ""
        return ModelicaTextError(what, where=Source(self.file, line, " ".join(text.split())))

    def refuse(self, what: str, line: int) -> NoReturn:
        """Raise an error with its line."""
        raise self.error(what, line)

    def deeper(self) -> None:
        """Count one level of brackets, statements, classes or modifications more."""
        self.depth += 1
        if self.depth > _DEEPEST:
            self.refuse(f"This is nested more than {_DEEPEST} deep.", self.line)

    @property
    def kind(self) -> str:
        """Kind of the next token."""
        return self.tokens[self.at][0]

    @property
    def text(self) -> str:
        """Text of the next token."""
        return self.tokens[self.at][1]

    @property
    def line(self) -> int:
        """Line of the next token."""
        return self.tokens[self.at][2]

    def take(self, *kinds: str) -> str:
        """Return the text of the next token and go on if it is of one of these kinds, else an empty text."""
        kind, text, _ = self.tokens[self.at]
        if kind in kinds or (kind == "name" and text in kinds):
            self.at += 1
            return text
        return ""

    def need(self, kind: str) -> str:
        """Return the text of the next token, which must be of this kind."""
        text = self.take(kind)
        if not text:
            wanted = f"a {kind}" if kind == "name" else f"'{kind}'"
            present = f"'{self.text}'" if self.text else "the end of the file"
            self.refuse(f"Expected {wanted} before {present}.", self.line)
        bare = text.strip("'")  # the name of a reserved word; 'time' is not the time
        return bare if text != bare and bare in _RESERVED and bare != "time" else text

    def dotted(self) -> str:
        """Read a name with dots; one from the outermost level begins with a dot."""
        names = ["", self.need("name")] if self.take(".") else [self.need("name")]
        while self.kind == "." and self.tokens[self.at + 1][0] == "name":
            self.at += 1
            names.append(self.need("name"))
        return ".".join(names)

    def strings(self) -> str:
        """Return the description, if there is one."""
        texts = []
        while self.kind == "string":
            texts.append(self.take("string")[1:-1])
            if not (self.kind == "+" and self.tokens[self.at + 1][0] == "string"):
                break
            self.take("+")
        return "".join(texts)

    def annotation(self) -> dict[str, range]:
        """Skip an annotation; return where its parts stand that are read, each from its name to its bracket."""
        parts: dict[str, range] = {}
        if not self.take("annotation"):
            return parts
        depth = begin = 0
        while True:
            kind, _, line = self.tokens[self.at]
            if kind == "end of file":
                self.refuse("An annotation has no end.", line)
            if depth == 1 and kind == "name":
                begin = self.at
            self.at += 1
            depth += (kind == "(") - (kind == ")")
            if depth == 1 and kind == ")" and (name := self.tokens[begin][1]) in _PARTS:
                parts[name] = range(begin, self.at)
            if depth == 0:
                return parts

    def part(self, parts: dict[str, range], name: str) -> list[Token]:
        """Return the tokens of a part of an annotation, none if it has no such part."""
        return [self.tokens[k] for k in parts.get(name, ())]
