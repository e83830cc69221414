"""Structural mass of a whole robot from its leg length: Draft's own method.

S = c L^e with L = thigh + shank [m], by log-log least squares over the robots of one population;
the total mass is S plus the actuators. It has the smallest error on held-out robots: with two
numbers per population it avoids the summed errors of classes with few rows, and the volume of a
trunk says little about its mass. docs/structure-trends.md lists the other methods tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from draft.fitting import least_squares
from draft.fitting.structure import fits
from draft.fitting.structure.attribution import Machine
from draft.fitting.structure.survey_holdout import Predictor
from draft.laws.law import Law
from draft.values import Array

LEG = ("thigh", "shank")
SIZE = "thigh + shank"
SOURCE = "fitted to draft/laws/data/segments.csv, docs/structure-trends.md"


def leg_length(robot: Machine) -> float:
    """Length of thigh plus shank [m], mean over the legs; 0 for a robot without legs."""
    total = 0.0
    for kind in LEG:
        lengths = [piece.row.length for piece in robot.pieces if piece.kind == kind]
        total += sum(lengths) / len(lengths) if lengths else 0.0
    return total


def fit(robots: Sequence[Machine]) -> Law:
    """Fit the law to the robots of one population; `sigma_log` is that of the residuals."""
    leg, mass = columns(robots)
    coefficients = least_squares.fit(leg[:, None], mass)
    residual = np.log(mass / least_squares.predict(coefficients, leg[:, None]))
    law = fits.law("whole", coefficients, leg, mass, ("leg_length", "m", "L"))
    return replace(
        law,
        formula=f"structure = {law.coefficient:.4g} L^{law.exponent:.3g}, L = {SIZE}",
        source=SOURCE,
        sigma_log=float(np.std(residual, ddof=2)),
    )


def columns(robots: Sequence[Machine]) -> tuple[Array, Array]:
    """Leg lengths [m] and structural masses [kg] of robots, shape (n,) each."""
    leg = np.array([leg_length(robot) for robot in robots])
    return leg, np.array([robot.mass - robot.actuators for robot in robots])


def by_legs(robots: Sequence[Machine]) -> Predictor:
    """Fit to some robots; returns a function for a robot's mass [kg]."""
    law = fit(robots)
    return lambda robot: robot.actuators + float(law(leg_length(robot)))
