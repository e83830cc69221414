"""Models of designs: MJCF, URDF, glTF, pictures, and their folder on disk."""

import draft.mujoco_log  # noqa: F401 - before anything is simulated
from draft.model.model import Model, build

__all__ = ["Model", "build"]
