"""The README's picture of the studio, taken in a real browser.

python -m docs.studio_picture   # docs/images/studio.png
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

from PIL import Image

import draft
from benchmarks import browser
from draft.studio.library import Library
from draft.studio.server import Studio

PICTURE = Path(__file__).resolve().parent / "images" / "studio.png"
SETTLE = 4.0  # until the page has drawn everything [s]


def main() -> None:
    """Take the picture: a changed quadruped before its pinned default."""
    take(PICTURE, compare)


def take(
    path: Path, act: Callable[[browser.Any], None], size: tuple[int, int] = browser.SIZE
) -> None:
    """Take a picture of the studio.

    Args:
        path: file of the picture.
        act: what to do in the tab before.
        size: width and height of the window [pixels].
    """
    with tempfile.TemporaryDirectory() as folder:
        studio = Studio(Library(draft.load("quadruped"), Path(folder)), port=0)
        try:
            with browser.browser() as opened:
                tab = browser.page(opened, f"http://127.0.0.1:{studio.port}/", size)
                tab.wait_for_selector("label:has-text('trunk_height')")
                act(tab)
                tab.mouse.move(10, 10)
                tab.evaluate(
                    "document.querySelectorAll('[role=alert] button').forEach(b => b.click())"
                )
                time.sleep(SETTLE)
                data = tab.screenshot()
        finally:
            studio.close()
    # No palette: it would lose the colours of few pixels, as those of the joints.
    Image.open(BytesIO(data)).convert("RGB").save(path, optimize=True)
    print(f"{path}  {path.stat().st_size // 1000} kB")


def compare(tab: browser.Any) -> None:
    """Show a changed robot before its pinned default."""
    tab.get_by_role("button", name="Pin", exact=True).click()
    for label, value in (("thigh_length", "0.36"), ("shank_length", "0.3")):
        browser.field(tab, label).fill(value)
    tab.evaluate("document.activeElement.blur()")


def walk(tab: browser.Any) -> None:
    """Let the robot walk, and give it longer thighs while it does."""
    tab.get_by_role("tab", name="Walk", exact=True).click()
    tab.get_by_label("Walk", exact=True).last.click()
    time.sleep(SETTLE)
    browser.field(tab, "thigh_length").fill("0.3")
    tab.evaluate("document.activeElement.blur()")
    tab.get_by_text("Torque over speed").last.evaluate("e => e.scrollIntoView()")


if __name__ == "__main__":
    main()
