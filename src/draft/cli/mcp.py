"""`draft mcp`: let an assistant design robots below a folder."""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from typing import Annotated

import tyro

from draft.extras import need


def main(
    folder: Annotated[
        tyro.conf.Positional[Path],
        tyro.conf.arg(metavar="FOLDER", help="Folder that the assistant reads and writes below."),
    ],
    /,
    *,
    allow_training: Annotated[
        bool, tyro.conf.arg(help="Offer a tool that trains policies (extra learn).")
    ] = False,
) -> int:
    """Let an assistant design robots below a folder, over standard input and output.

    An assistant that speaks the Model Context Protocol starts this command; docs/agents.md shows
    how to add it.
    """
    need("mcp", "mcp")
    from draft.assistant.server import serve

    if sys.stdin.isatty():
        print("waiting for an assistant on standard input; Ctrl-C ends it", file=sys.stderr)
    # The thread that reads standard input would outlast an interrupt.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    serve(folder, allow_training)
    return 0
