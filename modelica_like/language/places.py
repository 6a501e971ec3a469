"""Places in source files: of a `yield`, of the creation of a component."""

from __future__ import annotations

import ast
import inspect
import linecache
from collections.abc import Iterable, Iterator
from functools import cache
from itertools import islice
from pathlib import Path
from textwrap import dedent
from tokenize import COMMENT, TokenError, generate_tokens
from types import CodeType, GeneratorType
from typing import Any, cast

import casadi as ca

from modelica_like.errors import LanguageError, Source, UnknownName
from modelica_like.parsing import parse, source_lines

_LANGUAGE = str(Path(__file__).parent)
_PACKAGE = str(Path(__file__).parent.parent)

_CASADI = str(Path(ca.__file__).parent)
_END = object()

NOWHERE = Source("")
"""No place in a file."""


def caller() -> Source:
    """Return the nearest place on the stack outside this package."""
    frame = inspect.currentframe()
    assert frame is not None
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        frame = frame.f_back
    return source_of(frame.f_code, frame.f_lasti)


def located(generator: Any, label: str = "equations()") -> Iterator[tuple[Any, Source]]:
    """Run a generator and pair its items with the place of the `yield` in the user's file.

    Args:
        generator: returned by `equations()` or `events()`.
        label: name of that method, for messages.

    Raises:
        LanguageError: it is not iterable, or needs a member that a partial base does not define.
    """
    if not isinstance(generator, Iterable) or isinstance(generator, ca.SX):
        raise LanguageError(
            f"{label} returns {type(generator).__name__} instead of yielding equations or events.",
            advice="Is a `yield` missing?",
        )
    items: Iterator[Any] = iter(cast("Iterable[Any]", generator))
    while True:
        try:
            item = next(items, _END)
        except RuntimeError as error:
            raise _undecided(error, label) or _left_open(error) or error from None
        except AttributeError as error:
            raise _lacking(error) or error from None
        except (OSError, SystemExit) as error:
            raise LanguageError(f"{label} fails.", why=f"It raises {type(error).__name__}: {error}.") from error
        if item is _END:
            return
        yield item, _place(items)


def _raised_at(error: Exception) -> Source:
    """Return the last place outside this package and CasADi that an error came through."""
    place, frame = NOWHERE, error.__traceback__
    while frame is not None:
        if not frame.tb_frame.f_code.co_filename.startswith((_PACKAGE, _CASADI)):
            place = source_of(frame.tb_frame.f_code, frame.tb_lasti)
        frame = frame.tb_next
    return place


def _lacking(error: AttributeError) -> UnknownName | None:
    """Explain the error of a part that lacks what its owner uses."""
    from modelica_like.language.component import Component

    part = error.obj
    if not isinstance(part, Component):
        return None
    return UnknownName(
        f"{part.label} is of type {type(part).__name__} and has no '{error.name}', which its owner uses.",
        where=_raised_at(error), advice="A part that takes the place of another needs its connectors and signals.",
    )  # fmt: skip


def _undecided(error: RuntimeError, label: str) -> LanguageError | None:
    """Explain the error of CasADi if Python asks for the truth value of a symbolic relation."""
    if "truth value" not in str(error):
        return None
    return LanguageError(
        f"{label} asks Python whether a relation of symbols is true; that is known only during a run.",
        where=_raised_at(error),
        advice="Write where(condition, a, b), all_of(…), any_of(…); only structural fields decide an `if`.",
    )


def _left_open(error: RuntimeError) -> LanguageError | None:
    """Explain the member that a partial base needs."""
    frame = error.__traceback__
    while frame is not None and frame.tb_next is not None:
        frame = frame.tb_next
    # CasADi also raises it, with a text.
    if not isinstance(error, NotImplementedError) or error.args or frame is None:
        return None
    owner: object = frame.tb_frame.f_locals.get("self")
    kind = type(owner)
    base, _, name = frame.tb_frame.f_code.co_qualname.rpartition(".")
    wanted = inspect.getdoc(getattr(kind, name, None)) or ""
    decorator = "@property, " if isinstance(getattr(kind, name, None), property) else ""
    return LanguageError(
        f"{kind.__name__} does not define {name}, which its base {base} leaves open.",
        where=_class_source(kind),
        why=f"{base}.{name}: {wanted.splitlines()[0]}" if wanted else "",
        advice=f"Write it in {kind.__name__}: {decorator}def {name}(self).",
    )


def _class_source(kind: type) -> Source:
    try:
        lines, first = source_lines(kind)
    except (OSError, TypeError):  # created at a prompt
        return NOWHERE
    return Source(inspect.getfile(kind), first, lines[0].strip())


def _place(items: object) -> Source:
    """Return the present place of a generator: its own line, or that of the generator it delegates to."""
    frame = None
    while isinstance(items, GeneratorType) and not items.gi_code.co_filename.startswith(_LANGUAGE):
        frame = items.gi_frame
        items = cast(object, items.gi_yieldfrom)
    return NOWHERE if frame is None else source_of(frame.f_code, frame.f_lasti)


def source_of(code: CodeType, instruction: int) -> Source:
    """Return the source place of a byte-code instruction."""
    line, end_line, column, end_column = next(islice(code.co_positions(), instruction // 2, None))
    if line is None:
        return Source(code.co_filename, code.co_firstlineno)
    lines = [linecache.getline(code.co_filename, n).rstrip("\n") for n in range(line, (end_line or line) + 1)]
    if lines and end_column is not None and column is not None:
        lines[-1] = lines[-1].encode()[:end_column].decode(errors="ignore")
        lines[0] = lines[0].encode()[column:].decode(errors="ignore")
    # Reading tokens is slow at first, and few statements have comments inside.
    text = _without_comments(lines) if len(lines) > 1 and any("#" in line for line in lines) else " ".join(lines)
    return Source(code.co_filename, line, " ".join(text.split()))


def _without_comments(lines: list[str]) -> str:
    """Join the lines of a statement; a comment would swallow the lines after it."""
    kept = list(lines)
    try:
        for token in generate_tokens(iter([f"{line}\n" for line in lines]).__next__):
            if token.type == COMMENT:
                row, column = token.start
                kept[row - 1] = kept[row - 1][:column]
    except (TokenError, SyntaxError):
        pass
    return " ".join(kept)


def texts_of_fields(kind: type) -> dict[str, str]:
    """Return the texts below the annotated fields in the bodies of a component class and its bases."""
    texts: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        if not (base is object or base.__module__.startswith("modelica_like.language")):
            texts |= _own_texts(base)
    return texts


@cache
def _own_texts(kind: type) -> dict[str, str]:
    """Return the texts in the body of one class, once: many classes share their bases."""
    body = parse(dedent("".join(source_lines(kind)[0]))).body[0]
    assert isinstance(body, ast.ClassDef)
    return {
        field.target.id: _text_of(below)
        for field, below in zip(body.body, body.body[1:], strict=False)
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
    }


def _text_of(statement: ast.stmt) -> str:
    """Return the text of a statement that is a text."""
    value = statement.value if isinstance(statement, ast.Expr) else None
    words = value.value if isinstance(value, ast.Constant) else ""
    return inspect.cleandoc(words) if isinstance(words, str) else ""
