"""The evaluation battery in mjlab: all levels of all batteries of a ground in one simulation."""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import torch
from mjlab.envs import ManagerBasedRlEnv
from rsl_rl.models import MLPModel
from tensordict import TensorDict

from draft.errors import DraftError, Problem
from draft.learn.battery import Battery
from draft.learn.lab.agent import agent_settings
from draft.learn.lab.battery_env import build
from draft.learn.lab.measure import Measures
from draft.learn.lab.trainer import read_checkpoint, unfit
from draft.learn.lab.trial import Trial, layout
from draft.learn.machine import WARP
from draft.learn.quadruped import CLASSES
from draft.learn.run import Run
from draft.learn.scalars import Worlds
from draft.learn.utilisation import Histograms

Policy = Callable[[Any], torch.Tensor]  # Observations to actions, shape (worlds, 12).
Tell = Callable[[str, int, int], None]


def evaluate(
    trial: Trial,
    policy: Callable[[ManagerBasedRlEnv], Policy],
    device: str,
    tell: Tell = lambda *_: None,
    engine: str = WARP,
    threads: int = 1,
) -> tuple[Worlds, Histograms]:
    """Roll out all levels: one environment for the flat batteries, one for the stairs.

    Args:
        trial: what the policy is put through.
        policy: gives the policy for an environment; see `trained`.
        device: "cpu" or "cuda:0" and the like.
        tell: called after every step with the batteries' names, steps done and steps in all.
        engine: "native" or "warp".
        threads: of native MuJoCo.

    Raises:
        DraftError: the policy does not fit, or the device has too little memory.
    """
    grounds = [
        [battery for battery in trial.batteries if (battery.ground == "flat") == flat]
        for flat in (True, False)
    ]
    make = partial(build, device=device, engine=engine, threads=threads)
    parts = [_simulate(trial, own, policy, make, device, tell) for own in grounds if own]
    worlds = Worlds(
        **{
            name: np.concatenate([getattr(part, name) for part, _ in parts])
            for name in vars(parts[0][0])
        }
    )
    return worlds, Histograms(
        **{
            name: np.concatenate([getattr(part, name) for _, part in parts])
            for name in ("battery", "level", "member", "counts", "plane")
        },
        classes=CLASSES,
    )


def trained(run: Run, iteration: int, device: str) -> Callable[[ManagerBasedRlEnv], Policy]:
    """The mean action of a run's policy, for `evaluate`.

    Raises:
        DraftError: no such checkpoint, it cannot be read, or (later) it does not fit.
    """
    _, file = run.checkpoint(iteration)
    content = read_checkpoint(file, device)

    def made(env: ManagerBasedRlEnv) -> Policy:
        seen = TensorDict(dict(env.get_observations()), batch_size=[env.num_envs])
        numbers = agent_settings(run.plan.config.learning, run.plan.stage)["actor"]
        kept = ("hidden_dims", "activation", "obs_normalization", "distribution_cfg")
        shape = {name: numbers[name] for name in kept}
        actions = env.action_manager.total_action_dim
        actor = MLPModel(seen, {"actor": ["actor"]}, "actor", actions, **shape).to(device)
        try:
            actor.load_state_dict(content["actor_state_dict"], strict=True)
        except (KeyError, RuntimeError, TypeError, AttributeError) as error:
            raise unfit(file, error) from None
        actor.eval()
        return actor

    return made


def roll_out(env: ManagerBasedRlEnv, policy: Policy, trial: Trial, tell: Tell) -> Measures:
    """Let a policy act from a fresh start.

    Args:
        env: of `build`.
        policy: observations to actions.
        trial: for how long.
        tell: as in `evaluate`.
    """
    steps, settle = (round(time / env.step_dt) for time in (trial.seconds, trial.settle))
    env.common_step_counter = 0
    with torch.no_grad():
        with contextlib.redirect_stdout(io.StringIO()):  # mjlab tells the seed.
            seen, _ = env.reset(seed=trial.seed)
        robot = env.scene["robot"]
        measures = Measures(robot, trial.task.members[0].leg_joints, settle)
        terms: Any = env.metrics_manager.cfg
        terms["each_step"].func.call = measures.sample
        for step in range(1, steps + 1):
            actions = policy(TensorDict(dict(seen), batch_size=[env.num_envs]))
            seen, _, fallen, _, _ = env.step(actions)
            measures.add(fallen)
            tell("", step, steps)
    return measures


def _simulate(
    trial: Trial,
    batteries: Sequence[Battery],
    policy: Callable[[ManagerBasedRlEnv], Policy],
    make: Callable[[Trial, Sequence[Battery]], ManagerBasedRlEnv],
    device: str,
    tell: Tell,
) -> tuple[Worlds, Histograms]:
    names = ", ".join(battery.name for battery in batteries)
    rows = layout(trial, batteries)
    try:
        env = make(trial, batteries)
        try:
            acting = policy(env)
            measures = roll_out(env, acting, trial, lambda _, step, of: tell(names, step, of))
            columns = measures.fetch()
            samples = measures.samples(trial.each, len(trial.task.members))
        finally:
            env.close()
    except (RuntimeError, MemoryError) as error:
        # PyTorch says "out of memory", Warp "failed to allocate".
        words = " ".join(str(error).split())[:200]
        if not isinstance(error, MemoryError) and not re.search(
            "out of memory|failed to allocate|can't allocate|bad_alloc", words, re.I
        ):
            raise
        cause = f"{len(rows.level)} worlds do not fit into the memory of {device}: {words}"
        remedy = "ask fewer --replicas, fewer --levels, or one --battery at a time"
        raise DraftError(Problem(cause, None, remedy)) from None
    kept = {name: getattr(rows, name) for name in ("battery", "level", "member", "replica", "kept")}
    # The first replica of every level stands for its group.
    first = rows.replica == 0
    groups = {name: getattr(rows, name)[first] for name in ("battery", "level", "member")}
    counted = Histograms(**groups, counts=samples[0], plane=samples[1], classes=CLASSES)
    return Worlds(**kept, **columns), counted
