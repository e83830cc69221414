"""Pictures by MuJoCo's renderer on machines that have none."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

TWICE = """
from draft import DraftError, load
from draft.model.picture import open_renderer

model = load("quadruped").resolve().build().mujoco
for _ in range(2):
    try:
        open_renderer(model, (64, 48))
    except DraftError as error:
        print(error)
"""


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["disabled", "glfw"])
def test_each_attempt_without_a_renderer_is_reported(backend: str) -> None:
    # GLFW without a screen aborts the process at the second attempt.
    kept = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    done = subprocess.run(
        [sys.executable, "-c", TWICE],
        check=False,
        env=kept | {"MUJOCO_GL": backend},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    said = f"MuJoCo cannot draw on this machine (MUJOCO_GL is {backend})"
    assert done.stdout.count(said) == 2
