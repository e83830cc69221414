"""Capabilities that bodies have with one trained policy, from roll-outs.

Each body is rolled out at all levels of the batteries `speed` and `push`. The definitions are those
of the evaluation of a run (`draft.learn.scalars`), with fewer replicas.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from draft.learn.battery import BATTERIES, PUSH, SPEED, settle
from draft.learn.bodies import joined
from draft.learn.energy import add_energy
from draft.learn.features import family_features
from draft.learn.legged import LeggedRobot, check_family
from draft.learn.scalars import Worlds, curves, scalars
from draft.learn.source import Source
from draft.learn.utilisation import Histograms, utilisation
from draft.values import Array

if TYPE_CHECKING:
    from draft.learn.machine import Engine

Report = Callable[[int, int], object]
SPEEDS, KICKS = 6, (1.0, 2.0, 3.0, 4.0, 5.0)  # Number of speeds; kicks [m/s].
MOST_WORLDS = 4096  # Worlds of one simulation, for its memory.
_INTERVAL = 1.645  # Standard errors of a mean in half of a 90 % interval.


@dataclass(frozen=True)
class Learned:
    """Capabilities of N bodies; NaN where the roll-outs give none.

    Attributes:
        top_speed: largest median speed at which 80 % stay up [m/s], shape (N,).
        top_speed_error: half of its 90 % interval over the replicas [m/s], shape (N,).
        kick: kick from which half recover [m/s], shape (N,); the largest level if more do.
        cost_of_transport: electrical power per weight and speed, at top speed, shape (N,); see
            `draft.learn.energy`.
        limiting: joint class nearest its limit at top speed, and the limit: "knee torque".
        inside: whether each body is in the policy's region of validity, shape (N,).
    """

    top_speed: Array
    top_speed_error: Array
    kick: Array
    cost_of_transport: Array
    limiting: tuple[str, ...]
    inside: NDArray[np.bool_]


def speeds(source: Source) -> tuple[float, ...]:
    """Commanded speeds up to the fastest that a policy was trained with [m/s]."""
    return tuple(round(source.forward * (i + 1) / SPEEDS, 2) for i in range(SPEEDS))


def measure(
    source: Source,
    members: Sequence[LeggedRobot],
    device: str,
    engine: Engine,
    *,
    replicas: int = 3,
    seconds: float = 6.0,
    seed: int = 0,
    report: Report = lambda done, of: None,
) -> Learned:
    """Measure the capabilities of bodies with a policy.

    Args:
        source: the policy.
        members: bodies of one topology.
        device: "cpu" or "cuda:0" and the like.
        engine: physics engine.
        replicas: roll-outs of each body at each level.
        seconds: duration of a roll-out [s].
        seed: seed of everything random.
        report: called with the bodies done and their number.

    Raises:
        DraftError: the policy cannot be read or does not drive the bodies, or these have different
            topologies.
    """
    from draft.learn.lab.evaluate import evaluate
    from draft.learn.lab.trainer import task_of
    from draft.learn.lab.trial import Trial
    from draft.learn.machine import NATIVE, cores

    check_family(members)
    source.check(members[0])
    batteries = (
        replace(BATTERIES[SPEED], levels=speeds(source)),
        replace(BATTERIES[PUSH], levels=KICKS),
    )
    policy = source.actor(device)
    threads = cores() if engine.name == NATIVE else 1
    levels = sum(len(battery.levels) for battery in batteries)
    block = max(1, MOST_WORLDS // (levels * replicas))
    found: list[_One] = []
    for start in range(0, len(members), block):
        own = joined(members[start : start + block])
        task = replace(task_of(source.plan), members=own)
        trial = Trial(
            task, batteries, replicas * len(own), seed=seed, seconds=seconds, settle=settle(seconds)
        )
        worlds, histograms = evaluate(trial, policy, device, engine=engine.name, threads=threads)
        found += [_one(member, worlds, histograms) for member in own]
        report(len(found), len(members))
    return Learned(
        top_speed=np.array([one.top_speed for one in found]),
        top_speed_error=np.array([one.error for one in found]),
        kick=np.array([one.kick for one in found]),
        cost_of_transport=np.array([one.cost for one in found]),
        limiting=tuple(one.limiting for one in found),
        inside=np.logical_and.reduce(source.region.holds(family_features(tuple(members))), axis=1),
    )


@dataclass(frozen=True)
class _One:
    top_speed: float
    error: float
    kick: float
    cost: float
    limiting: str


def _one(member: LeggedRobot, worlds: Worlds, histograms: Histograms) -> _One:
    """Capabilities of one body."""
    own = worlds.of(worlds.member == member.name)
    by_battery = curves(own)
    add_energy(by_battery, member)
    values = scalars(by_battery, member.leg_length).values
    level, error = values["peak_command"], math.nan
    if level is not None:
        speed = own.of((own.battery == SPEED) & ~own.fell).at(level).speed
        error = _INTERVAL * float(np.std(speed)) / math.sqrt(len(speed))
    limit = utilisation(histograms, by_battery, values, member.name)["limiting"].get(SPEED)
    return _One(
        top_speed=_number(values["top_speed"]),
        error=error,
        kick=_number(values.get("kick")),
        cost=_number(values["cost_of_transport"]),
        limiting=f"{limit['joint']} {limit['by']}" if limit else "",
    )


def _number(value: float | None) -> float:
    return math.nan if value is None else value
