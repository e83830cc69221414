"""Errors of the laws on small actuators and on robots without legs, by shipped tables.

Residuals of the laws have a mean there that is not zero: the standard deviations are about the
laws, not about that mean, so that a band around what the law says holds such machines.
`python -m draft.fitting.beyond` writes the file of coefficients.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from draft.fitting import coefficients
from draft.fitting.limits import table
from draft.fitting.scores import fold_error
from draft.laws.actuators import laws
from draft.laws.beyond import FILE
from draft.laws.law import Law, Term, quantile
from draft.laws.servos import EXCLUDED, small_actuators
from draft.values import Array

LEGLESS = "robots_without_legs"
_STEPS = 60


def records() -> dict[str, Any]:
    """Content of the file of coefficients."""
    return coefficients.rounded(
        {
            "mass": _small("mass").record(),
            "volume": _small("volume").record(),
            "without_legs": _without_legs().record(),
        }
    )


def residuals(quantity: str) -> tuple[Array, Array, list[str]]:
    """Peak torques [N m], ln(true / predicted) and makers of actuators below the catalogue's.

    Args:
        quantity: "mass" or "volume" (of the box; the law also takes the reduction).
    """
    law = laws().trends[quantity]
    lowest = law.ranges["peak_torque"][0]
    torques, errors, makers = [], [], []
    for row in small_actuators():
        torque = float(row["stall_torque_Nm"] or "nan")
        if EXCLUDED in row["note"] or not torque < lowest:
            continue
        if quantity == "mass":
            true, inputs = float(row["mass_kg"] or "nan"), [torque]
        else:
            sizes = [float(row[f"{side}_m"] or "nan") for side in ("length", "width", "height")]
            true, inputs = math.prod(sizes), [torque, float(row["gear_ratio"] or "nan")]
        error = math.log(true / float(law(*inputs)))
        if math.isfinite(error):
            torques.append(torque)
            errors.append(error)
            makers.append(row["maker"])
    return np.array(torques), np.array(errors), makers


def fit(torques: Array, errors: Array) -> Term:
    """Standard deviation s = c torque^e by maximum likelihood, errors normal with mean zero."""
    log, squares = np.log(torques), errors**2

    def tilt(e: float) -> float:
        """Slope of the likelihood in e, at its best c; it falls with e."""
        weights = squares * np.exp(-2 * e * log)
        return float(weights @ log / weights.sum() - log.mean())

    low, high = -2.0, 2.0
    for _ in range(_STEPS):
        middle = (low + high) / 2
        low, high = (middle, high) if tilt(middle) > 0 else (low, middle)
    e = (low + high) / 2
    return Term(float(np.sqrt(np.mean(squares * np.exp(-2 * e * log)))), (e,))


def inside(torques: Array, errors: Array, makers: list[str], share: float) -> float:
    """Share of actuators in the band of a share, each maker's by a fit to the others'."""
    own = np.array(makers)
    hits = np.zeros(len(own), dtype=bool)
    for maker in set(makers):
        held = own == maker
        sigma = fit(torques[~held], errors[~held])([torques[held]])
        hits[held] = np.abs(errors[held]) <= quantile(share) * np.asarray(sigma)
    return float(hits.mean())


def _small(quantity: str) -> Law:
    torques, errors, makers = residuals(quantity)
    term = fit(torques, errors)
    return Law(
        name=quantity,
        unit="1",
        formula=f"sigma = {term.factor:.3g} peak_torque^{term.exponents[0]:.3f}",
        inputs=("peak_torque",),
        input_units=("N m",),
        terms=(term,),
        n=len(torques),
        ranges={"peak_torque": (float(torques.min()), float(torques.max()))},
        held_out={},
        source="draft/laws/data/small_actuators.csv; docs/twins.md",
        fold=fold_error(errors),
        coverage_50=inside(torques, errors, makers, 0.5),
        coverage_90=inside(torques, errors, makers, 0.9),
    )


def _without_legs() -> Law:
    rows = table(LEGLESS)
    true, said = (
        np.array([float(row[key]) for row in rows]) for key in ("mass_kg", "predicted_kg")
    )
    errors = np.log(true / said)
    return Law(
        name="without_legs",
        unit="kg",
        formula="mass = predicted mass",
        inputs=("mass",),
        input_units=("kg",),
        terms=(Term(1.0, (1.0,)),),
        n=len(rows),
        ranges={"mass": (float(said.min()), float(said.max()))},
        held_out={},
        source=f"draft/fitting/data/{LEGLESS}.csv; docs/twins.md",
        fold=fold_error(errors),
        sigma_log=float(np.sqrt(np.mean(errors**2))),
    )


if __name__ == "__main__":
    coefficients.write(FILE, records())
