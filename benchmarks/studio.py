"""How long a person waits in the studio, measured in a real browser.

`python -m benchmarks.studio` prints a table and writes `benchmarks/results/studio.json`. From the
key that moves a slider to the end of the frame that the page draws after the new mass stands in it:
the robot's meshes come in the same message as the numbers. Without a GPU the browser draws by
software, and a busy machine shows in every number. The rows of a walking robot swap its body at
each move, in the thread that also simulates it.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import draft
from benchmarks import browser
from benchmarks.rows import measured, publish
from draft.studio.library import Library
from draft.studio.server import Studio

MOVES = 60
EFFECT_ON = "payload_rated"  # Which all sliders of legs and trunk change, in both robots.
EFFECTS = """[...document.querySelectorAll('label')].map((one) => one.textContent)
  .filter((text) => /[▲▼]/.test(text)).join()"""
SECONDS = 5.0  # of walking before the moves [s]
# From a key press to the change of the mass, and to the end of the page's next frame [ms].
WAIT = """(thumb) => new Promise((done) => {
  const mass = () => document.getElementById('ds-mass')?.textContent;
  const before = mass();
  const start = performance.now();
  const watch = new MutationObserver(() => {
    if (mass() === before) return;
    watch.disconnect();
    const changed = performance.now() - start;
    requestAnimationFrame(() => {
      const channel = new MessageChannel();
      channel.port1.onmessage = () => done([changed, performance.now() - start]);
      channel.port2.postMessage(0);
    });
  });
  watch.observe(document.body, {subtree: true, childList: true, characterData: true});
  thumb.focus();
  thumb.dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight', bubbles: true}));
})"""


def main() -> None:
    """Measure, print a table and write it as JSON."""
    rows = [row for robot in ("quadruped", "humanoid") for row in studio(robot)]
    publish("studio", rows)


def studio(robot: str) -> list[dict[str, Any]]:
    """Time to a page that is ready, and from a slider's move to numbers and picture."""
    with tempfile.TemporaryDirectory() as folder:
        served = Studio(Library(draft.load(robot), Path(folder)), port=0)
        address = f"http://127.0.0.1:{served.port}/"
        try:
            with browser.browser() as opened:
                browser.page(opened, address).context.close()
                start = time.perf_counter()
                tab = browser.page(opened, address)
                ready = time.perf_counter() - start
                time.sleep(3)
                thumb = browser.slider(tab, "thigh_length")
                times = [thumb.evaluate(WAIT) for _ in range(MOVES)][5:]
                moved = _effects(tab)
                walking = _walking(served, tab)
        finally:
            served.close()
    numbers, picture = _medians(times)
    effects, effects_drawn = _medians(moved)
    return [
        *([] if walking is None else _walking_rows(robot, *walking)),
        measured(f"{robot}: page ready", ready, "s", 3.0),
        measured(f"{robot}: slider to numbers, median", numbers, "ms", 100.0),
        measured(f"{robot}: slider to picture and numbers, median", picture, "ms", 100.0),
        measured(f"{robot}: the same, 90 % of moves", _most([t for _, t in times]), "ms"),
        measured(f"{robot}: slider to effects of all sliders, median", effects, "ms", 100.0),
        measured(f"{robot}: slider to picture and effects, median", effects_drawn, "ms", 100.0),
    ]


def _effects(tab: Any) -> list[list[float]]:
    """Times of a slider's moves while all sliders show their effect on a metric [ms].

    Effects and numbers come in one message.
    """
    tab.get_by_role("tab", name="Levers", exact=True).click()
    browser.field(tab, "effect on").click()
    tab.get_by_role("option", name=EFFECT_ON, exact=True).click()
    tab.get_by_role("tab", name="Parameters", exact=True).click()
    tab.wait_for_function(f"{EFFECTS} !== ''")
    before = tab.evaluate(EFFECTS)
    thumb = browser.slider(tab, "thigh_length")
    times = [thumb.evaluate(WAIT) for _ in range(MOVES)][5:]
    if tab.evaluate(EFFECTS) == before:
        raise RuntimeError("the effects of the sliders stay as they were")
    return times


def _walking(served: Studio, tab: Any) -> tuple[list[list[float]], float] | None:
    """Times of a slider's moves while the robot walks [ms], and simulated over real time.

    None where no policy drives the robot.
    """
    tab.get_by_role("tab", name="Walk", exact=True).click()
    tab.get_by_label("Walk", exact=True).last.click()
    tab.wait_for_selector("#ds-speed, #ds-stands")
    (shown, _), *_ = served._panels.values()
    walk = shown._walker.walk
    if walk is None:
        return None
    time.sleep(2)
    start, before = time.perf_counter(), walk.data.time
    time.sleep(SECONDS)
    pace = (walk.data.time - before) / (time.perf_counter() - start)
    thumb = browser.slider(tab, "thigh_length")
    return [thumb.evaluate(WAIT) for _ in range(MOVES)][5:], pace


def _walking_rows(robot: str, times: list[list[float]], pace: float) -> list[dict[str, Any]]:
    numbers, picture = _medians(times)
    return [
        measured(f"{robot} walking: simulated over real time", pace, "1", 0.9, at_least=True),
        measured(f"{robot} walking: slider to numbers, median", numbers, "ms", 100.0),
        measured(f"{robot} walking: slider to picture and numbers, median", picture, "ms", 100.0),
        measured(f"{robot} walking: the same, 90 % of moves", _most([t for _, t in times]), "ms"),
    ]


def _medians(times: list[list[float]]) -> list[float]:
    """Median times to numbers, and to picture and numbers [ms]."""
    return [statistics.median(column) for column in zip(*times, strict=True)]


def _most(times: list[float]) -> float:
    return sorted(times)[int(0.9 * len(times))]


if __name__ == "__main__":
    main()
