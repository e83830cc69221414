"""The page of `draft play --web` in a real browser, and how it ends."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from benchmarks.browser import tab as new_tab

pytest.importorskip("mjlab")

from draft.learn.training.ppo.trainer import Trainer
from draft.learn.training.run import create
from tests.learn.small import plan

pytestmark = pytest.mark.filterwarnings("ignore")


def test_the_page_shows_the_run_until_interrupted(tmp_path: Path, browser: Any) -> None:
    run = create(tmp_path / "run", plan(ground="flat", stage="velocity"), {})
    trainer = Trainer(run, "cpu")
    trainer.keep()
    trainer.close()
    command = [sys.executable, "-m", "draft", "play", str(run.folder), "--web", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
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
