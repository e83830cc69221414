"""Models of designs: MJCF, URDF, glTF, pictures, and their folder on disk.

The text of a model (`draft.model.mjcf`) needs no MuJoCo, so both names are imported on first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from draft.lazy import on_first_use

if TYPE_CHECKING:
    from draft.model.model import Model, build

__all__ = ["Model", "build"]

__getattr__ = on_first_use(__name__, dict.fromkeys(__all__, "draft.model.model"))
