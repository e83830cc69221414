"""Models of designs compiled one by one, as each would be in a scene of its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from draft.learn.bodies.legged import LeggedRobot
from draft.learn.task.config import Config
from draft.learn.task.world.robot import robot


def compiled(members: Sequence[LeggedRobot], config: Config) -> list[mujoco.MjModel]:
    """Robots with the actuators and colliding geoms of the scene, without the scene."""
    return [robot((member,), config).build().compile() for member in members]


def check_masses(env: Any, models: Sequence[Any], tolerance: float) -> None:
    """Check that the mass matrix of every world is that of its own model, in five random poses.

    Args:
        env: an environment, on any engine.
        models: model of each world; from the first again if there are more worlds.
        tolerance: of an entry, per root of the product of its rows' inertias.
    """
    import torch

    drawn = np.random.default_rng(0)
    native = env.sim._batch.bind("M") if hasattr(env.sim, "_batch") else None
    for _ in range(5):
        pose = env.sim.data.qpos.double()
        quat = torch.from_numpy(drawn.normal(size=(env.num_envs, 4)))
        pose[:, 3:7] = quat / quat.norm(dim=1, keepdim=True)
        pose[:, 7:] = torch.from_numpy(drawn.uniform(-1.5, 1.5, (env.num_envs, 12)))
        if native is not None:  # Its states are in double precision.
            env.sim.state[:, 1 : 1 + pose.shape[1]] = pose
        else:
            env.sim.data.qpos[:] = pose.float()
            pose = env.sim.data.qpos.double()
        env.sim.forward()
        for world, entries in enumerate(env.sim.data.M.numpy() if native is None else native):
            model = models[world % len(models)]
            data = mujoco.MjData(model)
            data.qpos[:] = pose[world].numpy()
            mujoco.mj_forward(model, data)
            own, found = full(model, data.M), full(env.sim.mj_model, entries)
            gap, size = np.abs(found - own), np.sqrt(np.outer(np.diag(own), np.diag(own)))
            assert gap.max() < 0.1 * tolerance * np.abs(own).max()
            # Of small entries too: the coupling of two joints, per their own inertias.
            assert (gap / size).max() < tolerance


def full(model: Any, entries: np.ndarray) -> np.ndarray:
    """Mass matrix from what MuJoCo keeps of it."""
    data, found = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    data.M[:] = entries.ravel()
    mujoco.mj_fullM(model, data, found)
    return found
