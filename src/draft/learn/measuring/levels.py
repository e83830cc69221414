"""Skill tests: levels of a commanded speed, of a step's height, or of a kick's size.

The levels are those of the released code of arXiv 2609.38405.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from draft.errors import DraftError
from draft.learn.task.constants import ramp_at
from draft.learn.task.stages import STAGES, is_like
from draft.learn.training.reached import UNRECORDED, Reached

if TYPE_CHECKING:
    from draft.learn.training.run import Plan

SPEED, ASCENT, DESCENT, PUSH, WALK = "speed", "ascent", "descent", "push", "walk"
PARTS = 6  # Of a roll-out; the first is not measured.
KICKS = 4  # Parts of a roll-out between which kicks happen: at 3, 6 and 9 s.
WALKING = 0.4  # Command of all tests but `speed` [m/s].
# Published protocol: share of robots that stand, smallest vx of those commanded ahead [m/s].
STANDING, FORWARD_LEAST = 0.1, 0.3


@dataclass(frozen=True)
class SkillTest:
    """Levels of one quantity at which robots are rolled out.

    Attributes:
        name: its name.
        ground: "flat", or "ascent" and "descent" for stairs.
        unit: unit of the levels.
        levels: the levels, rising.
        walking: commanded forward speed if the levels are not speeds [m/s].
    """

    name: str
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
SKILL_TESTS = {
    test.name: test
    for test in (
        SkillTest(SPEED, "flat", "m/s", _SPEEDS),
        SkillTest(ASCENT, "ascent", "m", _STEPS),
        SkillTest(DESCENT, "descent", "m", _STEPS),
        SkillTest(PUSH, "flat", "m/s", _KICKS),
        SkillTest(WALK, "flat", "m/s", (WALKING,)),
    )
}
# Names of the arguments `test`, in the order of the published stages.
WORDS = {"walk": (WALK,), "speed": (SPEED,), "stairs": (ASCENT, DESCENT), "push": (PUSH,)}


# Largest levels; a pit of stairs deeper than a patch is wide is no ground to walk on.
_LARGEST = {SPEED: 100.0, ASCENT: 2.0, DESCENT: 2.0, PUSH: 100.0, WALK: 100.0}


def of_stage(stage: str) -> tuple[str, ...]:
    """Return the names of the skill tests for policies of a stage."""
    return (STAGES[stage].test,)


def skill_tests(
    words: Sequence[str], levels: int | Sequence[float] | None = None
) -> tuple[SkillTest, ...]:
    """Return skill tests, with all their levels or with some.

    Args:
        words: names in WORDS.
        levels: number of levels, spread over those of each test, or the levels themselves of
            one test; None for all.

    Raises:
        DraftError: the levels are invalid.
    """
    words = tuple(dict.fromkeys(words))
    chosen = tuple(SKILL_TESTS[name] for word in words for name in WORDS[word])
    if levels is None:
        return chosen
    if isinstance(levels, int):
        if levels < 1:
            raise no_levels(str(levels))
        return tuple(replace(test, levels=spread(test.levels, levels)) for test in chosen)
    said, values = ",".join(f"{value:g}" for value in levels), tuple(sorted({*levels}))
    if len(words) > 1:
        cause = f"`levels` {said} gives the levels of one test, and there are {len(words)}"
        raise DraftError(cause, "name one `test`, or give a number of levels")
    largest = _LARGEST[chosen[0].name]
    if not values or not all(0.0 < value <= largest for value in values):
        raise no_levels(said, largest)
    return tuple(replace(test, levels=values) for test in chosen)


def no_levels(given: str, most: float | None = None) -> DraftError:
    """Error of levels that are neither a number of them nor above 0 and at most `most`."""
    cause = f"`levels` {given} is neither a number of levels nor levels above 0"
    cause += "" if most is None else f" and at most {most:g}"
    return DraftError(cause, "such as 5, or 0.4,1.0,2.0")


def settle(seconds: float, tests: Sequence[SkillTest]) -> float:
    """Time at the start of a roll-out that is not measured [s].

    Fast robots take four seconds to get up to speed.
    """
    return seconds / (PARTS / 2 if any(test.name == SPEED for test in tests) else PARTS)


def spread(levels: Sequence[float], count: int) -> tuple[float, ...]:
    """Return some of the levels, evenly spread from the first to the last.

    Args:
        levels: the levels, rising.
        count: number of levels to return; all if there are no more.
    """
    if count >= len(levels):
        return tuple(levels)
    if count == 1:
        return (levels[0],)
    last = len(levels) - 1
    return tuple(levels[round(i * last / (count - 1))] for i in range(count))


def flags(
    chosen: Sequence[SkillTest], plan: Plan, iteration: int, reached: Reached = UNRECORDED
) -> list[str]:
    """List levels beyond those of the training, and tests for other stages.

    Args:
        chosen: the tests.
        plan: plan of the run.
        iteration: iterations of its checkpoint, at which ramps are evaluated.
        reached: difficulty reached by then.
    """
    notes = []
    for test in chosen:
        word = next(word for word, names in WORDS.items() if test.name in names)
        if word not in of_stage(plan.stage):
            notes.append(
                f"{test.name}: for policies of stage {stages_of(word)}; this one is of stage "
                f"{plan.stage}"
            )
        most = trained(test.name, plan, iteration, reached)
        beyond = [level for level in test.levels if level > most + 1e-9]
        if beyond:
            ends = " to ".join(f"{level:g}" for level in dict.fromkeys((beyond[0], beyond[-1])))
            notes.append(f"{test.name}: trained up to {most:.3g} {test.unit}; beyond it: {ends}")
    return notes


def trained(name: str, plan: Plan, iteration: int, reached: Reached = UNRECORDED) -> float:
    """Largest level of a test in the training of a policy, for its smallest design.

    Args:
        name: name of the test.
        plan: plan of the run.
        iteration: iterations of its checkpoint.
        reached: difficulty reached by then; if not recorded, that at the start of the training.
    """
    config, stage = plan.config, plan.stage
    root = min(member.scale for member in plan.members) ** 0.5
    if name in (ASCENT, DESCENT):
        mix = config.terrain if STAGES[stage].shares == "terrain" else config.ground
        if plan.ground != "uneven" or not mix.stairs:
            return 0.0
        last = max(config.ground.rows - 1, 1)
        share = min((mix.start_rows - 1 if reached.row is None else reached.row) / last, 1.0)
        return mix.step[0] + share * (mix.step[1] - mix.step[0])
    if name == PUSH:
        if is_like(stage, "push"):
            return min(config.push.linear[:2]) * ramp_at(config.push.ramp, max(iteration - 1, 0))
        return min(config.episodes.push_linear[:2]) * root
    if is_like(stage, "velocity") and config.velocity.growth and reached.fastest is not None:
        return reached.fastest
    if is_like(stage, "velocity") and not config.velocity.growth:
        return config.velocity.forward * ramp_at(config.velocity.ramp, max(iteration - 1, 0))
    if is_like(stage, "push"):
        return config.push.forward
    limited = config.terrain if is_like(stage, "terrain") else config.commands
    slowest = min(member.top_speed for member in plan.members)
    return min(config.commands.forward * root, limited.limit * slowest)


def stages_of(word: str) -> str:
    """Names of the stages that a name in WORDS is for."""
    return ", ".join(name for name in STAGES if word in of_stage(name))
