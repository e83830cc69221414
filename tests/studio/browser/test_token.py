"""Access from other machines."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import draft
from benchmarks import browser as chromium

viser = pytest.importorskip("viser", reason="needs the extra 'view'")

from draft.studio.library import Library  # noqa: E402
from draft.studio.server import Studio  # noqa: E402

pytestmark = pytest.mark.filterwarnings("ignore")
TOKEN = "a-token-of-20-chars_"


def test_without_the_token_a_browser_gets_nothing(browser: Any, folder: Path) -> None:
    studio = Studio(Library(draft.load("hopper"), folder), host="0.0.0.0", port=0, token=TOKEN)
    address = f"http://127.0.0.1:{studio.port}/"
    page = chromium.tab(browser)
    try:
        for query in ("", "?token=wrong-token-of-20-ch"):
            assert page.goto(address + query).status == 401
            assert "requires its token" in page.inner_text("body")
        tried = page.evaluate(
            """([address, protocol]) => new Promise((done) => {
              const socket = new WebSocket(address, protocol);
              socket.onmessage = () => done('message');
              socket.onopen = () => done('open');
              socket.onerror = () => done('refused');
            })""",
            [address.replace("http", "ws"), f"viser-v{viser.__version__}"],
        )
        assert tried == "refused"
        known = chromium.page(browser, f"{address}?token={TOKEN}")
        assert re.fullmatch(r"\d+\.\d+ kg", known.inner_text("#ds-mass"))
        assert TOKEN not in known.url
        assert page.goto(address).status == 401
        known.context.close()
    finally:
        page.context.close()
        studio.close()
