"""Where there is no screen, pictures are drawn by EGL or OSMesa."""

from __future__ import annotations

import ctypes.util
import os
import sys
from collections.abc import Sequence


def prefer_offscreen() -> None:
    """Let MuJoCo draw without a screen if there is none; call it before MuJoCo is imported."""
    screen = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if sys.platform == "linux" and not screen:
        found = ctypes.util.find_library("EGL")
        os.environ.setdefault("MUJOCO_GL", "egl" if found else "osmesa")


def choose_rendering(arguments: Sequence[str]) -> None:
    """Say how MuJoCo draws for a command, if it does; call it before MuJoCo is imported.

    Args:
        arguments: of `draft`.
    """
    command = [*arguments[:1]]
    if command in (["twin"], ["play"]) or [*arguments[:2]] == ["study", "report"]:
        prefer_offscreen()
    elif command not in (["view"], ["study"]):
        # On import MuJoCo loads the libraries that it renders with, a fifth of the time of a
        # build. What a study starts chooses for itself.
        os.environ.setdefault("MUJOCO_GL", "disabled")
