"""Error bands of the numbers of a design, each containing a share of real machines.

The error of a law is known from held-out vendors (`catalogue_holdout`). Errors of
several laws are propagated to first order (delta method) with their correlation: a module that is
heavier than its torque predicts is also larger. All actuators of one class are the same module and
share one error; errors of classes, and of segments of different kinds, are independent. The band of
a total is computed by Monte Carlo. Geometry has no error.

Below the torques that the laws of mass and volume were fitted to, their bands are as wide as the
errors at small actuators (`draft.laws.beyond`), those of a mass only downwards: 98 of 101 are
lighter than the law says. So is the band of a total, in proportion to the share of such actuators
in the mass of all: motors are as large a share of small robots as of others (docs/twins.md).

Bands are computed on request; that of a total takes half a millisecond per design.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from draft.design.actuators import Actuator, size
from draft.design.design import Design
from draft.design.structure_law import structure_laws
from draft.laws.beyond import beyond
from draft.laws.catalogue import MODULE
from draft.laws.law import Law, quantile
from draft.laws.quantities import CORNER
from draft.values import Array, Value, exp, log, maximum, minimum, some, sqrt, where

SHARES = (0.5, 0.9)
_STEP = 0.01
_DRAWS = 4096
# Number of designs whose totals are sampled at once, within a few megabytes.
_CHUNK = 64
# Slope below which a quantity does not change, except for rounding.
_STILL = 1e-9
# Laws whose errors are larger below the torques of their data.
_SMALL = ("mass", "volume")


class Band(NamedTuple):
    """Lower and upper bound, each a float or an array of shape (N,)."""

    low: Value
    high: Value


class Spread(NamedTuple):
    """An uncertain mass [kg]; `sigma` is the standard deviation of its logarithm."""

    mass: Value
    sigma: Value


def actuator_bands(actuator: Actuator, share: float = 0.9) -> dict[str, Band]:
    """Bands of the numbers of an actuator, in SI units.

    Args:
        actuator: a sized class.
        share: share of real modules within a band.

    Returns:
        A band for each quantity that depends on a trend; stated and measured ones have none.
    """
    widths, within = half_widths(actuator, share), {}
    if any(small_sigma_of(actuator, law) is not None for law in _SMALL):
        within = half_widths(actuator, share, ("mass",), outside=False)
    bands = {
        quantity: Band(value * exp(-width), value * exp(within.get(quantity, width)))
        for quantity, width in widths.items()
        for value in [getattr(actuator, quantity)]
    }
    if CORNER in bands:
        # No corner is beyond the no-load speed, and no power beyond that of a square.
        torque, speed = actuator.peak_torque, actuator.no_load_speed
        ends = {CORNER: speed}
        if not {"peak_torque", "no_load_speed"} & bands.keys():
            ends["peak_power"] = torque * speed
        for quantity, end in ends.items():
            if quantity in bands:
                low, high = bands[quantity]
                bands[quantity] = Band(low, minimum(high, end))
    return bands


def half_widths(
    actuator: Actuator,
    share: float = 0.9,
    of: Sequence[str] | None = None,
    outside: bool = True,
) -> dict[str, Value]:
    """Half-widths of the bands of quantities of an actuator, as natural logarithms.

    Args:
        actuator: a sized class.
        share: share of real modules within a band.
        of: the quantities; None for all.
        outside: whether laws have the errors at small actuators below the torques of their data.
    """
    slopes = sensitivities(actuator, of)
    laws = actuator.laws
    own: dict[str, Value] = {law: math.log(laws.error(law).band(share)) for law in slopes}
    for law in own if outside else ():
        sigma = small_sigma_of(actuator, law)
        if sigma is not None:
            own[law] = maximum(own[law], quantile(share) * sigma)
    variance: dict[str, Value] = {}
    for a, of_a in slopes.items():
        for b, of_b in slopes.items():
            factor = own[a] * own[b] * laws.correlation.get((a, b), float(a == b))
            for quantity in of_a.keys() & of_b.keys():
                term = factor * of_a[quantity] * of_b[quantity]
                variance[quantity] = variance.get(quantity, 0.0) + term
    return {q: sqrt(variance[q]) for q in actuator.quantities if q in variance}


def small_sigma_of(actuator: Actuator, law: str) -> Value | None:
    """Standard deviation of a law below the torques of its data, 0 within; None where none is."""
    if law not in _SMALL or actuator.kind != MODULE:
        return None
    below = actuator.peak_torque < actuator.laws.trends[law].ranges["peak_torque"][0]
    if not some(below):
        return None
    error: Law = getattr(beyond(), law)
    return where(below, error(actuator.peak_torque), 0.0)


def small_sigma(design: Design) -> Value | None:
    """Standard deviation that actuators below the torques of the laws add to ln(total mass).

    That of each class by its share in the mass of all actuators; None without such a class.
    """
    found = [share * sigma for share, sigma in small_actuators(design)]
    return sum(found[1:], found[0]) if found else None


def small_actuators(design: Design) -> list[tuple[Value, Value]]:
    """Classes whose mass a law predicts below the torques of its data.

    Returns:
        For each, its share in the mass of all actuators, and the standard deviation of ln(mass);
        of N designs, 0 for those within.
    """
    found: list[tuple[Value, Value]] = []
    for name, count in Counter(b.actuator.name for b in design.bodies if b.actuator).items():
        actuator = design.actuators[name]
        sigma = small_sigma_of(actuator, "mass")
        if sigma is None or "mass" not in sensitivities(actuator, ("mass",)):
            continue
        found.append((count * actuator.mass / design.actuator_mass, sigma))
    return found


def sensitivities(
    actuator: Actuator, of: Sequence[str] | None = None
) -> dict[str, dict[str, Value]]:
    """Sensitivity of quantities to the error of each law that they depend on.

    Args:
        actuator: a sized class.
        of: the quantities; None for all.

    Returns:
        d ln(quantity) / d ln(law) by law and quantity, without those that are zero.
    """
    origins, of = actuator.origins, actuator.quantities if of is None else of
    stated = {q: getattr(actuator, q) for q, origin in origins.items() if origin.kind == "stated"}
    by_trend = tuple(q for q in (CORNER,) if actuator.has_corner and q not in stated)
    laws = {
        name: None
        for quantity, origin in origins.items()
        # Nothing else follows from the rated torque.
        if quantity != "rated_torque" or quantity in of
        for name in origin.trends
    }
    slopes: dict[str, dict[str, Value]] = {}
    for law in laws:
        errors = {law: _STEP}
        moved = size(actuator.name, stated, actuator.part, None, actuator.laws, errors, by_trend)
        slopes[law] = {
            quantity: log(getattr(moved, quantity) / getattr(actuator, quantity)) / _STEP
            for quantity in of
            if quantity in origins and origins[quantity].kind not in ("stated", "catalogue")
        }
    return {
        law: {quantity: slope for quantity, slope in of.items() if some(abs(slope) > _STILL)}
        for law, of in slopes.items()
    }


def mass_band(design: Design, share: float = 0.9) -> Band:
    """Band of the total mass of a design [kg]."""
    own = sum_band(*mass_spreads(design), share)
    sigma = small_sigma(design)
    if sigma is None:
        return own
    return Band(wider(design.mass, own, quantile(share) * sigma).low, own.high)


def wider(mass: Value, band: Band, more: Value) -> Band:
    """Band of a mass with an independent error besides, both ends and `more` in logarithms."""
    low, high = (log(end / mass) for end in band)
    return Band(
        mass * exp(-sqrt(low * low + more * more)), mass * exp(sqrt(high * high + more * more))
    )


def sum_band(known: Value, spreads: Sequence[Spread], share: float) -> Band:
    """Band of the sum of a known mass and independent log-normal masses [kg].

    The Monte Carlo samples are always the same, so that the band of a design is reproducible. The
    median of the total is the sum of the masses: a sum of skewed errors would lie above it, but in
    real robots the sum of class medians is already rather too high (humanoids by 14 %, quadrupeds
    by -3 %).
    """
    if not spreads:
        return Band(known, known)
    columns = [known, *(x for spread in spreads for x in spread)]
    table = np.array(np.broadcast_arrays(*columns), dtype=np.float64)
    flat = table.reshape(len(columns), -1)
    middle = known + sum(spread.mass for spread in spreads)
    ends = np.empty((3, flat.shape[1]))
    draws = _draws(len(spreads))
    for at in range(0, flat.shape[1], _CHUNK):
        part = flat[:, at : at + _CHUNK]
        total = np.repeat(part[:1], _DRAWS, axis=0)
        for mass, sigma, z in zip(part[1::2], part[2::2], draws, strict=True):
            total += mass * np.exp(np.outer(z, sigma))
        total.sort(axis=0)
        # numpy.quantile imports masked arrays, which takes longer than a whole model.
        for k, q in enumerate(((1 - share) / 2, 0.5, (1 + share) / 2)):
            place = q * (_DRAWS - 1)
            low = min(int(place), _DRAWS - 2)
            step = total[low + 1] - total[low]
            ends[k, at : at + _CHUNK] = total[low] + (place - low) * step
    below, above = ends[0] / ends[1], ends[2] / ends[1]
    if table.ndim == 1:
        return Band(float(middle * below[0]), float(middle * above[0]))
    return Band(middle * below, middle * above)


@lru_cache(maxsize=8)
def _draws(sources: int) -> Array:
    """Standard normal samples, shape (sources, samples): the same values, in an own order per row.

    The orders come from a fixed hash (splitmix64), because importing NumPy's generators takes
    longer than computing the samples.
    """
    # Mid-points of equal shares of the distribution.
    x = np.linspace(-6.0, 6.0, 4801)
    density = np.exp(-x * x / 2)
    below = (np.cumsum(density) - density / 2) / density.sum()
    even = np.interp((np.arange(_DRAWS) + 0.5) / _DRAWS, below, x)
    bits = np.arange(1, sources * _DRAWS + 1, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        bits = (bits ^ (bits >> np.uint64(shift))) * np.uint64(factor)
    return even[np.argsort(bits.reshape(sources, _DRAWS), axis=1)]


def mass_spreads(design: Design) -> tuple[Value, list[Spread]]:
    """Known mass [kg], and the masses that depend on trends, each with one error."""
    population = structure_laws(design)
    known = design.carried_mass
    spreads: list[Spread] = []
    for actuator in design.actuators.values():
        count = sum(body.actuator is actuator for body in design.bodies)
        width = half_widths(actuator, of=("mass",), outside=False).get("mass") if count else None
        if width is None:
            known = known + count * actuator.mass
        else:
            spreads.append(Spread(count * actuator.mass, width / quantile(0.9)))
    by_trend: dict[str, Value] = {}
    for segment in design.segments:
        if segment.trend is None:
            known = known + segment.mass * segment.copies
        else:
            so_far = by_trend.get(segment.trend, 0.0)
            known = known + segment.of_parts * segment.copies
            predicted = segment.mass - segment.of_parts
            by_trend[segment.trend] = so_far + predicted * segment.copies
    for trend, mass in by_trend.items():
        spreads.append(Spread(mass, population.segments[trend].sigma))
    if design.lofted is None or design.lofted.density_stated:
        known = known + design.base_mass
    else:
        spreads.append(Spread(design.lofted.mass, population.trunk_law.sigma))
    return known, spreads
