"""How long motors can hold what roll-outs ask of them.

A motor's heat grows with the square of its torque. The root mean square of a joint's torque over
the rated torque of its motor tells by the overload law of turning modules (docs/limits.md) how long
it holds the gait. The torques are those of the histograms, so that a class of joints has one
number, over all its joints; that of the hottest class counts.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from draft.learn.bodies.legged import LeggedRobot, usual_ratings
from draft.learn.measuring.scalars import Curve
from draft.learn.measuring.utilisation import BINS, WIDTH, Histograms
from draft.values import Array

_CENTRES = (np.arange(BINS) + 0.5) * WIDTH


def add_heat(by_test: Mapping[str, Curve], histograms: Histograms, member: LeggedRobot) -> None:
    """Add the root mean square torque over the rated torque of the hottest class to curves.

    It is None at a level at which all fell.

    Args:
        by_test: curves of one robot.
        histograms: histograms of its joints' samples.
        member: the robot.
    """
    ratios = _peak_over_rated(member)
    for test, curve in by_test.items():
        curve["rms_rated"] = [
            _hottest(histograms.pooled(test, level, member.name)[:, 0], ratios)
            for level in curve["levels"]
        ]


def _hottest(counts: Array, ratios: Array) -> float | None:
    """Largest root mean square over the rated torque of classes, from counts of (classes, bins)."""
    total = counts.sum(axis=1)
    if not total.any():
        return None
    square = counts @ _CENTRES**2 / np.maximum(total, 1)
    return float(np.max(np.sqrt(square) * ratios))


def _peak_over_rated(member: LeggedRobot) -> Array:
    """Peak over rated torque of each class of joints, the largest of its joints."""
    rated = member.rated_torque or usual_ratings(member.peak_torque)
    found = np.zeros(len(member.classes))
    for joint, kind in enumerate(member.joint_classes):
        found[kind] = max(found[kind], member.peak_torque[joint] / rated[joint])
    return found
