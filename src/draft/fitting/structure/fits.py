"""Fits of structural mass over length by segment class, m = c L^e, and the density of trunks.

The published method: log-log least squares per class and population, e >= 0 (else the geometric
mean of the class); quadruped thighs and shanks only from robots with knees driven from the hip;
trunk: median of structural mass over the volume of the equivalent box. Source: arXiv 2609.38405.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from draft.fitting import least_squares
from draft.fitting.scores import fold_error
from draft.fitting.structure.attribution import Machine, Piece
from draft.fitting.structure.robots import excluded_segments
from draft.laws.law import Law, Term
from draft.laws.segment_classes import BASE
from draft.values import Array

FEWEST = 4
SOURCE = (
    "fitted to draft/laws/data/segments.csv by the method of arXiv 2609.38405, structure trends"
)
LENGTH, VOLUME = ("length", "m", "L"), ("volume", "m3", "V")
TRUNKS = (BASE, "torso")
BY_REMOTE_KNEES = ("thigh", "shank")


@dataclass(frozen=True)
class Structure:
    """Trends of one population by the published method.

    Attributes:
        fits: laws by class.
        densities: median structural mass over box volume of each kind of trunk [kg/m3].
        counts: number of rows of each density.
        mass_per_length: median over all classes, for a class without a fit [kg/m].
    """

    fits: Mapping[str, Law]
    densities: Mapping[str, float]
    counts: Mapping[str, int]
    mass_per_length: float


def structure(robots: Sequence[Machine]) -> Structure:
    """Fit the trends of the robots of one population."""
    rows = usable_rows(robots)
    fits = {
        kind: fit(kind, pieces)
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


def other(robots: Sequence[Machine]) -> Law:
    """Law for a link without a class: the median mass per length over the rows of all classes."""
    length, mass = columns([piece for pieces in limbs(robots).values() for piece in pieces])
    return law("other", proportional(length[:, None], mass), length, mass)


def usable_rows(robots: Iterable[Machine]) -> dict[str, list[Piece]]:
    """Rows of the fits by class, without those that are excluded."""
    excluded = excluded_segments()
    rows: dict[str, list[Piece]] = {}
    for robot in robots:
        for piece in robot.pieces:
            kind = piece.kind
            at_joint = robot.population == "quadruped" and not robot.remote_knees
            if not kind or not piece.fits or (robot.key, kind) in excluded:
                continue
            if kind in BY_REMOTE_KNEES and at_joint:
                continue
            rows.setdefault(kind, []).append(piece)
    return rows


def limbs(robots: Iterable[Machine]) -> dict[str, list[Piece]]:
    """Usable rows of every class except the base, including knees driven at the joint."""
    rows: dict[str, list[Piece]] = {}
    for robot in robots:
        for piece in robot.pieces:
            if piece.kind and piece.kind != BASE and piece.fits:
                rows.setdefault(piece.kind, []).append(piece)
    return rows


def fit(kind: str, pieces: Sequence[Piece]) -> Law:
    """Fit one class: least squares in logarithms, with an exponent not below 0."""
    length, mass = columns(pieces)
    return law(kind, growing(length[:, None], mass), length, mass)


def growing(inputs: Array, output: Array) -> Array:
    """Parameters ln c and e >= 0 of output = c x^e, shape (2,); NaN for too few rows.

    Args:
        inputs: shape (n, 1).
        output: shape (n,).
    """
    if len(output) < FEWEST:
        return np.full(2, np.nan)
    fitted = least_squares.fit(inputs, output)
    return fitted if fitted[1] >= 0.0 else np.array([np.log(output).mean(), 0.0])


def proportional(inputs: Array, output: Array) -> Array:
    """Parameters ln c and 1 of output = c x, shape (2,); c is the median of output over input."""
    return np.array([np.log(np.median(output / inputs[:, 0])), 1.0])


def law(
    name: str, coefficients: Array, x: Array, mass: Array, of: tuple[str, str, str] = LENGTH
) -> Law:
    """Power law with the fold error and the range of its rows, without held-out errors.

    Args:
        name: class of parts.
        coefficients: ln c and e, shape (2,).
        x: input, shape (n,).
        mass: mass [kg], shape (n,).
        of: name, unit and symbol of the input.
    """
    factor, exponent = float(np.exp(coefficients[0])), float(coefficients[1])
    quantity, unit, symbol = of
    return Law(
        name=name,
        unit="kg",
        formula=f"m = {factor:.3g} {symbol}^{exponent:.3g}",
        inputs=(quantity,),
        input_units=(unit,),
        terms=(Term(factor, (exponent,)),),
        n=len(mass),
        ranges={quantity: (float(x.min()), float(x.max()))},
        held_out={},
        source=SOURCE,
        fold=fold_error(np.log(factor * x**exponent / mass)),
    )


def columns(pieces: Sequence[Piece]) -> tuple[Array, Array]:
    """Lengths [m] and structural masses [kg], shape (n,) each."""
    length = np.array([piece.row.length for piece in pieces])
    return length, np.array([piece.structure for piece in pieces])


def density(pieces: Iterable[Piece]) -> tuple[float, int]:
    """Median structural mass over box volume [kg/m3], and the number of pieces."""
    values = [piece.structure / piece.row.box_volume for piece in solid(pieces)]
    return (float(np.median(values)) if values else math.nan), len(values)


def solid(pieces: Iterable[Piece]) -> list[Piece]:
    """Pieces with a volume."""
    return [piece for piece in pieces if piece.row.box_volume > 0]


def trunks(robots: Sequence[Machine]) -> Sequence[Piece]:
    """Trunk segments.

    Quadrupeds: the root segment. Humanoids: the segment after the waist, of robots whose
    description has a head (in others the torso includes the head).
    """
    if robots and robots[0].population == "quadruped":
        return usable_rows(robots).get(BASE, ())
    headed = [robot for robot in robots if any(piece.kind == "head" for piece in robot.pieces)]
    return usable_rows(headed).get("torso", ())
