"""Fit laws of several terms to logarithms: factors, and the exponents that a form leaves open."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from draft.laws.law import Term
from draft.values import Array

# Residuals of ln y up to this size count squared, larger ones by their absolute value (Huber).
HUBER = 0.2
_STEPS = 100
# Change of ln c or of an exponent below which the search ends.
_CLOSE = 1e-9
# Longest step in any of them.
_LONGEST = 2.0


@dataclass(frozen=True, slots=True)
class Form:
    """The shape of a law before it is fitted.

    Attributes:
        exponents: for each term the exponent of each input; None where it is fitted.
        start: factors c_k, then open exponents, from which the search starts.
        reciprocal: whether the law is one over the sum.
        robust: fit by Huber's loss instead of least squares.
    """

    exponents: tuple[tuple[float | None, ...], ...]
    start: tuple[float, ...]
    reciprocal: bool = False
    robust: bool = True

    def fit(self, inputs: Array, output: Array) -> tuple[Term, ...]:
        """Fit to positive inputs, shape (n, k), and outputs, shape (n,), all as logarithms.

        Newton's method on the loss of the residuals of ln y, halving steps that do not help.
        """
        theta = np.array(self.start)
        theta[: len(self.exponents)] = np.log(theta[: len(self.exponents)])
        theta = self._search(theta, inputs, output, math.inf)
        return self._terms(self._search(theta, inputs, output, HUBER) if self.robust else theta)

    def _search(self, theta: Array, inputs: Array, output: Array, limit: float) -> Array:
        """Parameters of least loss, residuals above a limit counting by their absolute value."""
        residual, slopes = self._linear(theta, inputs, output)
        for _ in range(_STEPS):
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
        """Residuals of ln y, shape (n,), and the slopes of ln y in theta, shape (n, p)."""
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
    """Huber's loss: squares up to a limit, straight lines beyond it."""
    size = np.abs(residual)
    straight = size > limit
    if not straight.any():
        return float(residual @ residual)
    return float(np.sum(np.where(straight, 2 * limit * size - limit**2, size**2)))


def _steps(residual: Array, slopes: Array, limit: float) -> Iterator[Array]:
    """Newton's step, with the loss's own curvature and then the safer reweighted one, shortened."""
    size = np.abs(residual)
    pull = np.minimum(1.0, limit / np.maximum(size, 1e-300))
    for curvature in ((size < limit).astype(np.float64), pull):
        hessian = slopes.T @ (slopes * curvature[:, None])
        hessian[np.diag_indices_from(hessian)] *= 1 + 1e-9
        hessian[np.diag_indices_from(hessian)] += 1e-9
        step: Array = np.asarray(np.linalg.solve(hessian, slopes.T @ (pull * residual)), np.float64)
        step *= min(1.0, _LONGEST / max(np.max(np.abs(step)), 1e-300))
        for scale in (1.0, 0.5, 0.25, 0.06):
            yield scale * step
