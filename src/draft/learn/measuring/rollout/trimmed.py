"""Trim of a policy in the worlds of an environment; `Controller` has that of one robot."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from mjlab.envs import ManagerBasedRlEnv

from draft.learn.policy.trim import START, Trim
from draft.values import Array


class Trimmed:
    """Trim of the observations of an environment's worlds."""

    def __init__(
        self, trim: Trim, env: ManagerBasedRlEnv, first: Mapping[str, int], period: Array
    ) -> None:
        """Take the trim.

        Args:
            trim: the trim.
            env: the environment.
            first: index of the first entry of each term of an observation.
            period: time between two actions of each world, in the unit of the trim, shape
                (worlds, 1).
        """
        self._trim, self._env, self._period = trim, env, period
        self._asked = [first["command"] + i for i in range(3)]
        self._down = [first["projected_gravity"] + i for i in range(3)]
        linear, angular = first["base_lin_vel"], first["base_ang_vel"]
        self._moving = [linear, linear + 1, angular + 2]
        self._state = np.tile(START, (env.num_envs, 1))

    def __call__(self, seen: Array) -> Array:
        """Trimmed observations, shape (worlds, n); worlds that were reset start anew."""
        state, trim, seen = self._state, self._trim, seen.astype(float)
        state[self._env.episode_length_buf.cpu().numpy() == 0] = START
        asked, moving = seen[:, self._asked], seen[:, self._moving]
        seen[:, self._asked] = trim.command(asked, state)
        seen[:, self._down] = trim.gravity(seen[:, self._down], state)
        state[:] = trim.next(state, asked, moving, self._period)
        return seen
