"""Environments of several topologies as one, for a policy that moves joints by their slots.

Each environment has the worlds of one topology. Observations and actions of all are padded to the
slots of `draft.learn.bodies.slots`, so that one network takes them in one call.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from mjlab.envs import ManagerBasedRlEnv
from mjlab.rl import RslRlVecEnvWrapper
from rsl_rl.env import VecEnv
from tensordict import TensorDict

from draft.learn.bodies.padding import (
    LAYOUTS,
    MOST,
    mirror_image,
    of_joints,
    places,
    powers,
    starts,
)
from draft.learn.bodies.slots import SLOTS, mirrored_slots, slots_of
from draft.learn.task.world.access import robot_of
from draft.learn.task.world.mirror import Flip


class Mixture(VecEnv):
    """Environments of several topologies, as rsl-rl's runner takes one.

    Attributes:
        present: whether each world's robot has a joint in each slot, shape (worlds, SLOTS).
        group: index of each world's environment, shape (worlds,).
    """

    def __init__(self, envs: Sequence[ManagerBasedRlEnv]) -> None:
        """Wrap and reset the environments."""
        self._parts = [_Part(env) for env in envs]
        self.device = torch.device(envs[0].device)
        self.cfg = envs[0].cfg
        counts = [env.num_envs for env in envs]
        self.num_envs, self.num_actions = sum(counts), SLOTS
        self.max_episode_length = max(env.max_episode_length for env in envs)
        self.present = torch.cat([part.present for part in self._parts])
        self.group = torch.arange(len(envs)).repeat_interleave(torch.tensor(counts)).to(self.device)
        self._rows = torch.tensor(counts).cumsum(0)[:-1]

    def get_observations(self) -> TensorDict:
        """Present observations of all worlds."""
        return self._joined([part.padded(part.env.get_observations()) for part in self._parts])

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict]:
        """Step all worlds.

        Args:
            actions: shape (worlds, SLOTS).
        """
        results = [
            part.step(own)
            for part, own in zip(self._parts, actions.tensor_split(self._rows), strict=True)
        ]
        seen, rewards, dones, extras = zip(*results, strict=True)
        outs: dict[str, Any] = {
            "time_outs": torch.cat([one["time_outs"] for one in extras]),
            "parts": extras,
        }
        return self._joined(seen), torch.cat(rewards), torch.cat(dones), outs

    def flips(self) -> dict[str, Flip]:
        """Mirror images of the groups of observations, and of the actions as `actions`."""

        def flip(source: np.ndarray, sign: np.ndarray) -> Flip:
            return Flip(
                torch.from_numpy(source.copy()).to(self.device),
                torch.from_numpy(sign).float().to(self.device),
            )

        images = {group: flip(*mirror_image(group)) for group in LAYOUTS}
        return images | {"actions": flip(mirrored_slots(), np.ones(SLOTS))}

    def _joined(self, seen: Sequence[TensorDict]) -> TensorDict:
        return torch.cat(list(seen))  # pyright: ignore[reportReturnType]


class _Part:
    """The environment of one topology."""

    def __init__(self, env: ManagerBasedRlEnv) -> None:
        self.env = RslRlVecEnvWrapper(env)
        self._robot = robot_of(env)
        slots = slots_of(self._robot.cfg.members[0])
        manager, device = env.observation_manager, env.device
        self._pads = {}
        for group in LAYOUTS:
            dims = (one[0] for one in manager.group_obs_term_dim[group])
            terms = list(zip(manager.active_terms[group], dims, strict=True))
            source = places(group, terms, slots).sources(group)
            self._pads[group] = (
                torch.from_numpy(source).to(device),
                torch.from_numpy(powers(group)).float().to(device),
            )
        driven = [joint for joint, slot in enumerate(slots.joints) if slot >= 0]
        self._driven = torch.tensor(driven, device=device)
        self._slots = torch.tensor([slots.joints[joint] for joint in driven], device=device)
        self.present = torch.zeros(env.num_envs, SLOTS, device=device)
        self.present[:, self._slots] = 1.0

    def padded(self, seen: TensorDict) -> TensorDict:
        """Observations of this environment's worlds in the slots."""
        scale, signs = self._robot.unit_logarithms(), self._robot.sign[:, self._driven]
        found = {}
        for group, (source, power) in self._pads.items():
            values = seen[group]
            wide = torch.cat((values, values.new_zeros(len(values), 1)), dim=1)
            factor, first = torch.exp(-scale @ power), starts(group)
            for name in of_joints(group):
                factor[:, first[name] + self._slots] *= signs
            found[group] = (wide[:, source] * factor).clamp(-MOST, MOST)
        return TensorDict(found, batch_size=seen.batch_size)

    def step(
        self, actions: torch.Tensor
    ) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict[str, Any]]:
        """Step this environment's worlds by actions of the slots."""
        own = actions.new_zeros(len(actions), self.env.num_actions)
        own[:, self._driven] = actions[:, self._slots] * self._robot.sign[:, self._driven]
        seen, rewards, dones, extras = self.env.step(own)
        return self.padded(seen), rewards, dones, extras
