"""Quick review of a policy after its training: tracking at four speeds, and falls."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from draft.learn.bodies.legged import by_topology, kind_of
from draft.learn.engine.machine import NATIVE, cores
from draft.learn.measuring.levels import ASCENT, DESCENT, PUSH, SKILL_TESTS, SPEED
from draft.learn.measuring.policies import config_of
from draft.learn.measuring.rollout.by_slots import by_slots
from draft.learn.measuring.rollout.evaluate import Policy, evaluate, exported, trained
from draft.learn.measuring.rollout.trial import Trial
from draft.learn.policy.reduced import open_for
from draft.learn.task.config import Config
from draft.learn.task.constants import scaled
from draft.learn.task.recipes import ANY
from draft.learn.task.stages import is_like
from draft.learn.task.world.task import Task
from draft.learn.training.ppo.legs_onnx import legs_of
from draft.learn.training.ppo.worlds import task_of
from draft.learn.training.progress import FASTEST, PROGRESS
from draft.learn.training.progress import fastest as fastest_commanded
from draft.learn.training.run import Run, file_digest, open_run

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv

    Maker = Callable[[ManagerBasedRlEnv], Policy]

REPLICAS, SECONDS, SETTLE = 64, 8.0, 2.0
BODIES, OF_EACH = 4, 4  # Most bodies of a topology that are tested, and robots of each.
STEPS, KICKS = (0.05, 0.10), (1.0, 3.0)
# Share of the commanded distance at which a robot that stays up has crossed the stairs.
CROSSED = 0.6
_WALKS = ("base", "velocity")  # Stages that teach what the policy of all legs can do.


@dataclass(frozen=True)
class Level:
    """Measures at one level.

    Attributes:
        test: name of the skill test.
        level: commanded speed [m/s], height of a step [m], or size of a kick [m/s].
        speed: median forward speed of the robots that stay up [m/s]; NaN for none.
        error: mean of their |speed - command| [m/s]; NaN for none.
        crossed: number of robots that stay up and walk CROSSED of the commanded distance.
        up: number of robots that stay up.
        robots: number of robots.
    """

    test: str
    level: float
    speed: float
    error: float
    crossed: int
    up: int
    robots: int


@dataclass(frozen=True)
class Kind:
    """Measures of some bodies of one topology.

    Attributes:
        name: name of the robot that they are designs of.
        bodies: number of bodies.
        levels: measures at each level.
    """

    name: str
    bodies: int
    levels: list[Level]


def review(run: Run, device: str, engine: str, replicas: int = REPLICAS) -> list[Level]:
    """Measure the last policy of a run; for stages `terrain` and `push` also on steps or kicks.

    Args:
        run: the run.
        device: "cpu" or "cuda:0" and the like.
        engine: "native" or "warp".
        replicas: number of robots per level.

    Raises:
        DraftError: the run has no policy, or it cannot be read.
    """
    policy = trained(run, run.checkpoint()[0], device)
    return levels(policy, _trial(run, replicas), device, engine)


def review_mixed(run: Run, device: str, engine: str, bodies: int = BODIES) -> list[Kind]:
    """Measure the last policy of a run of several topologies with the first bodies of each.

    Args:
        run: the run.
        device: "cpu" or "cuda:0" and the like.
        engine: "native" or "warp".
        bodies: largest number of bodies of each topology.

    Raises:
        DraftError: the run has no policy, or it cannot be read.
    """
    policy, found = by_slots(legs_of(run), device), []
    for members in by_topology(run.plan.members):
        chosen, kind = members[:bodies], kind_of(members)
        # Bodies observe nothing of their design: the policy knows it.
        task = Task(chosen, run.plan.stage, run.plan.config, ground="flat", see_ground=False)
        sizes = [math.sqrt(member.scale) for member in members]
        # Of a body of mean size; all are asked what the smallest can do.
        most = fastest_commanded(run.folder / PROGRESS, column=f"{kind}/{FASTEST}")
        most = most or run.plan.config.commands.forward
        asked = min(sizes[:bodies]) * len(sizes) / sum(sizes) * most
        test = replace(SKILL_TESTS[SPEED], levels=_quarters(asked))
        trial = Trial(task, (test,), OF_EACH * len(chosen), SECONDS, SETTLE)
        found.append(Kind(kind, len(chosen), levels(policy, trial, device, engine)))
    return found


def before(run: Run, device: str, engine: str, replicas: int = REPLICAS) -> list[Level]:
    """Measure the policy that a run started from as `review` measures its last one.

    Nothing if the run started from scratch, from a policy of another stage, which is to do
    something else, or from one that is no longer there or observes other things.
    """
    policy = _origin(run, device)
    return levels(policy, _trial(run, replicas), device, engine) if policy is not None else []


def _origin(run: Run, device: str) -> Maker | None:
    """The policy that a run started from; None for one that cannot be compared."""
    plan, origin = run.plan, run.plan.origin
    if origin is None:
        return None
    source = origin.folder(run.folder.parent)
    file = origin.policy_file or source / f"model_{origin.iteration}.pt"
    if not file.is_file() or file_digest(file) != origin.digest:
        return None
    if origin.policy_file is not None:
        known = open_for(file, plan.members)
        alike = known.stage == plan.stage or (known.stage == ANY.name and plan.stage in _WALKS)
        same = alike and bool(len(known.scan_points)) == plan.see_ground
        same = same and _seen(config_of(known)) == _seen(plan.config)
        return exported(known, device) if same else None
    first = open_run(source)
    same = first.plan.stage == plan.stage and first.plan.see_ground == plan.see_ground
    same = same and _seen(first.plan.config) == _seen(plan.config)
    return trained(first, origin.iteration, device) if same else None


def _seen(config: Config) -> tuple[bool, int]:
    """What a policy observes of the trunk's velocity and of past steps."""
    return config.observations.linear_velocity, config.observations.history


def _trial(run: Run, replicas: int) -> Trial:
    """Settings of the review of a run."""
    chosen = [replace(SKILL_TESTS[SPEED], levels=speeds(run))]
    if is_like(run.plan.stage, "terrain"):
        chosen += [replace(SKILL_TESTS[name], levels=STEPS) for name in (ASCENT, DESCENT)]
    if is_like(run.plan.stage, "push"):
        chosen += [replace(SKILL_TESTS[PUSH], levels=KICKS)]
    task = task_of(run.plan)
    # Draws fill the region evenly from the first on.
    task = replace(task, members=task.members[:replicas])
    return Trial(task, tuple(chosen), replicas, SECONDS, SETTLE)


def levels(policy: Maker, trial: Trial, device: str, engine: str) -> list[Level]:
    """Measure a policy at all levels of a trial.

    Args:
        policy: returns the policy for an environment.
        trial: settings of the evaluation.
        device: "cpu" or "cuda:0" and the like.
        engine: "native" or "warp".
    """
    threads = cores() if engine == NATIVE else 1
    worlds, _ = evaluate(trial, policy, device, engine=engine, threads=threads)
    measured = []
    for test in trial.tests:
        for level in test.levels:
            rows = (worlds.test == test.name) & (worlds.level == level)
            up = rows & ~worlds.fell
            speed, command = worlds.speed[up], test.command(level)
            known = bool(len(speed))
            measured.append(
                Level(
                    test=test.name,
                    level=level,
                    speed=float(np.median(speed)) if known else float("nan"),
                    error=float(np.abs(speed - command).mean()) if known else float("nan"),
                    crossed=int((speed >= CROSSED * command).sum()),
                    up=int(up.sum()),
                    robots=int(rows.sum()),
                )
            )
    return measured


def speeds(run: Run) -> tuple[float, ...]:
    """Four commanded speeds [m/s]: quarters of the largest of the last iterations."""
    plan = run.plan
    slowest = min(plan.members, key=lambda member: member.top_speed)
    c = plan.config.commands
    fastest = min(scaled(c, "forward").at(slowest.scale), c.limit * slowest.top_speed)
    if is_like(plan.stage, "velocity"):
        fastest = max(fastest, fastest_commanded(run.folder / PROGRESS) or 0.0)
    return _quarters(fastest)


def _quarters(fastest: float) -> tuple[float, ...]:
    return tuple(round(fastest * share, 2) for share in (0.25, 0.5, 0.75, 1.0))
