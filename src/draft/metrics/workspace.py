"""Volume of the places that the tip of an arm reaches, from poses drawn once for all designs."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from draft import geometry as g
from draft.design import Design
from draft.design.limbs import limbs
from draft.metrics.registry import metric
from draft.metrics.stretch import Chain, chain
from draft.metrics.tips import directions, outer_columns
from draft.values import Array, Value

POSES = 1 << 15
CELLS = 32  # along the longest side of the half-plane that the tip crosses
T = TypeVar("T")
R = TypeVar("R")


@metric(
    unit="m3",
    formula=f"sum of r dr dz dphi over the cells of the (r, z) plane of the first joint that "
    f"{POSES} poses reach",
    source="Pappus' theorem for the first joint; poses of Roberts' R sequence (2018)",
    better="more",
    base="arm",
    sampled=True,
)
def workspace_volume(design: Design) -> Value:
    """Volume of the places that the tip reaches over the ranges of the joints [m3].

    The turn of the first joint is exact; the others take a fixed set of poses, whose error is about
    2 %. Collisions with the floor and of the arm with itself are neglected. 0 for a tip that moves
    on a line or a plane. Not known of an arm in which a joint follows the first one.
    """
    arm = limbs(design).arm
    if arm is None or follows_first(chain(design, arm)):
        return math.nan
    if directions(outer_columns(design)[0]) < 3:
        return 0.0
    return of_each(design, chain(design, arm), _volume)


def follows_first(of: Chain) -> bool:
    """Whether a joint follows the first one, which then does not turn the rest as a whole."""
    first, *others = of.segments
    follows = [one.follows.body for one in others if one.follows is not None]
    return first.follows is not None or first.body in follows


def of_each(design: Design, numbers: T, work: Callable[[T], R]) -> R | Array:
    """Result of a function of the numbers of each design, one after the other.

    Args:
        design: one design, or N.
        numbers: tuples, also nested, of floats and arrays of shape (N,).
        work: function of such tuples without arrays.

    Returns:
        What it gives, or of N designs an array of shape (N, ...).
    """
    if design.count is None:
        return work(numbers)
    return np.array([work(_of_one(numbers, i)) for i in range(design.count)])


def _of_one(numbers: T, i: int) -> T:
    if isinstance(numbers, np.ndarray):
        return numbers[i].item()
    if isinstance(numbers, tuple):
        made = [_of_one(one, i) for one in numbers]
        return type(numbers)(*made) if hasattr(numbers, "_fields") else tuple(made)  # type: ignore
    return numbers


def spread(count: int, dimensions: int) -> Array:
    """Points of the unit cube that are spread evenly, shape (dimensions, count).

    Roberts' R sequence (2018): multiples of the powers of 1 / phi, phi^(d + 1) = phi + 1.
    """
    phi = 2.0
    for _ in range(60):
        phi = (1.0 + phi) ** (1.0 / (dimensions + 1))
    steps = phi ** -np.arange(1.0, dimensions + 1)
    return (0.5 + np.outer(steps, np.arange(1.0, count + 1))) % 1.0


def _volume(of: Chain) -> float:
    first, *others = of.segments
    free = [of.segments[j] for j in of.driven[1:]]
    shares = spread(POSES, len(free))[::-1]
    drawn = [
        one.low + share * (one.high - one.low) for one, share in zip(free, shares, strict=True)
    ]
    tip = of.tip
    for one, position in zip(others[::-1], of.positions([0.0, *drawn])[:0:-1], strict=True):
        at, rotation = one.place
        tip = g.add(at, g.rotate(rotation, one.moved(position, tip)))
    height = np.broadcast_to(g.dot(first.axis, tip), POSES)
    x, y = _across(first.axis)
    u, v = (np.broadcast_to(g.dot(axis, tip), POSES) for axis in (x, y))
    radius, about = np.hypot(u, v), np.arctan2(v, u)
    low = height.min()
    size = max(radius.max(), height.max() - low) / CELLS
    rows, columns = (radius / size).astype(int), ((height - low) / size).astype(int)
    # Poses by cell, and by angle in each; the first joint turns each of them through its range.
    cell = rows * (CELLS + 1) + columns
    order = np.lexsort((about, cell))
    cell, about = cell[order], about[order]
    starts = np.flatnonzero(np.diff(cell, prepend=-1))
    ends = np.append(starts[1:], len(cell)) - 1
    gaps = np.append(np.diff(about), 0.0)
    gaps[ends] = about[starts] + 2.0 * math.pi - about[ends]
    turn = min(first.high - first.low, 2.0 * math.pi)
    arcs = np.add.reduceat(np.minimum(gaps, turn), starts)
    full = np.zeros((CELLS + 3, CELLS + 3))
    full[cell[starts] // (CELLS + 1) + 1, cell[starts] % (CELLS + 1) + 1] = np.minimum(
        arcs, 2.0 * math.pi
    )
    full[0] = full[1]  # the axis is no boundary
    inside = full > 0
    beside = inside[:-2, 1:-1] & inside[2:, 1:-1] & inside[1:-1, :-2] & inside[1:-1, 2:]
    # Cells at the boundary are half inside, on average.
    shares = full[1:-1, 1:-1] * np.where(beside, 1.0, 0.5)
    middles = size * (np.arange(CELLS + 1) + 0.5)
    return float((middles[:, None] * shares).sum() * size * size)


def _across(axis: g.Vector) -> tuple[g.Vector, g.Vector]:
    """Two unit vectors across an axis and each other."""
    k = min(range(3), key=lambda i: abs(axis[i]))
    other = g.cross(axis, g.IDENTITY[k])
    x = g.scale(other, 1.0 / g.norm(other))
    return x, g.cross(axis, x)
