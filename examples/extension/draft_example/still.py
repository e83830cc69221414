"""A reward. PyTorch is not imported here, so that commands that do not learn stay quick."""

from __future__ import annotations

from typing import Any

from draft.extend import number, reward


@reward(
    weight=-0.5,
    gate=number(0.1, "m/s", "largest command that counts as standing", power=0.5, least=0.0),
)
def still(env: Any, gate: Any) -> Any:
    """Speed of a robot that is told to stand [m/s]."""
    from draft.learn.task.world.access import command_of, robot_of

    robot = robot_of(env)
    stands = command_of(env)[:, :2].norm(dim=1) < robot.scaled(gate)
    return robot.data.root_link_lin_vel_b.norm(dim=1) * stands  # shape (worlds,)
