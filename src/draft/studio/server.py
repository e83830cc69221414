"""Server of the studio: one session per browser tab."""

from __future__ import annotations

import secrets
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path

import viser

from draft.learn.policy.reduced import AnyPolicy
from draft.serving.server import Server
from draft.studio.library import Library, Setting
from draft.studio.panel import Panel
from draft.studio.report_page import report_page
from draft.studio.session import Point, Session


class Studio:
    """Serves a robot until it is closed.

    Attributes:
        port: port to open in a browser.
    """

    def __init__(
        self,
        library: Library,
        base: str = "",
        host: str = "127.0.0.1",
        port: int = 8080,
        token: str | None = None,
        out: Path = Path("out"),
        values: Mapping[str, Setting] | None = None,
        walk: bool = False,
        policies: Sequence[AnyPolicy] = (),
    ) -> None:
        """Start serving.

        Args:
            library: the robot's named designs.
            base: name of the design to show first; "" for the values in parameters.yaml.
            host: address to serve on; one that other machines can reach requires a token.
            port: port to serve on; 0 for any free one.
            token: secret that the browser must send; None for none.
            out: folder that models are exported to.
            values: changes to that design, by name.
            walk: whether its robot walks at once.
            policies: policies to walk with before those that ship.

        Raises:
            DraftError: the design does not exist, the values give no robot, a token is missing, or
                the port is taken.
        """
        self._library, self._out, self._walk, self._policies = library, out, walk, policies
        self._begin = Point(base, dict(values or {}))
        Session(library, self._begin)  # raises before anything is served
        self._panels: dict[int, tuple[Panel, str]] = {}
        self._pages: dict[str, Session] = {}
        self._lock = threading.Lock()
        self._server = Server(host, port, token, self._page)
        self.port = self._server.port
        self._server.viser.on_client_connect(self._connect)
        self._server.viser.on_client_disconnect(self._disconnect)

    def close(self) -> None:
        """Stop serving."""
        with self._lock:
            panels, self._panels = list(self._panels.values()), {}
        for panel, _ in panels:
            panel.close()
        self._server.close()

    def _connect(self, client: viser.ClientHandle) -> None:
        session = Session(self._library, self._begin)
        # The path is secret, so that no other tab can open this report.
        path = f"/report/{secrets.token_urlsafe(16)}"
        panel = Panel(client, session, self._out, path, self._walk, self._policies)
        with self._lock:
            self._panels[client.client_id] = (panel, path)
            self._pages[path] = session
        if client.client_id not in self._server.viser.get_clients():  # It left meanwhile.
            self._disconnect(client)

    def _disconnect(self, client: viser.ClientHandle) -> None:
        with self._lock:
            panel, path = self._panels.pop(client.client_id, (None, ""))
            self._pages.pop(path, None)
        if panel is not None:
            panel.close()

    def _page(self, path: str) -> str | None:
        """HTML of a report, or of a gamepad, by its URL path."""
        session = self._pages.get(path)
        if session is not None:
            return report_page(session)
        with self._lock:
            gamepads = [panel.gamepad for panel, _ in self._panels.values()]
        answers = (gamepad.page(path) for gamepad in gamepads)
        return next((html for html in answers if html is not None), None)
