"""Policy of a run's checkpoint in an environment."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable

import torch
from mjlab.envs import ManagerBasedRlEnv
from mjlab.rl import RslRlVecEnvWrapper

from draft.errors import DraftError
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.training.ppo.agent import Runner, agent_settings
from draft.learn.training.ppo.checkpoint import misfit, read_checkpoint
from draft.learn.training.run import Run

Policy = Callable[..., torch.Tensor]  # Observations to actions, shape (robots, joints).


class Loaded:
    """Policy of a run's checkpoint in an environment.

    Attributes:
        env: the environment, wrapped for rsl-rl.
        policy: observations to mean actions.
        runner: rsl-rl's runner.
        member: numbers of the design.
        iteration: iterations of the checkpoint.
    """

    def __init__(
        self,
        run: Run,
        env: ManagerBasedRlEnv,
        member: LeggedRobot,
        device: str,
        iteration: int | None = None,
    ) -> None:
        """Read the policy; the environment is closed if that fails.

        Args:
            run: the run.
            env: the environment, with robots of this design.
            member: the design.
            device: "cpu" or "cuda:0" and the like.
            iteration: iterations of the checkpoint; None for the last.

        Raises:
            DraftError: no such checkpoint, or the policy does not fit.
        """
        self._run, self._device = run, device
        self.iteration, _ = run.checkpoint(iteration)
        self.member = member
        # rsl-rl prints the networks as long tables.
        with contextlib.redirect_stdout(io.StringIO()):
            self.env = RslRlVecEnvWrapper(env)
            numbers = agent_settings(run.plan.config, run.plan.stage, run.plan.seed)
            self.runner = Runner(self.env, numbers, None, device)
        try:
            self.policy = self.load(self.iteration)
        except DraftError:
            self.close()
            raise

    def load(self, iteration: int) -> Policy:
        """Load the policy of a checkpoint.

        Raises:
            DraftError: there is none, it cannot be read, or it does not fit.
        """
        self.iteration, file = self._run.checkpoint(iteration)
        content = read_checkpoint(file, self._device)
        try:
            self.runner.alg.load(content, {"actor": True}, strict=True)
        except (KeyError, RuntimeError, TypeError, AttributeError) as error:
            raise misfit(file, error) from None
        self.policy = self.runner.get_inference_policy(device=self._device)
        return self.policy

    def close(self) -> None:
        """Close the environment."""
        self.env.close()
