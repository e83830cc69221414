"""The page of `draft play --web` in a real browser, and how it ends."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks import browser

pytest.importorskip("mjlab")
pytest.importorskip("playwright", reason="needs Playwright")
if browser.found() is None:
    pytest.skip("needs Chromium or Chrome", allow_module_level=True)

from draft.learn.lab.trainer import Trainer
from draft.learn.run import create
from tests.learn.small import plan

pytestmark = pytest.mark.filterwarnings("ignore")


def test_the_page_shows_the_run_until_interrupted(tmp_path: Path) -> None:
    run = create(tmp_path / "run", plan(ground="flat", stage="velocity"), {})
    trainer = Trainer(run, "cpu")
    trainer.keep()
    trainer.close()
    command = [sys.executable, "-m", "draft", "play", str(run.folder), "--web", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            line = process.stdout.readline() if process.stdout else ""
            address = re.fullmatch(r"open (http://127\.0\.0\.1:\d+/) in a browser.*\n", line)
            assert address
            with browser.browser() as opened:
                tab = opened.new_page()
                tab.goto(address[1])
                tab.wait_for_selector("text=Checkpoints", timeout=60_000)
                tab.wait_for_selector("text=lin_vel_x", timeout=60_000)
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(timeout=60)
    assert process.returncode == 130
