"""Where along its length the structure of a class of segments balances, and whether that is known.

A segment's centre of mass, less its actuators at their places: quadrupeds' at its first joint (only
robots with knees driven from the hip), half of a humanoid's at either side of each joint. One value
per robot, the median of its copies; the trend is the median over robots. Thighs have one; why other
classes have none is told in docs/structure-trends.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from draft.fitting.structure.attribution import Machine
from draft.fitting.structure.fits import FEWEST, usable_rows
from draft.laws.structure import MIDDLE, Centre

# Classes whose two ends are a joint and a joint or a tip, with structure in between.
CLASSES = {
    "quadruped": ("thigh", "shank"),
    "humanoid": ("thigh", "shank", "upper_arm", "forearm"),
}
# Of these, the classes whose trend improves the twins' M(q) on robots held out.
TRENDS = ("thigh",)


def shares(robots: Sequence[Machine], kind: str) -> dict[str, float]:
    """Structural centre of a class by robot, as a share of the length.

    Left out are segments without a centre, and those whose structure would balance outside its
    length: there the actuators' places are not those assumed.
    """
    found: dict[str, list[float]] = {}
    for piece in usable_rows(robots).get(kind, ()):
        # A centre that is not known is NaN and fails, too.
        if 0.0 < piece.centre < 1.0:
            found.setdefault(piece.row.robot, []).append(piece.centre)
    return {robot: float(np.median(values)) for robot, values in found.items()}


def fit(by_robot: Mapping[str, float], makers: Mapping[str, str]) -> Centre:
    """Median over robots, and its mean absolute error on robots and makers held out."""
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
    """What is measured of each class of one population's robots, trend or not."""
    kinds = CLASSES[robots[0].population] if robots else ()
    measured = {kind: shares(robots, kind) for kind in kinds}
    return {kind: fit(own, makers) for kind, own in measured.items() if len(own) >= FEWEST}


def _error(by_robot: Mapping[str, float], groups: Mapping[str, str]) -> float:
    """Mean absolute error of the median of the other groups; of the middle where there is none."""
    errors = []
    for key, value in by_robot.items():
        others = [other for name, other in by_robot.items() if groups[name] != groups[key]]
        guess = float(np.median(others)) if others else MIDDLE
        errors.append(abs(guess - value))
    return float(np.mean(errors))
