"""Points of the height scan."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from draft.values import Array


def scan_points(size: Sequence[float], pitch: float) -> Array:
    """Points of the height scan in the trunk's heading frame; x changes fastest.

    Args:
        size: sides of the scanned rectangle, forwards and sideways [m].
        pitch: distance between neighbours [m].

    Returns:
        Positions forwards and to the left [m], shape (points, 2).
    """
    x, y = (pitch * (np.arange(n) - (n - 1) / 2) for n in (round(s / pitch) + 1 for s in size))
    across, along = np.meshgrid(y, x, indexing="ij")
    return np.column_stack((along.ravel(), across.ravel())).astype(float)
