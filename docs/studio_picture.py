"""The README's picture of the studio, taken in a real browser.

python -m docs.studio_picture   # docs/images/studio.png
"""

from __future__ import annotations

import tempfile
import time
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
    with tempfile.TemporaryDirectory() as folder:
        studio = Studio(Library(draft.load("quadruped"), Path(folder)), port=0)
        try:
            with browser.browser() as opened:
                data = _take(opened, f"http://127.0.0.1:{studio.port}/")
        finally:
            studio.close()
    # A palette keeps the file small; the page has few colours.
    picture = Image.open(BytesIO(data)).convert("RGB").quantize(200)
    picture.save(PICTURE, optimize=True)
    print(f"{PICTURE}  {PICTURE.stat().st_size // 1000} kB")


def _take(opened: browser.Any, address: str) -> bytes:
    tab = browser.page(opened, address)
    tab.wait_for_selector("label:has-text('trunk_height')")
    tab.get_by_role("button", name="Pin", exact=True).click()
    for label, value in (("thigh_length", "0.36"), ("shank_length", "0.3")):
        browser.field(tab, label).fill(value)
    tab.evaluate("document.activeElement.blur()")
    tab.evaluate(
        "document.querySelectorAll('[role=alert] button').forEach(button => button.click())"
    )
    time.sleep(SETTLE)
    return tab.screenshot()


if __name__ == "__main__":
    main()
