"""Server of viser behind a guard."""

from __future__ import annotations

import contextlib
import io
import secrets
import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING

from draft.errors import DraftError
from draft.extras import need
from draft.serving.guard import Guard
from draft.serving.inner import check_denied, requiring

if TYPE_CHECKING:
    import mujoco

    Callback = Callable[[mujoco.MjModel, mujoco.MjData], None]


class Server:
    """A viser server that can be reached only through a guard.

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
        secret = secrets.token_urlsafe(32)
        # viser prints its own address, which must not be opened.
        with contextlib.redirect_stdout(io.StringIO()), requiring(secret):
            self.viser = viser.ViserServer(host="127.0.0.1", port=0, label="Draft", verbose=False)
        try:
            inner = self.viser.get_port()
            check_denied(inner)
            self._guard = Guard(host, port, inner, token, page, secret)
        except DraftError:
            self.viser.stop()
            raise
        self.port = self._guard.port

    def show(self, model: mujoco.MjModel, data: mujoco.MjData, **callbacks: Callback) -> None:
        """Show a MuJoCo model with mjviser until Ctrl-C.

        Args:
            model: the model.
            data: its state.
            callbacks: `step_fn` and `reset_fn` of `mjviser.Viewer`.

        Raises:
            KeyboardInterrupt: always, at the end.
        """
        viewer = need("mjviser", "view").Viewer(model, data, server=self.viser, **callbacks)
        # The viewer catches Ctrl-C, stops viser, which prints a message, and returns.
        with contextlib.redirect_stdout(io.StringIO()):
            viewer.run()
        raise KeyboardInterrupt

    def close(self) -> None:
        """Stop serving."""
        self._guard.close()
        with contextlib.redirect_stdout(io.StringIO()):
            self.viser.stop()
