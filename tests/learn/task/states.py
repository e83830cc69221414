"""Known states of robots in an environment."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
import torch

from draft.learn.engine.machine import NATIVE
from draft.learn.engine.worlds.simulate import make
from draft.learn.task.mdp.commands import command_term
from draft.learn.task.mdp.environment import environment
from draft.learn.task.recipes import LAPTOP
from draft.learn.task.world.task import Task
from tests.learn.small import member

ROOTS = torch.tensor([1.0, 1.5416667, 2.7083333]).sqrt()  # sqrt(s) of cheetah, bear, giraffe.


def each(env: Any, values: Any) -> torch.Tensor:
    """One value per design, for every world."""
    return torch.as_tensor(values, dtype=torch.float32)[env.scene["robot"].member]


def first(env: Any, values: torch.Tensor) -> torch.Tensor:
    """Values of the worlds of the first design, whose tree is that of the model."""
    return values[env.scene["robot"].member == 0]


def roots(env: Any) -> torch.Tensor:
    """sqrt(s) of every world's design."""
    return each(env, ROOTS)


def turn(axis: str, angle: float) -> torch.Tensor:
    """Quaternion (w, x, y, z) of a turn about an axis."""
    found = torch.zeros(4)
    half = torch.tensor(angle / 2)
    found[0], found["wxyz".index(axis)] = half.cos(), half.sin()
    return found


def place(
    env: Any,
    at: Any = (0.0, 0.0, 0.0),
    quat: Any = (1.0, 0.0, 0.0, 0.0),
    linear: Any = (0.0, 0.0, 0.0),
    angular: Any = (0.0, 0.0, 0.0),
    joints: Any = None,
    speeds: Any = 0.0,
) -> None:
    """Put every robot into a state, and work out all that follows from it.

    Args:
        env: the environment.
        at: place of the trunk's origin [m].
        quat: its attitude.
        linear, angular: its velocity, in the world's axes [m/s, rad/s].
        joints: joint angles [rad]; default the home pose.
        speeds: joint velocities [rad/s].
    """
    robot, worlds = env.scene["robot"], env.num_envs

    def rows(values: Any) -> torch.Tensor:
        found = torch.as_tensor(values, dtype=torch.float32)
        return found.expand(worlds, found.shape[-1]) if found.ndim < 2 else found

    pose = (rows(at), rows(quat), rows(linear), rows(angular))
    robot.write_root_state_to_sim(torch.cat(pose, dim=1))
    home = robot.data.default_joint_pos.clone()
    angles = home if joints is None else rows(joints)
    robot.write_joint_state_to_sim(angles, torch.zeros_like(home) + speeds)
    env.sim.forward()
    env.scene.update(dt=0.0)


def value(env: Any, name: str) -> torch.Tensor:
    """What a reward term gives, before its weight."""
    term = env.reward_manager.get_term_cfg(name)
    return term.func(env, **term.params)


def stand(env: Any, lift: float = 0.0, **state: Any) -> None:
    """Put every robot with its lowest foot `lift` [m] above flat ground."""
    height = env.scene["robot"].height + lift
    at = torch.stack((torch.zeros_like(height), torch.zeros_like(height), height), dim=1)
    place(env, at, **state)


def ask(env: Any, vx: Any = 0.0, vy: Any = 0.0, wz: Any = 0.0) -> None:
    """Command every robot the same velocity."""
    value = command_term(env).vel_command_b
    value[:, 0], value[:, 1], value[:, 2] = vx, vy, wz


def laptop(stage: str, *words: str, worlds: int, ground: Any = "flat", **values: Any) -> Any:
    """An environment of the recipe `laptop` in the engine of CPUs, of shipped designs."""
    config = LAPTOP.config.with_values(values)
    members = tuple(member(word) for word in words or ("cheetah",))
    task = Task(members, stage, config, ground, see_ground=ground == "uneven")
    env = make(environment(task, worlds), "cpu", NATIVE)
    env.reset()
    return env


def drive(
    env: Any,
    patch: pytest.MonkeyPatch,
    forward: Any,
    measured: Any,
    seconds: float,
    steady: bool = True,
) -> None:
    """Command every robot straight ahead, and let the speeds that are measured be others.

    Args:
        env: the environment.
        patch: undoes what is measured.
        forward: commanded speeds [m/s].
        measured: measured speeds [m/s].
        seconds: how long [s].
        steady: whether their episodes are some seconds old.
    """
    term, ahead = command_term(env), torch.tensor([1.0, 0.0, 0.0])
    for kind in (term.is_standing_env, term.is_heading_env):
        kind[:] = False
    both = torch.zeros(2, env.num_envs)
    both[0], both[1] = forward, measured
    term.vel_command_b[:], speeds = both[..., None] * ahead
    data = SimpleNamespace(root_link_lin_vel_b=speeds, heading_w=torch.zeros(env.num_envs))
    patch.setattr(term, "robot", SimpleNamespace(data=data))
    # They have stood for so long, unless the test says otherwise.
    since = torch.full((env.num_envs,), 1000) if steady else env.episode_length_buf
    patch.setattr(env, "episode_length_buf", since)
    for _ in range(round(seconds / env.step_dt)):
        term._update_command()
