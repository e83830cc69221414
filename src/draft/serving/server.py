"""viser's server behind a guard."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable
from typing import Any

from draft.errors import DraftError
from draft.extras import need
from draft.serving.guard import Guard


class Server:
    """A viser server that is reached through a guard only.

    Attributes:
        viser: the server; what it shows is the caller's.
        port: the port to open in a browser.
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
            host: address to serve on; one that other machines reach needs a token.
            port: 0 for any free one.
            token: what a visitor must know; None for nothing.
            page: HTML of a path of Draft's own; None for viser's paths.

        Raises:
            DraftError: viser is not installed, a token is missing, or the port is taken.
        """
        viser = need("viser", "view")
        # viser prints its own address, which is not the one to open.
        with contextlib.redirect_stdout(io.StringIO()):
            self.viser = viser.ViserServer(host="127.0.0.1", port=0, label="Draft", verbose=False)
        try:
            self._guard = Guard(host, port, self.viser.get_port(), token, page)
        except DraftError:
            self.viser.stop()
            raise
        self.port = self._guard.port

    def show(self, model: Any, data: Any, **act: Callable[[Any, Any], None]) -> None:
        """Show a MuJoCo model with mjviser until interrupted.

        Args:
            model: the model.
            data: its state.
            act: `step_fn` and `reset_fn` of `mjviser.Viewer`, each called with model and data.

        Raises:
            KeyboardInterrupt: the one way in which it ends.
        """
        viewer = need("mjviser", "view").Viewer(model, data, server=self.viser, **act)
        # It notes Ctrl-C, stops viser, which says so, and returns.
        with contextlib.redirect_stdout(io.StringIO()):
            viewer.run()
        raise KeyboardInterrupt

    def close(self) -> None:
        """Stop serving."""
        self._guard.close()
        with contextlib.redirect_stdout(io.StringIO()):
            self.viser.stop()
