"""Knee of a leg, by the geometry of its joints."""

from __future__ import annotations

import numpy as np

from draft.values import Array


def knee_of(points: Array, axes: Array) -> tuple[int, float]:
    """Joint between the two long links of a leg, and its angle from the straight leg [rad].

    Args:
        points: anchors of the joints from the trunk outwards, and the foot, shape (joints + 1, 3).
        axes: axes of the joints, shape (joints, 3).
    """
    links = np.diff(points, axis=0)
    lengths = np.linalg.norm(links, axis=1)
    knee = 1 + int(np.minimum(lengths[:-1], lengths[1:]).argmax()) if len(axes) > 1 else 0
    if not knee:
        return 0, 0.0
    axis = axes[knee]
    above, below = (one - axis * (one @ axis) for one in links[knee - 1 : knee + 1])
    return knee, float(np.arctan2(axis @ np.cross(above, below), above @ below))
