"""Write type stubs of MuJoCo's compiled modules to `typings/mujoco`, for the type checker.

Run `python -m scripts.mujoco_stubs` after MuJoCo's version in `uv.lock` has changed.
"""

from __future__ import annotations

from pathlib import Path

TYPINGS = Path(__file__).parents[1] / "typings"
