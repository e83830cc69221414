"""Environment of mjlab on either physics engine; no other module depends on which it is."""

from __future__ import annotations

from functools import partial
from unittest import mock

from mjlab.envs import ManagerBasedRlEnv, ManagerBasedRlEnvCfg, manager_based_rl_env

from draft.learn.engine.machine import NATIVE


def make(
    cfg: ManagerBasedRlEnvCfg, device: str, engine: str, threads: int = 1
) -> ManagerBasedRlEnv:
    """Make an environment.

    mjlab constructs the `Simulation` of its module; for native MuJoCo that name is replaced during
    the construction.

    Args:
        cfg: configuration of the environment.
        device: "cpu" or "cuda:0" and the like.
        engine: "native" or "warp".
        threads: threads of native MuJoCo.
    """
    if engine != NATIVE:
        return ManagerBasedRlEnv(cfg, device)
    from draft.learn.engine.worlds.native import NativeSimulation

    native = partial(NativeSimulation, threads=threads)
    with mock.patch.object(manager_based_rl_env, "Simulation", native):
        return ManagerBasedRlEnv(cfg, device)
