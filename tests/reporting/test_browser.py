"""A browser without a network opens the page, draws every figure and has nothing to complain of."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from benchmarks.browser import tab as new_tab
from draft.reporting.page import page
from draft.reporting.subjects import Subject

pytest.importorskip("plotly")


@pytest.mark.parametrize("size", [(1280, 720), (2200, 1000), (390, 800)])
def test_the_page_opens_offline_and_draws(
    size: tuple[int, int], three: list[Subject], tmp_path: Path, browser: Any
) -> None:
    path = tmp_path / "report.html"
    path.write_text(page(three), encoding="utf-8")
    said: list[str] = []
    asked: list[str] = []
    tab = new_tab(browser, offline=True, viewport={"width": size[0], "height": size[1]})
    tab.on("console", lambda m: said.append(m.text) if m.type == "error" else None)
    tab.on("pageerror", lambda error: said.append(str(error)))
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto(path.as_uri())
    tab.wait_for_function("document.querySelectorAll('.plot .main-svg').length >= 4")
    plots = tab.evaluate("[...document.querySelectorAll('.plot')].map(p => p.data.length)")
    lost = tab.evaluate(
        "[...document.querySelectorAll('.plot')].filter(p => /WebGL is not/.test(p.innerText))"
        ".length"
    )
    wide = tab.evaluate("document.documentElement.scrollWidth - innerWidth")
    tab.context.close()
    assert said == []
    assert [url for url in asked if not url.startswith(("file:", "data:", "blob:"))] == []
    assert all(plots)
    assert len(plots) >= 4
    assert lost == 0
    assert wide <= 0
