"""A run's policy at work, for watching: its mean action, no noise, no pushes, a steady command."""

from __future__ import annotations

import contextlib
import io
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import torch
from mjlab.envs import ManagerBasedRlEnv, ManagerBasedRlEnvCfg
from mjlab.rl import RslRlVecEnvWrapper

from draft.errors import DraftError, Problem, suggest
from draft.learn.config import Config
from draft.learn.constants import scaled
from draft.learn.lab.agent import Runner, agent_settings
from draft.learn.lab.env_cfg import environment
from draft.learn.lab.mdp.access import COMMAND
from draft.learn.lab.simulate import make
from draft.learn.lab.trainer import read_checkpoint, task_of, unfit
from draft.learn.machine import WARP
from draft.learn.playback import SETTLING, Command, Outcome
from draft.learn.quadruped import Quadruped
from draft.learn.run import Run
from draft.learn.scenery import dress

# Kinds of uneven ground that robots stand on, one after the other.
KINDS = ("rough", "waves", "stairs", "slope", "stairs_pit", "slope_pit", "flat")
_SLIDER = 10.0  # mjlab's sliders end there [m/s, rad/s].


class Player:
    """A run's policy with one of its designs.

    A family's policy is played with one member at a time, as bodies of several in one simulation
    would all be drawn with the first one's shapes.

    Attributes:
        env: the environment, as rsl-rl sees it.
        policy: observations to mean actions.
        runner: rsl-rl's.
        member: the design.
        iteration: of the checkpoint.
        command: what is asked for.
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
            iteration: of the checkpoint; the last where None.
            member: name of the design; the first where None.
            ground: "uneven" or "flat"; as it was trained where None.
            robots: number of worlds.
            command: vx, vy [m/s], wz [rad/s]; see `walking` where None.
            engine: "native" or "warp".

        Raises:
            DraftError: no such checkpoint or member, or the policy does not fit.
        """
        self._run, self._device = run, device
        self.iteration, _ = run.checkpoint(iteration)
        self.member = member_of(run, member)
        self.command = command or walking(self.member, run.plan.config)
        plan = replace(run.plan, members=(self.member,), ground=ground or run.plan.ground)
        # mjlab and rsl-rl print the environment and the networks as tables, at length.
        with contextlib.redirect_stdout(io.StringIO()):
            settings = _for_watching(environment(task_of(plan), robots, play=True))
            env = make(settings, device, engine)
            _place(env)
            steady = torch.tensor([self.command] * robots, device=device)
            env.command_manager.get_term(COMMAND).hold(steady)  # type: ignore[attr-defined]
            self.env = RslRlVecEnvWrapper(env)
            numbers = agent_settings(plan.config.learning, plan.stage, plan.seed)
            self.runner = Runner(self.env, numbers, None, device)
        try:
            self.policy: Any = self.load(self.iteration)
        except DraftError:
            self.close()
            raise

    def load(self, iteration: int) -> Any:
        """Take the policy of a checkpoint.

        Raises:
            DraftError: there is none, it cannot be read, or it does not fit.
        """
        self.iteration, file = self._run.checkpoint(iteration)
        content = read_checkpoint(file, self._device)
        try:
            self.runner.alg.load(content, {"actor": True}, strict=True)
        except (KeyError, RuntimeError, TypeError, AttributeError) as error:
            raise unfit(file, error) from None
        self.policy = self.runner.get_inference_policy(device=self._device)
        return self.policy

    @property
    def period(self) -> float:
        """Time between two actions [s]."""
        return self.env.unwrapped.step_dt

    def scene(self) -> tuple[Any, str]:
        """See `draft.learn.playback.Player`."""
        return self.env.unwrapped.sim.mj_model, "robot/"

    def poses(self) -> Any:
        """See `draft.learn.playback.Player`."""
        return self.env.unwrapped.sim.data.qpos.cpu().numpy()

    def steps(self, seconds: float) -> int:
        """Actions in a time."""
        return max(1, round(seconds / self.period))

    def play(self, seconds: float, tell: Callable[[int], None] = lambda _: None) -> Outcome:
        """Let the policy act from a fresh start.

        Args:
            seconds: for how long.
            tell: called with the number of steps done, from 0 on.

        Raises:
            DraftError: the simulation or the policy gives what is no number.
        """
        env = self.env.unwrapped
        steps = self.steps(seconds)
        skipped = min(round(SETTLING / env.step_dt), steps // 2)
        asked = torch.tensor(self.command[:2], device=env.device)
        falls = torch.zeros((), device=env.device)
        sums = torch.zeros(2, device=env.device)
        finite = torch.ones((), dtype=torch.bool, device=env.device)
        with torch.inference_mode():
            seen, _ = self.env.reset()
            tell(0)
            for step in range(1, steps + 1):
                actions = self.policy(seen)
                finite &= actions.isfinite().all()
                seen, _, ended, _ = self.env.step(actions)
                falls += ended.sum()
                velocity = env.scene["robot"].data.root_link_lin_vel_b[:, :2]
                if step > skipped:
                    error = (velocity - asked).norm(dim=1).mean()
                    sums += torch.stack((velocity[:, 0].mean(), error))
                tell(step)
        speed, error = (sums / (steps - skipped)).tolist()
        if not bool(finite) or not math.isfinite(speed) or not math.isfinite(error):
            cause = "the policy or the simulation gives what is no number"
            raise DraftError(Problem(cause, None, "take another checkpoint, or train it anew"))
        walked = steps * env.step_dt
        return Outcome(walked, env.num_envs, self.command, speed, error, int(falls))

    def close(self) -> None:
        """Let go of the environment."""
        self.env.close()


def member_of(run: Run, name: str | None) -> Quadruped:
    """A design of a run, the first where none is named.

    Raises:
        DraftError: there is none of that name.
    """
    members = {member.name: member for member in run.plan.members}
    # `cheetah` stands for `quadruped:cheetah`.
    short = {known.rpartition(":")[2]: member for known, member in members.items()}
    if name is None:
        return run.plan.members[0]
    found = members.get(name) or short.get(name)
    if found is None:
        cause = f"{run.folder} has no design '{name}'"
        raise DraftError(Problem(cause, None, suggest(name, short, "designs")))
    return found


def walking(member: Quadruped, config: Config) -> Command:
    """Straight ahead at half the largest forward command of the base stage."""
    c = config.commands
    most = min(scaled(c, "forward").at(member.scale), c.limit * member.top_speed)
    return 0.5 * most, 0.0, 0.0


def _for_watching(settings: ManagerBasedRlEnvCfg) -> ManagerBasedRlEnvCfg:
    """An environment's configuration with sliders, start and look for watching."""
    drawn: Any = settings.commands[COMMAND]
    ranges = drawn.ranges
    for name in ("lin_vel_x", "lin_vel_y", "ang_vel_z"):
        most = min(getattr(ranges, name)[1], _SLIDER)
        setattr(ranges, name, (-most, most))
    start = settings.events["reset_base"].params["pose_range"]
    start.update({"x": (0.0, 0.0), "y": (0.0, 0.0), "yaw": (0.0, 0.0)})
    terrain = settings.scene.terrain
    if terrain is not None:
        terrain.env_spacing = settings.viewer.distance
    settings.scene.spec_fn = dress
    return settings


def _place(env: ManagerBasedRlEnv) -> None:
    """Put each robot on a kind of uneven ground, as hard as training's start has it."""
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
