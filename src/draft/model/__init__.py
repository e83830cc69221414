"""Models of designs: MJCF, URDF, glTF, pictures, and their folder on disk."""

from draft.model.model import Model, build

__all__ = ["Model", "build"]
