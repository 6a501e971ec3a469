"""A Markdown extension: LaTeX between dollar signs becomes MathML while the site is built; no script is needed."""

from __future__ import annotations

import re
from typing import Any
from xml.etree.ElementTree import Element

from latex2mathml.converter import convert
from markdown import Markdown
from markdown.blockprocessors import BlockProcessor
from markdown.extensions import Extension
from markdown.inlinepatterns import InlineProcessor

_BLOCK = re.compile(r"^\$\$\s*(.*?)\s*\$\$$", re.DOTALL)
_INLINE = r"(?<![\\$\w])\$(?![\s$])([^$\n]*?[^$\s\\])\$(?![\w$])"


def mathml(latex: str, display: str) -> str:
    """Return LaTeX as MathML; `display` is block or inline."""
    # A row of equations ends with \\cr where Markdown would eat a double backslash; the converter knows `split` only.
    return convert(latex.replace("\\cr", "\\\\").replace("{aligned}", "{split}"), display=display)


class _Inline(InlineProcessor):
    def handleMatch(self, m: Any, data: str) -> tuple[str, int, int]:
        return self.md.htmlStash.store(mathml(m[1], "inline")), m.start(0), m.end(0)


class _Block(BlockProcessor):
    def test(self, parent: Element, block: str) -> bool:
        return _BLOCK.match(block.strip()) is not None

    def run(self, parent: Element, blocks: list[str]) -> None:
        found = _BLOCK.match(blocks.pop(0).strip())
        assert found is not None, "`test` has seen it"
        made = Element("p", {"class": "mathematics"})
        made.text = self.parser.md.htmlStash.store(mathml(found[1], "block"))
        parent.append(made)


class Mathematics(Extension):
    """Inline mathematics between single dollar signs, and blocks between double ones."""

    def extendMarkdown(self, md: Markdown) -> None:
        """Register both."""
        # After code (190), whose dollars are none; before escapes (180), which would take the backslashes.
        md.inlinePatterns.register(_Inline(_INLINE, md), "mathematics", 185)
        md.parser.blockprocessors.register(_Block(md.parser), "mathematics", 80)


def makeExtension(**options: Any) -> Mathematics:
    """Return the extension, as Markdown asks for it by the module's name."""
    return Mathematics(**options)
