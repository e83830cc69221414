"""Environment of a trial: every world has its own command, kick and patch of stairs."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np
import torch
from mjlab.envs import ManagerBasedRlEnv, ManagerBasedRlEnvCfg
from mjlab.envs import mdp as envs_mdp
from mjlab.managers.event_manager import EventTermCfg
from mjlab.managers.termination_manager import TerminationTermCfg
from mjlab.terrains import (
    BoxInvertedPyramidStairsTerrainCfg,
    BoxPyramidStairsTerrainCfg,
    TerrainEntityCfg,
)
from mjlab.terrains.terrain_generator import SubTerrainCfg, TerrainOutput

from draft.learn.engine.machine import WARP
from draft.learn.engine.worlds.simulate import make
from draft.learn.measuring.levels import KICKS, SkillTest
from draft.learn.measuring.rollout.measure import EACH_STEP
from draft.learn.measuring.rollout.trial import Layout, Trial, layout
from draft.learn.task.groups import Episodes, Ground
from draft.learn.task.mdp import events
from draft.learn.task.mdp.commands import command_term
from draft.learn.task.mdp.environment import FALLS, environment

COLUMNS = {"descent": "stairs", "ascent": "stairs_pit"}


def build(
    trial: Trial, tests: Sequence[SkillTest], device: str, engine: str = WARP, threads: int = 1
) -> ManagerBasedRlEnv:
    """Make the environment of skill tests that share a ground, not yet reset.

    Args:
        trial: settings of the evaluation.
        tests: the tests, all flat or all on stairs.
        device: "cpu" or "cuda:0" and the like.
        engine: "native" or "warp".
        threads: threads of native MuJoCo.
    """
    rows = layout(trial, tests)
    # mjlab prints the environment as long tables.
    with contextlib.redirect_stdout(io.StringIO()):
        env = make(env_cfg(trial, tests, rows), device, engine, threads)
    if rows.ground[0] != "flat":
        _place(env, rows, _heights(tests))
    command = torch.zeros(len(rows.command), 3, device=env.device)
    command[:, 0] = torch.from_numpy(rows.command).to(env.device)
    command_term(env).hold(command)
    return env


def env_cfg(trial: Trial, tests: Sequence[SkillTest], rows: Layout) -> ManagerBasedRlEnvCfg:
    """Configuration of the environment, without rewards, curriculum, pushes and time-outs."""
    heights = _heights(tests)
    # What is measured is the design: motors as stated, whatever errors its training drew.
    config = trial.task.config.with_values(_AS_STATED)
    task = replace(
        trial.task, seed=trial.seed, ground="uneven" if heights else "flat", config=config
    )
    if heights:
        task = replace(
            task, config=task.config.with_values(_STAIRS | {"ground.rows": len(heights)})
        )
    cfg = environment(task, len(rows.command))
    cfg.episode_length_s = 1e9
    cfg.rewards, cfg.curriculum, cfg.metrics = {}, {}, dict(EACH_STEP)
    cfg.observations = {"actor": cfg.observations["actor"]}
    cfg.terminations = {name: cfg.terminations[name] for name in FALLS}
    # A world whose state is not finite counts as fallen.
    cfg.terminations["broken"] = TerminationTermCfg(func=envs_mdp.nan_detection)
    cfg.events = _events(trial, cfg, rows)
    cfg.scene.env_spacing = 0.0  # All start in the middle of a plane.
    if heights and cfg.scene.terrain is not None:
        _set_heights(cfg.scene.terrain, heights)
    return cfg


_AS_STATED = {f"episodes.{name}": getattr(Episodes(), name) for name in ("motor", "joint_friction")}
# Both kinds of stairs and nothing else, with the same dimensions for all stages.
_STAIRS = {
    f"{group}.{name}": share
    for group in ("ground", "terrain")
    for name, share in (
        *(("stairs", 1.0), ("pits", 0.5), ("flat", 0.0)),
        *(("slopes", 0.0), ("rough", 0.0), ("waves", 0.0)),
    )
} | {f"ground.{name}": getattr(Ground(), name) for name in ("patch", "tread", "platform", "rim")}


def _events(trial: Trial, cfg: ManagerBasedRlEnvCfg, rows: Layout) -> dict[str, EventTermCfg]:
    """Events of training without pushes: the designs first, then the extra ones."""
    terms = {n: term for n, term in cfg.events.items() if term.mode in ("startup", "reset")}
    first = {name: terms.pop(name) for name in ("designs",) if name in terms}
    dt = cfg.sim.mujoco.timestep * cfg.decimation
    if rows.kick.any():
        steps = tuple(round(i * trial.seconds / KICKS / dt) for i in range(1, KICKS))
        params = {"most": tuple(rows.kick.tolist()), "steps": steps}
        terms["kick"] = EventTermCfg(func=events.Kicks, mode="step", params=params)
    return {**first, **trial.extra, **terms}


def _heights(tests: Sequence[SkillTest]) -> tuple[float, ...]:
    """Step heights of all stairs, one row of patches each."""
    return tuple(sorted({n for test in tests if test.ground != "flat" for n in test.levels}))


@dataclass(kw_only=True)
class StairsOfHeightsCfg(SubTerrainCfg):
    """Stairs with a given height of a step in each row.

    Attributes:
        stairs: mjlab's configuration of the stairs.
        heights: height of a step in each row [m].
    """

    stairs: BoxPyramidStairsTerrainCfg | BoxInvertedPyramidStairsTerrainCfg
    heights: tuple[float, ...]

    def function(
        self, difficulty: float, spec: mujoco.MjSpec, rng: np.random.Generator
    ) -> TerrainOutput:
        """Add the geometry of a patch to a scene."""
        height = self.heights[round(difficulty * (len(self.heights) - 1))]
        stairs = replace(self.stairs, size=self.size, step_height_range=(height, height))
        return stairs.function(0.0, spec, rng)


def _set_heights(terrain: TerrainEntityCfg, heights: tuple[float, ...]) -> None:
    """Give every row of a terrain's stairs its height."""
    generator = terrain.terrain_generator
    patches = {} if generator is None else generator.sub_terrains
    for name, patch in patches.items():
        if isinstance(patch, (BoxPyramidStairsTerrainCfg, BoxInvertedPyramidStairsTerrainCfg)):
            patches[name] = StairsOfHeightsCfg(
                proportion=patch.proportion, stairs=patch, heights=heights
            )


def _place(env: ManagerBasedRlEnv, rows: Layout, heights: tuple[float, ...]) -> None:
    """Put each robot on the patch of its world."""
    terrain = env.scene.terrain
    if terrain is None or terrain.cfg.terrain_generator is None:
        return
    columns = list(terrain.cfg.terrain_generator.sub_terrains)
    kinds = [columns.index(COLUMNS[ground]) for ground in rows.ground.tolist()]
    levels = np.searchsorted(np.array(heights), rows.level)
    terrain.terrain_types[:] = torch.tensor(kinds, device=env.device)
    terrain.terrain_levels[:] = torch.from_numpy(levels).to(env.device)
    still = torch.zeros(env.num_envs, dtype=torch.bool, device=env.device)
    ids = torch.arange(env.num_envs, device=env.device)
    terrain.update_env_origins(ids, still, still)
