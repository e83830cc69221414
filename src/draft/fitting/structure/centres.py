"""Centre of mass of the structure of a segment class along its length, and its error.

The centre is that of the segment without its actuators: those of quadrupeds are at its first joint
(only robots with knees driven from the hip), and half of each of a humanoid's on either side of its
joint. Each robot gives one value, the median of its copies; the trend is the median over robots.
Only thighs have a trend; docs/structure-trends.md explains why.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from draft.fitting.structure.attribution import Machine
from draft.fitting.structure.fits import FEWEST, usable_rows
from draft.laws.structure import MIDDLE, Centre

# Classes with a joint at one end, a joint or a tip at the other, and structure between them.
CLASSES = {
    "quadruped": ("thigh", "shank"),
    "humanoid": ("thigh", "shank", "upper_arm", "forearm"),
}
# Those of them whose trend improves M(q) of the twins of held-out robots.
TRENDS = ("thigh",)


def shares(robots: Sequence[Machine], kind: str) -> dict[str, float]:
    """Structural centre of a class by robot, as a share of the length.

    Omitted are segments without a centre, and those whose centre lies outside the length, where
    the assumed positions of the actuators are wrong.
    """
    by_robot: dict[str, list[float]] = {}
    for piece in usable_rows(robots).get(kind, ()):
        # An unknown centre is NaN and fails this test, too.
        if 0.0 < piece.centre < 1.0:
            by_robot.setdefault(piece.row.robot, []).append(piece.centre)
    return {robot: float(np.median(values)) for robot, values in by_robot.items()}


def fit(by_robot: Mapping[str, float], makers: Mapping[str, str]) -> Centre:
    """Median over robots, with its mean absolute errors on held-out robots and makers."""
    values = np.array(list(by_robot.values()))
    low, middle, high = map(float, np.percentile(values, (25, 50, 75)))
    return Centre(
        value=middle,
        n=len(values),
        p25=low,
        p75=high,
        held_out=_error(by_robot, {key: key for key in by_robot}),
        held_out_maker=_error(by_robot, makers),
        held_out_middle=float(np.mean(np.abs(values - MIDDLE))),
    )


def centres(robots: Sequence[Machine], makers: Mapping[str, str]) -> dict[str, Centre]:
    """Measured centre of each class of one population, whether it has a trend or not."""
    kinds = CLASSES[robots[0].population] if robots else ()
    measured = {kind: shares(robots, kind) for kind in kinds}
    return {kind: fit(own, makers) for kind, own in measured.items() if len(own) >= FEWEST}


def _error(by_robot: Mapping[str, float], groups: Mapping[str, str]) -> float:
    """Mean absolute error of the median of the other groups, or of the middle without others."""
    errors = []
    for key, value in by_robot.items():
        others = [other for name, other in by_robot.items() if groups[name] != groups[key]]
        guess = float(np.median(others)) if others else MIDDLE
        errors.append(abs(guess - value))
    return float(np.mean(errors))
