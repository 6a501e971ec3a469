"""The language server: between the protocol and the answers."""

from __future__ import annotations

import asyncio
import os
import sys
import time
from pathlib import Path
from typing import Any

from lsprotocol import types
from pygls.exceptions import JsonRpcInvalidParams
from pygls.lsp.server import LanguageServer
from pygls.uris import from_fs_path, to_fs_path

from modelica_like.analyse.sizing.run import survey
from modelica_like.edit.suggested import title
from modelica_like.errors import DEFECTS, ModelicaLikeError
from modelica_like.lsp import answers
from modelica_like.lsp.change import Edit, applied, renamed
from modelica_like.lsp.text import Text
from modelica_like.netlist.outline import Span
from modelica_like.netlist.read import FMU_PART
from modelica_like.show.report.problems import netlist_problems

_PAUSE = 0.3
"""Seconds without a change after which a text is checked: people type faster."""
_SLOW = 2.0
"""A text whose check takes more seconds of CPU time is checked when it is saved, not while it is typed."""
_KINDS = {
    "section": types.CompletionItemKind.Module, "type": types.CompletionItemKind.Class,
    "value": types.CompletionItemKind.Field, "part": types.CompletionItemKind.Variable,
    "end": types.CompletionItemKind.Interface, "unit": types.CompletionItemKind.Unit,
    "word": types.CompletionItemKind.Value,
}  # fmt: skip


class Server(LanguageServer):
    """The server with what it knows of open files: their problems, and how long their checks take."""

    def __init__(self, version: str) -> None:
        # Whole texts: a change of a part counts lines by other characters than the protocol (U+2028).
        super().__init__("modelica-like", version, text_document_sync_kind=types.TextDocumentSyncKind.Full)
        self.problems: dict[str, list[tuple[types.Range, dict[str, Any]]]] = {}
        self.seconds: dict[str, float] = {}
        self.last: tuple[str, str, Text] | None = None

    def text(self, uri: str) -> Text:
        """Return an open file; it is read once."""
        source = self.workspace.get_text_document(uri).source
        if self.last is None or self.last[:2] != (uri, source):
            self.last = uri, source, Text(Path(to_fs_path(uri) or uri), source)
        return self.last[2]

    def at(self, params: Any) -> tuple[Text, int]:
        """Return the text and the offset that a question is about."""
        text, position = self.text(params.text_document.uri), params.position
        line = text.lines[min(position.line, len(text.lines) - 1)]
        place = self.workspace.position_codec.position_from_client_units([line], types.Position(0, position.character))
        return text, text.outline.offset(position.line + 1, place.character + 1)

    def range(self, text: Text, span: Span) -> types.Range:
        """Return the range of a span."""
        ends = (text.outline.position(offset) for offset in span)
        return types.Range(*(types.Position(line - 1, self._units(text, line, column)) for line, column in ends))

    def _units(self, text: Text, line: int, column: int) -> int:
        """Return how many of the client's units stand before a column; most lines need no look."""
        before = text.lines[line - 1]
        return column - 1 if before.isascii() else self.workspace.position_codec.client_num_units(before[: column - 1])

    def check(self, uri: str) -> None:
        """Check an open file, and publish its problems."""
        text, before = self.text(uri), time.process_time()
        listed = [(self._place(text, problem), problem) for problem in _problems(text)]
        self.seconds[uri], self.problems[uri] = time.process_time() - before, listed
        diagnostics = [_diagnostic(place, problem) for place, problem in listed]
        self.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, diagnostics))

    def _place(self, text: Text, problem: dict[str, Any]) -> types.Range:
        """Return the place of a problem; one in a netlist inside is shown where that is used."""
        file, line = problem["file"], problem["line"]
        if file and (other := Path(file).resolve()) != text.path.resolve():
            uses = [entry.value for entry in text.outline.entries if entry.path[-1] == "is"]
            used = (use for use in uses if (text.path.parent / text.outline.read(use)).resolve() == other)
            return self.range(text, text.outline.inside(next(used, (0, 0))))
        begin = text.outline.offset(line or 1, problem["column"] or 1)
        length = problem["length"] or len(text.lines[(line or 1) - 1])
        return self.range(text, (begin, begin + length))

    def edits(self, text: Text, uri: str, changes: list[Edit]) -> types.WorkspaceEdit:
        """Return changes of one file."""
        return types.WorkspaceEdit({uri: [types.TextEdit(self.range(text, span), new) for span, new in changes]})


def _problems(text: Text) -> list[dict[str, Any]]:
    try:
        if text.kind == "sizing":
            return [error.as_json() for error in survey(text.path, text.text)]
        if text.kind != "netlist" or f'"{FMU_PART}"' in text.text:  # those are checked by `cosim`
            return []
        return netlist_problems(text.path, text.text)
    except (OSError, *DEFECTS) as error:
        return [ModelicaLikeError(f"Internal error: {type(error).__name__}: {error}").as_json()]


def _diagnostic(place: types.Range, problem: dict[str, Any]) -> types.Diagnostic:
    note = problem["kind"] == "note"
    severity = types.DiagnosticSeverity.Information if note else types.DiagnosticSeverity.Error
    message = "\n".join(filter(None, (problem["what"], problem["why"], problem["advice"])))
    return types.Diagnostic(place, message, severity, code=problem["kind"], source="modelica-like")


def _watch(server: Server) -> None:
    """Check files when they are opened, changed and saved."""

    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    def opened(params: types.DidOpenTextDocumentParams) -> None:
        server.check(params.text_document.uri)

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    async def changed(params: types.DidChangeTextDocumentParams) -> None:
        document = params.text_document
        await asyncio.sleep(_PAUSE)
        known = server.workspace.text_documents.get(document.uri)
        if known and known.version == document.version and server.seconds.get(document.uri, 0.0) < _SLOW:
            server.check(document.uri)

    @server.feature(types.TEXT_DOCUMENT_DID_SAVE)
    def saved(params: types.DidSaveTextDocumentParams) -> None:
        for uri in [*server.workspace.text_documents]:  # other files may use it
            server.check(uri)

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    def closed(params: types.DidCloseTextDocumentParams) -> None:
        server.problems.pop(params.text_document.uri, None)
        server.text_document_publish_diagnostics(types.PublishDiagnosticsParams(params.text_document.uri, []))


def _answer(server: Server) -> None:
    """Answer questions about a place."""

    @server.feature(types.TEXT_DOCUMENT_COMPLETION, types.CompletionOptions(trigger_characters=[*'".=[{ ']))
    def complete(params: types.CompletionParams) -> list[types.CompletionItem]:
        text, offset = server.at(params)

        def shown(word: answers.Word, span: Span, written: str) -> types.CompletionItem:
            edit, detail = (
                types.TextEdit(server.range(text, span), written),
                word.about.removeprefix(word.label).strip(": \n").partition("\n")[0],
            )
            return types.CompletionItem(
                word.label, kind=_KINDS[word.kind], detail=detail, filter_text=written, text_edit=edit
            )

        return [shown(*item) for item in answers.complete(text, offset)]

    @server.feature(types.TEXT_DOCUMENT_HOVER)
    def hover(params: types.HoverParams) -> types.Hover | None:
        text, offset = server.at(params)
        answer = answers.explain(text, offset)
        # As plain text: descriptions may be of others, and are no markup.
        content = types.MarkupContent(types.MarkupKind.PlainText, answer[0]) if answer else None
        return types.Hover(content, server.range(text, answer[1])) if answer and content else None

    @server.feature(types.TEXT_DOCUMENT_DEFINITION)
    def define(params: types.DefinitionParams) -> types.Location | None:
        text, offset = server.at(params)
        if (found := answers.definition(text, offset)) is None:
            return None
        path, line, column, length = found
        if path == text.path:
            begin = text.outline.offset(line, column)
            return types.Location(params.text_document.uri, server.range(text, (begin, begin + length)))
        place = types.Position(line - 1, 0)
        return types.Location(from_fs_path(str(path.resolve())) or "", types.Range(place, place))

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def symbols(params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        text = server.text(params.text_document.uri)

        def shown(symbol: answers.Symbol, kind: types.SymbolKind) -> types.DocumentSymbol:
            places = server.range(text, symbol.whole), server.range(text, symbol.span)
            inner = [shown(below, types.SymbolKind.Object) for below in symbol.inner]
            return types.DocumentSymbol(symbol.name, kind, *places, detail=symbol.about, children=inner)

        return [shown(symbol, types.SymbolKind.Module) for symbol in answers.symbols(text)]


def _change(server: Server) -> None:
    """Rename, and apply suggestions."""

    @server.feature(types.TEXT_DOCUMENT_RENAME)
    def rename(params: types.RenameParams) -> types.WorkspaceEdit:
        text, offset = server.at(params)
        try:
            return server.edits(text, params.text_document.uri, renamed(text, offset, params.new_name))
        except ModelicaLikeError as error:
            raise JsonRpcInvalidParams("\n".join(filter(None, (error.what, error.advice)))) from None

    @server.feature(types.TEXT_DOCUMENT_CODE_ACTION, types.CodeActionOptions([types.CodeActionKind.QuickFix]))
    def fixes(params: types.CodeActionParams) -> list[types.CodeAction]:
        uri, text, actions = params.text_document.uri, server.text(params.text_document.uri), []
        for place, problem in server.problems.get(uri, ()):
            suggestion = problem["suggestion"]
            if not suggestion or place.end < params.range.start or params.range.end < place.start:
                continue
            if problem["file"] == str(text.path) and (changes := applied(text, suggestion)):
                label = title(suggestion)
                edit, told = server.edits(text, uri, changes), [_diagnostic(place, problem)]
                actions.append(types.CodeAction(label, types.CodeActionKind.QuickFix, diagnostics=told, edit=edit))
        return actions


def serve(version: str) -> None:
    """Answer an editor on standard input and output until it ends the server.

    Args:
        version: of this package.
    """
    # What modules and libraries print goes to standard error: it is no part of the protocol.
    before, stdout = os.dup(1), sys.stdout
    try:
        with os.fdopen(os.dup(1), "wb") as out:
            os.dup2(2, 1)
            sys.stdout = sys.stderr
            server = Server(version)
            for register in (_watch, _answer, _change):
                register(server)
            server.start_io(sys.stdin.buffer, out)
    finally:
        sys.stdout = stdout
        os.dup2(before, 1)
        os.close(before)
