"""Power laws by ordinary least squares in logarithms, and how well they predict rows held out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


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


def gmfe(predicted: Array, published: Array) -> float:
    """Geometric mean fold error, exp(mean |ln(predicted / published)|)."""
    return float(np.exp(np.mean(np.abs(np.log(predicted / published)))))


def r_squared(predicted: Array, published: Array) -> float:
    """Share of the variance of ln(published) that the prediction explains."""
    y = np.log(published)
    residual = y - np.log(predicted)
    return float(1 - residual @ residual / np.sum((y - y.mean()) ** 2))


def leave_one_out(inputs: Array, output: Array) -> Array:
    """Predict every row from a fit to all the others, shape (n,)."""
    return leave_group_out(inputs, output, list(range(len(output))))


def leave_group_out(inputs: Array, output: Array, groups: Sequence[object]) -> Array:
    """Predict every row from a fit to the rows of all other groups, shape (n,)."""
    labels = np.array([str(group) for group in groups])
    predicted = np.empty_like(output)
    for label in np.unique(labels):
        held = labels == label
        predicted[held] = predict(fit(inputs[~held], output[~held]), inputs[held])
    return predicted
