"""Fits of laws of several terms to logarithms: factors, and the free exponents of a form."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from draft.laws.law import Term
from draft.values import Array

# Residual of ln y up to which Huber's loss is quadratic.
HUBER = 0.2
_MAX_STEPS = 100
# Change of ln c or of an exponent below which the search ends.
_CLOSE = 1e-9
# Largest change of any of them in one step.
_MAX_CHANGE = 2.0


@dataclass(frozen=True, slots=True)
class Form:
    """Form of a law: its terms, with the exponents that are fixed.

    Attributes:
        exponents: for each term the exponent of each input; None where it is fitted.
        start: starting values of the search: factors c_k, then free exponents.
        reciprocal: whether the law is one over the sum.
        robust: fit by Huber's loss instead of least squares.
    """

    exponents: tuple[tuple[float | None, ...], ...]
    start: tuple[float, ...]
    reciprocal: bool = False
    robust: bool = True

    def fit(self, inputs: Array, output: Array) -> tuple[Term, ...]:
        """Fit to logarithms of positive inputs, shape (n, k), and of the output, shape (n,).

        Newton's method on the loss of the residuals of ln y, with shorter steps where the full
        step does not reduce the loss.
        """
        theta = np.array(self.start)
        theta[: len(self.exponents)] = np.log(theta[: len(self.exponents)])
        theta = self._search(theta, inputs, output, math.inf)
        return self._terms(self._search(theta, inputs, output, HUBER) if self.robust else theta)

    def _search(self, theta: Array, inputs: Array, output: Array, limit: float) -> Array:
        """Parameters with the least Huber loss; residuals above the limit count linearly."""
        residual, slopes = self._linear(theta, inputs, output)
        for _ in range(_MAX_STEPS):
            worst = _loss(residual, limit) * (1 + 1e-14)
            for step in _steps(residual, slopes, limit):
                tried, tried_slopes = self._linear(theta + step, inputs, output)
                if _loss(tried, limit) <= worst:
                    theta, residual, slopes = theta + step, tried, tried_slopes
                    break
            else:
                break
            if np.max(np.abs(step)) < _CLOSE:
                break
        return theta

    def _terms(self, theta: Array) -> tuple[Term, ...]:
        factors, rest = np.exp(theta[: len(self.exponents)]), iter(theta[len(self.exponents) :])
        return tuple(
            Term(float(factor), tuple(float(next(rest)) if e is None else e for e in exponents))
            for factor, exponents in zip(factors, self.exponents, strict=True)
        )

    def _linear(self, theta: Array, inputs: Array, output: Array) -> tuple[Array, Array]:
        """Residuals of ln y, shape (n,), and derivatives of ln y by theta, shape (n, p)."""
        rest = iter(theta[len(self.exponents) :])
        logs = np.empty((len(self.exponents), len(output)))
        for k, exponents in enumerate(self.exponents):
            known = np.array([next(rest) if e is None else e for e in exponents])
            logs[k] = theta[k] + inputs @ known
        top = logs.max(axis=0)
        weights = np.exp(logs - top)
        total = weights.sum(axis=0)
        shares = weights / total
        sign = -1.0 if self.reciprocal else 1.0
        slopes = [*shares]
        for share, exponents in zip(shares, self.exponents, strict=True):
            slopes += [share * inputs[:, i] for i, e in enumerate(exponents) if e is None]
        return output - sign * (top + np.log(total)), sign * np.array(slopes).T


def _loss(residual: Array, limit: float) -> float:
    """Huber's loss: quadratic up to a limit, linear beyond it."""
    size = np.abs(residual)
    linear = size > limit
    if not linear.any():
        return float(residual @ residual)
    return float(np.sum(np.where(linear, 2 * limit * size - limit**2, size**2)))


def _steps(residual: Array, slopes: Array, limit: float) -> Iterator[Array]:
    """Trial steps: Newton's, then that of reweighted least squares, each at several lengths."""
    size = np.abs(residual)
    weights = np.minimum(1.0, limit / np.maximum(size, 1e-300))
    for curvature in ((size < limit).astype(np.float64), weights):
        hessian = slopes.T @ (slopes * curvature[:, None])
        hessian[np.diag_indices_from(hessian)] *= 1 + 1e-9
        hessian[np.diag_indices_from(hessian)] += 1e-9
        step: Array = np.asarray(
            np.linalg.solve(hessian, slopes.T @ (weights * residual)), np.float64
        )
        step *= min(1.0, _MAX_CHANGE / max(np.max(np.abs(step)), 1e-300))
        for scale in (1.0, 0.5, 0.25, 0.06):
            yield scale * step
