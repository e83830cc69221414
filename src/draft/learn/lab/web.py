"""A policy in the browser: mjlab's viewer on a server of our own, on this machine by default."""

from __future__ import annotations

import threading
import time

from mjlab.viewer import ViserPlayViewer
from mjlab.viewer.viser.viewer import CheckpointManager, format_time_ago

from draft.learn.lab.play import Player
from draft.learn.run import Run
from draft.serving.server import Server

_POLL = 1.0  # seconds


class Page:
    """The page; checkpoints of the run can be changed while it is shown.

    Attributes:
        port: that it is served at.
    """

    def __init__(
        self,
        player: Player,
        run: Run,
        host: str,
        port: int,
        token: str | None = None,
        follow: bool = False,
    ) -> None:
        """Start serving.

        Args:
            player: what is shown.
            run: whose checkpoints can be taken.
            host: address to serve on; one that other machines reach needs a token.
            port: 0 for any free one.
            token: what a visitor must know; None for nothing.
            follow: change to each new checkpoint.
        """
        self._player, self._run, self._follow = player, run, follow
        self._server = Server(host, port, token)
        self.port = self._server.port

    def run(self) -> None:
        """Simulate and show until interrupted.

        Raises:
            KeyboardInterrupt: the one way in which it ends.
        """
        checkpoints = CheckpointManager(
            current_name=str(self._player.iteration),
            fetch_available=self._available,
            load_checkpoint=lambda name: self._player.load(int(name)),
        )
        # The viewer counts elevation upwards, MuJoCo's own renderer downwards.
        view = self._player.env.cfg.viewer
        view.elevation = abs(view.elevation)
        viewer = ViserPlayViewer(
            self._player.env,
            self._player.policy,
            viser_server=self._server.viser,
            checkpoint_manager=checkpoints,
        )
        if self._follow:
            threading.Thread(target=self._renew, args=(viewer,), daemon=True).start()
        # mjlab notes Ctrl-C and ends between two steps. Raised within one, it could come up where
        # exceptions are dropped, in a finaliser or a callback from C, and be lost.
        viewer.run(catch_sigint=True)
        raise KeyboardInterrupt

    def close(self) -> None:
        """Stop serving."""
        self._server.close()

    def _renew(self, viewer: ViserPlayViewer) -> None:
        """Have the viewer take each new checkpoint, between two of its steps."""
        shown = self._player.iteration
        while True:
            time.sleep(_POLL)
            newest = self._run.checkpoints()[-1][0]
            if newest != shown:
                viewer.request_action("FETCH_CHECKPOINT", "latest")
                shown = newest

    def _available(self) -> list[tuple[str, str]]:
        """Iterations of the checkpoints, and how old they are."""
        now = time.time()
        return [
            (str(iteration), format_time_ago(int(now - file.stat().st_mtime)))
            for iteration, file in self._run.checkpoints()
        ]
