"""PPO with rsl-rl's models, storage and checkpoints, and an update that is fast on CPUs.

It differs from rsl-rl's PPO in seven ways. Observations are normalised by statistics that change
only between iterations; in rsl-rl they change during a rollout, and the update then measures a KL
divergence that no gradient caused. All processes share these statistics. Gradients and KL
divergence of a mini-batch are reduced together. The networks can be kept mirror-symmetric. The
learning rate and the weight of the entropy can decay at the end. In a mixture of robots with
different joints, each learns from the actions of its own joints, and advantages are normalised for
each topology. An actor can first imitate a teacher, in the states that it comes to by itself
(DAgger: Ross, Gordon and Bagnell, 2011).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import torch
from rsl_rl.algorithms import PPO
from rsl_rl.env import VecEnv
from rsl_rl.models import MLPModel
from tensordict import TensorDict
from torch import distributed

from draft.errors import DraftError
from draft.learn.engine.worlds.mixture import Mixture
from draft.learn.task.world.mirror import flips
from draft.learn.training.ppo.symmetry import Symmetric

_HIGHEST_RATE = 1e-2
_LAST = 0.05  # Learning rate and weight of the entropy at the end of a training that decays.
_LOG_2PI = math.log(2 * math.pi)
_ASYMMETRIC = 1e-3  # Relative change of weights by a projection that is more than rounding.


class Ppo(PPO):
    """PPO for an actor and a critic that are multilayer perceptrons, with a Gaussian policy.

    Attributes:
        least_rate: floor of the adaptive learning rate.
        learns_actor: whether the actor learns from rewards; else its statistics rest too.
        teacher: actions that the actor imitates instead, for what the critic observes; None for
            none.
    """

    def __init__(
        self, *args: Any, symmetric: bool = False, least_rate: float = 1e-5, **more: Any
    ) -> None:
        """Take the arguments of rsl-rl's PPO and two more.

        Args:
            args: positional arguments of rsl-rl's PPO.
            symmetric: whether to keep actor and critic mirror-symmetric.
            least_rate: floor of the adaptive learning rate.
            more: keyword arguments of rsl-rl's PPO.
        """
        super().__init__(*args, **more)
        self.least_rate, self._symmetric = least_rate, symmetric
        self._first_rate, self._factor = self.learning_rate, 1.0
        self.learns_actor = True
        self.teacher: Callable[[torch.Tensor], torch.Tensor] | None = None
        parameters = [*self.actor.parameters(), *self.critic.parameters()]
        self.optimizer = torch.optim.Adam(parameters, lr=self.learning_rate, fused=True)
        self._symmetry: Symmetric | None = None
        # Of a mixture: whether a world's robot has each joint, and the world's topology.
        self._present: torch.Tensor | None = None
        self._group: torch.Tensor | None = None

    @staticmethod
    def construct_algorithm(obs: TensorDict, env: VecEnv, cfg: dict[str, Any], device: str) -> PPO:
        """Construct as rsl-rl does, then make the networks symmetric if requested.

        Raises:
            DraftError: the mirror image of an observation or of a layer is not known.
        """
        alg = PPO.construct_algorithm(obs, env, cfg, device)
        if isinstance(alg, Ppo) and isinstance(env, Mixture):
            alg._present, alg._group = env.present, env.group
        if isinstance(alg, Ppo) and alg._symmetric:
            wrapper: Any = env  # mjlab's, which has the environment as `unwrapped`.
            images = env.flips() if isinstance(env, Mixture) else flips(wrapper.unwrapped)
            alg._symmetry = Symmetric(
                alg.actor, alg.critic, images["actor"], images["critic"], images["actions"]
            )
            alg._symmetry.project()
        return alg

    def process_env_step(
        self,
        obs: TensorDict,
        rewards: torch.Tensor,
        dones: torch.Tensor,
        extras: dict[str, torch.Tensor],
    ) -> None:
        """Record a step; statistics of observations change only in `update`."""
        transition = self.transition
        transition.rewards = rewards.clone()
        transition.dones = dones
        if transition.values is not None:  # Set by `act`.
            bootstrap = transition.values.squeeze(1) * extras["time_outs"]
            transition.rewards += self.gamma * bootstrap
        self.storage.add_transition(transition)
        transition.clear()

    def load(
        self, loaded_dict: dict[str, Any], load_cfg: dict[str, Any] | None, strict: bool
    ) -> bool:
        """Load as rsl-rl does; the networks stay symmetric if that was requested.

        Raises:
            DraftError: they are to be symmetric, and those that are loaded are not.
        """
        loaded = super().load(loaded_dict, load_cfg, strict)
        for group in self.optimizer.param_groups:
            group["fused"] = True
        if self._symmetry is not None:
            if self._symmetry.deviation() > _ASYMMETRIC:
                # The units of another network are no pairs: the projection would be noise.
                cause = "the policy to start from is not mirror-symmetric, and this training is"
                raise DraftError(cause, "`values` learning.mirror=false")
            self._symmetry.project()
        return loaded

    def decay(self, share: float) -> None:
        """Limit the learning rate, and the weight of the entropy.

        Args:
            share: share of the decay that is done, from 0 to 1.
        """
        self._factor = _LAST**share

    def compute_returns(self, obs: TensorDict) -> None:
        """Compute returns and advantages; those of a mixture are normalised for each topology."""
        super().compute_returns(obs)
        storage, group = self.storage, self._group
        if group is None:
            return
        advantages = storage.returns - storage.values
        for one in group.unique():
            own = advantages[:, group == one]
            advantages[:, group == one] = (own - own.mean()) / (own.std() + 1e-8)
        storage.advantages = advantages

    def update(self) -> dict[str, float]:
        """Learn from the rollout, then add its observations to the statistics.

        Returns:
            Means over all mini-batches of "value" loss, "surrogate" loss, "entropy", "kl" and the
            mean square of the "difference" from the teacher's actions, 0 without a teacher.
        """
        storage = self.storage
        seen = storage.observations.flatten(0, 1)
        with torch.no_grad():
            inputs = [model.get_latent(seen) for model in (self.actor, self.critic)]
            rollout = [
                one.flatten(0, 1)
                for one in (
                    storage.actions,
                    storage.values,
                    storage.advantages,
                    storage.returns,
                    storage.actions_log_prob,
                    *(storage.distribution_params or ()),  # Set by the first transition.
                )
            ]
            present = self._present
            if present is not None:
                present = present.repeat(len(storage.observations), 1)
                actions, mean, std = rollout[0], *rollout[-2:]
                rollout[4] = _log_prob(actions, mean, std, present)[:, None]
            taught = None if self.teacher is None else self.teacher(seen["critic"])
        sums = torch.zeros(5, device=self.device)
        size = len(rollout[0]) // self.num_mini_batches
        for _ in range(self.num_learning_epochs):
            order = torch.randperm(size * self.num_mini_batches, device=self.device)
            for rows in order.split(size):
                own, told = (None if one is None else one[rows] for one in (present, taught))
                samples = (one[rows] for one in (*inputs, *rollout))
                sums += self._learn(*samples, present=own, taught=told)
        with torch.no_grad():
            rests = not self.learns_actor and taught is None
            for model in (self.critic,) if rests else (self.actor, self.critic):
                self._normalise(model, seen)
            if self._symmetry is not None:
                # The weights too: a fused step rounds the last few numbers differently.
                self._symmetry.project()
        storage.clear()
        names = ("value", "surrogate", "entropy", "kl", "difference")
        means = sums / (self.num_learning_epochs * self.num_mini_batches)
        return dict(zip(names, means.tolist(), strict=True))

    def _learn(
        self,
        seen: torch.Tensor,
        seen_by_critic: torch.Tensor,
        actions: torch.Tensor,
        old_values: torch.Tensor,
        advantages: torch.Tensor,
        returns: torch.Tensor,
        old_log_prob: torch.Tensor,
        old_mean: torch.Tensor,
        old_std: torch.Tensor,
        present: torch.Tensor | None,
        taught: torch.Tensor | None,
    ) -> torch.Tensor:
        """Take one gradient step on a mini-batch, each argument of shape (samples, ...).

        `present` tells which actions move a joint; None for all. `taught` are a teacher's actions.

        Returns:
            Value loss, surrogate loss, entropy, KL divergence and difference, shape (5,).
        """
        mean = self.actor.mlp(seen)
        values = self.critic.mlp(seen_by_critic)
        std = action_std(self.actor)
        log_std = std.log()
        log_prob = _log_prob(actions, mean, std, present)
        entropy = log_std + 0.5 * (1 + _LOG_2PI)
        entropy = entropy.sum() if present is None else (entropy * present).sum(1).mean()
        with torch.no_grad():
            moved = (old_std.square() + (old_mean - mean).square()) / (2 * std.square())
            divergence = log_std - old_std.log() + moved - 0.5
            if present is not None:
                divergence = divergence * present
            kl = divergence.sum(1).mean()
        clip, advantage = self.clip_param, advantages.squeeze(1)
        ratio = (log_prob - old_log_prob.squeeze(1)).exp()
        surrogate = -torch.min(
            advantage * ratio, advantage * ratio.clamp(1 - clip, 1 + clip)
        ).mean()
        value = (values - returns).square()
        # A critic that learns alone is new, and far from what it may move by.
        if self.use_clipped_value_loss and self.learns_actor:
            clipped = old_values + (values - old_values).clamp(-clip, clip)
            value = torch.max(value, (clipped - returns).square())
        value = value.mean()
        # A weight of zero, since processes share the gradients of all parameters.
        share = float(self.learns_actor)
        loss = self.value_loss_coef * value + share * (
            surrogate - self._factor * self.entropy_coef * entropy
        )
        difference = torch.zeros_like(kl) if taught is None else (mean - taught).square().mean()
        loss = loss + difference
        self.optimizer.zero_grad(set_to_none=False)
        loss.backward()
        kl = self._reduce(kl)
        if self._symmetry is not None:
            self._symmetry.project_gradients()
        self._adapt(float(kl))
        for model in (self.actor, self.critic):
            torch.nn.utils.clip_grad_norm_(model.parameters(), self.max_grad_norm)
        if not self.learns_actor:
            # With gradients of zero Adam would count steps, and overshoot when the actor begins.
            resting: Any = self.actor if taught is None else self.actor.distribution
            for parameter in resting.parameters():
                parameter.grad = None
        self.optimizer.step()
        losses = (value, surrogate, entropy, kl, difference)
        return torch.stack([one.detach() for one in losses])

    def _adapt(self, kl: float) -> None:
        """Adapt the learning rate to the desired KL divergence."""
        if self.schedule != "adaptive" or not self.learns_actor:
            return
        if kl > 2.0 * self.desired_kl:
            self.learning_rate = max(self.least_rate, self.learning_rate / 1.5)
        elif 0.0 < kl < 0.5 * self.desired_kl:
            self.learning_rate = min(_HIGHEST_RATE, self.learning_rate * 1.5)
        if self._factor < 1.0:
            self.learning_rate = min(self.learning_rate, self._factor * self._first_rate)
        for group in self.optimizer.param_groups:
            group["lr"] = self.learning_rate

    def _reduce(self, kl: torch.Tensor) -> torch.Tensor:
        """Average gradients, and the KL divergence with them, over all processes."""
        if self.gpu_world_size == 1:
            return kl
        grads = [p.grad for group in self.optimizer.param_groups for p in group["params"]]
        flat = torch.cat([*(grad.flatten() for grad in grads), kl[None]])
        distributed.all_reduce(flat)
        flat /= self.gpu_world_size
        start = 0
        for grad in grads:
            grad.copy_(flat[start : start + grad.numel()].view_as(grad))
            start += grad.numel()
        return flat[-1]

    def _normalise(self, model: MLPModel, seen: TensorDict) -> None:
        """Add a rollout of all processes to a model's mean and variance of observations."""
        if not model.obs_normalization:
            return
        values = torch.cat([seen[group] for group in model.obs_groups], dim=1)
        normaliser: Any = model.obs_normalizer  # rsl-rl declares no types of its buffers.
        # About the samples' own mean, to limit rounding errors: constant values then have a
        # variance of zero, not a negative one. Processes may have different numbers of samples.
        mean = values.mean(0)
        spread = (values - mean).square_().mean(0)
        shift = mean.double() - normaliser._mean[0]
        sums = torch.stack((torch.ones_like(shift), shift, spread + shift.square())) * len(values)
        if self.gpu_world_size > 1:
            distributed.all_reduce(sums)
        count = int(sums[0, 0])
        shift, square = (sums[1:] / count).unbind()
        normaliser.count += count
        rate = count / float(normaliser.count)
        spread = (square - shift.square()).clamp(min=0.0)
        normaliser._var += rate * (spread - normaliser._var + (1 - rate) * shift.square())
        normaliser._mean += rate * shift
        normaliser._std = normaliser._var.sqrt()


def _log_prob(
    actions: torch.Tensor, mean: torch.Tensor, std: torch.Tensor, present: torch.Tensor | None
) -> torch.Tensor:
    """Logarithm of the probability density of actions, shape (samples,)."""
    far = -0.5 * ((actions - mean) / std).square()
    if present is not None:
        return ((far - std.log() - 0.5 * _LOG_2PI) * present).sum(1)
    return far.sum(1) - std.log().sum() - 0.5 * _LOG_2PI * actions.shape[1]


def action_std(actor: MLPModel) -> torch.Tensor:
    """Standard deviation of an actor's actions, shape (joints,)."""
    distribution: Any = actor.distribution  # rsl-rl does not declare its parameters.
    return distribution.std_param.clamp(*distribution.std_range)
