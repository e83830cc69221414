"""The pages of a run in a real browser: `draft play --web`, and `draft train --view`."""

from __future__ import annotations

import contextlib
import re
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from benchmarks.browser import tab as new_tab

pytest.importorskip("mjlab")

from draft.learn.training.ppo.trainer import Trainer
from draft.learn.training.run import create
from draft.learn.watching.follow import Follower
from tests.learn.small import plan
from tests.waiting import until

pytestmark = pytest.mark.filterwarnings("ignore")


@pytest.fixture
def trainer(tmp_path: Path) -> Iterator[Trainer]:
    run = create(tmp_path / "run", plan(ground="flat", stage="velocity"), {})
    with contextlib.closing(Trainer(run, "cpu")) as made:
        yield made


def _answers(port: int) -> bool:
    try:
        urllib.request.urlopen(f"http://127.0.0.1:{port}/").close()
    except OSError:
        return False
    return True


def test_the_page_shows_the_run_until_interrupted(
    trainer: Trainer, tmp_path: Path, browser: Any
) -> None:
    trainer.keep()
    command = [sys.executable, "-m", "draft", "play", "run", "--web", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=tmp_path) as process:
        try:
            assert process.stdout is not None
            said = process.stdout.readline()
            assert said.startswith("policy: iteration 0 of 1800, unfinished: ")
            line = process.stdout.readline()
            address = re.fullmatch(r"open (http://127\.0\.0\.1:\d+/) in a browser.*\n", line)
            assert address
            tab = new_tab(browser)
            tab.goto(address[1])
            tab.wait_for_selector("text=Checkpoints")
            tab.wait_for_selector("text=lin_vel_x")
            tab.context.close()
        finally:
            process.send_signal(signal.SIGINT)
            process.wait()
    assert process.returncode == 130


def test_the_page_opens_at_the_first_checkpoint_and_changes_with_the_next(
    trainer: Trainer, tmp_path: Path, browser: Any
) -> None:
    with contextlib.closing(Follower(tmp_path / "run", "127.0.0.1", 0)) as follower:
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
    assert not _answers(follower.port)
