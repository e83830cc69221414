"""Browser page of a run's newest checkpoint during its training, in a process of its own."""

from __future__ import annotations

import contextlib
import io
import multiprocessing
import os
import signal
import sys
import threading
import time
from pathlib import Path

from draft.learn.engine.machine import NATIVE, obstacle
from draft.learn.silence import quiet
from draft.learn.training.run import open_run

_POLL = 1.0  # Time between two looks for a checkpoint, or at the parent process [s].


class Follower:
    """Browser page that changes to each new checkpoint.

    Attributes:
        port: port of the server, which starts at the first checkpoint.
    """

    def __init__(self, folder: Path, host: str, port: int) -> None:
        """Start the process.

        Args:
            folder: folder of the run.
            host: address to serve on.
            port: port to serve on; 0 for any free one.
        """
        self.port = port or _free_port(host)
        context = multiprocessing.get_context("spawn")
        self._process = context.Process(
            target=_serve, args=(folder, host, self.port, os.getpid()), daemon=True
        )
        self._process.start()

    def close(self) -> None:
        """Stop the process."""
        self._process.terminate()
        self._process.join()


def _free_port(host: str) -> int:
    import socket

    with socket.socket() as made:
        made.bind((host, 0))
        return made.getsockname()[1]


def _serve(folder: Path, host: str, port: int, parent: int) -> None:
    """Wait for a checkpoint, then show it and its successors until the parent process exits."""
    quiet()
    # Ctrl-C is for the training, which ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    if sys.platform != "win32":
        os.nice(5)  # Training comes first.
    run = open_run(folder)
    while not run.checkpoints():
        time.sleep(_POLL)
    import torch

    torch.set_num_threads(1)
    engine = NATIVE if obstacle() is None else "warp"
    # The viewer prints each checkpoint that it loads, which would mix with the training's lines.
    with contextlib.redirect_stdout(io.StringIO()):
        if run.plan.mixed:
            from draft.learn.watching.side_by_side import SideBySide, SideBySidePage

            shown = SideBySide(run)
            with contextlib.closing(SideBySidePage(shown, run, host, port, follow=True)) as page:
                page.run()
            return
        from draft.learn.watching.play import Player
        from draft.learn.watching.web import Page

        with (
            contextlib.closing(Player(run, "cpu", engine=engine)) as player,
            contextlib.closing(Page(player, run, host, port, follow=True)) as page,
        ):
            page.run()


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_POLL)
    os._exit(0)
