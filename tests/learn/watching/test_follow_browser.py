"""The page of `draft train --view` in a real browser: it waits, shows, and goes on by itself."""

from __future__ import annotations

import contextlib
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from benchmarks.browser import tab as new_tab

pytest.importorskip("mjlab")

from draft.learn.training.ppo.trainer import Trainer
from draft.learn.training.run import Run, create
from draft.learn.watching.follow import Follower
from tests.learn.small import plan
from tests.waiting import until

pytestmark = pytest.mark.filterwarnings("ignore")


@contextlib.contextmanager
def _trained(folder: Path) -> Iterator[tuple[Run, Trainer]]:
    run = create(folder, plan(ground="flat"), {})
    with contextlib.closing(Trainer(run, "cpu")) as trainer:
        yield run, trainer


def _answers(port: int) -> bool:
    try:
        urllib.request.urlopen(f"http://127.0.0.1:{port}/").close()
    except OSError:
        return False
    return True


def test_the_page_opens_at_the_first_checkpoint_and_changes_with_the_next(
    tmp_path: Path, browser: Any
) -> None:
    with _trained(tmp_path / "run") as (run, trainer):
        follower = Follower(run.folder, "127.0.0.1", 0)
        try:
            assert not _answers(follower.port)
            trainer.keep()
            until(lambda: _answers(follower.port))
            tab = new_tab(browser)
            tab.goto(f"http://127.0.0.1:{follower.port}/")
            tab.get_by_role("tab", name="Checkpoints").click()
            tab.wait_for_selector("input[value^='0 ']")
            trainer.train(2)
            trainer.keep()
            tab.wait_for_selector("input[value^='2 ']")
            tab.context.close()
        finally:
            follower.close()
    assert not _answers(follower.port)
