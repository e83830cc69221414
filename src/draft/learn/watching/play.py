"""A run's policy for watching: its mean action without noise and pushes, at a fixed command."""

from __future__ import annotations

import contextlib
import io
import math
from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np
import torch
from mjlab.envs import ManagerBasedRlEnv, ManagerBasedRlEnvCfg
from numpy.typing import NDArray

from draft.errors import DraftError, suggest
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.engine.machine import WARP
from draft.learn.engine.worlds.simulate import make
from draft.learn.policy.play_options import Command
from draft.learn.policy.playback import SETTLING, Outcome
from draft.learn.policy.scenery import dress
from draft.learn.task.config import Config
from draft.learn.task.constants import scaled
from draft.learn.task.mdp.commands import VelocityCommandCfg, command_term
from draft.learn.task.mdp.environment import environment
from draft.learn.task.world.access import COMMAND, robot_of
from draft.learn.training.ppo.loaded import Loaded
from draft.learn.training.ppo.worlds import task_of
from draft.learn.training.run import Run

# Kinds of uneven ground, in the order in which robots are put onto them.
KINDS = ("rough", "waves", "stairs", "slope", "stairs_pit", "slope_pit", "flat")
_SLIDER = 10.0  # Largest end of mjlab's sliders [m/s, rad/s].


class Player(Loaded):
    """A run's policy with one of its designs, to watch.

    A family's policy is played with one member at a time, as all robots of a simulation would be
    drawn with the shapes of the first member.

    Attributes:
        command: commanded vx, vy [m/s], wz [rad/s].
    """

    def __init__(
        self,
        run: Run,
        device: str,
        iteration: int | None = None,
        member: str | None = None,
        ground: str | None = None,
        robots: int = 1,
        command: Command | None = None,
        engine: str = WARP,
    ) -> None:
        """Make the environment and read the policy.

        Args:
            run: the run.
            device: "cpu" or "cuda:0" and the like.
            iteration: iterations of the checkpoint; None for the last.
            member: name of the design; None for the first.
            ground: "uneven" or "flat"; None for that of the training.
            robots: number of worlds.
            command: vx, vy [m/s], wz [rad/s]; None for that of `walking`.
            engine: "native" or "warp".

        Raises:
            DraftError: no such checkpoint or member, or the policy does not fit.
        """
        chosen = member_of(run, member)
        run.checkpoint(iteration)  # before the environment, which takes seconds
        self.command = command or walking(chosen, run.plan.config)
        plan = replace(run.plan, members=(chosen,), ground=ground or run.plan.ground)
        # mjlab prints the environment as long tables.
        with contextlib.redirect_stdout(io.StringIO()):
            cfg = _for_watching(environment(task_of(plan), robots, play=True))
            env = make(cfg, device, engine)
            _place(env)
            command_term(env).hold(torch.tensor([self.command] * robots, device=device))
        super().__init__(run, env, chosen, device, iteration)

    @property
    def period(self) -> float:
        """Time between two actions [s]."""
        return self.env.unwrapped.step_dt

    def scene(self) -> tuple[mujoco.MjModel, str]:
        """Return the model and the prefix of the robot's names in it."""
        return self.env.unwrapped.sim.mj_model, "robot/"

    def poses(self) -> NDArray[np.float64]:
        """Return positions `qpos` of each robot, shape (robots, nq)."""
        return self.env.unwrapped.sim.data.qpos.cpu().numpy()

    def steps(self, seconds: float) -> int:
        """Return the number of actions in a time [s], at least 1."""
        return max(1, round(seconds / self.period))

    def play(self, seconds: float, report: Callable[[int], None] = lambda _: None) -> Outcome:
        """Run the policy from a fresh start.

        Args:
            seconds: duration [s].
            report: called with the number of actions done, from 0 on.

        Raises:
            DraftError: the simulation or the policy gives values that are not finite.
        """
        env = self.env.unwrapped
        steps = self.steps(seconds)
        skipped = min(round(SETTLING / env.step_dt), steps // 2)
        commanded = torch.tensor(self.command[:2], device=env.device)
        falls = torch.zeros((), device=env.device)
        sums = torch.zeros(2, device=env.device)
        finite = torch.ones((), dtype=torch.bool, device=env.device)
        with torch.inference_mode():
            seen, _ = self.env.reset()
            report(0)
            for step in range(1, steps + 1):
                actions = self.policy(seen)
                finite &= actions.isfinite().all()
                seen, _, ended, _ = self.env.step(actions)
                falls += ended.sum()
                velocity = robot_of(env).data.root_link_lin_vel_b[:, :2]
                if step > skipped:
                    error = (velocity - commanded).norm(dim=1).mean()
                    sums += torch.stack((velocity[:, 0].mean(), error))
                report(step)
        speed, error = (sums / (steps - skipped)).tolist()
        if not bool(finite) or not math.isfinite(speed) or not math.isfinite(error):
            cause = "the policy or the simulation gives values that are not finite"
            raise DraftError(cause, "use another checkpoint, or train it again")
        duration = steps * env.step_dt
        return Outcome(duration, env.num_envs, self.command, speed, error, int(falls))


def member_of(run: Run, name: str | None) -> LeggedRobot:
    """Return a design of a run by name; the first if `name` is None.

    Raises:
        DraftError: there is none of that name.
    """
    members = {member.name: member for member in run.plan.members}
    # `cheetah` is short for `quadruped:cheetah`.
    short = {known.rpartition(":")[2]: member for known, member in members.items()}
    if name is None:
        return run.plan.members[0]
    member = members.get(name) or short.get(name)
    if member is None:
        cause = f"{run.folder} has no design '{name}'"
        raise DraftError(cause, suggest(name, short, "designs"))
    return member


def walking(member: LeggedRobot, config: Config) -> Command:
    """Command straight ahead, at half the largest forward command of the base stage."""
    c = config.commands
    most = min(scaled(c, "forward").at(member.scale), c.limit * member.top_speed)
    return 0.5 * most, 0.0, 0.0


def _for_watching(cfg: ManagerBasedRlEnvCfg) -> ManagerBasedRlEnvCfg:
    """Change sliders, start and appearance of an environment for watching."""
    command = cfg.commands[COMMAND]
    if isinstance(command, VelocityCommandCfg):
        for name in ("lin_vel_x", "lin_vel_y", "ang_vel_z"):
            most = min(getattr(command.ranges, name)[1], _SLIDER)
            setattr(command.ranges, name, (-most, most))
    start = cfg.events["reset_base"].params["pose_range"]
    start.update({"x": (0.0, 0.0), "y": (0.0, 0.0), "yaw": (0.0, 0.0)})
    terrain = cfg.scene.terrain
    if terrain is not None:
        terrain.env_spacing = cfg.viewer.distance
    cfg.scene.spec_fn = dress
    return cfg


def _place(env: ManagerBasedRlEnv) -> None:
    """Put each robot on a kind of uneven ground, in the hardest row of the training's start."""
    terrain = env.scene.terrain
    if terrain is None or terrain.cfg.terrain_generator is None:
        return
    have = list(terrain.cfg.terrain_generator.sub_terrains)
    kinds = [have.index(kind) for kind in KINDS if kind in have]
    worlds = torch.arange(env.num_envs, device=env.device)
    terrain.terrain_types[:] = torch.tensor(kinds, device=env.device)[worlds % len(kinds)]
    terrain.terrain_levels[:] = terrain.cfg.max_init_terrain_level or 0
    still = torch.zeros_like(worlds, dtype=torch.bool)
    terrain.update_env_origins(worlds, still, still)
