"""Browser page of a run's policy: mjlab's viewer on Draft's own server."""

from __future__ import annotations

import threading
import time

from mjlab.viewer import ViserPlayViewer
from mjlab.viewer.viser.viewer import CheckpointManager, format_time_ago

from draft.learn.training.run import Run
from draft.learn.watching.play import Player
from draft.serving.server import Server

_POLL = 1.0  # Time between two looks for a new checkpoint [s].


class Page:
    """Browser page of a run's policy, on which its checkpoint can be changed.

    Attributes:
        port: port of the server.
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
            player: the policy to show.
            run: its run, whose checkpoints can be chosen.
            host: address to serve on; one that other machines reach needs a token.
            port: port to serve on; 0 for any free one.
            token: secret that visitors need; None for none.
            follow: whether to change to each new checkpoint.
        """
        self._player, self._run, self._follow = player, run, follow
        self._server = Server(host, port, token)
        self.port = self._server.port

    def run(self) -> None:
        """Simulate and show until interrupted.

        Raises:
            KeyboardInterrupt: on Ctrl-C.
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
        # mjlab records Ctrl-C and ends between two steps. Raised within a step, the exception could
        # be lost in a finaliser or in a callback from C.
        viewer.run(catch_sigint=True)
        raise KeyboardInterrupt

    def close(self) -> None:
        """Stop serving."""
        self._server.close()

    def _renew(self, viewer: ViserPlayViewer) -> None:
        """Make the viewer load each new checkpoint, between two of its steps."""
        loaded = self._player.iteration
        while True:
            time.sleep(_POLL)
            newest = self._run.checkpoints()[-1][0]
            if newest != loaded:
                viewer.request_action("FETCH_CHECKPOINT", "latest")
                loaded = newest

    def _available(self) -> list[tuple[str, str]]:
        """Iterations of the checkpoints, and their ages."""
        now = time.time()
        return [
            (str(iteration), format_time_ago(int(now - file.stat().st_mtime)))
            for iteration, file in self._run.checkpoints()
        ]
