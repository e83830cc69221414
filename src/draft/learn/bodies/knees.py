"""Knee of a leg, by the geometry of its joints."""

from __future__ import annotations

import numpy as np

from draft.values import Array

# Cosine of the angle to the way from hip to foot from which an axis turns the leg about that way.
# Knees of surveyed robots have 0.39 at most.
_ALONG = 0.7


def knee_of(points: Array, axes: Array) -> tuple[int, float]:
    """Joint that folds a leg nearest to its middle, and its angle from the straight leg [rad].

    The middle is that of the way along the leg, so that it is the same in all poses. A joint that
    turns the leg about the way from hip to foot, such as a yaw, does not fold it.

    Args:
        points: anchors of the joints from the trunk outwards, and the foot, shape (joints + 1, 3).
        axes: axes of the joints, shape (joints, 3).
    """
    links = np.diff(points, axis=0)
    along = np.append(0.0, np.linalg.norm(links, axis=1).cumsum())
    way = points[-1] - points[0]
    folds = abs(axes @ way) <= _ALONG * np.linalg.norm(way)
    knee = int((np.minimum(along, along[-1] - along)[:-1] * folds).argmax())
    if not knee:
        return 0, 0.0
    axis = axes[knee]
    thigh, shank = (one - axis * (one @ axis) for one in links[knee - 1 : knee + 1])
    return knee, float(np.arctan2(axis @ np.cross(thigh, shank), thigh @ shank))
