"""Tools of an assistant: functions of a folder, and of arguments that are checked as settings."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import create_model

from draft.assistant.folder import Folder
from draft.settings import Settings

Record = dict[str, Any]
Function = Callable[..., Record | bytes]


@dataclass(frozen=True)
class Tool:
    """A tool.

    Attributes:
        function: what it does; its docstring is the description for assistants.
        arguments: its arguments.
        results: JSON Schema of its record; None for a picture.
        less: what to ask for where its answer is too large, as an imperative.
        writes: whether it writes files.
        trains: whether it trains.
    """

    function: Function
    arguments: type[Settings]
    results: Record | None
    less: str
    writes: bool
    trains: bool

    def __call__(self, folder: Folder, given: Mapping[str, Any]) -> Record | bytes:
        """Call it: a record, or a picture as PNG.

        Raises:
            DraftError: an argument is unknown, missing or invalid, or what the function raises.
        """
        return self.function(folder, **dict(self.arguments.of(given)))


TOOLS: dict[str, Tool] = {}


def tool(
    results: Mapping[str, Any] | None,
    less: str = "ask about one robot",
    writes: bool = False,
    trains: bool = False,
) -> Callable[[Function], Function]:
    """Offer a function of a folder and of described arguments to assistants.

    Args:
        results: types of its record by name; None for a picture.
        less: see `Tool`.
        writes: see `Tool`.
        trains: see `Tool`.
    """

    def add(function: Function) -> Function:
        name = function.__name__
        _, *own = inspect.signature(function, eval_str=True).parameters.values()
        given: dict[str, Any] = {
            one.name: (one.annotation, ... if one.default is one.empty else one.default)
            for one in own
        }
        arguments = create_model(name, __base__=Settings, **given)
        schema = None
        if results is not None:
            fields: dict[str, Any] = {key: (kind, ...) for key, kind in results.items()}
            schema = create_model(name, **fields).model_json_schema()
        TOOLS[name] = Tool(function, arguments, schema, less, writes, trains)
        return function

    return add
