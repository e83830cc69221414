"""Errors of laws on held-out modules, and error bands for new modules.

Fold errors are exp(mean |ln(predicted / published)|). Modules of a vendor share designers, gears
and ways of measuring, so holding out single rows underestimates the error; the next actuator of a
designer is more like one of a vendor that the catalogue lacks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from draft.fitting import scores
from draft.fitting.actuators.catalogue_rows import Mask, Rows
from draft.fitting.actuators.recipes import Logs, Recipe, fit_all, predict_all
from draft.values import Array

SHARES = (0.5, 0.9)


@dataclass(frozen=True)
class Coverage:
    """Share of held-out modules inside a band that was set without their vendor.

    Attributes:
        overall: over all modules.
        by_vendor: over those of one vendor.
    """

    overall: float
    by_vendor: dict[str, float]


def held_out(
    recipes: tuple[Recipe, ...],
    rows: Rows,
    groups: Sequence[object],
    train: Mask | None = None,
    mass_from_all: bool = False,
) -> Logs:
    """Predict each row from laws fitted without its group.

    Args:
        recipes: the set of laws.
        rows: the catalogue.
        groups: label of each row; rows of one label are held out together.
        train: rows that may be used for fitting; all where None.
        mass_from_all: fit the mass also to rows without a reduction, as the published vendor
            hold-out does.

    Returns:
        Logarithms by quantity, shape (n,); NaN where an input is missing.
    """
    allowed = np.ones(len(rows.name), dtype=bool) if train is None else train
    labels = np.unique(np.array([str(group) for group in groups]), return_inverse=True)[1]
    predicted: Logs = {}
    for label in np.unique(labels[rows.geared]):
        held = labels == label
        keep = allowed & ~held
        mass_keep = keep if mass_from_all else keep & rows.geared
        for quantity, values in predict_all(
            recipes, fit_all(recipes, rows, keep, mass_keep), rows, held
        ).items():
            predicted.setdefault(quantity, np.full(len(rows.name), np.nan))[held] = values
    return predicted


def errors(rows: Rows, predicted: Logs) -> Logs:
    """Errors ln(published / predicted) of geared rows, NaN elsewhere."""
    return {
        quantity: np.where(
            rows.geared, rows.log[quantity.removesuffix("_of_size")] - values, np.nan
        )
        for quantity, values in predicted.items()
    }


def coverage(recipes: tuple[Recipe, ...], rows: Rows) -> dict[tuple[str, float], Coverage]:
    """Share of the modules of each vendor inside bands that were set without that vendor.

    For each vendor, the laws are fitted to the other vendors, and the band is set by the errors of
    these others when they are held out in turn, so that neither depends on the vendor.

    Returns:
        Coverage by quantity and share.
    """
    vendors = np.array(rows.vendor)
    inside: dict[tuple[str, float], dict[str, Array]] = {}
    held_out_errors = errors(rows, held_out(recipes, rows, rows.vendor, mass_from_all=True))
    for vendor in np.unique(vendors[rows.geared]):
        own, others = vendors == vendor, vendors != vendor
        calibration = errors(rows, _of_others(recipes, rows, others))
        for quantity, error in held_out_errors.items():
            own_errors = error[own & ~np.isnan(error)]
            for share in SHARES if len(own_errors) else ():
                limit = np.log(scores.fold(calibration[quantity][others], share))
                inside.setdefault((quantity, share), {})[str(vendor)] = np.abs(own_errors) <= limit
    return {
        key: Coverage(
            float(np.mean(np.concatenate(list(masks.values())))),
            {vendor: float(np.mean(mask)) for vendor, mask in masks.items()},
        )
        for key, masks in inside.items()
    }


def _of_others(recipes: tuple[Recipe, ...], rows: Rows, others: Mask) -> Logs:
    """Held-out predictions of vendors, fitted to some rows alone."""
    return held_out(recipes, rows, rows.vendor, train=others, mass_from_all=True)
