"""Stages of training: what each starts from, how it is evaluated, and its changes of the task.

All stages share one environment (`draft.learn.task.mdp.environment`): walking at a commanded
velocity, with pushes. A stage is a function that changes its configuration, with the numbers of the
group of its name. This module loads neither mjlab nor PyTorch; the functions do.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import BeforeValidator
from pydantic_core import PydanticKnownError

from draft.extensions import Registry
from draft.learn.task.constants import JOINTS, Scaled, scaled

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnvCfg

    from draft.learn.task.groups import Velocity
    from draft.learn.task.mdp.commands import Pushed, VelocityCommandCfg
    from draft.learn.task.mdp.events import Kind
    from draft.learn.task.world.task import Task

Change = Callable[["ManagerBasedRlEnvCfg", "Task"], None]


@dataclass(frozen=True)
class Stage:
    """A stage of training.

    Attributes:
        name: its name.
        change: changes mjlab's configuration of the environment that all stages share.
        origin: stage whose policy it starts from; None to start from scratch.
        like: stage whose changes are made first; None for none.
        shares: group of numbers with the shares of the kinds of ground.
        uneven: whether it needs uneven ground; recipes may train others on a plane.
        test: name of the skill test that evaluates its policies.
    """

    name: str
    change: Change
    origin: str | None = "base"
    like: str | None = None
    shares: Literal["ground", "terrain"] = "ground"
    uneven: bool = False
    test: str = "walk"

    def apply(self, cfg: ManagerBasedRlEnvCfg, task: Task) -> None:
        """Make the changes of the stage, after those of the stage that it is like."""
        if self.like is not None:
            STAGES[self.like].apply(cfg, task)
        self.change(cfg, task)


STAGES: Registry[Stage] = Registry("stage")


def one_of(names: Collection[str]) -> BeforeValidator:
    """Return a validator of text that is one of some names, which may grow."""

    def check(value: object) -> object:
        if isinstance(value, str) and value not in names:
            raise PydanticKnownError("literal_error", {"expected": ", ".join(map(repr, names))})
        return value

    return BeforeValidator(check)


# Name of a stage in options and files; extensions may add stages.
StageName = Annotated[str, one_of(STAGES)]


def is_like(stage: str, other: str) -> bool:
    """Return whether a stage is another one, or makes its changes first."""
    found = STAGES.get(stage)
    deeper = found.like if found else None
    return stage == other or (deeper is not None and is_like(deeper, other))


def base(cfg: ManagerBasedRlEnvCfg, task: Task) -> None:
    """Walk on gently uneven ground at a commanded velocity, with pushes."""
    cfg.rewards["action_rate"].params["ramp"] = task.config.rewards.action_rate_ramp


def velocity(cfg: ManagerBasedRlEnvCfg, task: Task) -> None:
    """Follow commands that grow far beyond the estimated top speed."""
    from mjlab.managers.curriculum_manager import CurriculumTermCfg
    from mjlab.managers.reward_manager import RewardTermCfg

    from draft.learn.task.mdp import curriculums, rewards
    from draft.learn.task.mdp.commands import Growth, Pushed
    from draft.learn.task.mdp.events import strong_pushes

    config, v = task.config, task.config.velocity
    command, terms = _command(cfg), cfg.rewards
    start = command.forward
    command.set_largest(Scaled(v.forward), Scaled(v.sideways), Scaled(v.turn), task)
    command.limit = None
    if v.growth:
        command.growth = Growth(start, scaled(v, "growth"), v.tracked, v.missed)
        cfg.curriculum["fastest"] = CurriculumTermCfg(func=curriculums.fastest)
    else:
        command.ramp = v.ramp
        params = {"ramp": v.ramp, "steps": config.learning.steps}
        cfg.curriculum["speed_share"] = CurriculumTermCfg(func=curriculums.logged, params=params)
    if v.pushed:
        command.pushed = Pushed(v.pushed, *_slow(task))
        pushes = cfg.events["push"].params
        pushes["kinds"] = (*pushes["kinds"], strong_pushes(config))
        pushes["share"] = v.pushed
    tracking, air_time = terms["linear_velocity"], terms["air_time"]
    if v.relative:
        tracking.func = rewards.track_relative
        tracking.params["share"] = v.relative
    else:
        tracking.func = rewards.track_capped
        tracking.params = {"headroom": v.headroom, "share": v.sigma}
    air_time.weight = v.air_time_weight
    air_time.params["most"] = Scaled(v.air_time_most)
    terms["action_rate"].weight = v.action_rate_weight
    terms["speed"] = RewardTermCfg(
        func=rewards.speed,
        weight=v.speed_weight,
        params={"headroom": v.headroom, "gate": v.speed_gate},
    )


def any_legs(cfg: ManagerBasedRlEnvCfg, task: Task) -> None:
    """Walk from scratch at commands that grow, with one policy for robots of any legs.

    Sums over joints count as those of twelve. Robots on two legs are asked lower speeds.
    """
    from mjlab.managers.reward_manager import RewardTermCfg

    from draft.learn.task.mdp import rewards

    numbers, v, member = task.config.rewards, task.config.velocity, task.members[0]
    command, terms = _command(cfg), cfg.rewards
    share = JOINTS / len(member.joints)
    terms["action_rate"].params["ramp"] = numbers.action_rate_ramp
    for name in ("action_rate", "joint_limits"):
        terms[name].weight *= share
    legs = len(member.feet)
    command.set_largest(*largest_of_any(v, legs), task)
    if command.growth is not None and legs == 2:
        first = command.growth.start
        start = Scaled(_FIRST_ON_TWO_LEGS * first.value, first.power)
        command.growth = command.growth._replace(start=start)
    if command.pushed is not None:
        command.pushed = command.pushed._replace(**_pushed_of_any(command.pushed, legs))
        pushes = cfg.events["push"].params
        *usual, strong = pushes["kinds"]
        pushes["kinds"] = (*usual, _sized(strong))
    command.single = v.single
    if v.progress:
        gate = scaled(numbers, "clearance_gate")
        terms["progress"] = RewardTermCfg(
            func=rewards.progress, weight=v.progress, params={"gate": gate}
        )
    if v.turning:
        terms["turning"] = RewardTermCfg(
            func=rewards.turning, weight=v.turning, params={"gate": v.turning_gate}
        )


def largest_of_any(numbers: Velocity, legs: int) -> tuple[Scaled, Scaled, Scaled]:
    """Largest |vx|, |vy| and |wz| of stage `any` for robots on a number of legs."""
    ahead, aside = _ON_TWO_LEGS if legs == 2 else (1.0, 1.0)
    forward, sideways = Scaled(ahead * numbers.forward, 0.5), Scaled(aside * numbers.sideways, 0.5)
    return forward, sideways, Scaled(numbers.turn, -0.5)


def _pushed_of_any(pushed: Pushed, legs: int) -> dict[str, Scaled]:
    """Largest commands of pushed robots of any size: as fast for their size, slower on two legs."""
    ahead, aside = _ON_TWO_LEGS if legs == 2 else (1.0, 1.0)
    return {
        "forward": Scaled(ahead * pushed.forward.value, 0.5),
        "sideways": Scaled(aside * pushed.sideways.value, 0.5),
        "turn": Scaled(pushed.turn.value, -0.5),
    }


def _sized(kind: Kind) -> Kind:
    """Pushes as large for the size of each robot as they are for a leg of 0.48 m."""
    most = kind.most
    powers = (*[0.5] * (len(most) // 2), *[-0.5] * (len(most) // 2))
    return kind._replace(
        most=tuple(Scaled(one.value, power) for one, power in zip(most, powers, strict=True))
    )


def terrain(cfg: ManagerBasedRlEnvCfg, task: Task) -> None:
    """Move to harder rows of ground by crossing easier ones."""
    from mjlab.managers.curriculum_manager import CurriculumTermCfg
    from mjlab.managers.reward_manager import RewardTermCfg

    from draft.learn.task.mdp import curriculums, rewards
    from draft.learn.task.mdp.commands import Away

    t, command = task.config.terrain, _command(cfg)
    command.limit = t.limit
    if t.forward[1]:
        low, high = t.forward
        command.away = Away(Scaled(low, 0.5), Scaled(high, 0.5), t.away)
    if t.episode:
        cfg.terminations["time_out"].params["length"] = scaled(t, "episode")
    if t.progress:
        gate = scaled(task.config.rewards, "clearance_gate")
        cfg.rewards["progress"] = RewardTermCfg(
            func=rewards.progress, weight=t.progress, params={"gate": gate}
        )
    if t.clearance:
        cfg.rewards["clearance"].params["target"] = scaled(t, "clearance")
    cfg.rewards["clearance"].weight *= t.clearance_share
    if task.ground == "uneven":
        # A robot that runs away from hard ground has not mastered it.
        cfg.terminations["left_ground"].time_out = False
        params = {"promotion": t.promotion, "demotion": t.demotion, "by_way": t.by_way}
        cfg.curriculum["row"] = CurriculumTermCfg(func=curriculums.rows, params=params)


def push(cfg: ManagerBasedRlEnvCfg, task: Task) -> None:
    """Withstand pushes of the same size for every design, which grow."""
    from mjlab.managers.curriculum_manager import CurriculumTermCfg

    from draft.learn.task.mdp import curriculums
    from draft.learn.task.mdp.events import strong_pushes

    p, command = task.config.push, _command(cfg)
    command.set_largest(*_slow(task), task)
    command.limit = None
    cfg.events["push"].params["kinds"] = (strong_pushes(task.config),)
    cfg.rewards["linear_velocity"].params = {"sigma": Scaled(p.sigma)}
    params = {"ramp": p.ramp, "steps": task.config.learning.steps}
    cfg.curriculum["push_factor"] = CurriculumTermCfg(func=curriculums.logged, params=params)


def _command(cfg: ManagerBasedRlEnvCfg) -> VelocityCommandCfg:
    """Return the configuration of the velocity command."""
    from draft.learn.task.world.access import COMMAND

    # mjlab declares the base class of all commands.
    return cfg.commands[COMMAND]  # type: ignore[return-value]


def _slow(task: Task) -> tuple[Scaled, Scaled, Scaled]:
    """Largest commands of robots that are pushed strongly."""
    p = task.config.push
    return Scaled(p.forward), Scaled(p.sideways), Scaled(p.turn)


# Shares of the speeds ahead and to the side in stage `any`, and of the first speed ahead.
_ON_TWO_LEGS, _FIRST_ON_TWO_LEGS = (0.2, 0.5), 0.5
# Stages of the paper, which a study trains unless its file names others.
PUBLISHED = (
    Stage("base", base, origin=None),
    Stage("velocity", velocity, test="speed"),
    Stage("terrain", terrain, shares="terrain", uneven=True, test="stairs"),
    Stage("push", push, test="push"),
)
for _stage in (*PUBLISHED, Stage("any", any_legs, origin=None, like="velocity")):
    STAGES.add(_stage.name, _stage, __name__)
