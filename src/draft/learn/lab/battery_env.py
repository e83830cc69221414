"""The environment of batteries: every world with its own command, kick and patch of stairs."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from mjlab.envs import ManagerBasedRlEnv, ManagerBasedRlEnvCfg
from mjlab.envs import mdp as envs_mdp
from mjlab.managers.event_manager import EventTermCfg
from mjlab.managers.termination_manager import TerminationTermCfg
from mjlab.terrains.terrain_generator import SubTerrainCfg, TerrainOutput

from draft.learn.battery import KICKS, Battery
from draft.learn.config import Ground
from draft.learn.lab.env_cfg import environment
from draft.learn.lab.mdp import events
from draft.learn.lab.mdp.access import COMMAND
from draft.learn.lab.measure import EACH_STEP
from draft.learn.lab.simulate import make
from draft.learn.lab.trial import Layout, Trial, layout
from draft.learn.machine import WARP

COLUMNS = {"descent": "stairs", "ascent": "stairs_pit"}


def build(
    trial: Trial, batteries: Sequence[Battery], device: str, engine: str = WARP, threads: int = 1
) -> ManagerBasedRlEnv:
    """The environment of batteries that share a ground, every world in its place, not yet reset."""
    rows = layout(trial, batteries)
    # mjlab prints the environment as tables, at length.
    with contextlib.redirect_stdout(io.StringIO()):
        env = make(settings(trial, batteries, rows), device, engine, threads)
    if rows.ground[0] != "flat":
        _place(env, rows, _heights(batteries))
    command = torch.zeros(len(rows.command), 3, device=env.device)
    command[:, 0] = torch.from_numpy(rows.command).to(env.device)
    env.command_manager.get_term(COMMAND).hold(command)  # type: ignore[attr-defined]
    return env


def settings(trial: Trial, batteries: Sequence[Battery], rows: Layout) -> ManagerBasedRlEnvCfg:
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
    made.terminations["broken"] = TerminationTermCfg(func=envs_mdp.nan_detection)
    made.events = _events(trial, made, rows)
    made.scene.env_spacing = 0.0  # All start at the middle of a plane.
    if heights:
        _ladder(made.scene.terrain, heights)
    return made


# Both kinds of stairs and nothing else, of the same shape whatever a stage was trained on.
_STAIRS = {
    f"{group}.{name}": share
    for group in ("ground", "terrain")
    for name, share in (
        *(("stairs", 1.0), ("pits", 0.5), ("flat", 0.0)),
        *(("slopes", 0.0), ("rough", 0.0), ("waves", 0.0)),
    )
} | {f"ground.{name}": getattr(Ground(), name) for name in ("patch", "tread", "platform", "rim")}


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
