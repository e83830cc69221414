"""The evaluation battery in mjlab: all levels of all batteries of a ground in one simulation.

World w belongs to one battery, level, replica and member, and has its own command, kick and patch
of stairs. Members alternate from world to world, as in training.
"""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import torch
from mjlab.envs import ManagerBasedRlEnv, ManagerBasedRlEnvCfg
from mjlab.envs import mdp as stock
from mjlab.managers.event_manager import EventTermCfg
from mjlab.managers.termination_manager import TerminationTermCfg
from mjlab.terrains.terrain_generator import SubTerrainCfg, TerrainOutput
from rsl_rl.models import MLPModel
from tensordict import TensorDict

from draft.errors import DraftError, Problem
from draft.learn.battery import (
    FORWARD_LEAST,
    KICKS,
    REPLICAS,
    SECONDS,
    SETTLE,
    STANDING,
    Battery,
)
from draft.learn.evaluation import Asked
from draft.learn.lab.agent import agent_settings
from draft.learn.lab.measure import EACH_STEP, Measures
from draft.learn.lab.tasks import Task, environment
from draft.learn.lab.terms import events
from draft.learn.lab.terms.rewards import COMMAND
from draft.learn.lab.trainer import read_checkpoint, task_of, unfit
from draft.learn.quadruped import CLASSES
from draft.learn.run import Run
from draft.learn.scalars import Worlds
from draft.learn.utilisation import Histograms

Policy = Callable[[Any], torch.Tensor]  # Observations to actions, shape (worlds, 12).
Tell = Callable[[str, int, int], None]
COLUMNS = {"descent": "stairs", "ascent": "stairs_pit"}


@dataclass(frozen=True)
class Trial:
    """What a policy is put through.

    Attributes:
        task: the robots and the numbers; the ground is the batteries'.
        batteries: what is asked.
        replicas: roll-outs of each level; they are shared out among the members, each of which
            has as many, so there may be a few more.
        published: as the released code: some stand, some get 0.3 m/s at least.
        seed: of everything random.
        seconds: of a roll-out [s].
        settle: what does not count of it [s].
        extra: events at the start, besides those of training; they come before those.
    """

    task: Task
    batteries: tuple[Battery, ...]
    replicas: int = REPLICAS
    published: bool = False
    seed: int = 0
    seconds: float = SECONDS
    settle: float = SETTLE
    extra: Mapping[str, EventTermCfg] = field(default_factory=dict)

    @property
    def each(self) -> int:
        """Replicas of each member."""
        return -(-self.replicas // len(self.task.members))


@dataclass(frozen=True)
class Layout:
    """What each world is, one row per world.

    Attributes:
        battery, level, member, replica, kept: as of `scalars.Worlds`.
        command: forward [m/s].
        kick: largest along x and y [m/s].
        ground: of `Battery.ground`.
    """

    battery: np.ndarray
    level: np.ndarray
    member: np.ndarray
    replica: np.ndarray
    kept: np.ndarray
    command: np.ndarray
    kick: np.ndarray
    ground: np.ndarray


def layout(trial: Trial, batteries: Sequence[Battery]) -> Layout:
    """What each world of a simulation is: battery, then level, replica and member."""
    names = [member.name for member in trial.task.members]
    size = trial.each * len(names)
    rungs = [(battery, level) for battery in batteries for level in battery.levels]

    def of_rungs(values: list[Any]) -> np.ndarray:
        return np.repeat(np.array(values), size)

    command = of_rungs([battery.command(level) for battery, level in rungs])
    kept = np.ones(len(command), dtype=bool)
    if trial.published:
        drawn = np.random.default_rng(trial.seed).random((2, len(command)))
        kept = drawn[0] >= STANDING
        ahead = drawn[1] < trial.task.config.commands.forward_only
        command = np.where(ahead, np.maximum(command, FORWARD_LEAST), command) * kept
    return Layout(
        battery=of_rungs([battery.name for battery, _ in rungs]),
        level=of_rungs([level for _, level in rungs]),
        member=np.tile(np.array(names), len(rungs) * trial.each),
        replica=np.tile(np.repeat(np.arange(trial.each), len(names)), len(rungs)),
        kept=kept,
        command=command,
        kick=of_rungs([battery.kick(level) for battery, level in rungs]),
        ground=of_rungs([battery.ground for battery, _ in rungs]),
    )


def evaluate(
    trial: Trial,
    policy: Callable[[ManagerBasedRlEnv], Policy],
    device: str,
    tell: Tell = lambda *_: None,
) -> tuple[Worlds, Histograms]:
    """Roll out all levels: one environment for the flat batteries, one for the stairs.

    Args:
        trial: what the policy is put through.
        policy: gives the policy for an environment; see `trained`.
        device: "cpu" or "cuda:0" and the like.
        tell: called after every step with the batteries' names, steps done and steps in all.

    Raises:
        DraftError: the policy does not fit, or the device has too little memory.
    """
    grounds = [
        [battery for battery in trial.batteries if (battery.ground == "flat") == flat]
        for flat in (True, False)
    ]
    parts = [_simulate(trial, own, policy, device, tell) for own in grounds if own]
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


def trial(run: Run, batteries: Sequence[Battery], what: Asked) -> Trial:
    """What a run's policy is put through.

    Args:
        run: the run.
        batteries: with their levels.
        what: is asked.

    Raises:
        DraftError: inertia errors are asked for, and cannot be drawn for its designs.
    """
    extra: Mapping[str, EventTermCfg] = {}
    if what.errors is not None:
        from draft.learn.lab.perturb import events as inertia_errors

        extra = inertia_errors(run.plan.members, what.errors)
    return Trial(
        task=task_of(run.plan),
        batteries=tuple(batteries),
        replicas=what.replicas,
        published=what.protocol == "published",
        seed=what.evaluation_seed,
        seconds=what.seconds,
        settle=what.settle,
        extra=extra,
    )


def build(trial: Trial, batteries: Sequence[Battery], device: str) -> ManagerBasedRlEnv:
    """The environment of batteries that share a ground, every world in its place, not yet reset."""
    rows = layout(trial, batteries)
    # mjlab prints the environment as tables, at length.
    with contextlib.redirect_stdout(io.StringIO()):
        env = ManagerBasedRlEnv(_settings(trial, batteries, rows), device)
    if rows.ground[0] != "flat":
        _place(env, rows, _heights(batteries))
    command = torch.zeros(len(rows.command), 3, device=env.device)
    command[:, 0] = torch.from_numpy(rows.command).to(env.device)
    env.command_manager.get_term(COMMAND).hold(command)  # type: ignore[attr-defined]
    return env


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
    device: str,
    tell: Tell,
) -> tuple[Worlds, Histograms]:
    names = ", ".join(battery.name for battery in batteries)
    rows = layout(trial, batteries)
    try:
        env = build(trial, batteries, device)
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
            "out of memory|failed to allocate", words, re.I
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


def _settings(trial: Trial, batteries: Sequence[Battery], rows: Layout) -> ManagerBasedRlEnvCfg:
    """An environment without rewards, curriculum, pushes and time-outs."""
    heights = _heights(batteries)
    task = replace(trial.task, seed=trial.seed, ground="uneven" if heights else "flat")
    if heights:
        task = replace(
            task, config=task.config.with_values(_STAIRS | {"ground.rows": len(heights)})
        )
    made = environment(task, len(rows.command))
    made.episode_length_s = 1e9
    made.rewards, made.curriculum, made.metrics = {}, {}, dict(EACH_STEP)
    made.observations = {"actor": made.observations["actor"]}
    made.terminations = {name: made.terminations[name] for name in ("tilted", "low")}
    # A world that blew up has fallen.
    made.terminations["broken"] = TerminationTermCfg(func=stock.nan_detection)
    made.events = _events(trial, made, rows)
    made.scene.env_spacing = 0.0  # All start at the middle of a plane.
    if heights:
        _ladder(made.scene.terrain, heights)
    return made


# Both kinds of stairs and nothing else, whatever the stage.
_STAIRS = {
    f"{group}.{name}": share
    for group in ("ground", "terrain")
    for name, share in (("stairs", 1), ("flat", 0), ("slopes", 0), ("rough", 0), ("waves", 0))
}


def _events(trial: Trial, made: ManagerBasedRlEnvCfg, rows: Layout) -> dict[str, EventTermCfg]:
    """Those of training without pushes; the designs first, then the extra ones."""
    found = {name: term for name, term in made.events.items() if name != "push"}
    first = {name: found.pop(name) for name in ("designs",) if name in found}
    dt = made.sim.mujoco.timestep * made.decimation
    if rows.kick.any():
        steps = tuple(round(i * trial.seconds / KICKS / dt) for i in range(1, KICKS))
        params = {"most": tuple(rows.kick.tolist()), "steps": steps}
        found["kick"] = EventTermCfg(func=events.Kicks, mode="step", params=params)
    return {**first, **trial.extra, **found}


def _heights(batteries: Sequence[Battery]) -> tuple[float, ...]:
    """Step heights of all stairs, one row of patches each."""
    return tuple(sorted({n for b in batteries if b.ground != "flat" for n in b.levels}))


@dataclass(kw_only=True)
class RungsCfg(SubTerrainCfg):
    """Stairs whose rows have given steps.

    Attributes:
        stairs: of mjlab.
        heights: of a step in each row [m].
    """

    stairs: Any
    heights: tuple[float, ...]

    def function(self, difficulty: float, spec: Any, rng: np.random.Generator) -> TerrainOutput:
        """Geometry of a patch."""
        height = self.heights[round(difficulty * (len(self.heights) - 1))]
        stairs = replace(self.stairs, size=self.size, step_height_range=(height, height))
        return stairs.function(0.0, spec, rng)


def _ladder(terrain: Any, heights: tuple[float, ...]) -> None:
    """Give every row of a terrain's stairs its height."""
    patches = terrain.terrain_generator.sub_terrains
    for name, patch in patches.items():
        patches[name] = RungsCfg(proportion=patch.proportion, stairs=patch, heights=heights)


def _place(env: ManagerBasedRlEnv, rows: Layout, heights: tuple[float, ...]) -> None:
    """Put each world on its patch."""
    terrain: Any = env.scene.terrain
    columns = list(terrain.cfg.terrain_generator.sub_terrains)
    kinds = [columns.index(COLUMNS[ground]) for ground in rows.ground.tolist()]
    levels = np.searchsorted(np.array(heights), rows.level)
    terrain.terrain_types[:] = torch.tensor(kinds, device=env.device)
    terrain.terrain_levels[:] = torch.from_numpy(levels).to(env.device)
    still = torch.zeros(env.num_envs, dtype=torch.bool, device=env.device)
    ids = torch.arange(env.num_envs, device=env.device)
    terrain.update_env_origins(ids, still, still)
