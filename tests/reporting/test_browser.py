"""A browser without a network opens the page, draws every figure and has nothing to complain of."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from benchmarks.browser import tab as new_tab
from draft.design.references import open_designs
from draft.reporting.page import page
from draft.reporting.subjects import Subject, subjects

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
    tab.wait_for_function("document.querySelectorAll('.plot .main-svg').length >= 3")
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
    assert len(plots) >= 3
    assert lost == 0
    assert wide <= 0


PLACES = """() => document.getElementById('plot-robots').data
  .filter((trace) => trace.type === 'mesh3d' && trace.x.length).map((trace) => trace.x[0])"""


def lowest_foot(found: list[Subject], time: float) -> float:
    """Height of the lowest point of all feet in the recordings at a time [m]."""
    heights = []
    for gait, model in ((one.gait, one.model) for one in found):
        if gait is None or model is None or not gait.walks:
            continue
        frame = round(time / gait.period)
        for i in np.flatnonzero(model.mujoco.geom_type == mujoco.mjtGeom.mjGEOM_SPHERE):
            body = int(model.mujoco.geom_bodyid[i]) - 1
            turned = np.zeros(3)
            mujoco.mju_rotVecQuat(
                turned, model.mujoco.geom_pos[i], gait.quaternions[frame, body].copy()
            )
            centre = gait.positions[frame, body] + turned
            heights.append(centre[2] - model.mujoco.geom_size[i, 0])
    return float(min(heights))


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_robots_walk_offline_until_they_are_paused(
    scheme: str, tmp_path: Path, browser: Any
) -> None:
    path = tmp_path / "report.html"
    found = subjects(open_designs(["cheetah", "bear", "giraffe"]), walk=True)
    path.write_text(page(found), encoding="utf-8")
    said: list[str] = []
    size = {"width": 1280, "height": 720}
    tab = new_tab(browser, offline=True, viewport=size, color_scheme=scheme)
    tab.on("console", lambda m: said.append(m.text) if m.type == "error" else None)
    tab.on("pageerror", lambda error: said.append(str(error)))
    tab.goto(path.as_uri())
    tab.wait_for_function(f"({PLACES})().length > 0")
    before = tab.evaluate(PLACES)
    tab.wait_for_function(f"(old) => ({PLACES})().every((x, i) => x !== old[i])", arg=before)
    button = tab.locator("#walk-play")
    assert button.inner_text() == "Pause"
    button.click()
    assert button.inner_text() == "Play"
    tab.evaluate("draftWalk.draw(1.0)")
    first = tab.evaluate(PLACES)
    tab.evaluate("draftWalk.draw(1.2)")
    second = tab.evaluate(PLACES)
    lowest = tab.evaluate(
        "Math.min(...document.getElementById('plot-robots').data"
        ".filter((t) => t.type === 'mesh3d' && t.z.length).flatMap((t) => [...t.z]))"
    )
    tab.locator("#walk-speed").fill("0.5")
    assert tab.inner_text("#walk-shown") == "0.5 ×"
    wide = tab.evaluate("document.documentElement.scrollWidth - innerWidth")
    tab.context.close()
    assert said == []
    assert first != second
    # The page moves the vertices as MuJoCo moved the feet, which are drawn as polyhedra.
    assert lowest == pytest.approx(lowest_foot(found, 1.2), abs=2e-3)
    assert wide <= 0
