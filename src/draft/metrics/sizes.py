"""Masses and lengths of a design."""

from __future__ import annotations

import math

from draft.design import Design
from draft.design.bands import mass_spreads
from draft.design.cached import once
from draft.design.legs import legs
from draft.laws.law import quantile
from draft.metrics.registry import metric
from draft.metrics.stretch import stretched
from draft.values import Value, asin, clip, divide, exp, maximum, sin, some, sqrt

BAND = 0.9
_LAWS = "Draft's trends, docs/actuator-trends.md and docs/structure-trends.md"
_FLEISHMAN = "Fleishman 1978, Psychometrika 43(4)"


@metric(
    unit="kg",
    formula="sum of trunk, members, ends, actuators and what it carries",
    source=_LAWS,
    better="less",
)
def mass(design: Design) -> Value:
    """Total mass, boxes and a payload included [kg]."""
    return design.mass


@metric(
    unit="kg",
    formula="quantile of the sum of log-normal masses, by a quadratic in a normal variable",
    source=_FLEISHMAN,
    better="less",
)
def mass_low(design: Design) -> Value:
    """Lower end of the 90 % band of the mass of such a robot, once built, to about 5 % [kg]."""
    return _band(design)[0]


@metric(unit="kg", formula="as mass_low", source=_FLEISHMAN, better="less")
def mass_high(design: Design) -> Value:
    """Upper end of the 90 % band of the mass of such a robot, once built, to about 5 % [kg]."""
    return _band(design)[1]


@once
def _band(design: Design) -> tuple[Value, Value]:
    """Ends of the band of the total mass [kg].

    Each mass that depends on a trend is log-normal and independent. It is approximated by m + s Z +
    c Z^2 with Z normal and the same median and band, and so is their sum, with the sums of means,
    variances and third moments (Fleishman 1978, Psychometrika 43). `Design.mass_band` samples the
    quantiles at a thousand times the cost; these ends are within 2 % of them for the shipped
    quadrupeds and within 5 % for the humanoid. In both, the median is the total mass.
    """
    known, spreads = mass_spreads(design)
    z = quantile(BAND)
    median, variance, third = known, 0.0, 0.0
    for spread in spreads:
        factor = exp(z * spread.sigma)
        up, down = spread.mass * (factor - 1.0), spread.mass * (1.0 - 1.0 / factor)
        s, c = (up + down) / (2.0 * z), (up - down) / (2.0 * z * z)
        median = median + spread.mass + c
        variance = variance + s * s + 2.0 * c * c
        third = third + 6.0 * s * s * c + 8.0 * c * c * c
    if not some(variance > 0):
        return design.mass, design.mass
    # c of the sum, from 6 s^2 c + 8 c^3 = third and s^2 + 2 c^2 = variance.
    skew = divide(third, 8.0 * (variance / 2.0) * sqrt(variance / 2.0))
    c = sqrt(2.0 * variance) * sin(asin(clip(skew, -1.0, 1.0)) / 3.0)
    s = sqrt(maximum(variance - 2.0 * c * c, 0.0))
    unit = design.mass / (median - c)
    middle = design.mass + unit * z * z * c
    return middle - unit * z * s, middle + unit * z * s


@metric(
    unit="kg",
    formula="mass - mass of actuators - mass of carried parts",
    source=_LAWS,
    better="less",
)
def structure_mass(design: Design) -> Value:
    """Mass of trunk, members and end effectors [kg]."""
    return design.structure_mass


@metric(unit="1", formula="mass of actuators / mass", source=_LAWS)
def actuator_share(design: Design) -> Value:
    """Mass of the actuators over total mass [1]."""
    return design.actuator_mass / design.mass


@metric(unit="m", formula="L = L_thigh + L_shank", source="arXiv 2609.38405", base="floating")
def leg_length(design: Design) -> Value:
    """Thigh plus shank, between the axes of hip, knee and ankle [m].

    The longest kind of leg counts. It is measured perpendicular to the axis of the knee.
    `Design.leg_length`, which the structure trends use, is the sum of the distances between joints,
    sideways offsets included.
    """
    lengths = [leg.length for leg in legs(design)]
    return maximum(*lengths) if lengths else math.nan


@metric(
    unit="m",
    formula="distance from hip to ankle at the straightest knee + ankle to floor; of an arm max "
    "over q of |(x, y)_tip - (x, y)_shoulder|",
    source="geometry; Wang and Chen 1991, IEEE T-RA 7(4), for the steps along one joint of an arm",
    base="floating or arm",
)
def reach(design: Design) -> Value:
    """Largest height of a hip over the floor; of an arm, level distance from shoulder to tip [m].

    The longest kind of leg counts. The knee is as straight as its range allows and the foot is
    level; its radius or height is included.

    The shoulder of an arm is the point on the axis of its first joint that is nearest to the origin
    of the second: on an upright first axis the distance is that from the axis. All joints are in
    their ranges; the search along one joint at a time is exact for arms with upright and level
    axes, and may end at a local best where axes are oblique.
    """
    stretch = stretched(design)
    if stretch is not None:
        return stretch.reach
    heights = [leg.span(leg.bend[0]) + leg.below for leg in legs(design)]
    return maximum(*heights) if heights else math.nan
