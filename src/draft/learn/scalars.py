"""What a battery's roll-outs say: curves over its levels, and one number per capability.

Definitions are those of the released code of arXiv 2609.38405 where the paper leaves them open.
A number that roll-outs cannot give is None with a reason in words, never not-a-number.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from draft.learn.battery import ASCENT, DESCENT, PUSH, SPEED, WALK

GRAVITY = 9.81  # [m/s^2]
SURVIVAL = 0.8  # Share that must stay up at a speed for it to count.
HALF = 0.5  # Share that must recover from a kick, or traverse a step.


@dataclass(frozen=True)
class Worlds:
    """Roll-outs, one row each.

    Attributes:
        battery: names.
        level: of the battery.
        member: names of designs.
        replica: numbers, from 0.
        fell: it fell, at any time.
        speed: mean forward speed in the trunk's frame, after settling [m/s].
        mechanical: mean of sum |tau qdot| [W].
        heat: mean of sum tau^2 w_NL / tau_peak [W].
        rise: height of the trunk at the end above that when it had settled [m].
        kept: it was commanded to walk.

    The four measures mean nothing where it fell.
    """

    battery: np.ndarray
    level: np.ndarray
    member: np.ndarray
    replica: np.ndarray
    fell: np.ndarray
    speed: np.ndarray
    mechanical: np.ndarray
    heat: np.ndarray
    rise: np.ndarray
    kept: np.ndarray

    def of(self, rows: np.ndarray) -> Worlds:
        """Some rows.

        Args:
            rows: a mask.
        """
        return Worlds(**{one.name: getattr(self, one.name)[rows] for one in fields(self)})

    def at(self, level: float) -> Worlds:
        """Rows of a level."""
        return self.of(np.isclose(self.level, level, rtol=0.0, atol=1e-9))


@dataclass
class Scalars:
    """Capabilities of a design.

    Attributes:
        values: by name; None where the roll-outs cannot give one.
        reasons: why, by name.
        flags: what else to know.
    """

    values: dict[str, float | None] = field(default_factory=dict)
    reasons: dict[str, str] = field(default_factory=dict)
    flags: list[str] = field(default_factory=list)

    def put(self, name: str, value: float | None, reason: str = "") -> float | None:
        """Note a number, or why there is none."""
        self.values[name] = value
        if value is None:
            self.reasons[name] = reason
        return value


def survival(rows: Worlds) -> float:
    """Share of roll-outs that did not fall."""
    return float(np.mean(~rows.fell))


def median_speed(rows: Worlds) -> float | None:
    """Median over those that did not fall of their mean forward speed [m/s]."""
    return _median(rows.speed[~rows.fell])


def efficiency(rows: Worlds) -> float | None:
    """Median over those that did not fall of Pm / (Pm + PJ), mechanical power and heat."""
    total = rows.mechanical + rows.heat
    works = ~rows.fell & (total > 0)
    return _median(rows.mechanical[works] / total[works])


def traversed(rows: Worlds, step: float) -> float:
    """Share that did not fall and ended more than one step higher or lower."""
    return float(np.mean(~rows.fell & (np.abs(np.where(rows.fell, 0.0, rows.rise)) > step)))


def curves(rows: Worlds) -> dict[str, dict[str, Any]]:
    """Curves over the levels of each battery, as plain data."""
    found = {}
    for name in dict.fromkeys(rows.battery.tolist()):
        of = rows.of(rows.battery == name)
        levels = np.unique(of.level).tolist()
        each = [of.at(level) for level in levels]
        found[name] = {
            "levels": levels,
            "survival": [survival(one) for one in each],
            "speed": [median_speed(one) for one in each],
            "eta": [efficiency(one) for one in each],
        }
        if name in (ASCENT, DESCENT):
            found[name]["traversed"] = [
                traversed(one, level) for one, level in zip(each, levels, strict=True)
            ]
        elif name == PUSH:
            found[name]["recovered"] = [survival(one) for one in each]
    return found


def scalars(found: Mapping[str, Mapping[str, Any]], leg_length: float) -> Scalars:
    """Capabilities that the curves of some batteries give.

    Args:
        found: curves by battery, as `curves` gives them.
        leg_length: of the design [m].
    """
    made = Scalars()
    tasks: dict[str, Callable[[], None]] = {
        SPEED: lambda: _speed(made, found[SPEED], leg_length),
        WALK: lambda: _walk(made, found[WALK]),
        PUSH: lambda: _push(made, found[PUSH], leg_length),
    }
    for name, task in tasks.items():
        if name in found:
            task()
    if ASCENT in found or DESCENT in found:
        _stairs(made, found, leg_length)
    return made


def top_speed(curve: Mapping[str, Any]) -> tuple[float, float] | None:
    """Largest median speed over the levels where enough stay up, and that level; None if none."""
    counted = [
        (speed, level)
        for level, share, speed in zip(
            curve["levels"], curve["survival"], curve["speed"], strict=True
        )
        if share >= SURVIVAL and speed is not None
    ]
    return max(counted, key=lambda pair: pair[0], default=None)


def kick(levels: Sequence[float], recovered: Sequence[float]) -> tuple[float | None, bool]:
    """Kick at which the share that recovers first crosses a half, linearly interpolated.

    Args:
        levels: rising [m/s].
        recovered: shares.

    Returns:
        The kick, None where fewer than half recover at the first level; and whether the share
        crosses a half at all: where it does not, the kick is the last level.
    """
    if recovered[0] < HALF:
        return None, True
    for i in range(1, len(levels)):
        if recovered[i] < HALF:
            share = (recovered[i - 1] - HALF) / (recovered[i - 1] - recovered[i])
            return levels[i - 1] + share * (levels[i] - levels[i - 1]), True
    return levels[-1], False


def tallest(levels: Sequence[float], shares: Sequence[float]) -> float | None:
    """Highest level whose share is at least a half; None where there is none."""
    return max((n for n, share in zip(levels, shares, strict=True) if share >= HALF), default=None)


def _speed(made: Scalars, curve: Mapping[str, Any], leg_length: float) -> None:
    best = top_speed(curve)
    why = _none_up(curve) or f"fewer than {SURVIVAL:.0%} stay up at every speed"
    value = made.put("top_speed", best[0] if best else None, why)
    made.put("peak_command", best[1] if best else None, why)
    eta = curve["eta"][curve["levels"].index(best[1])] if best else None
    made.put("eta", eta, why if best is None else "no joint does work or gives off heat")
    froude = None if value is None else value / math.sqrt(GRAVITY * leg_length)
    made.put("top_speed_normalised", froude, why)


def _walk(made: Scalars, curve: Mapping[str, Any]) -> None:
    made.put("walk_survival", curve["survival"][0])
    made.put("walk_speed", curve["speed"][0], "all fell")


def _push(made: Scalars, curve: Mapping[str, Any], leg_length: float) -> None:
    levels = curve["levels"]
    value, crosses = kick(levels, curve["recovered"])
    why = _none_up(curve) or f"fewer than half recover at the first level, {levels[0]:g} m/s"
    made.put("kick", value, why)
    froude = None if value is None else value / math.sqrt(GRAVITY * leg_length)
    made.put("kick_normalised", froude, why)
    if not crosses:
        made.flags.append(f"kick: half or more recover at every level, up to {levels[-1]:g} m/s")


def _stairs(made: Scalars, found: Mapping[str, Mapping[str, Any]], leg_length: float) -> None:
    shares = {}
    for name in (ASCENT, DESCENT):
        if name in found:
            curve = found[name]
            shares[name] = dict(zip(curve["levels"], curve["traversed"], strict=True))
            value = tallest(curve["levels"], curve["traversed"])
            made.put(f"step_{name}", value, _none_up(curve) or _NO_STEP)
    if len(shares) < 2:
        return
    levels = [level for level in shares[ASCENT] if level in shares[DESCENT]]
    means = [(shares[ASCENT][level] + shares[DESCENT][level]) / 2 for level in levels]
    both = [_none_up(found[name]) for name in shares]
    why = _NONE_UP if all(both) else _NO_STEP
    value = made.put("step", tallest(levels, means), why)
    made.put("step_normalised", None if value is None else value / leg_length, why)


_NONE_UP = "all fell at every level"
_NO_STEP = "fewer than half traverse any step"


def _none_up(curve: Mapping[str, Any]) -> str:
    """A reason where nobody stays up at any level."""
    return "" if any(curve["survival"]) else _NONE_UP


def _median(values: np.ndarray) -> float | None:
    return float(np.median(values)) if values.size else None
