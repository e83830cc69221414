"""Scores of laws by their errors ln(published / predicted), one for each row."""

from __future__ import annotations

import numpy as np

from draft.values import Array


def fold_error(error: Array) -> float:
    """Geometric mean fold error, exp(mean |error|); rows with NaN are skipped."""
    return float(np.exp(np.nanmean(np.abs(error))))


def fold(error: Array, share: float) -> float:
    """Fold error within which a share of new rows lies, from the errors of n held-out rows.

    The quantile is that of split conformal prediction, share (n + 1) / n.
    """
    size = np.abs(error[~np.isnan(error)])
    return float(np.exp(np.quantile(size, min(1.0, share * (1 + 1 / len(size))))))


def r_squared(error: Array, published: Array) -> float:
    """Share of the variance of ln(published) that a law explains; both of shape (n,)."""
    return float(1 - np.sum(error**2) / np.sum((published - published.mean()) ** 2))
