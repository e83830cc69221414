"""Capabilities of a robot by one policy, with intervals, and what limits them.

Speeds are measured at commands that the policy was trained with, over the last two thirds of a
roll-out. Intervals are those of a bootstrap over the roll-outs, from 5 to 95 %: they say how sure
the measurement is, not how right the model. A sample in which too few stay up, or that climbs no
step, counts as zero for what a robot can reach.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from draft.design import Design
from draft.design.legs import GRAVITY
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.engine.machine import NATIVE, Engine, cores
from draft.learn.measuring.conditions import with_conditions
from draft.learn.measuring.energy import NAMES as ENERGY
from draft.learn.measuring.energy import add_energy, electronics_power, supply
from draft.learn.measuring.evaluation_options import Extras
from draft.learn.measuring.levels import ASCENT, DESCENT, PUSH, SKILL_TESTS, SPEED, SkillTest
from draft.learn.measuring.policies import Source
from draft.learn.measuring.scalars import SURVIVAL, Worlds, curves, scalars
from draft.metrics.leaping import push_off_of
from draft.validation.standing import standing
from draft.values import scalar

SPEEDS = 8  # Commands up to the fastest that was trained.
WALKING = 0.5  # Commanded speed of a walk, per sqrt(g L).
CLIMBING = 0.3  # Commanded speed on stairs, per sqrt(g L).
KICKS = (1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5)  # Per sqrt(g L).
STEPS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5)  # Per L.
REPLICAS, SECONDS, SETTLE = 16, 9.0, 3.0
_DRAWS, _ENDS = 400, (0.05, 0.95)
Report = Callable[[str, int, int], object]


@dataclass(frozen=True)
class Estimate:
    """A capability.

    Attributes:
        value: the number; NaN if there is none.
        low, high: ends of its interval; those of a number in closed form are the number.
        limit: what limits it; "" if nothing is known.
        reason: why there is none.
    """

    value: float
    low: float
    high: float
    limit: str = ""
    reason: str = ""

    @staticmethod
    def exact(value: float, limit: str = "") -> Estimate:
        """A number in closed form."""
        return Estimate(value, value, value, limit)

    @staticmethod
    def none(reason: str) -> Estimate:
        """No number."""
        return Estimate(math.nan, math.nan, math.nan, reason=reason)


def in_closed_form(member: LeggedRobot, design: Design) -> dict[str, Estimate]:
    """Mass, load that a standing robot holds, jump, and power and endurance while it stands.

    Args:
        member: the robot, whose masses count.
        design: its design, for the motors.
    """
    held = standing(member, design)
    power = electronics_power(member) + held.heat
    return {
        "mass": Estimate.exact(member.mass),
        "payload_peak": Estimate.exact(held.payload(held.peak), "peak torque"),
        "payload_rated": Estimate.exact(held.payload(held.rated), "rated torque"),
        "jump_height": Estimate.exact(scalar(push_off_of(design, member.mass).height)),
        "standing_power": Estimate.exact(power),
        "endurance_standing": Estimate.exact(supply(member)[0] / power),
    }


def measured(
    source: Source,
    member: LeggedRobot,
    device: str,
    engine: Engine,
    *,
    replicas: int = REPLICAS,
    seconds: float = SECONDS,
    seed: int = 0,
    conditions: Extras | None = None,
    climber: Source | None = None,
    report: Report = lambda what, step, steps: None,
) -> dict[str, Estimate]:
    """Capabilities of a robot from roll-outs of a policy.

    Args:
        source: the policy.
        member: the robot.
        device: "cpu" or "cuda:0" and the like.
        engine: physics engine.
        replicas: roll-outs at each level.
        seconds: duration of a roll-out [s]; the first third is not measured.
        seed: seed of everything random.
        conditions: physics that differs from that of the training.
        climber: policy that climbs and descends stairs; None to leave stairs out.
        report: called after every step with the tests' names, steps done and total steps.

    Raises:
        DraftError: the policy does not drive the robot, or the physics is impossible.
    """
    from draft.learn.measuring.rollout.evaluate import evaluate
    from draft.learn.measuring.rollout.trial import Trial
    from draft.learn.training.ppo.worlds import task_of

    root = math.sqrt(GRAVITY * member.leg_length)
    most = source.forward_for(member)
    commands = {round(most * (i + 1) / SPEEDS, 3) for i in range(SPEEDS)}
    walking = round(WALKING * root, 3)
    commands.add(walking)
    heights = tuple(round(share * member.leg_length, 4) for share in STEPS)
    runs = _test(SPEED, tuple(sorted(commands)))
    kicks = _test(PUSH, tuple(round(k * root, 3) for k in KICKS), walking=WALKING * root)
    chosen = [(source, (runs, kicks))]
    if climber is not None:
        up, down = (_test(name, heights, walking=CLIMBING * root) for name in (ASCENT, DESCENT))
        chosen.append((climber, (up, down)))
    threads, settle = cores() if engine.name == NATIVE else 1, seconds * SETTLE / SECONDS
    parts = []
    for one, tests in chosen:
        one.drive.check(member)
        config = with_conditions(one.plan.config, conditions or Extras())
        task = replace(task_of(one.plan), members=(member,), config=config)
        trial = Trial(task, tests, replicas, seconds, settle, seed=seed)
        where = {"engine": engine.name, "threads": threads}
        parts.append(evaluate(trial, one.drive.actor(device), device, report, **where)[0])
    worlds = parts[0].with_rows(*parts[1:])
    values = _numbers(worlds, member, walking)
    drawn = _resampled(worlds, member, walking, seed)
    found = {}
    for name, value in values.items():
        if value is None:
            found[name] = Estimate.none(_WHY.get(name, "too few stay up"))
            continue
        low, high = np.quantile(drawn[name], _ENDS) if drawn[name] else (value, value)
        found[name] = Estimate(value, float(low), float(high))
    return found


_REACHED = ("top_speed", "kick", "step_up", "step_down")
_WHY = {"step_up": "it climbs no step", "step_down": "it descends no step"}


def _test(name: str, levels: tuple[float, ...], walking: float | None = None) -> SkillTest:
    test = replace(SKILL_TESTS[name], levels=levels)
    return test if walking is None else replace(test, walking=walking)


def _numbers(worlds: Worlds, member: LeggedRobot, walking: float) -> dict[str, float | None]:
    """Capabilities of roll-outs by name; None where there is none."""
    by_test = curves(worlds)
    add_energy(by_test, member)
    values = scalars(by_test, member.leg_length).values
    names = {"step_ascent": "step_up", "step_descent": "step_down"}
    kept = ("top_speed", "peak_command", "kick", *names)
    found = {names.get(name, name): values[name] for name in kept if name in values}
    speed = by_test[SPEED]
    at = speed["levels"].index(walking)
    power = (speed.get("power") or [None])[at]
    stays = speed["survival"][at] >= SURVIVAL
    walks = stays and (speed.get("endurance") or [None])[at] is not None and power is not None
    found["walking_speed"] = speed["speed"][at] if walks else None
    found["walking_power"] = electronics_power(member) + power if walks and power else None
    return found | {name: (speed.get(name) or [None])[at] if stays else None for name in ENERGY}


def _resampled(
    worlds: Worlds, member: LeggedRobot, walking: float, seed: int
) -> Mapping[str, list[float]]:
    """Numbers of bootstrap samples of the roll-outs of each level, by name."""
    rng = np.random.default_rng(seed)
    groups: dict[tuple[str, float], list[int]] = {}
    for i, key in enumerate(zip(worlds.test.tolist(), worlds.level.tolist(), strict=True)):
        groups.setdefault(key, []).append(i)
    drawn: dict[str, list[float]] = {}
    for _ in range(_DRAWS):
        rows = np.concatenate([rng.choice(own, len(own)) for own in groups.values()])
        for name, value in _numbers(worlds.of(rows), member, walking).items():
            found = drawn.setdefault(name, [])
            if value is not None or name in _REACHED:
                found.append(value or 0.0)
    return drawn
