"""Actions of elements and keys of the browser, as tasks of the tab's thread."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from functools import partial
from typing import Any

import viser

from draft.studio.controls import Handle
from draft.studio.tasks import TaskThread

Element = Handle | viser.GuiButtonGroupHandle | viser.GuiCheckboxHandle


def on(tasks: TaskThread, handle: Element, key: str, action: Callable[[Any], object]) -> None:
    """Call an action with the value of an element when the user changes or clicks it.

    A newer value replaces a waiting one; clicks are all carried out.

    Args:
        tasks: thread of the tab.
        handle: the element.
        key: name of the task.
        action: what to do.
    """
    count = itertools.count()

    async def clicked(_: viser.GuiEvent[Any]) -> None:
        tasks.submit(f"{key} {next(count)}", partial(_call, action, handle.value))

    async def changed(event: viser.GuiEvent[Any]) -> None:
        if event.client_id is not None:  # a person's change, not one of the program
            tasks.submit(key, partial(_call, action, handle.value))

    if isinstance(handle, viser.GuiButtonGroupHandle):
        handle.on_click(clicked)
    else:
        handle.on_update(changed)


def on_key(
    gui: viser.GuiApi,
    tasks: TaskThread,
    label: str,
    key: Any,
    action: Callable[[], object],
    modifier: Any = None,
) -> None:
    """Call an action when a key is pressed; a field that is being typed in keeps its keys.

    Args:
        gui: elements of the tab.
        tasks: thread of the tab.
        label: name in the list of commands.
        key: such as "Z", see `viser`.
        action: what to do.
        modifier: such as "cmd/ctrl"; None for none.
    """
    count = itertools.count()

    async def triggered(_: object) -> None:
        tasks.submit(f"{label} {next(count)}", lambda: _call(lambda _: action(), None))

    gui.add_command(label, hotkey=key, modifier=modifier).on_trigger(triggered)


def _call(action: Callable[[Any], object], value: Any) -> None:
    action(value)
