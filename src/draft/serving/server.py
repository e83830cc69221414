"""Server of viser with a guard."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from draft.errors import DraftError
from draft.extras import need
from draft.serving.addresses import check_free, not_served
from draft.serving.guard import Guard
from draft.serving.hook import check_denied, guarded

if TYPE_CHECKING:
    import mujoco

    Callback = Callable[[mujoco.MjModel, mujoco.MjData], None]

_FROM = (1.2, -1.4, 0.7)  # The camera at first, from what is shown, per its size.
# Where this machine reaches a server that listens at all its addresses.
_EVERYWHERE = {"": "127.0.0.1", "0.0.0.0": "127.0.0.1", "::": "::1"}


class Server:
    """A viser server whose guard judges every request.

    Attributes:
        viser: the server; the caller decides what it shows.
        port: port to open in a browser.
    """

    def __init__(
        self,
        host: str,
        port: int,
        token: str | None = None,
        page: Callable[[str], str | None] = lambda _: None,
    ) -> None:
        """Start serving.

        Args:
            host: address to serve on; one that other machines can reach requires a token.
            port: port to serve on; 0 for any free one.
            token: secret that the browser must send; None for none.
            page: returns the HTML of a URL path, or None for the paths of viser.

        Raises:
            DraftError: viser is not installed or cannot be guarded, a token is missing, or the port
                is taken.
        """
        viser = need("viser", "view")
        # A tab may be closed at any time, also while its robot moves.
        warnings.filterwarnings("ignore", message="Queued a .* on a closed connection")
        guard, bare = Guard(host, token, page), host.strip("[]")
        check_free(host, port)  # viser tries a thousand other ports instead.
        # viser prints its address, without a token.
        with contextlib.redirect_stdout(io.StringIO()), guarded(guard):
            self.viser = viser.ViserServer(host=bare, port=port, label="Draft", verbose=False)
        self.port = self.viser.get_port()
        try:
            if port and self.port != port:
                raise not_served(host, port, os.strerror(errno.EADDRINUSE), errno.EADDRINUSE)
            check_denied(self.port, _EVERYWHERE.get(bare, bare))
        except DraftError:
            self.close()
            raise

    def show(self, model: mujoco.MjModel, data: mujoco.MjData, **callbacks: Callback) -> None:
        """Show a MuJoCo model with mjviser until Ctrl-C.

        Args:
            model: the model.
            data: its state.
            callbacks: `step_fn` and `reset_fn` of `mjviser.Viewer`.

        Raises:
            KeyboardInterrupt: always, at the end.
        """
        camera, center = self.viser.initial_camera, np.asarray(model.stat.center)
        camera.look_at = center
        camera.position = center + model.stat.extent * np.array(_FROM)
        viewer = need("mjviser", "view").Viewer(model, data, server=self.viser, **callbacks)
        # The viewer catches Ctrl-C, stops viser, which prints a message, and returns.
        with contextlib.redirect_stdout(io.StringIO()):
            viewer.run()
        raise KeyboardInterrupt

    def close(self) -> None:
        """Stop serving."""
        with contextlib.redirect_stdout(io.StringIO()):
            self.viser.stop()
