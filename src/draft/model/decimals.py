"""Rounding of numbers to the ten significant digits of the text of a model."""

from __future__ import annotations

import numpy as np

from draft.values import Array

DIGITS = 10
# Powers of ten as the nearest doubles, from 10**-_SPAN to 10**_SPAN.
_SPAN = 300
_POWERS = np.array([float(f"1e{k}") for k in range(-_SPAN, _SPAN + 1)])


def rounded(values: Array) -> Array:
    """Round an array of any shape as the text of a model does.

    The result equals formatting and parsing each number, except where the digits after the tenth
    are within rounding of one half. Infinities and NaN are kept.
    """
    with np.errstate(all="ignore"):
        exponent = np.floor(np.log10(np.abs(values)))
        regular = np.abs(exponent) < _SPAN - DIGITS  # neither zero, nor infinite, nor NaN
        shift = np.where(regular, DIGITS - 1 - exponent, 0.0).astype(np.intp)
        scale = _POWERS[shift + _SPAN]
        # Below 10**23 powers of ten are exact, and so is the rounded quotient.
        nearest = np.rint(values * scale) / scale + 0.0
    return np.where(regular, nearest, values + 0.0)
