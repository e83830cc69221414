"""Mirror images: the signs and sides of every term are those of the physics."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

pytest.importorskip("mjlab")

import torch
from mjlab.envs import ManagerBasedRlEnv
from mjlab.utils.lab_api.math import quat_apply, quat_from_euler_xyz

from draft.errors import DraftError
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.task.mdp.commands import command_term
from draft.learn.task.mdp.environment import environment
from draft.learn.task.world import mirror
from draft.learn.task.world.access import GROUND
from draft.learn.task.world.task import Task
from tests.learn.small import member
from tests.learn.task.states import place

POLAR = (1.0, -1.0, 1.0)
AXIAL = (-1.0, 1.0, -1.0)


@pytest.fixture(scope="module", params=["cheetah", "wheeled"])
def robot(request: pytest.FixtureRequest) -> LeggedRobot:
    return member(request.param)


@pytest.fixture(scope="module")
def env(robot: LeggedRobot) -> Any:
    """Two worlds without anything random after the reset; the second is to mirror the first."""
    task = Task((robot,), ground="flat", see_design=robot.is_quadruped)
    made = ManagerBasedRlEnv(environment(task, 2, play=True), device="cpu")
    yield made
    made.close()


def start_mirrored(env: Any, member: LeggedRobot) -> None:
    """Put the first world in a state without symmetry, and the second in its mirror image."""
    env.reset()
    torch.manual_seed(4)
    polar, axial = torch.tensor([[1.0] * 3, POLAR]), torch.tensor([[1.0] * 3, AXIAL])
    linear, angular = torch.randn(2, 3) * 0.4
    count = len(member.joints)
    joints, speeds = torch.tensor(member.home) + 0.1 * torch.randn(count), torch.randn(count)
    quat = quat_from_euler_xyz(*(torch.tensor([0.12, -0.09, 0.4]) * axial).unbind(1))
    place(
        env,
        torch.tensor([0.3, 0.7, member.height + 0.005]) * polar,
        quat,
        linear * polar,
        quat_apply(quat, angular * axial),
        torch.stack((joints, other_side(joints, member))),
        torch.stack((speeds, other_side(speeds, member))),
    )
    command = command_term(env)
    command.vel_command_b[:] = torch.tensor([[0.6, 0.3, -0.2], [0.6, -0.3, 0.2]])
    command.is_heading_env[:] = False
    command.is_standing_env[:] = False
    command.time_left[:] = 1e6


def other_side(values: torch.Tensor, member: LeggedRobot) -> torch.Tensor:
    """Joint angles of the mirrored robot, by the names of its joints."""
    found = values.clone()
    for i, name in enumerate(member.joints):
        other = {"L": "R", "R": "L"}
        twin = member.joints.index("".join((name[0], other[name[1]], name[2:])))
        found[twin] = -values[i] if name.endswith("hip_roll") else values[i]
    return found


def walk_mirrored(env: Any, member: LeggedRobot, steps: int) -> dict[str, torch.Tensor]:
    """Observations of both worlds after mirrored actions from mirrored states."""
    start_mirrored(env, member)
    generator, seen = torch.Generator().manual_seed(2), {}
    for _ in range(steps):
        action = torch.randn(len(member.joints), generator=generator)
        seen = env.step(torch.stack((action, other_side(action, member))))[0]
    assert env.episode_length_buf.tolist() == [steps, steps]  # No fall has reset a world.
    return seen


def of_terms(env: Any, group: str, values: torch.Tensor) -> dict[str, torch.Tensor]:
    """Values of a group by term."""
    manager = env.observation_manager
    widths = [dims[0] for dims in manager.group_obs_term_dim[group]]
    return dict(zip(manager.active_terms[group], values.split(widths, dim=-1), strict=True))


def test_the_mirrored_robot_sees_the_mirror_image_of_what_the_robot_sees(
    env: Any, robot: LeggedRobot
) -> None:
    seen = walk_mirrored(env, robot, 12)
    for group, (one, other) in seen.items():
        expected = of_terms(env, group, mirror.flips(env)[group](one))
        for name, value in of_terms(env, group, other).items():
            torch.testing.assert_close(value, expected[name], atol=2e-3, rtol=2e-3, msg=name)
    # It touches the ground, and is not symmetric itself; flat ground looks alike from both sides.
    here, there = (of_terms(env, "critic", one) for one in seen["critic"])
    wheels = bool(robot.rolls)  # All of them stay on the ground.
    assert 0 < here["foot_contact"].sum() < 4 + wheels
    same = {"foot_contact", "foot_air_time"} if wheels else set[str]()
    for name in here.keys() - {"height_scan", "design"} - same:
        assert (here[name] - there[name]).abs().max() > 0.004, name


def test_the_scan_of_mirrored_ground_is_mirrored(
    env: Any, robot: LeggedRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    ground = env.scene[GROUND]
    place = (torch.arange(322) - 160.5) * 0.025
    x, y = torch.meshgrid(place, place.abs(), indexing="ij")
    # The same on both sides of y = 0, where the worlds stand; not so about either robot.
    monkeypatch.setattr(ground, "_map", 0.1 * torch.sin(2 * x) + 0.2 * torch.cos(1.5 * y + x))
    rim = torch.tensor([161.0, 161.0])  # Cells from the edge to the middle, and one around all.
    monkeypatch.setattr(ground, "_shift", rim, raising=False)
    monkeypatch.setattr(ground, "_last", (2 * rim - 1).int(), raising=False)
    start_mirrored(env, robot)
    env.sim.forward()
    seen = env.observation_manager.compute(update_history=True)["critic"]
    here, there = (of_terms(env, "critic", one) for one in seen)
    image = of_terms(env, "critic", mirror.flips(env)["critic"](seen[0]))
    for name in ("height_scan", "foot_height"):
        torch.testing.assert_close(there[name], image[name], atol=2e-3, rtol=0)
    assert (here["height_scan"] - there["height_scan"]).abs().max() > 0.02


def test_an_image_of_an_image_is_what_it_was(env: Any) -> None:
    flips = mirror.flips(env)
    assert set(flips) == {"actor", "critic", "actions"}
    for flip in flips.values():
        values = torch.randn(5, len(flip.source))
        assert torch.equal(flip(flip(values)), values)
        assert not torch.equal(flip(values), values)


def test_what_has_no_known_image_is_refused(
    env: Any, robot: LeggedRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    manager, cfg = env.observation_manager, env.scene["robot"].cfg
    terms, widths = manager.active_terms, manager.group_obs_term_dim
    smell = ["smell" if name == "command" else name for name in terms["actor"]]
    odd = replace(robot, name="odd", mirror_sign=tuple(-s for s in robot.mirror_sign))
    wide = [(6,), *widths["actor"][1:]]
    for words, patch in {
        r"(?s)observation 'smell' is not known.*learning\.mirror": (terms, "actor", smell),
        r"'base_lin_vel'.*shape \(6,\), not \(3,\)": (widths, "actor", wide),
        "of odd mirror differently from those of ": (vars(cfg), "members", (robot, odd)),
    }.items():
        with monkeypatch.context() as patched:
            patched.setitem(*patch)
            with pytest.raises(DraftError, match=words):
                mirror.flips(env)
