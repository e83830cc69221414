"""Server of the Model Context Protocol (MCP) over standard input and output.

Tools run in a thread, one at a time, so that pings are answered meanwhile. While the server runs,
the protocol's library sends to standard error what else is printed. Refusals are results that are
marked as errors, with the messages of Draft.
"""

from __future__ import annotations

import base64
import contextlib
import inspect
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import anyio
import anyio.to_thread
from mcp.server import Server
from mcp.server.stdio import stdio_server
from mcp.types import (
    CallToolRequestParams,
    CallToolResult,
    ImageContent,
    ListToolsResult,
    TextContent,
    ToolAnnotations,
)
from mcp.types import Tool as Offer

from draft.assistant import tools  # noqa: F401 - which adds them
from draft.assistant.folder import Folder
from draft.assistant.tool import TOOLS, Tool
from draft.errors import DraftError, suggest
from draft.extensions import fault
from draft.extras import own_version

LARGEST = 1_000_000  # Bytes of an answer.
_INSTRUCTIONS = """\
Draft designs robots: list_robots shows what there is, check says whether a design can be built and
which numbers it has, metrics without a design what can be measured. Numbers are SI, angles radians.
To keep a changed design of a shipped robot, copy the robot by new_robot first. Paths are relative
to the folder that is served."""


def serve(root: Path, training: bool = False) -> None:
    """Serve tools until standard input ends.

    Args:
        root: folder that they read and write below; it becomes the current folder.
        training: whether to offer tools that train.

    Raises:
        DraftError: the folder does not exist.
    """
    assistant = Assistant(Folder(root), training)
    with contextlib.chdir(assistant.folder.root):
        anyio.run(assistant.run)


class Assistant:
    """The tools of a folder, as the protocol asks for them."""

    def __init__(self, folder: Folder, training: bool) -> None:
        self.folder = folder
        self._training = training
        self._one = anyio.CapacityLimiter(1)

    async def run(self) -> None:
        """Answer until standard input ends."""
        server = Server(
            "draft",
            version=own_version(),
            instructions=_INSTRUCTIONS,
            on_list_tools=self._list,
            on_call_tool=self._call,
        )
        async with stdio_server() as (read, write):
            await server.run(read, write, server.create_initialization_options())

    async def _list(self, context: object, given: object) -> ListToolsResult:
        offered = (name for name, tool in TOOLS.items() if self._training or not tool.trains)
        return ListToolsResult(tools=[_offer(name, TOOLS[name]) for name in offered])

    async def _call(self, context: object, given: CallToolRequestParams) -> CallToolResult:
        return await anyio.to_thread.run_sync(
            self.answer, given.name, given.arguments or {}, limiter=self._one
        )

    def answer(self, name: str, given: Mapping[str, Any]) -> CallToolResult:
        """Call a tool; what it refuses is a result too."""
        try:
            result = _result(self._tool(name)(self.folder, given))
            size = len(result.model_dump_json())
            if size > LARGEST:
                cause = f"the answer of {size / 1e6:.1f} MB is larger than {LARGEST / 1e6:g} MB"
                raise DraftError(cause, TOOLS[name].less)
        except DraftError as error:
            return _refusal(str(error))
        except Exception as error:
            return _refusal(fault(error))
        return result

    def _tool(self, name: str) -> Tool:
        if name not in TOOLS:
            raise DraftError(f"there is no tool '{name}'", suggest(name, TOOLS, "tools"))
        if TOOLS[name].trains and not self._training:
            cause = f"'{name}' is not allowed: this server was started without training"
            raise DraftError(cause, "ask the user to start it with training allowed")
        return TOOLS[name]


def _offer(name: str, tool: Tool) -> Offer:
    """A tool as the protocol describes it."""
    return Offer(
        name=name,
        description=inspect.getdoc(tool.function),
        input_schema=tool.arguments.model_json_schema(),
        output_schema=tool.results,
        annotations=ToolAnnotations(read_only_hint=not tool.writes, destructive_hint=False),
    )


def _result(found: Mapping[str, Any] | bytes) -> CallToolResult:
    if isinstance(found, bytes):
        data = base64.b64encode(found).decode()
        return CallToolResult(content=[ImageContent(data=data, mime_type="image/png")])
    text = json.dumps(found, ensure_ascii=False, allow_nan=False)
    return CallToolResult(content=[TextContent(text=text)], structured_content=dict(found))


def _refusal(text: str) -> CallToolResult:
    return CallToolResult(content=[TextContent(text=text)], is_error=True)
