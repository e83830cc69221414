"""The page of `draft train --view` in a real browser: it waits, shows, and goes on by itself."""

from __future__ import annotations

import contextlib
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from benchmarks import browser

pytest.importorskip("mjlab")
pytest.importorskip("playwright", reason="needs Playwright")
if browser.found() is None:
    pytest.skip("needs Chromium or Chrome", allow_module_level=True)

from draft.learn.lab.follow import Follower
from draft.learn.lab.trainer import Trainer
from draft.learn.run import Run, create
from tests.learn.small import plan

pytestmark = pytest.mark.filterwarnings("ignore")


@contextlib.contextmanager
def _trained(folder: Path) -> Iterator[tuple[Run, Trainer]]:
    run = create(folder, plan(ground="flat"), {})
    with contextlib.closing(Trainer(run, "cpu")) as trainer:
        yield run, trainer


def _answers(port: int) -> bool:
    try:
        urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=1).close()
    except OSError:
        return False
    return True


def test_the_page_opens_at_the_first_checkpoint_and_changes_with_the_next(
    tmp_path: Path,
) -> None:
    with _trained(tmp_path / "run") as (run, trainer):
        follower = Follower(run.folder, "127.0.0.1", 0)
        try:
            assert not _answers(follower.port)
            trainer.keep()
            _until(lambda: _answers(follower.port))
            with browser.browser() as opened:
                tab = opened.new_page()
                tab.goto(f"http://127.0.0.1:{follower.port}/")
                tab.get_by_role("tab", name="Checkpoints").click(timeout=60_000)
                tab.wait_for_selector("input[value^='0 ']", timeout=60_000)
                trainer.train(2)
                trainer.keep()
                tab.wait_for_selector("input[value^='2 ']", timeout=60_000)
        finally:
            follower.close()
    assert not _answers(follower.port)


def _until(true: Callable[[], bool], seconds: float = 120.0) -> None:
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end
        time.sleep(0.2)
