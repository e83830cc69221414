"""A browser without a network shows the page, every figure of it, at any width."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from benchmarks.browser import tab as new_tab

pytest.importorskip("matplotlib")
pytest.importorskip("pyarrow")

from draft.model.picture import Pixels
from draft.study.report import robots, writing
from tests.learn import synthetic


def test_the_page_opens_offline_and_fits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, browser: Any
) -> None:
    monkeypatch.setattr(writing, "KINDS", ("svg",))
    monkeypatch.setattr(robots, "render", _blank)
    synthetic.study(tmp_path, designs=("cheetah",), seeds=(0,), stages=("velocity",))
    page = writing.write(tmp_path)
    said: list[str] = []
    asked: list[str] = []
    for width in (1400, 420):
        tab = new_tab(browser, offline=True, viewport={"width": width, "height": 900})
        tab.on("console", lambda message: said.append(message.text))
        tab.on("request", lambda request: asked.append(request.url))
        tab.goto(page.as_uri())
        drawn = tab.evaluate("[...document.images].map(i => i.complete && i.naturalWidth > 50)")
        wide = tab.evaluate("document.documentElement.scrollWidth - innerWidth")
        assert len(drawn) >= 7
        assert all(drawn)
        assert wide <= 0
        tab.context.close()
    assert said == []
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []


def _blank(members: list) -> tuple[Pixels, list[float], float]:
    import numpy as np

    return np.zeros((60, 200, 3), np.uint8), [100.0] * len(members), 50.0
