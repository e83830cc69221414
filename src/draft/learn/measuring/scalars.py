"""Curves over the levels of skill tests, and one number per capability.

Definitions that the paper leaves open are those of the released code of arXiv 2609.38405. A number
that roll-outs cannot give is None with a reason, never not-a-number.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Required

import numpy as np
from typing_extensions import TypedDict  # pydantic cannot read that of typing before 3.12

from draft.laws.limits import turning_time, turning_torque
from draft.learn.measuring.levels import ASCENT, DESCENT, PUSH, SPEED, WALK
from draft.metrics.capabilities import CAPABILITIES

SURVIVAL = 0.8  # Share that must not fall at a speed for it to count.
HALF_HOUR = 1800.0  # Time for which a speed has to be held to count as sustained [s].
_ROUNDED = 1e-6  # Relative error of a level.
LONGEST = 1e5  # Longest time that is told apart from no limit [s].
HALF = 0.5  # Share that must recover from a kick, or traverse a step.


class Curve(TypedDict, total=False):
    """Measures over the levels of a skill test, one value per level.

    Attributes:
        levels: the levels, rising.
        survival: share of roll-outs that did not fall.
        speed: median forward speed [m/s].
        eta: median efficiency.
        power: median electrical power [W].
        cost_of_transport, endurance, range: see `energy.add_energy`; of one design.
        rms_rated: see `heating.add_heat`; of one design.
        traversed: share that traversed the step, for stairs.
        recovered: share that recovered from the kicks, for push.
    """

    levels: Required[list[float]]
    survival: Required[list[float]]
    speed: Required[list[float | None]]
    eta: Required[list[float | None]]
    power: list[float | None]
    cost_of_transport: list[float | None]
    endurance: list[float | None]
    range: list[float | None]
    rms_rated: list[float | None]
    traversed: list[float]
    recovered: list[float]


@dataclass(frozen=True)
class Worlds:
    """Roll-outs, one row each.

    Attributes:
        test: name of the skill test.
        level: level of the test.
        member: name of the design.
        replica: number of the replica, from 0.
        fell: whether it fell at any time.
        speed: mean forward speed in the trunk's frame, after settling [m/s].
        mechanical: mean of sum |tau qdot| [W].
        heat: mean of sum tau^2 w_NL / tau_stall [W].
        copper: mean of the motors' heat, by the corner of the trend where none is stated [W].
        driving: mean of sum max(tau qdot, 0) [W].
        rise: height of the trunk at the end relative to that after settling [m].
        kept: whether it was commanded to walk.

    The six measures have no meaning for a roll-out that fell.
    """

    test: np.ndarray
    level: np.ndarray
    member: np.ndarray
    replica: np.ndarray
    fell: np.ndarray
    speed: np.ndarray
    mechanical: np.ndarray
    heat: np.ndarray
    copper: np.ndarray
    driving: np.ndarray
    rise: np.ndarray
    kept: np.ndarray

    def of(self, rows: np.ndarray) -> Worlds:
        """Select rows.

        Args:
            rows: mask of the rows.
        """
        return Worlds(**{one.name: getattr(self, one.name)[rows] for one in fields(self)})

    def with_rows(self, *others: Worlds) -> Worlds:
        """Append the rows of others."""
        parts = (self, *others)
        return Worlds(
            **{
                one.name: np.concatenate([getattr(part, one.name) for part in parts])
                for one in fields(self)
            }
        )

    def at(self, level: float) -> Worlds:
        """Select the rows of a level."""
        return self.of(np.isclose(self.level, level, rtol=0.0, atol=1e-9))


@dataclass
class Scalars:
    """Capabilities of a design.

    Attributes:
        values: numbers by name; None if the roll-outs cannot give one.
        reasons: reasons for each None, by name.
        flags: remarks on the numbers.
    """

    values: dict[str, float | None] = field(default_factory=dict)
    reasons: dict[str, str] = field(default_factory=dict)
    flags: list[str] = field(default_factory=list)

    def put(self, name: str, value: float | None, reason: str = "") -> float | None:
        """Add a number, or the reason why there is none; return the number."""
        self.values[name] = value
        if value is None:
            self.reasons[name] = reason
        return value


def survival(rows: Worlds) -> float:
    """Share of roll-outs that did not fall."""
    return float(np.mean(~rows.fell))


def median_speed(rows: Worlds) -> float | None:
    """Median of the mean forward speeds of roll-outs that did not fall [m/s]."""
    return _median(rows.speed[~rows.fell])


def efficiency(rows: Worlds) -> float | None:
    """Median of Pm / (Pm + PJ) of roll-outs that did not fall, of mechanical power and heat."""
    total = rows.mechanical + rows.heat
    valid = ~rows.fell & (total > 0)
    return _median(rows.mechanical[valid] / total[valid])


def electrical_power(rows: Worlds, regeneration: float = 0.0) -> float | None:
    """Median electrical power of roll-outs that did not fall [W]: driving power plus heat.

    Args:
        rows: the roll-outs.
        regeneration: share of the power of braking joints that returns to the battery.
    """
    braking = rows.mechanical - rows.driving
    power = rows.driving + rows.copper - regeneration * braking
    return _median(power[~rows.fell])


def traversed(rows: Worlds, step: float) -> float:
    """Share of roll-outs that did not fall and ended more than one step higher or lower."""
    return float(np.mean(~rows.fell & (np.abs(np.where(rows.fell, 0.0, rows.rise)) > step)))


def curves(rows: Worlds, regeneration: float = 0.0) -> dict[str, Curve]:
    """Compute the curve of each test, by name; see `electrical_power` for the arguments."""
    by_test: dict[str, Curve] = {}
    for name in dict.fromkeys(rows.test.tolist()):
        own = rows.of(rows.test == name)
        levels = np.unique(own.level).tolist()
        each = [own.at(level) for level in levels]
        curve: Curve = {
            "levels": levels,
            "survival": [survival(one) for one in each],
            "speed": [median_speed(one) for one in each],
            "eta": [efficiency(one) for one in each],
            "power": [electrical_power(one, regeneration) for one in each],
        }
        if name in (ASCENT, DESCENT):
            curve["traversed"] = [
                traversed(one, level) for one, level in zip(each, levels, strict=True)
            ]
        elif name == PUSH:
            curve["recovered"] = [survival(one) for one in each]
        by_test[name] = curve
    return by_test


def scalars(by_test: Mapping[str, Curve], leg_length: float, trained: float = math.inf) -> Scalars:
    """Compute the capabilities from the curves of skill tests.

    Args:
        by_test: curves by test, from `curves`.
        leg_length: leg length of the design [m].
        trained: fastest command of the training [m/s]: top speeds are those up to it.
    """
    result = Scalars()
    if SPEED in by_test:
        _speed(result, by_test[SPEED], trained)
    if WALK in by_test:
        _walk(result, by_test[WALK])
    if PUSH in by_test:
        _push(result, by_test[PUSH])
    if ASCENT in by_test or DESCENT in by_test:
        _stairs(result, by_test)
    for name, one in CAPABILITIES.items():
        if one.law is not None and one.law.of in result.values:
            value, why = result.values[one.law.of], result.reasons.get(one.law.of, "")
            result.put(name, None if value is None else one.law.value(value, leg_length), why)
    return result


def top_speed(curve: Curve, trained: float = math.inf) -> tuple[float, float] | None:
    """Largest median speed over the levels with enough survival, and its level; None if none.

    Args:
        curve: curve of commanded speeds.
        trained: fastest command that counts [m/s].
    """
    counted = [
        (speed, level)
        for level, share, speed in zip(
            curve["levels"], curve["survival"], curve["speed"], strict=True
        )
        if share >= SURVIVAL and speed is not None and level <= trained * (1 + _ROUNDED)
    ]
    return max(counted, key=lambda pair: pair[0], default=None)


def kick(levels: Sequence[float], recovered: Sequence[float]) -> tuple[float | None, bool]:
    """Kick at which the share that recovers first drops below a half, linearly interpolated.

    Args:
        levels: sizes of the kicks, rising [m/s].
        recovered: share that recovers at each level.

    Returns:
        The kick [m/s], None if fewer than half recover at the first level; and whether the share
        drops below a half at all: if not, the kick is the last level.
    """
    if recovered[0] < HALF:
        return None, True
    for i in range(1, len(levels)):
        if recovered[i] < HALF:
            share = (recovered[i - 1] - HALF) / (recovered[i - 1] - recovered[i])
            return levels[i - 1] + share * (levels[i] - levels[i - 1]), True
    return levels[-1], False


def tallest(levels: Sequence[float], shares: Sequence[float]) -> float | None:
    """Highest level whose share is at least a half; None if there is none."""
    return max((n for n, share in zip(levels, shares, strict=True) if share >= HALF), default=None)


def _speed(result: Scalars, curve: Curve, trained: float) -> None:
    best, beyond = top_speed(curve, trained), top_speed(curve)
    why = _none_up(curve) or f"fewer than {SURVIVAL:.0%} stay up at every speed"
    if curve["levels"][0] > trained * (1 + _ROUNDED):
        why = f"every level is beyond the training, up to {trained:.3g} m/s"
    if beyond is not None and beyond != best:
        result.put("top_speed_beyond", beyond[0])
    result.put("top_speed", best[0] if best else None, why)
    result.put("peak_command", best[1] if best else None, why)
    eta = curve["eta"][curve["levels"].index(best[1])] if best else None
    result.put("eta", eta, why if best is None else "no joint does work or gives off heat")
    place = curve["levels"].index(best[1]) if best else None
    if "rms_rated" in curve:
        held = sustained_speed(curve, turning_torque(HALF_HOUR))
        cause = why if best is None else "its motors overheat at every speed"
        result.put("sustained_speed", held[0] if held else None, cause)
        rms = None if place is None else curve["rms_rated"][place]
        result.put("hold_time", None if rms is None else min(turning_time(rms), LONGEST), why)
        _energy(result, curve, held[1] if held else None, cause, names=("endurance", "range"))
        _energy(result, curve, place, why, names=("cost_of_transport",))
    else:
        _energy(result, curve, place, why)


def sustained_speed(curve: Curve, most: float) -> tuple[float, int] | None:
    """Largest speed whose torques can be held, and its level's place; None if there is none.

    Between the last level that can be held and the next it is interpolated.

    Args:
        curve: curve of commanded speeds, with `rms_rated`.
        most: root mean square torque over the rated one that can be held.
    """
    rows = [
        (i, speed, rms)
        for i, (share, speed, rms) in enumerate(
            zip(curve["survival"], curve["speed"], curve.get("rms_rated", []), strict=False)
        )
        if share >= SURVIVAL and speed is not None and rms is not None
    ]
    held = [row for row in rows if row[2] <= most]
    if not held:
        return None
    place, best, rms = max(held, key=lambda row: row[1])
    after = [row for row in rows if row[0] > place and row[2] > most and row[1] > best]
    if after:
        _, faster, more = after[0]
        best += (most - rms) / (more - rms) * (faster - best)
    return best, place


def _walk(result: Scalars, curve: Curve) -> None:
    result.put("walk_survival", curve["survival"][0])
    result.put("walk_speed", curve["speed"][0], "all fell")
    fell = curve["speed"][0] is None
    _energy(result, curve, None if fell else 0, "all fell", "walk_")


def _energy(
    result: Scalars,
    curve: Curve,
    place: int | None,
    why: str,
    prefix: str = "",
    names: Sequence[str] = ("cost_of_transport", "endurance", "range"),
) -> None:
    """Add cost of transport, endurance and range at a level of a curve that has them."""
    reason = why if place is None else "it does not move forwards, or uses no power"
    columns = {
        "cost_of_transport": curve.get("cost_of_transport"),
        "endurance": curve.get("endurance"),
        "range": curve.get("range"),
    }
    for name in names:
        values = columns[name]
        if values is not None:
            result.put(prefix + name, None if place is None else values[place], reason)


def _push(result: Scalars, curve: Curve) -> None:
    levels = curve["levels"]
    value, crosses = kick(levels, curve.get("recovered", []))
    why = _none_up(curve) or f"fewer than half recover at the first level, {levels[0]:g} m/s"
    result.put("kick", value, why)
    if not crosses:
        result.flags.append(f"kick: half or more recover at every level, up to {levels[-1]:g} m/s")


def _stairs(result: Scalars, by_test: Mapping[str, Curve]) -> None:
    shares = {}
    for name in (ASCENT, DESCENT):
        if name in by_test:
            curve = by_test[name]
            crossed = curve.get("traversed", [])
            shares[name] = dict(zip(curve["levels"], crossed, strict=True))
            value = tallest(curve["levels"], crossed)
            result.put(f"step_{name}", value, _none_up(curve) or _NO_STEP)
    if len(shares) < 2:
        return
    levels = [level for level in shares[ASCENT] if level in shares[DESCENT]]
    means = [(shares[ASCENT][level] + shares[DESCENT][level]) / 2 for level in levels]
    both = [_none_up(by_test[name]) for name in shares]
    why = _NONE_UP if all(both) else _NO_STEP
    result.put("step", tallest(levels, means), why)


_NONE_UP = "all fell at every level"
_NO_STEP = "fewer than half traverse any step"


def _none_up(curve: Curve) -> str:
    """Reason if all roll-outs fell at every level; "" otherwise."""
    return "" if any(curve["survival"]) else _NONE_UP


def _median(values: np.ndarray) -> float | None:
    return float(np.median(values)) if values.size else None
