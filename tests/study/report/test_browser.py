"""A browser without a network shows the page, every figure of it, at any width."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from benchmarks.browser import tab as new_tab

pytest.importorskip("matplotlib")
pytest.importorskip("pyarrow")

from draft.study.report import writing


def test_the_page_opens_offline_and_fits(one: Path, browser: Any) -> None:
    page = writing.write(one)
    said: list[str] = []
    asked: list[str] = []
    tab = new_tab(browser, offline=True, viewport={"width": 1400, "height": 900})
    tab.on("console", lambda message: said.append(message.text))
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto(page.as_uri())
    for width in (1400, 420):
        tab.set_viewport_size({"width": width, "height": 900})
        drawn = tab.evaluate("[...document.images].map(i => i.complete && i.naturalWidth > 50)")
        assert len(drawn) >= 7
        assert all(drawn)
        assert tab.evaluate("document.documentElement.scrollWidth - innerWidth") <= 0
    tab.context.close()
    assert said == []
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []
