"""Make mjlab's environment on the engine that was chosen; nothing else knows which it is."""

from __future__ import annotations

from functools import partial
from typing import Any
from unittest import mock

from mjlab.envs import ManagerBasedRlEnv, ManagerBasedRlEnvCfg
from mjlab.envs import manager_based_rl_env as mjlab_environment

from draft.learn.machine import NATIVE


def make(
    settings: ManagerBasedRlEnvCfg, device: str, engine: str, threads: int = 1
) -> ManagerBasedRlEnv:
    """Make an environment.

    mjlab constructs the `Simulation` that stands in its module; while it does, the native one
    stands there.

    Args:
        settings: configuration of the environment.
        device: "cpu" or "cuda:0" and the like.
        engine: "native" or "warp".
        threads: of native MuJoCo.
    """
    if engine != NATIVE:
        return ManagerBasedRlEnv(settings, device)
    from draft.learn.lab.native import NativeSimulation

    native: Any = partial(NativeSimulation, threads=threads)
    with mock.patch.object(mjlab_environment, "Simulation", native):
        return ManagerBasedRlEnv(settings, device)
