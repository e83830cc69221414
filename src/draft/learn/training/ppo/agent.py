"""Configuration of rsl-rl's runner and PPO."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass
from typing import Any

from mjlab.rl import (
    MjlabOnPolicyRunner,
    RslRlModelCfg,
    RslRlOnPolicyRunnerCfg,
    RslRlPpoAlgorithmCfg,
)
from torch import distributed

from draft.learn.task.config import Config


@dataclass
class PpoCfg(RslRlPpoAlgorithmCfg):
    """Configuration of `draft.learn.training.ppo.ppo.Ppo`.

    Attributes:
        symmetric: whether to keep the networks mirror-symmetric.
        least_rate: floor of the adaptive learning rate.
    """

    symmetric: bool = False
    least_rate: float = 1e-5


class Runner(MjlabOnPolicyRunner):
    """mjlab's runner, with processes that may also share a CPU."""

    def _configure_multi_gpu(self) -> None:
        """Join the process group: NCCL between GPUs, gloo on a CPU."""
        count = int(os.getenv("WORLD_SIZE", "1"))
        if self.device != "cpu" or count == 1:
            super()._configure_multi_gpu()
            return
        rank = int(os.environ["RANK"])
        self.gpu_world_size, self.gpu_global_rank, self.gpu_local_rank = count, rank, rank
        self.is_distributed = True
        self.cfg["multi_gpu"] = {"global_rank": rank, "local_rank": rank, "world_size": count}
        if not distributed.is_initialized():
            distributed.init_process_group("gloo", rank=rank, world_size=count)


def agent(config: Config, stage: str, seed: int = 0) -> RslRlOnPolicyRunnerCfg:
    """Configuration of the runner.

    Args:
        config: the numbers.
        stage: one of `draft.learn.task.stages.STAGES`.
        seed: seed of the first weights and of the actions.
    """
    learning = config.learning
    return RslRlOnPolicyRunnerCfg(
        seed=seed,
        actor=RslRlModelCfg(
            hidden_dims=learning.hidden,
            activation="elu",
            obs_normalization=True,
            distribution_cfg={
                "class_name": "GaussianDistribution",
                "init_std": learning.initial_std,
                "std_type": "scalar",
            },
        ),
        critic=RslRlModelCfg(hidden_dims=learning.hidden, activation="elu", obs_normalization=True),
        algorithm=PpoCfg(
            class_name="draft.learn.training.ppo.ppo:Ppo",
            num_learning_epochs=learning.epochs,
            num_mini_batches=learning.mini_batches,
            learning_rate=learning.learning_rate,
            schedule="adaptive",
            gamma=learning.discount,
            lam=learning.trace,
            entropy_coef=learning.entropy,
            desired_kl=learning.kl,
            max_grad_norm=learning.gradient,
            value_loss_coef=learning.value_weight,
            use_clipped_value_loss=True,
            clip_param=learning.clip,
            symmetric=learning.mirror,
            least_rate=learning.least_rate,
        ),
        experiment_name=f"draft_{stage}",
        logger="tensorboard",
        num_steps_per_env=learning.steps,
        max_iterations=config.iterations(stage),
        save_interval=learning.save_every,
    )


def agent_settings(config: Config, stage: str, seed: int = 0) -> dict[str, Any]:
    """Configuration of the runner as the plain data that rsl-rl takes, and changes."""
    return asdict(agent(config, stage, seed))
