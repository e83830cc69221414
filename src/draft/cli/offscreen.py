"""Where there is no screen, pictures are drawn by EGL or OSMesa."""

from __future__ import annotations

import ctypes.util
import os
import sys


def prefer_offscreen() -> None:
    """Let MuJoCo draw without a screen if there is none; call it before MuJoCo is imported."""
    screen = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if sys.platform == "linux" and not screen:
        found = ctypes.util.find_library("EGL")
        os.environ.setdefault("MUJOCO_GL", "egl" if found else "osmesa")
