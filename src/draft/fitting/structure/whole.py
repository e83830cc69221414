"""Structural mass of a whole robot by its legs: Draft's own method, which wins on held-out robots.

S = c L^e with L = thigh + shank [m], log-log least squares over one population's robots; a robot
weighs S plus its actuators. Two numbers per population: sums of per-class laws add up the errors
of thin classes, and a trunk's volume says little of what is in it. docs/structure-trends.md has
what else was tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from draft.fitting import least_squares
from draft.fitting.structure.attribution import Machine
from draft.fitting.structure.holdout import Predictor

LEG = ("thigh", "shank")


@dataclass(frozen=True, slots=True)
class WholeFit:
    """S = coefficient L^exponent [kg, m], its robots, spread of ln S and leg lengths."""

    coefficient: float
    exponent: float
    n: int
    sigma_log: float
    range: tuple[float, float]

    def mass(self, leg: float) -> float:
        """Structural mass [kg] of a robot with legs of this length [m]."""
        return self.coefficient * leg**self.exponent


def leg_length(robot: Machine) -> float:
    """Length of thigh plus shank [m], averaged over the legs; 0 where a robot has none."""
    total = 0.0
    for kind in LEG:
        lengths = [piece.row.length for piece in robot.pieces if piece.kind == kind]
        total += sum(lengths) / len(lengths) if lengths else 0.0
    return total


def fit(robots: Sequence[Machine]) -> WholeFit:
    """Fit the law to one population's robots."""
    leg = np.array([leg_length(robot) for robot in robots])
    mass = np.array([robot.mass - robot.actuators for robot in robots])
    coefficients = least_squares.fit(leg[:, None], mass)
    residual = np.log(mass / least_squares.predict(coefficients, leg[:, None]))
    return WholeFit(
        float(np.exp(coefficients[0])),
        float(coefficients[1]),
        len(robots),
        float(np.std(residual, ddof=2)),
        (float(leg.min()), float(leg.max())),
    )


def by_legs(robots: Sequence[Machine]) -> Predictor:
    """Train on some robots; the result predicts a robot's mass [kg]."""
    law = fit(robots)
    return lambda robot: robot.actuators + law.mass(leg_length(robot))
