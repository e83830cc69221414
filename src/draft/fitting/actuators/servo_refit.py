"""Fit of the laws of servos to the gathered table, scored on makers held out.

`python -m draft.fitting.actuators.servo_refit` writes the file that Draft ships; a test checks that
it is reproduced.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from draft.fitting import coefficients
from draft.fitting.actuators.catalogue_refit import fit_set
from draft.fitting.actuators.catalogue_rows import rows_of
from draft.fitting.actuators.recipes import PEAK_TORQUE, Recipe, form, least_squares
from draft.fitting.limits import Points, fitted_law
from draft.laws.catalogue import SERVO, catalogue
from draft.laws.law import Law, Term
from draft.laws.servos import EXCLUDED, TRENDS, read_servos
from draft.values import Array

TABLE, PAGE = "draft/laws/data/small_actuators.csv", "docs/actuator-trends.md"
# Rated torques are known of servos of two makers, a quarter to a third of the peak: the law of
# modules of high ratio, a quarter, stands for them.
RECIPES = (
    # The motor and the gears share one box, and both grow with the torque.
    Recipe("mass", ("peak_torque",), least_squares),
    Recipe("volume", ("peak_torque",), least_squares),
    Recipe("aspect_ratio", ("peak_torque",), form((0.0,), start=(0.8,)).fit),
    # The motors of all servos have about the same no-load speed.
    Recipe("gear_ratio", ("no_load_speed",), form((-1.0,), start=(1570.0,)).fit),
    PEAK_TORQUE,
)
_ROTOR = "its rotor is left out"  # Note of rows whose rotor inertia is doubtful.


def servo_trends() -> dict[str, Any]:
    """Content of the file of coefficients."""
    record = fit_set(
        SERVO, RECIPES, rows_of(catalogue(SERVO).values(), every=True), f"{TABLE}; {PAGE}"
    )
    rotor = coefficients.rounded(_rotor().record())
    laws: Any = record["laws"]
    more = {"rotor_inertia": rotor, "rotor_inertia_of_size": rotor}
    return {SERVO: record | {"laws": laws | more}}


def _rotor() -> Law:
    """Inertia of a rotor from the mass of its servo, identified by others from its motion.

    A free exponent errs more on makers held out. Servos of two axes count by the mass per axis.
    """
    known = [
        part for part in read_servos() if part.rotor_inertia is not None and _ROTOR not in part.note
    ]
    mass = np.array([part.mass / (2 if EXCLUDED in part.note else 1) for part in known])
    inertia = np.array([part.rotor_inertia for part in known], float)
    points = Points(mass, inertia, [part.vendor for part in known])
    held = ("vendor", TABLE)
    formula = "rotor_inertia = {:.4g} mass"
    return fitted_law(
        "rotor_inertia", "kg m2", formula, ("mass", "kg"), points, _mean_ratio, held, PAGE
    )


def _mean_ratio(x: Array, y: Array) -> Term:
    """Geometric mean of y / x."""
    return Term(float(np.exp(np.mean(np.log(y / x)))), (1.0,))


if __name__ == "__main__":
    coefficients.write(TRENDS, servo_trends())
