"""A policy in an environment of other robots than its own: joints in its order, signs and range."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from mjlab.envs import ManagerBasedRlEnv
from numpy.typing import ArrayLike
from tensordict import TensorDict

from draft.learn.bodies.legged import LeggedRobot
from draft.learn.policy.matching import OF_JOINTS, Match
from draft.learn.policy.policy import DESIGN
from draft.learn.task.world.access import robot_of

Policy = Callable[[TensorDict], torch.Tensor]
_GROUP = "actor"


def matched(
    make: Callable[[ManagerBasedRlEnv], Policy],
    match: Callable[[LeggedRobot], Match],
    known: tuple[ArrayLike, ArrayLike],
) -> Callable[[ManagerBasedRlEnv], Policy]:
    """Return a function that makes a policy for the robots of an environment.

    Args:
        make: makes the policy for an environment of its own robots.
        match: returns the match of the policy's joints with those of a robot.
        known: lower and upper end of the features of the policy's training, at the nearest of
            which it observes those that lie outside, shape (features,).

    Raises:
        DraftError: (later) the policy does not drive one of the robots.
    """

    def make_policy(env: ManagerBasedRlEnv) -> Policy:
        policy, robot = make(env), robot_of(env)
        matches = [match(member) for member in robot.cfg.members]
        same = all(one.same for one in matches)
        spans = _spans(env)
        size = max(end for _, end in spans.values())
        index = np.tile(np.arange(size), (len(matches), 1))
        sign = np.ones((len(matches), size))
        for row, one in enumerate(matches):
            for name in OF_JOINTS:
                start, end = spans.get(name, (0, 0))
                if end > start:
                    entries, signs = one.entries(name, robot.cfg.members[0].rolls, end - start)
                    index[row, start:end] = start + np.array(entries)
                    sign[row, start:end] = signs
        order, signs = (np.array([getattr(m, x) for m in matches]) for x in ("joints", "sign"))
        taken, flipped = _of_worlds(robot.member, index, sign)
        joints, turned = _of_worlds(robot.member, order, signs)
        low, high = (torch.tensor(np.asarray(x), dtype=torch.float32).to(env.device) for x in known)
        start, end = spans.get(DESIGN, (0, 0))

        def act(seen: TensorDict) -> torch.Tensor:
            values = seen[_GROUP]
            if not same:
                values = values.gather(1, taken) * flipped
            if end > start:
                values = values.clone()
                values[:, start:end] = values[:, start:end].clamp(low, high)
            actions = policy(TensorDict({**seen, _GROUP: values}, batch_size=seen.batch_size))
            if same:
                return actions
            return torch.zeros_like(actions).scatter(1, joints, actions * turned)

        return act

    return make_policy


def _spans(env: ManagerBasedRlEnv) -> dict[str, tuple[int, int]]:
    """First entry of each term of the observations, and the one after its last."""
    manager, start = env.observation_manager, 0
    spans = {}
    dims = manager.group_obs_term_dim[_GROUP]
    for name, shape in zip(manager.active_terms[_GROUP], dims, strict=True):
        spans[name] = (start, start + shape[0])
        start += shape[0]
    return spans


def _of_worlds(
    member: torch.Tensor, index: np.ndarray, sign: np.ndarray
) -> tuple[torch.Tensor, torch.Tensor]:
    """Rows of the members for each world, as tensors of its device."""
    indices = torch.from_numpy(index.astype(np.int64)).to(member.device)[member]
    signs = torch.tensor(sign, dtype=torch.float32).to(member.device)[member]
    return indices, signs
