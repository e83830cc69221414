"""The policy of all legs in an environment of robots of one topology."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from mjlab.envs import ManagerBasedRlEnv
from tensordict import TensorDict

from draft.learn.bodies.features import GRAVITY
from draft.learn.bodies.padding import MOST, places, size, starts, units
from draft.learn.bodies.slots import FEATURES, SLOTS, describe
from draft.learn.measuring.rollout.trimmed import Trimmed
from draft.learn.policy.reduced import LegsPolicy
from draft.learn.task.world.access import robot_of

Policy = Callable[[TensorDict], torch.Tensor]
_GROUP = "actor"
_FIRST = starts(_GROUP)


def by_slots(policy: LegsPolicy, device: str) -> Callable[[ManagerBasedRlEnv], Policy]:
    """Return a function that makes the policy for the robots of an environment.

    Args:
        policy: the policy.
        device: device of the environment.

    Raises:
        DraftError: (later) a leg of a robot has more joints than there are slots.
    """

    def make_policy(env: ManagerBasedRlEnv) -> Policy:
        robot, manager = robot_of(env), env.observation_manager
        lengths = [one[0] for one in manager.group_obs_term_dim[_GROUP]]
        terms = list(zip(manager.active_terms[_GROUP], lengths, strict=True))
        entries, factors, fixed, slots, signs = [], [], [], [], []
        unused, first = size(_GROUP), _FIRST["design"]
        for member in robot.cfg.members:
            own, features = describe(member)
            found = places(_GROUP, terms, own)
            to = np.append(units(_GROUP, member.leg_length), 0.0)
            entries.append(np.where(found.entry < 0, unused, found.entry))
            factors.append(found.sign * to[entries[-1]] / found.share)
            constant = np.zeros(unused + 1)
            constant[first : first + FEATURES] = policy.nearest(features, len(member.feet))
            fixed.append(constant)
            slots.append([SLOTS if slot < 0 else slot for slot in own.joints])
            signs.append(own.signs)

        worlds = robot.member.cpu().numpy()
        entry, factor, constant, slot, sign = (
            np.array(one)[worlds] for one in (entries, factors, fixed, slots, signs)
        )
        rows = np.arange(len(worlds))[:, None]
        # A mixture's topologies have an environment each, so all have as many legs.
        trim = policy.trim(len(robot.cfg.members[0].feet))
        lengths = np.array([member.leg_length for member in robot.cfg.members])[worlds]
        period = env.step_dt / np.sqrt(lengths / GRAVITY)[:, None]
        trimmed = Trimmed(trim, env, _FIRST, period)

        def act(seen: TensorDict) -> torch.Tensor:
            padded = constant.copy()
            np.add.at(padded, (rows, entry), seen[_GROUP].cpu().numpy() * factor)
            padded = trimmed(padded[:, :unused].clip(-MOST, MOST))
            wide = policy.network(padded.astype(np.float32))
            still = np.append(wide, np.zeros((len(wide), 1), wide.dtype), axis=1)
            return torch.from_numpy((still[rows, slot] * sign).astype(np.float32)).to(device)

        return act

    return make_policy
