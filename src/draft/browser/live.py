"""A page with its designer in a process of this machine."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from draft.browser.designer import Designer
from draft.learn.policy.reduced import open_any
from draft.serving.messages import MessageServer

PATH = "/designer"  # As in `designer.js`.


def serve(
    page: Sequence[Path], skill: str = "walk", policies: Sequence[str | Path] = (), port: int = 0
) -> MessageServer:
    """Serve a page on this machine alone, and answer its messages.

    Args:
        page: files of a page that was written with `live`, see `draft.browser.page.page`.
        skill: what its policies can do, as the page was written with.
        policies: files of policies to walk with before those that ship.
        port: port to serve on; 0 for any free one.

    Raises:
        DraftError: a policy cannot be read, or the port is taken.
    """
    designer = Designer(skill, [open_any(file) for file in policies])
    files = {path.name: path.read_bytes() for path in page}
    return MessageServer(files, PATH, designer.answer, port)
