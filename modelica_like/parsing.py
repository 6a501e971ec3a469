"""Python's parser, for one thread at a time.

CPython 3.11 and 3.12 count the depth of syntax trees for all threads together: two that parse at once may end in a
SystemError (its issue 106905). `inspect` parses, too.
"""

from __future__ import annotations

import ast
import inspect
from threading import RLock
from typing import Any, Literal

_LOCK = RLock()


def parse(text: str, mode: Literal["exec", "eval"] = "exec") -> Any:
    """Return the syntax tree of a text.

    Raises:
        SyntaxError, ValueError, MemoryError, RecursionError: as of `ast.parse`.
    """
    with _LOCK:
        return ast.parse(text, mode=mode)


def source_lines(of: Any) -> tuple[list[str], int]:
    """Return the lines of a class or function, and the number of the first one.

    Raises:
        OSError, TypeError: as of `inspect.getsourcelines`.
    """
    with _LOCK:
        return inspect.getsourcelines(of)
