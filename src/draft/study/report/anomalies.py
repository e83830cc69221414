"""Results that look wrong, and need an explanation."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from draft.learn.bodies.legged import CLASSES, LeggedRobot
from draft.learn.measuring.levels import ASCENT, SPEED, WALK
from draft.learn.measuring.scalars import SURVIVAL
from draft.learn.measuring.utilisation import CELL, CELLS
from draft.metrics.capabilities import CAPABILITIES, RANKED
from draft.study.report.records import Evaluation, Samples, Study, seeds_in_words
from draft.study.report.spread import ARM_WORDS, by_seed
from draft.values import Array

# Largest range of the top speed over seeds, per its median.
RANGE = 0.25
# Least speed of a robot that walks, per command.
WALKS = 0.5


def anomalies(study: Study) -> list[str]:
    """Return the results that look wrong, a sentence each."""
    return [words for check in CHECKS for words in check(study)]


def not_walking(study: Study) -> Iterator[str]:
    """Yield base policies that fall, or stand still."""
    for design, title in study.titles.items():
        for one in study.of(design, "nominal"):
            curve = one.summary.tests.get(WALK)
            if not curve:
                continue
            survival, speed = curve["survival"][0], curve["speed"][0]
            asked = curve["levels"][0]
            if survival < SURVIVAL or speed is None:
                why = f"{100 * survival:.0f} % of the roll-outs stay up at {asked:g} m/s"
            elif speed < WALKS * asked:
                why = f"it walks at {speed:.2f} m/s at a command of {asked:g} m/s"
            else:
                continue
            yield f"{title}, seed {one.run.seed}, did not learn to walk: {why}."


def not_climbing(study: Study) -> Iterator[str]:
    """Yield designs of which no seed climbs any step."""
    for design, title in study.titles.items():
        for arm in study.arms:
            values = by_seed(study, design, arm, "step_ascent")
            if values.measured and not values.known:
                whose = f"{ARM_WORDS[arm]}, {seeds_in_words([*values.reasons])}"
                lowest = _lowest(study, design, arm)
                yield (
                    f"{title} cannot climb ({whose}): fewer than half of the roll-outs climb even "
                    f"{lowest:g} m."
                )


def _lowest(study: Study, design: str, arm: str) -> float:
    """Return the lowest step that was tried [m]."""
    tried = (one.summary.tests.get(ASCENT) for one in study.of(design, arm))
    return min(curve["levels"][0] for curve in tried if curve)


def varying(study: Study) -> Iterator[str]:
    """Yield top speeds that vary widely over seeds."""
    for design, title in study.titles.items():
        for arm in study.arms:
            found = by_seed(study, design, arm, "top_speed").spread
            if found and found.count > 1 and found.high - found.low > RANGE * found.median:
                share = (found.high - found.low) / found.median
                yield (
                    f"{title}'s top speed ({ARM_WORDS[arm]}) ranges over {100 * share:.0f} % of "
                    f"its median ({found.low:.2f} to {found.high:.2f} m/s, {found.count} seeds); "
                    f"at most {100 * RANGE:.0f} % is expected."
                )


def too_efficient(study: Study) -> Iterator[str]:
    """Yield efficiencies above what the counted torques and speeds of the motors allow."""
    for design, title in study.titles.items():
        for one in study.of(design, "nominal"):
            eta = one.summary.scalars.get("eta")
            most = largest_efficiency(one)
            if eta is not None and most is not None and eta > most:
                yield (
                    f"{title}, seed {one.run.seed}: an efficiency of {eta:.3f} is above what the "
                    f"counted torques and speeds of its motors allow, {most:.3f}."
                )


def largest_efficiency(one: Evaluation) -> float | None:
    """Return the largest efficiency that the counted samples of the speed test allow.

    The efficiency is Pm / (Pm + PJ) with Pm = sum |tau w| and PJ = sum tau^2 w_NL / tau_stall. Each
    sample is taken at the corner of its cell with the least torque in PJ, and at that with the
    largest torque and speed in Pm. Samples of all replicas are pooled.

    Returns:
        The bound; None if samples of a joint class are missing.
    """
    found: Mapping[str, Array] = {**one.samples.get(SPEED, Samples()).plane}
    if set(found) != set(CLASSES):
        return None
    low = CELL * np.arange(CELLS)
    high = low + CELL
    high[-1] = 2 * low[-1]  # The last cell has no end; no joint comes near this.
    mechanical = heat = 0.0
    member = one.run.members[0]
    for joint, (weight, of_heat) in _powers(member).items():
        share = found[joint] / found[joint].sum()
        mechanical += weight * float(np.sum(share * np.outer(high, high)))
        heat += of_heat * float(np.sum(share * low[:, None] ** 2))
    return mechanical / (mechanical + heat)


def _powers(member: LeggedRobot) -> dict[str, tuple[float, float]]:
    """Return the scales of power and of heat of each joint class, summed over legs [W].

    These are peak torque times no-load speed, and the heat at peak torque.
    """
    peak, stall = np.array(member.peak_torque), np.array(member.stall_torque)
    power = peak * np.array(member.no_load_speed)
    legs = np.array(member.leg_joints)
    scales = ((x[legs].sum(0).tolist()) for x in (power, power * (peak / stall)))
    return dict(zip(CLASSES, zip(*scales, strict=True), strict=True))


def better_when_wrong(study: Study) -> Iterator[str]:
    """Yield skills that untrained inertia errors improve in every seed."""
    for design, title in study.titles.items():
        for scalar in RANKED:
            right, wrong = (by_seed(study, design, arm, scalar).known for arm in ARM_WORDS)
            both = sorted(set(right) & set(wrong))
            if len(both) > 1 and min(wrong[s] for s in both) > max(right[s] for s in both):
                words, unit = CAPABILITIES[scalar].label, CAPABILITIES[scalar].unit
                unit = "" if unit == "1" else f" {unit}"
                yield (
                    f"{title}'s {words} is better with inertia errors than without, in every seed: "
                    f"at least {min(wrong[s] for s in both):.2f}{unit} against at most "
                    f"{max(right[s] for s in both):.2f}{unit}."
                )


CHECKS: tuple[Callable[[Study], Iterator[str]], ...] = (
    *(not_walking, not_climbing, varying),
    *(too_efficient, better_when_wrong),
)
