"""The pose in which an imported robot stands at first."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from draft.imports.anatomy import ROLLING
from draft.imports.formatting import tidy, vector
from draft.imports.reduce import Body
from draft.values import scalar

CROUCH = 1.2
# Largest sum of a knee's limits, as a share of its range, that leaves the way it bends open.
EVEN = 0.02


def home_pose(way: Sequence[Body], mirrored: bool = False) -> list[float]:
    """Home values [rad or m]: a quadruped's straight legs are bent, others stay.

    Args:
        way: bodies of a limb.
        mirrored: whether it is a fore-and-aft reflection of the chain's original: a knee that
            bends either way then bends the other way, as in legs that form an X.
    """
    angles = [0.0] * len(way)
    roles = [body.role for body in way]
    if "flexion" in roles and "knee" in roles:
        i, j = roles.index("flexion"), roles.index("knee")
        bend = sum(way[j].limits)
        even = abs(bend) < EVEN * float(np.ptp(way[j].limits))
        sign = 1.0 if (mirrored if even else bend > 0) else -1.0
        turn = float(np.sign(way[i].axis @ way[j].axis))
        angles[j], angles[i] = sign * CROUCH, -sign * turn * CROUCH / 2
    found: list[float] = []
    for body, angle in zip(way, angles, strict=True):
        if body.role in ROLLING:
            found.append(0.0)
            continue
        low, high = vector(body.limits, 4)
        found.append(tidy(min(max(angle, scalar(low)), scalar(high)), 4))
    return found
