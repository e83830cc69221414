"""Density of trunks by volume and leg length: the total mass that uses both opinions.

The published sum sees the drawn trunk, but its median density says little about its mass; the leg
length predicts whole robots better, but does not see the trunk. Here limbs weigh by class, as
published, and the trunk weighs c V^(1/2) L^b kg, with its volume V [m3] and L = thigh + shank [m].
c and b have the least squared errors of ln(total mass), so that the trunk makes up for errors of
the classes that the robots have in common. Outside the surveyed range of V or L, the density is
that at the edge: no term grows with a power there. docs/structure-trends.md compares exponents.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from draft.fitting.scores import fold_error
from draft.fitting.structure import whole
from draft.fitting.structure.attribution import Machine
from draft.fitting.structure.fits import TRUNKS, Structure, structure
from draft.fitting.structure.survey_holdout import Predictor, structure_of
from draft.laws.law import Law, Term
from draft.values import Array

# Exponent of the volume in the mass: an equal share of both opinions, the geometric mean of a law
# in proportion to the volume and one of the leg length alone. It is chosen, not fitted: surveyed
# volumes are those of boxes with the trunk's inertia, and a fit would hardly look at the trunk.
OF_VOLUME = 0.5
_MAX_STEPS, _CLOSE = 100, 1e-12


@dataclass(frozen=True, slots=True)
class Columns:
    """What the fit needs of n robots, shape (n,) each.

    Attributes:
        volume: of the trunk [m3]; 0 where no solid has its inertia.
        leg: thigh + shank [m].
        rest: actuators and predicted limbs [kg].
        mass: total mass [kg].
    """

    volume: Array
    leg: Array
    rest: Array
    mass: Array


def fit(robots: Sequence[Machine], of_volume: float = OF_VOLUME) -> Law:
    """Fit the law to the robots of one population.

    Args:
        robots: surveyed robots.
        of_volume: exponent of the volume in the mass of the trunk.

    Returns:
        The law of the density [kg/m3]; its errors are those of the mass that actuators and limbs
        leave for the trunk, of robots where any is left.
    """
    rows = columns(robots, structure(robots))
    ln_c, of_leg = _search(rows, of_volume)
    factor, exponents = math.exp(ln_c), (of_volume - 1, of_leg)
    left, solid = rows.mass - rows.rest, rows.volume > 0
    fits = solid & (left > 0)
    trunk = factor * rows.volume[fits] ** of_volume * rows.leg[fits] ** of_leg
    residual = np.log(trunk / left[fits])
    return Law(
        name="trunk",
        unit="kg/m3",
        formula=f"density = {factor:.4g} V^{exponents[0]:.3g} L^{of_leg:.3g}, L = {whole.SIZE}",
        inputs=("volume", "leg_length"),
        input_units=("m3", "m"),
        terms=(Term(factor, exponents),),
        n=len(robots),
        ranges={"volume": _ends(rows.volume[solid]), "leg_length": _ends(rows.leg)},
        held_out={},
        source=whole.SOURCE,
        beyond="edge",
        fold=fold_error(residual),
    )


def columns(robots: Sequence[Machine], model: Structure) -> Columns:
    """Volumes, leg lengths and masses of robots, their limbs predicted by class."""
    return Columns(
        np.array([trunk_volume(robot) for robot in robots]),
        np.array([whole.leg_length(robot) for robot in robots]),
        np.array([robot.actuators + limb_mass(robot, model) for robot in robots]),
        np.array([robot.mass for robot in robots]),
    )


def trunk_volume(robot: Machine) -> float:
    """Volume of the boxes of the trunk: the root, and the torso of a humanoid with a waist [m3]."""
    return sum(piece.row.box_volume for piece in robot.pieces if piece.kind in TRUNKS)


def limb_mass(robot: Machine, model: Structure) -> float:
    """Structural mass of all segments but the trunk, predicted by class [kg]."""
    trunk = {piece.row.segment for piece in robot.pieces if piece.kind in TRUNKS}
    masses = structure_of(robot, model)
    return sum(mass for segment, mass in masses.items() if segment not in trunk)


def by_both(robots: Sequence[Machine], of_volume: float = OF_VOLUME) -> Predictor:
    """Fit to some robots; returns a function for a robot's mass [kg]."""
    model, law = structure(robots), fit(robots, of_volume)

    def predict(robot: Machine) -> float:
        volume = trunk_volume(robot)
        trunk = volume * float(law(volume, whole.leg_length(robot)))
        return robot.actuators + limb_mass(robot, model) + trunk

    return predict


def _search(rows: Columns, of_volume: float) -> tuple[float, float]:
    """Return ln c and the exponent of the leg length, by Gauss-Newton steps."""
    ln_leg = np.log(rows.leg)
    theta = np.array([math.log(rows.mass.mean() / 2 / np.mean(rows.volume**of_volume)), 0.0])
    for _ in range(_MAX_STEPS):
        trunk = np.exp(theta[0] + theta[1] * ln_leg) * rows.volume**of_volume
        total = rows.rest + trunk
        slopes = np.column_stack([trunk, trunk * ln_leg]) / total[:, None]
        step = np.linalg.lstsq(slopes, np.log(rows.mass / total), rcond=None)[0]
        theta = theta + np.clip(step, -1.0, 1.0)
        if np.max(np.abs(step)) < _CLOSE:
            break
    return float(theta[0]), float(theta[1])


def _ends(values: Array) -> tuple[float, float]:
    return float(values.min()), float(values.max())
