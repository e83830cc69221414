"""How fast is a web page in which robots walk? Measured in a real browser.

`python -m benchmarks.page` prints a table and writes `benchmarks/results/page.json`. Without a GPU
the browser draws by software, and a busy machine shows in every number: run it alone.
"""

from __future__ import annotations

import functools
import http.server
import statistics
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from benchmarks import browser
from benchmarks.rows import measured, publish, timed
from draft.browser.page import page

WARM, SECONDS = 4.0, 6.0  # Before a measurement, and of it [s].
MOVES = 20
ALONE = "three robots, physics and policy alone, simulated per real time, in whole percents"
THREE = ("cheetah", "bear", "giraffe")
RANGES = ("thigh_length=0.2:0.3", "shank_length=0.2:0.3", "actuators.leg.peak_torque=60:120")


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: object) -> None:
        pass


def main() -> None:
    """Measure, print a table and write it as JSON."""
    with tempfile.TemporaryDirectory() as place, browser.browser() as opened:
        one, three, varied = (Path(place) / name for name in ("one", "three", "varied"))
        page(["cheetah"], one)
        took, _ = timed(lambda: page(THREE, three))
        page(["cheetah"], varied, vary=RANGES)
        with _tab(opened, one) as tab:
            drawn = _rates(tab)
        with _tab(opened, three) as tab:
            abreast = _rates(tab)
            tab.evaluate("draftPage.picture.draw = () => {}")
            alone = _rates(tab)
        with _tab(opened, varied) as tab:
            moves = _moves(tab)
    publish(
        "page",
        [
            measured("page of three robots", took, "s", 15.0),
            measured("one robot, 1280 x 720", drawn[0], "pictures/s", 20.0, at_least=True),
            measured("one robot, simulated per real time", 100 * drawn[1], "%"),
            measured("three robots", abreast[0], "pictures/s"),
            measured(ALONE, round(100 * alone[1]), "%", 100.0, at_least=True),
            measured("slider to new body, median", statistics.median(moves), "ms", 50.0),
            measured(f"slider to new body, most of {MOVES}", max(moves), "ms"),
        ],
    )


@contextmanager
def _tab(opened: Any, folder: Path) -> Iterator[Any]:
    """A tab with the page of a folder, whose robots have walked for a while."""
    handler = functools.partial(_Quiet, directory=str(folder))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    width, height = browser.SIZE
    tab = browser.tab(opened, viewport={"width": width, "height": height})
    try:
        tab.goto(f"http://127.0.0.1:{server.server_port}/index.html")
        tab.wait_for_function("window.draftPage")
        time.sleep(WARM)
        yield tab
    finally:
        tab.context.close()
        server.shutdown()
        server.server_close()


def _rates(tab: Any) -> tuple[float, float]:
    """Pictures per second, and simulated per real time."""
    before = tab.evaluate("({ ...draftPage.count })")
    time.sleep(SECONDS)
    after = tab.evaluate("({ ...draftPage.count })")
    wall = after["wall"] - before["wall"]
    pictures, simulated = (after[name] - before[name] for name in ("pictures", "simulated"))
    return pictures / wall, simulated / wall


def _moves(tab: Any) -> list[float]:
    """Times from a slider's move to the new body [ms]."""
    found = []
    for k in range(MOVES):
        tab.evaluate(
            """(share) => { const [slider] = draftPage.shaped;
              slider.value = Number(slider.min) + share * (slider.max - slider.min);
              draftPage.reshape(); }""",
            k / MOVES,
        )
        found.append(tab.evaluate("draftPage.count.reshaped"))
        time.sleep(0.1)
    return found


if __name__ == "__main__":
    main()
