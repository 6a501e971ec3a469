"""Netlists with hostile texts: forty payloads of markup and control characters in every field that is a text."""

from __future__ import annotations

import json
from collections.abc import Iterator

PAYLOADS = (
    "<script>alert(1)</script>", "<img src=x onerror=alert(1)>", "\"><svg onload=alert(1)>", "'-alert(1)-'", "{{7*7}}",
    "${7*7}", "#{7*7}", "<%= 7*7 %>", "]]>", "<!--", "-->", "&lt;b&gt;", "&#x41;", "[bold]x[/]", "[/]",
    "[link=file:///x]y[/link]", "](javascript:alert(1))", "![x](http://x.invalid)", "`x`",
    "```\nx\n```", "$\\input{x}$", "\\write18{x}", "%s%n%x",
    "{0}{x!r}", "\\u0000", "\u202egpj.exe", "\u2028",
    "\u200b", "\ufeff", "e\u0301", "\U0001f600", "\x1b[31mred\x1b[0m",
    "\x1b]0;t\x07", "\x7f", "\x9b31m", "a\tb", "a\rb", "file:///etc/passwd", "../../x", "; rm -rf x",
)  # fmt: skip
PART = '[parts]\na = {{ is = "Inertia", J = 1 }}\n'
FIELDS = (
    'name = {0}\ndescription = {0}\n[parts]\na = {{ is = "Inertja" }}\n', "[parts]\na = {{ is = {0} }}\n",
    '[parts]\na = {{ is = "Inertia", J = {0} }}\n', '[parts]\na = {{ is = "Inertia", {0} = 1 }}\n',
    '[parts]\n{0} = {{ is = "Inertia" }}\n', PART + '[series]\n{0} = ["a", {0}]\n',
    PART + '[connect]\n{0} = ["a.flange_a", {0}]\n', "{0} = {0}\n", PART + "[start]\n{0} = {0}\n",
    PART + "[simulate]\nuntil = {0}\n", PART + "[expose]\n{0} = {0}\n", "free = [{0}]\n" + PART,
    '[parameters]\n{0} = {0}\n[parts]\na = {{ is = "Inertia", J = {0} }}\n', PART + "[display]\n{0} = {0}\n",
)  # fmt: skip


def texts() -> Iterator[str]:
    """Yield netlists with each payload in each field."""
    assert len(PAYLOADS) == 40
    for payload in PAYLOADS:
        for field in FIELDS:
            yield field.format(json.dumps(payload, ensure_ascii="\x7f" in payload))
