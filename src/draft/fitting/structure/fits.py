"""Structural mass of a class of segments by length, m = c L^e, and the density of trunks.

The published method: log-log least squares per class and population, e >= 0 (else the class's
geometric mean); quadruped thighs and shanks only over knees driven from the hip; trunk: median of
structural mass over the volume of the inertia's box. Source: arXiv 2609.38405.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from draft.fitting import least_squares
from draft.fitting.scores import fold_error
from draft.fitting.structure.attribution import Machine, Piece
from draft.fitting.structure.classes import BASE
from draft.fitting.structure.robots import excluded_segments
from draft.values import Array

FEWEST = 4
TRUNKS = (BASE, "torso")
BY_REMOTE_KNEES = ("thigh", "shank")


@dataclass(frozen=True, slots=True)
class Fit:
    """One class's law m = coefficient L^exponent [kg, m], its rows, fold error and lengths."""

    coefficient: float
    exponent: float
    n: int
    fold: float
    range: tuple[float, float]

    def mass(self, length: float) -> float:
        """Structural mass [kg] at a length [m], without the rule for the edges."""
        return self.coefficient * length**self.exponent


@dataclass(frozen=True)
class Structure:
    """The published method's trends of one population.

    Attributes:
        fits: by class.
        densities: median structural mass over box volume of each kind of trunk [kg/m3].
        counts: rows behind each density.
        mass_per_length: median over all classes, for a class that has no fit [kg/m].
    """

    fits: Mapping[str, Fit]
    densities: Mapping[str, float]
    counts: Mapping[str, int]
    mass_per_length: float


def structure(robots: Sequence[Machine]) -> Structure:
    """Fit the trends of one population's robots."""
    rows = usable_rows(robots)
    fits = {
        kind: fit(pieces)
        for kind, pieces in rows.items()
        if kind not in TRUNKS and len(pieces) >= FEWEST
    }
    densities = {kind: density(rows.get(kind, ())) for kind in TRUNKS}
    per_length = [
        piece.structure / piece.row.length
        for kind, pieces in limbs(robots).items()
        for piece in pieces
    ]
    return Structure(
        fits,
        {kind: median for kind, (median, _) in densities.items()},
        {kind: n for kind, (_, n) in densities.items()},
        float(np.median(per_length)) if per_length else math.nan,
    )


def other(robots: Sequence[Machine]) -> Fit:
    """The rule for a link of no class: the median mass per length of all classes' rows."""
    length, mass = columns([piece for pieces in limbs(robots).values() for piece in pieces])
    per_length = float(np.median(mass / length))
    fold = fold_error(np.log(per_length * length / mass))
    return Fit(per_length, 1.0, len(length), fold, (float(length.min()), float(length.max())))


def usable_rows(robots: Iterable[Machine]) -> dict[str, list[Piece]]:
    """Rows of the fits by class, after the exclusions."""
    out = excluded_segments()
    rows: dict[str, list[Piece]] = {}
    for robot in robots:
        for piece in robot.pieces:
            kind = piece.kind
            at_joint = robot.population == "quadruped" and not robot.remote_knees
            if not kind or not piece.fits or (robot.key, kind) in out:
                continue
            if kind in BY_REMOTE_KNEES and at_joint:
                continue
            rows.setdefault(kind, []).append(piece)
    return rows


def limbs(robots: Iterable[Machine]) -> dict[str, list[Piece]]:
    """Usable rows of every class but the base, knees driven at the joint among them."""
    rows: dict[str, list[Piece]] = {}
    for robot in robots:
        for piece in robot.pieces:
            if piece.kind and piece.kind != BASE and piece.fits:
                rows.setdefault(piece.kind, []).append(piece)
    return rows


def fit(pieces: Sequence[Piece]) -> Fit:
    """Fit one class: least squares in logarithms, with an exponent not below 0."""
    length, mass = columns(pieces)
    intercept, exponent = least_squares.fit(length[:, None], mass)
    if exponent < 0.0:
        intercept, exponent = np.log(mass).mean(), 0.0
    predicted = np.exp(intercept) * length**exponent
    return Fit(
        float(np.exp(intercept)),
        float(exponent),
        len(pieces),
        fold_error(np.log(predicted / mass)),
        (float(length.min()), float(length.max())),
    )


def columns(pieces: Sequence[Piece]) -> tuple[Array, Array]:
    """Lengths [m] and structural masses [kg], shape (n,) each."""
    length = np.array([piece.row.length for piece in pieces])
    return length, np.array([piece.structure for piece in pieces])


def density(pieces: Iterable[Piece]) -> tuple[float, int]:
    """Median structural mass over box volume [kg/m3], and of how many."""
    values = _densities(pieces)
    return (float(np.median(values)) if values else math.nan), len(values)


def _densities(pieces: Iterable[Piece]) -> list[float]:
    return [piece.structure / piece.row.box_volume for piece in pieces if piece.row.box_volume > 0]


def trunk_density(robots: Sequence[Machine]) -> tuple[float, int]:
    """Density of the trunk that a designer means [kg/m3], and of how many."""
    return density(_trunks(robots))


def trunk_fold(robots: Sequence[Machine]) -> float:
    """Geometric mean fold error of that density over the trunks that it is the median of."""
    values = np.array(_densities(_trunks(robots)))
    return fold_error(np.log(values / np.median(values)))


def _trunks(robots: Sequence[Machine]) -> Sequence[Piece]:
    """The segments that a designer means by trunk.

    Quadrupeds: the root segment. Humanoids: the segment after the waist, over robots whose
    description has a head (else the torso holds what others have in the head).
    """
    if robots and robots[0].population == "quadruped":
        return usable_rows(robots).get(BASE, ())
    headed = [robot for robot in robots if any(piece.kind == "head" for piece in robot.pieces)]
    return usable_rows(headed).get("torso", ())
