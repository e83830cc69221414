"""PPO of rsl-rl with the numbers of a configuration."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from mjlab.rl import RslRlModelCfg, RslRlOnPolicyRunnerCfg, RslRlPpoAlgorithmCfg

from draft.learn.config import Learning


@dataclass
class PpoCfg(RslRlPpoAlgorithmCfg):
    """PPO with rsl-rl's symmetry, which mjlab's own configuration leaves out.

    Attributes:
        symmetry_cfg: arguments of `rsl_rl.extensions.Symmetry`; None to learn without it.
    """

    symmetry_cfg: dict[str, Any] | None = None


# Each mini-batch with its mirror image behind it: twice the samples, for the same steps.
MIRRORED = {
    "data_augmentation_func": "draft.learn.lab.mirror:augment",
    "use_data_augmentation": True,
    "use_mirror_loss": False,
    "mirror_loss_coeff": 0.0,
}


def agent(learning: Learning, stage: str, seed: int = 0) -> RslRlOnPolicyRunnerCfg:
    """Configuration of the runner.

    Args:
        learning: the numbers.
        stage: of `draft.learn.config.STAGES`.
        seed: of the first weights and of the actions.
    """
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
            symmetry_cfg=dict(MIRRORED) if learning.mirror else None,
        ),
        experiment_name=f"draft_{stage}",
        logger="tensorboard",
        num_steps_per_env=learning.steps,
        max_iterations=learning.iterations(stage),
        save_interval=learning.save_every,
    )


def agent_settings(learning: Learning, stage: str, seed: int = 0) -> dict[str, Any]:
    """The same as the plain data that rsl-rl's runner takes, and changes."""
    return asdict(agent(learning, stage, seed))
