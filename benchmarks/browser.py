"""A real browser for measurements, tests and pictures of the studio."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
# Software rendering, so that it runs where there is no screen; nothing is fetched from anywhere.
OPTIONS = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
SIZE = (1280, 720)


def found() -> str | None:
    """Path of an installed browser of the Chromium family; None where there is none."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


@contextmanager
def browser() -> Iterator[Any]:
    """Playwright's handle of a browser, closed at the end.

    Raises:
        FileNotFoundError: there is no browser.
    """
    from playwright.sync_api import sync_playwright

    path = found()
    if path is None:
        raise FileNotFoundError(f"no browser of these is installed: {', '.join(NAMES)}")
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=path, args=OPTIONS, timeout=0)
        try:
            yield opened
        finally:
            opened.close()


def tab(opened: Any, **options: Any) -> Any:
    """Open a tab in a context of its own, which waits for what it needs without a limit.

    Args:
        opened: the browser.
        options: of Playwright's `new_context`.
    """
    context = opened.new_context(**options)
    context.set_default_timeout(0)
    return context.new_page()


def page(opened: Any, address: str, size: tuple[int, int] = SIZE) -> Any:
    """A tab of its own context at an address of the studio, ready to be used."""
    width, height = size
    made = tab(opened, viewport={"width": width, "height": height})
    made.goto(address)
    made.wait_for_selector("#ds-mass")
    return made


def slider(tab: Any, label: str) -> Any:
    """The thumb of the slider with this label; arrow keys move it."""
    uuid = tab.locator(f"label:has-text('{label}')").first.get_attribute("for")
    return tab.locator(f"[id='{uuid}'] [role=slider]")


def field(tab: Any, label: str) -> Any:
    """The last box in the row of a label: a text, a number, or a list to choose from."""
    row = tab.locator(f"div:has(> div > p > label:has-text('{label}'))").first
    return row.locator("input:not([type=hidden])").last
