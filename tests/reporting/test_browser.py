"""A browser without a network opens the page, draws every figure and has nothing to complain of."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from benchmarks.browser import tab as new_tab
from draft.design.references import open_designs
from draft.reporting import dots
from draft.reporting.page import page
from draft.reporting.subjects import Subject, subjects

pytest.importorskip("plotly")


@pytest.fixture
def opened(tmp_path: Path, browser: Any) -> Iterator[Callable[[list[Subject]], Any]]:
    """Open a report without a network; nothing may be fetched or complained of."""
    said: list[str] = []
    asked: list[str] = []
    tab = new_tab(browser, offline=True, viewport={"width": 1280, "height": 720})
    tab.on("console", lambda m: said.append(m.text) if m.type == "error" else None)
    tab.on("pageerror", lambda error: said.append(str(error)))
    tab.on("request", lambda request: asked.append(request.url))

    def show(found: list[Subject]) -> Any:
        path = tmp_path / "report.html"
        path.write_text(page(found), encoding="utf-8")
        tab.goto(path.as_uri())
        return tab

    yield show
    assert said == []
    assert [url for url in asked if not url.startswith(("file:", "data:", "blob:"))] == []
    tab.context.close()


def resize(tab: Any, width: int, height: int) -> None:
    """Change the window, and wait until the page is no wider than it: figures follow later."""
    tab.set_viewport_size({"width": width, "height": height})
    tab.wait_for_function("() => document.documentElement.scrollWidth <= innerWidth")


def test_the_page_opens_offline_and_draws(
    three: list[Subject], opened: Callable[[list[Subject]], Any]
) -> None:
    tab = opened(three)
    tab.wait_for_function("document.querySelectorAll('.plot .main-svg').length >= 3")
    for width, height in ((1280, 720), (2200, 1000), (390, 800)):
        resize(tab, width, height)
        plots = tab.evaluate("[...document.querySelectorAll('.plot')].map(p => p.data.length)")
        assert all(plots)
        assert len(plots) == 2
    lost = "[...document.querySelectorAll('figure')].filter(p => /no WebGL/.test(p.innerText))"
    assert tab.evaluate(f"{lost}.length") == 0
    assert tab.evaluate("draftRobots.robots.length") == 3


LOOK = """() => [...document.querySelectorAll('.dots .row')].map((row) => ({
  ends: [...row.querySelectorAll('span')].map((span) => span.innerText),
  dots: [...row.querySelectorAll('i')].map((dot) => {
    const box = dot.getBoundingClientRect();
    return [box.x, box.y, box.width, box.height];
  })}))"""


@pytest.mark.parametrize("count", [2, 8])
def test_no_dot_covers_another(count: int, opened: Callable[[list[Subject]], Any]) -> None:
    names = ["quadruped:cheetah", "quadruped:bear", "humanoid", "quadruped:giraffe", "hopper"]
    found = subjects(open_designs((names * 2)[:count]))
    tab = opened(found)
    for width in (1280, 400):
        resize(tab, width, 800)
        rows = tab.evaluate(LOOK)
        assert len(rows) == len(dots.metrics(found)) + len(dots.parameters(found))
        for row in rows:
            assert len(row["ends"]) == 2
            boxes = np.array(row["dots"])
            assert (boxes[:, 0] >= 0).all()
            assert (boxes[:, 0] + boxes[:, 2] <= width).all()
            centres = boxes[:, :2] + boxes[:, 2:] / 2
            away = np.linalg.norm(centres[:, None] - centres[None], axis=2)
            assert away[~np.eye(len(boxes), dtype=bool)].min() >= boxes[0, 2] - 0.5


PLACES = "() => draftRobots.robots.map((robot) => [...robot.positions].join())"
# Height of the lowest corner of all triangles, by the matrices with which three.js draws them.
LOWEST = """() => Math.min(...draftRobots.robots.flatMap(({ figure }) =>
  [...figure.parts.values()].map(({ mesh: { geometry, matrix } }) => {
    const { array } = geometry.attributes.position;
    const [a, b, c, d] = [2, 6, 10, 14].map((k) => matrix.elements[k]);
    let lowest = Infinity;
    for (let i = 0; i < array.length; i += 3)
      lowest = Math.min(lowest, a * array[i] + b * array[i + 1] + c * array[i + 2] + d);
    return lowest;
  })))"""


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


@pytest.mark.slow
def test_robots_walk_under_live_physics_where_the_extra_is(
    opened: Callable[[list[Subject]], Any],
) -> None:
    pytest.importorskip("mjswan", reason="needs the extra page")
    tab = opened(subjects(open_designs(["cheetah", "hopper"]), walk=True))
    live = tab.frames[1]
    live.wait_for_function("window.draftPage && draftPage.robots[0].qpos[0] > 0.2")
    assert "It stands: no policy drives" in live.evaluate(
        "() => { draftPage.choose(1); return document.getElementById('why').textContent; }"
    )


def test_the_robots_walk_until_they_are_paused(
    monkeypatch: pytest.MonkeyPatch, opened: Callable[[list[Subject]], Any]
) -> None:
    monkeypatch.setattr("draft.reporting.subjects.available", lambda: False)
    found = subjects(open_designs(["cheetah", "bear", "giraffe"]), walk=True)
    tab = opened(found)
    tab.wait_for_function("window.draftRobots")
    before = tab.evaluate(PLACES)
    tab.wait_for_function(f"(old) => ({PLACES})().every((x, i) => x !== old[i])", arg=before)
    button = tab.locator("#walk-play")
    assert button.inner_text() == "Pause"
    button.click()
    assert button.inner_text() == "Play"
    for scheme in ("light", "dark"):
        tab.emulate_media(color_scheme=scheme)
        tab.evaluate("() => { draftRobots.time = 1.0; draftRobots.draw(); }")
        first = tab.evaluate(PLACES)
        tab.evaluate("() => { draftRobots.time = 1.2; draftRobots.draw(); }")
        assert tab.evaluate(PLACES) != first
        # The page moves the bodies as MuJoCo moved the feet, which are drawn as polyhedra.
        assert tab.evaluate(LOWEST) == pytest.approx(lowest_foot(found, 1.2), abs=2e-3)
    tab.locator("#walk-speed").fill("0.5")
    assert tab.inner_text("#walk-shown") == "0.5 ×"
