"""The evaluation battery: what a policy is asked for, level by level.

The grids are those of the released code of arXiv 2609.38405; the levels of a battery are one
ladder of one quantity: a commanded speed, a step's height, a kick's size.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from draft.errors import DraftError, Problem, suggest

if TYPE_CHECKING:
    from draft.learn.run import Plan

SPEED, ASCENT, DESCENT, PUSH, WALK = "speed", "ascent", "descent", "push", "walk"
REPLICAS = 256
SECONDS, SETTLE = 12.0, 2.0  # Of a roll-out, and what of its beginning does not count [s].
KICKS = 4  # Parts of a roll-out between which kicks come: at 3, 6 and 9 s.
WALKING = 0.4  # Command of all batteries but `speed` [m/s].
STANDING, FORWARD_LEAST = 0.1, 0.3  # Of the published protocol: share, and least vx [m/s].


@dataclass(frozen=True)
class Battery:
    """A ladder of levels.

    Attributes:
        name: its name.
        stage: whose policy it asks.
        ground: "flat", or "ascent" and "descent" for stairs.
        unit: of its levels.
        levels: rising.
        walking: commanded forward speed where the levels are not speeds [m/s].
    """

    name: str
    stage: str
    ground: Literal["flat", "ascent", "descent"]
    unit: str
    levels: tuple[float, ...]
    walking: float = WALKING

    def command(self, level: float) -> float:
        """Commanded forward speed at a level [m/s]."""
        return level if self.name in (SPEED, WALK) else self.walking

    def kick(self, level: float) -> float:
        """Largest kick along x and y at a level [m/s]."""
        return level if self.name == PUSH else 0.0


# fmt: off
_SPEEDS = (0.2, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0, 7.0, 8.0,
           10.0, 12.0, 14.0, 17.0, 20.0)
# fmt: on
_STEPS = tuple(round(0.05 + 0.025 * i, 3) for i in range(19))
_KICKS = tuple(1.0 + 0.5 * i for i in range(23))
BATTERIES = {
    battery.name: battery
    for battery in (
        Battery(SPEED, "velocity", "flat", "m/s", _SPEEDS),
        Battery(ASCENT, "terrain", "ascent", "m", _STEPS),
        Battery(DESCENT, "terrain", "descent", "m", _STEPS),
        Battery(PUSH, "push", "flat", "m/s", _KICKS),
        Battery(WALK, "base", "flat", "m/s", (WALKING,)),
    )
}
# What the command line calls them, in the order of the stages.
WORDS = {"walk": (WALK,), "speed": (SPEED,), "stairs": (ASCENT, DESCENT), "push": (PUSH,)}


def named(text: str) -> tuple[str, ...]:
    """Words of a list such as "speed,stairs", each once.

    Raises:
        DraftError: one is no battery, or there is none.
    """
    words = [word.strip() for word in text.split(",") if word.strip()]
    for word in words:
        if word not in WORDS:
            remedy = suggest(word, WORDS, "batteries")
            raise DraftError(Problem(f"there is no battery '{word}'", None, remedy))
    if not words:
        raise DraftError(Problem("--battery names none", None, f"batteries: {', '.join(WORDS)}"))
    return tuple(dict.fromkeys(words))


def of_stage(stage: str) -> tuple[str, ...]:
    """Words of the batteries that ask policies of a stage."""
    return tuple(word for word, names in WORDS.items() if BATTERIES[names[0]].stage == stage)


def batteries(words: Sequence[str], levels: str | None = None) -> tuple[Battery, ...]:
    """Batteries, with all their levels or with fewer.

    Args:
        words: of WORDS.
        levels: a number of levels, spread over each grid, or the levels themselves: "0.4,1.0".

    Raises:
        DraftError: the levels make no sense.
    """
    found = tuple(BATTERIES[name] for word in words for name in WORDS[word])
    if levels is None:
        return found
    text = levels.strip()
    if re.fullmatch(r"\d{1,9}", text):
        if int(text) < 1:
            raise _wrong_levels(levels)
        return tuple(replace(b, levels=spread(b.levels, int(text))) for b in found)
    if len(words) > 1:
        cause = f"--levels {levels} gives the levels of one battery, and there are {len(words)}"
        raise DraftError(Problem(cause, None, "name one --battery, or give a number of levels"))
    try:
        values = tuple(sorted({float(part) for part in text.split(",") if part.strip()}))
    except ValueError:
        raise _wrong_levels(levels) from None
    # A pit of stairs deeper than a patch is wide is no ground to walk on.
    if not values or not all(0.0 < value <= _MOST[found[0].name] for value in values):
        raise _wrong_levels(levels, _MOST[found[0].name])
    return tuple(replace(battery, levels=values) for battery in found)


_MOST = {SPEED: 100.0, ASCENT: 2.0, DESCENT: 2.0, PUSH: 100.0, WALK: 100.0}


def settle(seconds: float) -> float:
    """What of a roll-out's beginning does not count [s]."""
    return seconds / (SECONDS / SETTLE)


def spread(levels: Sequence[float], count: int) -> tuple[float, ...]:
    """Some of the levels, evenly spread from the first to the last.

    Args:
        levels: rising.
        count: how many; all where there are no more.
    """
    if count >= len(levels):
        return tuple(levels)
    if count == 1:
        return (levels[0],)
    last = len(levels) - 1
    return tuple(levels[round(i * last / (count - 1))] for i in range(count))


def check_stage(found: Sequence[Battery], stage: str, run: object) -> None:
    """Check that batteries ask a policy for what it learned.

    Args:
        found: the batteries.
        stage: of the policy.
        run: its run, for the message.

    Raises:
        DraftError: one is of another stage.
    """
    for battery in found:
        if battery.stage != stage:
            cause = (
                f"battery '{_word(battery)}' asks policies of stage {battery.stage}, and {run} is "
                f"of stage {stage}"
            )
            own = ", ".join(of_stage(stage))
            raise DraftError(Problem(cause, None, f"--battery {own}, or --force to ask it anyway"))


@dataclass(frozen=True)
class Met:
    """What robots met in training by a checkpoint, as far as it was noted.

    Attributes:
        row: hardest row of stairs that one was on; None where that is not known.
        fastest: fastest |vx| that was asked for [m/s]; None where that follows a ramp.
    """

    row: float | None = None
    fastest: float | None = None


def flags(found: Sequence[Battery], plan: Plan, iteration: int, met: Met = Met()) -> list[str]:
    """What a reader of the results must know: levels beyond what the policy was trained on.

    Args:
        found: the batteries.
        plan: of the run.
        iteration: of its checkpoint; ramps are as far as then.
        met: what was noted by then.
    """
    told = []
    for battery in found:
        if battery.stage != plan.stage:
            told.append(
                f"{battery.name}: asks policies of stage {battery.stage}; this one is of stage "
                f"{plan.stage}"
            )
        most = trained(battery.name, plan, iteration, met)
        beyond = [level for level in battery.levels if level > most + 1e-9]
        if beyond:
            told.append(
                f"{battery.name}: trained up to {most:.3g} {battery.unit}; beyond it: "
                f"{', '.join(f'{level:g}' for level in beyond)}"
            )
    return told


def trained(name: str, plan: Plan, iteration: int, met: Met = Met()) -> float:
    """Largest level of a battery that a policy met in training, for its smallest design.

    Args:
        name: of the battery.
        plan: of the run.
        iteration: of its checkpoint.
        met: what was noted by then; what the training began with where none was.
    """
    config, stage = plan.config, plan.stage
    root = min(member.scale for member in plan.members) ** 0.5
    if name in (ASCENT, DESCENT):
        mix = config.terrain if stage == "terrain" else config.ground
        if plan.ground != "uneven" or not mix.stairs:
            return 0.0
        last = max(config.ground.rows - 1, 1)
        share = min((mix.start_rows - 1 if met.row is None else met.row) / last, 1.0)
        return mix.step[0] + share * (mix.step[1] - mix.step[0])
    if name == PUSH:
        if stage == "push":
            return min(config.push.linear[:2]) * _at(config.push.ramp, iteration)
        return min(config.episodes.push_linear[:2]) * root
    if stage == "velocity" and config.velocity.growth and met.fastest is not None:
        return met.fastest
    if stage == "velocity" and not config.velocity.growth:
        return config.velocity.forward * _at(config.velocity.ramp, iteration)
    if stage == "push":
        return config.push.forward
    share = config.terrain.limit if stage == "terrain" else config.commands.limit
    slowest = min(member.top_speed for member in plan.members)
    return min(config.commands.forward * root, share * slowest)


def _at(ramp: Sequence[tuple[int, float]], iteration: int) -> float:
    """Value of a ramp in the last of some iterations; see `lab.mdp.curriculums`."""
    return [value for start, value in ramp if start <= max(iteration - 1, 0)][-1]


def _word(battery: Battery) -> str:
    return next(word for word, names in WORDS.items() if battery.name in names)


def _wrong_levels(levels: str, most: float | None = None) -> DraftError:
    cause = f"--levels {levels} is neither a number of levels nor levels above 0"
    cause += "" if most is None else f" and at most {most:g}"
    return DraftError(Problem(cause, None, "such as 5, or 0.4,1.0,2.0"))
