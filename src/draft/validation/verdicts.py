"""Verdict on a predicted capability beside a published one.

The rule was stated before the comparison. Top speed, step and standing load are limits of a
machine, and controllers and product rules keep below them: a prediction below the best published
figure is an error, one above it is not. Energy is right within a factor of `ENERGY`. A payload
without a definition is not judged.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from draft.design.legs import GRAVITY
from draft.validation.capabilities import Estimate
from draft.validation.published import Figure, best, of_robot

ENERGY = 1.5
_OTHER_WAY: dict[str, Literal["least", "most", ""]] = {"least": "most", "most": "least", "": ""}
LIMITS = {
    "top_speed": ("top_speed",),
    "step_up": ("step", "stairs"),
    "payload_peak": ("payload_standing",),
}
Word = Literal["right", "below", "within", "outside", "not judged", "not measured"]


@dataclass(frozen=True)
class Verdict:
    """A prediction beside a published figure.

    Attributes:
        quantity: the capability.
        figure: the published figure.
        published: its value; of a power, derived from battery and endurance if need be.
        word: "right" or "below" for limits, "within" or "outside" a factor for energy; "not
            judged", "not measured".
        physical: whether a top speed is a claim on the machine and not on its controller: at least
            sqrt(g L), where walking ends.
    """

    quantity: str
    figure: Figure
    published: float
    word: Word
    physical: bool = True


def verdicts(key: str, leg_length: float, found: dict[str, Estimate]) -> list[Verdict]:
    """Judge the capabilities of a robot that have published figures.

    Args:
        key: key of the robot in the survey.
        leg_length: its leg length [m].
        found: capabilities by name.
    """
    rows = []
    for name, quantities in LIMITS.items():
        figure = best([one for q in quantities for one in of_robot(key, q)])
        if figure is None:
            continue
        value = found[name].value if name in found else math.nan
        physical = name != "top_speed" or figure.high >= math.sqrt(GRAVITY * leg_length)
        word: Word = "right" if value >= figure.high else "below"
        if math.isnan(value):
            word = "not measured"
        rows.append(Verdict(name, figure, figure.high, word, physical))
    power = walking_power(key)
    if power is not None:
        figure, watts = power
        value = found["walking_power"].value if "walking_power" in found else math.nan
        fold = math.exp(abs(math.log(value / watts))) if value > 0 else math.nan
        word = "within" if fold <= ENERGY else "outside"
        if figure.bound == "most" and value <= watts:
            word = "within"
        if math.isnan(value):
            word = "not measured"
        rows.append(Verdict("walking_power", figure, watts, word))
    rows += [
        Verdict("payload_walking", one, one.high, "not judged")
        for one in of_robot(key, "payload")[:1]
    ]
    return rows


def walking_power(key: str) -> tuple[Figure, float] | None:
    """Published mean power of a walking robot [W]: stated, or battery over its endurance."""
    stated = of_robot(key, "walking_power")
    if stated:
        return stated[0], stated[0].high
    batteries, times = of_robot(key, "battery_energy"), of_robot(key, "endurance")
    walking = [one for one in times if one.condition.startswith("walking")]
    if not batteries or not walking:
        return None
    figure = walking[0]
    # A longer time is less power.
    figure = replace(figure, bound=_OTHER_WAY[figure.bound])
    return figure, batteries[0].high / math.sqrt(figure.low * figure.high)
