"""Between the Model Context Protocol and the tools."""

from __future__ import annotations

import inspect
import re
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import anyio
from anyio.to_thread import run_sync
from mcp.server.lowlevel import Server
from mcp.server.stdio import stdio_server
from mcp_types import CallToolRequestParams, CallToolResult, ListToolsResult, TextContent, Tool, ToolAnnotations

from modelica_like.arguments import takes
from modelica_like.edit.document import OPERATIONS
from modelica_like.errors import DEFECTS, ModelicaLikeError
from modelica_like.mcp import answers
from modelica_like.mcp.tools import ARGUMENTS, OWN, SECONDS, Tools, too_long, use
from modelica_like.mcp.turns import Call, Turns
from modelica_like.trust import confined

_READING = {"netlists", "text", "library", "check", "simulate", "values", "sensitivities", "steady"}
_ABOUT = (
    "Drive-trains as netlists (TOML): parts with parameters and units, joined in [series] and [connect]. All files are "
    "in one folder. Find types by library, begin by new, change by operations (add, connect, set …), then check and "
    "simulate. Every operation is written to the file; undo takes it back. A problem's suggestion is made by apply."
)
_ARGUMENT = re.compile(r"^    (\w+): (.*(?:\n        .*)*)", re.M)
_KINDS: dict[str, dict[str, Any]] = {
    "str": {"type": "string"}, "float": {"type": "number"}, "Mapping": {"type": "object"},
    "Sequence": {"type": "array", "items": {"type": "string"}},
}  # fmt: skip


def listed() -> list[Tool]:
    """Return the descriptions of all tools, with schemas of their arguments."""
    operations = [_tool(name, OPERATIONS[name], ["file"]) for name in OPERATIONS]
    return [*operations, *(_tool(name, function, []) for name, function in OWN.items())]


def _tool(name: str, function: Callable[..., Any], before: list[str]) -> Tool:
    text = inspect.cleandoc(function.__doc__ or "")
    described = ARGUMENTS | {key: " ".join(about.split()) for key, about in _ARGUMENT.findall(text)}
    kinds = dict.fromkeys(before, "str") | {key: str(argument.annotation) for key, argument in takes(function).items()}
    needed = [key for key, argument in takes(function).items() if argument.default is inspect.Parameter.empty]
    properties = {key: {**_kind(annotation), "description": described[key]} for key, annotation in kinds.items()}
    inputs = {"type": "object", "properties": properties, "required": [*before, *needed], "additionalProperties": False}
    hints = ToolAnnotations(read_only_hint=name in _READING, open_world_hint=False)
    return Tool(name=name, description=text.partition("\n\nArgs:")[0], input_schema=inputs, annotations=hints)


def _kind(annotation: str) -> dict[str, Any]:
    kinds = [_KINDS[kind.partition("[")[0]] for kind in annotation.split(" | ") if kind not in ("None", "Any")]
    return kinds[0] if len(kinds) == 1 else {"anyOf": kinds} if kinds else {}


def answer(tools: Tools, root: Path, name: str, arguments: dict[str, Any]) -> CallToolResult:
    """Use a tool; what it refuses is an answer, too."""
    try:
        with confined(root):
            data, failed = use(tools, name, arguments), False
    except ModelicaLikeError as error:
        return refused(root, error)
    except OSError as error:
        what = f"{Path(error.filename or 'A temporary file').name}: {error.strerror or error}."
        data, failed = {"problems": [{"what": what}]}, True
    except DEFECTS as error:
        data, failed = {"problems": [{"what": f"Internal error: {type(error).__name__}: {error}"}]}, True
    return _result(data, failed=failed)


def refused(root: Path, error: ModelicaLikeError) -> CallToolResult:
    """Return the answer to what is refused."""
    problems = answers.problems(root, [problem.as_json() for problem in error.problems()])
    return _result({"problems": problems}, failed=True)


def _result(data: dict[str, Any], *, failed: bool) -> CallToolResult:
    return CallToolResult(content=[TextContent(text=answers.written(data))], is_error=failed)


def serve(version: str, folder: Path) -> None:
    """Answer a program on standard input and output until it ends the server.

    Args:
        version: of this package.
        folder: with the netlists; no file outside is read or written.

    Raises:
        NetlistError: there is no such folder.
    """
    # One at a time: a netlist is read, changed and written.
    tools, root, turns, in_turn = Tools(folder), folder.resolve(), Turns[CallToolResult](), anyio.Semaphore(1)

    async def on_list_tools(context: Any, params: Any) -> ListToolsResult:
        return ListToolsResult(tools=listed())

    async def on_call_tool(context: Any, params: CallToolRequestParams) -> CallToolResult:
        name, arguments = params.name, dict(params.arguments or {})
        call = Call(
            partial(answer, tools, root, name, arguments), lambda stop: refused(root, too_long(name, SECONDS, stop))
        )
        async with in_turn:
            turns.add(call)
            try:
                with anyio.move_on_after(SECONDS):
                    return await run_sync(call.answer.result, abandon_on_cancel=True)
                turns.stop(call)
                return await run_sync(call.answer.result)
            finally:
                turns.stop(call)  # nobody waits for it any more

    handlers = {"on_list_tools": on_list_tools, "on_call_tool": on_call_tool}
    server = Server("modelica-like", version=version, instructions=_ABOUT, **handlers)

    async def main() -> None:
        # What modules and libraries print goes to standard error: stdio_server keeps the protocol apart.
        async with stdio_server() as (read, write):
            await server.run(read, write, server.create_initialization_options())

    def speak() -> None:
        try:
            anyio.run(main)
        finally:
            turns.add(None)

    threading.Thread(target=speak, daemon=True).start()
    turns.work()
