"""A browser without a network shows the page, every figure of it, at any width."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("pyarrow")
pytest.importorskip("playwright")

from playwright.sync_api import sync_playwright

from draft.model.picture import Pixels
from draft.study.report import robots, writing
from tests.learn import synthetic

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
BROWSER = next(filter(None, map(shutil.which, NAMES)), None)


@pytest.mark.skipif(BROWSER is None, reason="no Chromium on the path")
def test_the_page_opens_offline_and_fits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writing, "KINDS", ("svg",))
    monkeypatch.setattr(robots, "render", _blank)
    synthetic.study(tmp_path, designs=("cheetah",), seeds=(0,), stages=("velocity",))
    page = writing.write(tmp_path)
    said: list[str] = []
    asked: list[str] = []
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        for width in (1400, 420):
            size = {"width": width, "height": 900}
            tab = browser.new_context(offline=True, viewport=size).new_page()  # type: ignore[arg-type]
            tab.on("console", lambda message: said.append(message.text))
            tab.on("request", lambda request: asked.append(request.url))
            tab.goto(page.as_uri())
            drawn = tab.evaluate("[...document.images].map(i => i.complete && i.naturalWidth > 50)")
            wide = tab.evaluate("document.documentElement.scrollWidth - innerWidth")
            assert len(drawn) >= 7
            assert all(drawn)
            assert wide <= 0
        browser.close()
    assert said == []
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []


def _blank(members: list) -> tuple[Pixels, list[float], float]:
    import numpy as np

    return np.zeros((60, 200, 3), np.uint8), [100.0] * len(members), 50.0
