"""Choice of MuJoCo's renderer on machines without a screen, before MuJoCo is imported."""

from __future__ import annotations

import ctypes.util
import os
import sys


def prefer_offscreen() -> None:
    """Render with EGL, or OSMesa, if there is no screen.

    With neither, drawing is disabled: MuJoCo cannot be imported with a renderer that is missing.
    """
    if sys.platform == "linux" and not has_screen():
        os.environ.setdefault("MUJOCO_GL", preferred())


def preferred() -> str:
    """Return the renderer without a screen on Linux: "egl", "osmesa" or "disabled"."""
    installed = (name for name in ("EGL", "OSMesa") if ctypes.util.find_library(name))
    return next(installed, "disabled").lower()


def has_screen() -> bool:
    """Return whether a display server is named, on Linux."""
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def disable_drawing() -> None:
    """Load no renderer, which would take a fifth of the time of a build."""
    os.environ.setdefault("MUJOCO_GL", "disabled")


def can_draw() -> bool:
    """Whether MuJoCo can render in this process."""
    renderer = os.environ.get("MUJOCO_GL")
    if renderer is not None:
        return renderer not in ("disabled", "off", "false", "0")
    return sys.platform != "linux" or has_screen()
