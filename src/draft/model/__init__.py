"""Numbers -> MJCF, and a folder on disk."""

from draft.model.model import Model, build

__all__ = ["Model", "build"]
