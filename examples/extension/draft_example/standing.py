"""A reward of walking: a robot that is told to stand should not move."""

from __future__ import annotations

from typing import TYPE_CHECKING

from draft.extend import Scaled, number, reward

if TYPE_CHECKING:
    import torch
    from mjlab.envs import ManagerBasedRlEnv


@reward(
    weight=-0.5,
    gate=number(0.1, "m/s", "command below which it stands", power=0.5, least=0.0),
)
def standing(env: ManagerBasedRlEnv, gate: Scaled) -> torch.Tensor:
    """Speed of a robot that is told to stand."""
    # Imported here: the module is loaded by every command, and mjlab takes seconds.
    from draft.learn.task.world.access import command_of, robot_of

    robot = robot_of(env)
    stands = command_of(env)[:, :2].norm(dim=1) < robot.scaled(gate)
    return robot.data.root_link_lin_vel_b[:, :2].norm(dim=1) * stands
