"""Levers of one tab: what each slider does to a metric, a metric that is held, and one to reach.

All of it is without the browser; `levers_tab` shows it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from draft.design import Design
from draft.errors import DraftError
from draft.explore.nearest import Solution
from draft.explore.sensitivity import sensitivity, stated_numbers
from draft.explore.solve import solve
from draft.metrics import find, of_design
from draft.metrics.registry import reads_verdict
from draft.studio import fields
from draft.values import Array, brief, scalar

NOTHING = "(none)"
_POINTS, _ROUNDS = 65, 3  # Of the search for the value that holds a metric.
_EVEN = 1e-9  # Relative change of a metric that counts as none.


@dataclass
class Levers:
    """What a tab shows and holds.

    Attributes:
        metric: metric whose effects the sliders show; "" for none.
        held: metric that stays while sliders move; "" for none.
        follower: number that follows so that it stays; "" for none.
        told: what the last move of a slider did to the follower; "" for nothing.
    """

    metric: str = ""
    held: str = ""
    follower: str = ""
    told: str = ""

    def effects(self, design: Design) -> dict[str, str]:
        """Effect of a step of each stated number on the metric, as short text by name."""
        if not self.metric:
            return {}
        found = sensitivity(design, [self.metric], samples=2, verdicts=False)
        return {
            name: effect_text(float(found.step_up[i, 0]), float(found.step_down[i, 0]))
            for i, name in enumerate(found.names)
        }

    def moved(self, design: Design, name: str, value: float) -> dict[str, float]:
        """Values to set where a slider moves to a value: its own, and the follower's.

        Args:
            design: the design before the move; its metric is what is held.
            name: the number of the slider.
            value: the value that it moves to.
        """
        self.told = ""
        own = {name: value}
        if not (self.held and self.follower) or name == self.follower:
            return own
        held = hold(design, own, self.held, self.follower)
        if held is None:
            self.told = f"{self.held} is undefined there: {self.follower} stays"
            return own
        at, exact = held
        unit = find(self.held).unit
        target = f"{self.held} {brief(scalar(of_design(design, [self.held])[self.held]))} {unit}"
        if exact:
            self.told = f"{self.follower} {brief(at)} holds {target}"
        else:
            self.told = f"{target} cannot be held: {self.follower} ends at {brief(at)}"
        return own | {self.follower: at}


def effect_text(up: float, down: float) -> str:
    """Direction and size of an effect, of a step more and, if that is none, of a step less."""
    change = up if up and not math.isnan(up) else -down
    if math.isnan(change) or not change:
        return ""
    return f"{'▲' if change > 0 else '▼'} {abs(change):.2g}"


def hold(
    design: Design, moved: Mapping[str, float], metric: str, follower: str
) -> tuple[float, bool] | None:
    """Value of a number at which a metric stays what it is, while others move.

    Args:
        design: the design before the move.
        moved: the values that move.
        metric: the metric that stays.
        follower: the number that follows.

    Returns:
        The nearest such value and True, or the end of the number's range that comes nearest and
        False; None where the metric has no value.
    """
    target = scalar(of_design(design, [metric])[metric])
    now = stated_numbers(design)[follower]
    low, high = reach(design, follower, now)

    def missed(points: Array) -> Array:
        values = {**moved, follower: points}
        many = design.spec.resolve(design.values, values, judge=reads_verdict([metric]))
        found = np.asarray(of_design(many, [metric])[metric], float)
        return np.broadcast_to(found, len(points)) - target

    points = np.unique(np.append(np.linspace(low, high, _POINTS), now))
    miss = missed(points)
    if not np.isfinite(miss).any():
        return None
    even = abs(miss) <= _EVEN * max(abs(target), 1e-12)
    if even[points == now].any():
        return now, True
    crossing = np.flatnonzero(np.diff(np.sign(miss)) != 0)
    crossing = crossing[np.isfinite(miss[crossing]) & np.isfinite(miss[crossing + 1])]
    if not len(crossing):
        nearest = int(np.nanargmin(abs(miss)))
        return float(points[nearest]), False
    middle = (points[crossing] + points[crossing + 1]) / 2
    at = crossing[np.argmin(abs(middle - now))]
    ends = float(points[at]), float(points[at + 1])
    for _ in range(_ROUNDS):
        points = np.linspace(*ends, 33)
        miss = missed(points)
        k = int(np.flatnonzero(np.diff(np.sign(miss)) != 0)[0])
        ends = float(points[k]), float(points[k + 1])
    return (ends[0] + ends[1]) / 2, True


def reach(design: Design, name: str, value: float) -> tuple[float, float]:
    """Range in which a slider moves a number."""
    parameter = design.spec.parameters.get(name)
    bounds = parameter.bounds if parameter is not None else None
    low, high = bounds or fields.reach(value)
    return min(low, value), max(high, value)


def to_target(design: Design, metric: str, text: str) -> Solution:
    """Nearest design that reaches a target, such as ">= 0.5", or "0.5" for the side that is meant.

    Raises:
        DraftError: the text is no target, or the metric has no value.
    """
    words = text.strip()
    sign = next((s for s in (">=", "<=", ">", "<") if words.startswith(s)), "")
    try:
        number = float(words.removeprefix(sign))
    except ValueError:
        raise DraftError(f"'{words}' is no target", 'such as "0.5" or "<= 30"') from None
    if not sign:
        now = scalar(of_design(design, [metric])[metric])
        sign = ">=" if number >= now else "<="
    return solve(design, [f"{metric} {sign} {number!r}"])


def between(solution: Solution, share: float) -> dict[str, float]:
    """Values on the way from the design that a search started from to its solution."""
    return {one.name: one.before + share * (one.after - one.before) for one in solution.moved}
