"""Errors of the total mass of robots that are held out from the fit of the trends.

The prediction adds limbs by length, the trunk by volume, and actuators by torque. Segments without
a class (fingers, wheels, linkages) are not predicted, but are part of the true mass.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from draft.fitting.scores import fold_error
from draft.fitting.structure.attribution import Machine
from draft.fitting.structure.fits import TRUNKS, Structure, structure

Predictor = Callable[[Machine], float]
Method = Callable[[Sequence[Machine]], Predictor]


@dataclass(frozen=True, slots=True)
class Score:
    """Errors of total mass over n held-out robots.

    Attributes:
        fold: geometric mean fold error.
        bias: mean ln(predicted / true).
        n: number of robots.
        logs: ln(predicted / true) of each robot.
    """

    fold: float
    bias: float
    n: int
    logs: tuple[float, ...]


def published(robots: Sequence[Machine]) -> Predictor:
    """Fit the published method to some robots; returns a function for a robot's mass [kg]."""
    model = structure(robots)
    return lambda robot: robot.actuators + sum(structure_of(robot, model).values())


def structure_of(robot: Machine, model: Structure) -> dict[str, float]:
    """Structural mass by segment, predicted by the published method [kg]."""
    masses: dict[str, float] = {}
    for piece in robot.pieces:
        kind, row = piece.kind, piece.row
        if kind in TRUNKS:
            masses[row.segment] = model.densities[kind] * row.box_volume
        elif kind in model.fits:
            masses[row.segment] = float(model.fits[kind](row.length))
        elif kind:
            masses[row.segment] = model.mass_per_length * row.length
    return masses


def population_median(robots: Sequence[Machine]) -> Predictor:
    """Predict the median mass of the other robots, as a baseline."""
    median = float(np.median([robot.mass for robot in robots]))
    return lambda _: median


def leave_one_out(robots: Sequence[Machine], method: Method) -> Score:
    """Predict each robot from all the others."""
    return leave_group_out(robots, [robot.key for robot in robots], method)


def leave_group_out(robots: Sequence[Machine], groups: Sequence[str], method: Method) -> Score:
    """Predict each robot from those of all other groups, such as other makers."""
    predicted: dict[str, float] = {}
    for group in sorted(set(groups)):
        pairs = list(zip(robots, groups, strict=True))
        predictor = method([robot for robot, label in pairs if label != group])
        for robot, label in pairs:
            if label == group:
                predicted[robot.key] = predictor(robot)
    return score(robots, [predicted[robot.key] for robot in robots])


def across(train: Sequence[Machine], test: Sequence[Machine], method: Method) -> Score:
    """Predict the robots of one population from those of another."""
    predictor = method(train)
    return score(test, [predictor(robot) for robot in test])


def score(robots: Sequence[Machine], predicted: Sequence[float]) -> Score:
    """Compare predicted with true masses."""
    mass = np.array([robot.mass for robot in robots])
    guess = np.array(predicted)
    logs = np.log(guess / mass)
    return Score(fold_error(logs), float(logs.mean()), len(robots), tuple(map(float, logs)))


def spread(robots: Sequence[Machine]) -> tuple[float, float, float]:
    """10th percentile, median and 90th percentile of the actuators' share of mass."""
    low, middle, high = np.percentile([robot.share for robot in robots], (10, 50, 90))
    return float(low), float(middle), float(high)
