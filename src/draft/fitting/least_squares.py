"""Power laws by ordinary least squares of logarithms, and their predictions of held-out rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from draft.values import Array


def fit(inputs: Array, output: Array) -> Array:
    """Fit output = c x1^e1 x2^e2 ... by least squares of the logarithms.

    Args:
        inputs: positive numbers, shape (n, k).
        output: positive numbers, shape (n,).

    Returns:
        ln c and the exponents, shape (k + 1,).
    """
    return least_squares(np.log(inputs), np.log(output))


def least_squares(inputs: Array, output: Array) -> Array:
    """Intercept and slopes, shape (k + 1,), of output (n,) over inputs (n, k)."""
    design = np.column_stack([np.ones(len(output)), inputs])
    return np.linalg.lstsq(design, output, rcond=None)[0].astype(np.float64)


def predict(coefficients: Array, inputs: Array) -> Array:
    """Value of a power law at inputs of shape (n, k)."""
    return np.exp(coefficients[0] + np.log(inputs) @ coefficients[1:])


def leave_group_out(
    inputs: Array,
    output: Array,
    groups: Sequence[object],
    by: Callable[[Array, Array], Array] = fit,
) -> Array:
    """Predict every row from a fit to the rows of all other groups.

    Args:
        inputs: positive numbers, shape (n, k).
        output: positive numbers, shape (n,).
        groups: label of each row; rows of one label are held out together.
        by: function that fits a law, with the arguments of `fit`.

    Returns:
        Predictions, shape (n,); NaN where there is no other group to fit to.
    """
    labels = np.array([str(group) for group in groups])
    predicted = np.full_like(output, np.nan)
    for label in np.unique(labels):
        held = labels == label
        if not held.all():
            predicted[held] = predict(by(inputs[~held], output[~held]), inputs[held])
    return predicted
