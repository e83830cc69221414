"""Pages on a server of their own, opened in a real browser."""

from __future__ import annotations

import functools
import http.server
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from benchmarks import browser as chromium


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: object) -> None:
        pass


@pytest.fixture
def opened(browser: Any) -> Iterator[Callable[[Path, str], Any]]:
    """Opens the page of a folder at a link; the tab has the faults of its scripts as `faults`."""
    servers: list[http.server.ThreadingHTTPServer] = []
    tabs: list[Any] = []

    def open_(folder: Path, link: str = "") -> Any:
        handler = functools.partial(_Quiet, directory=str(folder))
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        servers.append(server)
        tab = chromium.tab(browser, viewport={"width": 1280, "height": 720})
        tabs.append(tab)
        tab.faults = []
        tab.on("pageerror", lambda error: tab.faults.append(str(error)))
        tab.asked = []
        tab.on("request", lambda request: tab.asked.append(request.url))
        tab.goto(f"http://127.0.0.1:{server.server_port}/index.html{link}")
        tab.wait_for_function(
            "window.draftPage || /cannot/.test(document.getElementById('note').textContent)"
        )
        return tab

    yield open_
    for tab in tabs:
        tab.context.close()  # A page simulates as long as it is open.
    for server in servers:
        server.shutdown()
        server.server_close()
