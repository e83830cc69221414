"""Robots on driven wheels in training: a wheel's target is a speed, and its angle means nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mjlab")

import torch
from mjlab.envs import ManagerBasedRlEnv

import draft
from draft.learn.bodies.legged import LeggedRobot, legged_robot
from draft.learn.task.mdp.environment import environment
from draft.learn.task.stages import STAGES
from draft.learn.task.world.task import Task
from draft.metrics.rolling import rolling_speed
from draft.values import scalar
from tests.learn.small import member
from tests.learn.task.states import ask, place, stand

LAYOUT = {
    "base_lin_vel": 3,
    "base_ang_vel": 3,
    "projected_gravity": 3,
    "joint_pos": 12,
    "joint_vel": 12,
    "actions": 12,
    "command": 3,
}
FEET = {"foot_height": 4, "foot_air_time": 4, "foot_contact": 4, "foot_contact_forces": 12}
RADIUS = 0.085  # Of the shipped robot's wheels [m].


@pytest.fixture(scope="module")
def wheeled() -> LeggedRobot:
    return member("wheeled")


@pytest.fixture(scope="module")
def fast(wheeled: LeggedRobot) -> LeggedRobot:
    """The same robot with other motors of its wheels."""
    numbers = zip(wheeled.no_load_speed, wheeled.peak_torque, wheeled.rolls, strict=True)
    speeds, torques = zip(
        *((2 * w if r else w, t / 2 if r else t) for w, t, r in numbers), strict=True
    )
    return replace(wheeled, name="fast", no_load_speed=speeds, peak_torque=torques)


@pytest.fixture(scope="module")
def env(wheeled: LeggedRobot, fast: LeggedRobot) -> Any:
    """Two worlds without noise and pushes: the shipped robot, and one with faster wheels."""
    task = Task((wheeled, fast), ground="flat", see_ground=False)
    made = ManagerBasedRlEnv(environment(task, 2, play=True), device="cpu")
    made.reset()
    yield made
    made.close()


def wheels(values: torch.Tensor) -> torch.Tensor:
    """Values of the joints of the four wheels, shape (worlds, 4)."""
    return values[:, 3::4]


def observed(env: Any, group: str) -> dict[str, torch.Tensor]:
    """What a group of observations shows, by term."""
    manager = env.observation_manager
    seen = manager.compute_group(group, update_history=True)
    sizes = [size for (size,) in manager.group_obs_term_dim[group]]
    return dict(zip(manager.active_terms[group], seen.split(sizes, dim=1), strict=True))


def sent(env: Any, actions: torch.Tensor) -> Any:
    """Data of the robot after its targets of an action are set."""
    env.action_manager.process_action(actions)
    env.action_manager.apply_action()
    return env.scene["robot"].data


def test_a_robot_on_driven_wheels_has_joints_that_roll_and_a_speed_of_rolling() -> None:
    design = draft.load("wheeled").resolve()
    found = legged_robot(design)
    assert found.rolls == (False, False, False, True) * 4
    assert found.turned == (0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14)
    assert found.top_speed == scalar(rolling_speed(design))
    assert not found.is_quadruped
    again = LeggedRobot.from_dict(found.as_dict())
    assert again == found
    assert "rolls" not in member().as_dict()


def test_targets_of_wheels_are_shares_of_their_no_load_speed_and_others_are_angles(
    env: Any, wheeled: LeggedRobot
) -> None:
    data = sent(env, torch.full((2, 16), 2.0))
    expected = torch.tensor([2 * 0.1 * 45.0, 2 * 0.1 * 90.0])[:, None].expand(2, 4)
    torch.testing.assert_close(wheels(data.joint_vel_target), expected)
    hinges = list(wheeled.turned)
    angles = torch.tensor(wheeled.home)[hinges] + 2 * 0.175 - data.encoder_bias[:, hinges]
    torch.testing.assert_close(data.joint_pos_target[:, hinges], angles)
    assert not data.joint_vel_target[:, hinges].any()


@pytest.mark.parametrize("share", [-1.5, -1.0, -0.5, 0.0, 0.5, 0.9, 1.0])
def test_the_servo_of_a_wheel_keeps_to_the_line_of_its_motor(env: Any, share: float) -> None:
    robot = env.scene["robot"]
    speed = share * robot.no_load_speed
    line = min(1.0, 1.0 - share), max(-1.0, -1.0 - share)
    for target in (-9.0, -0.5, 0.5, 9.0):
        # Wheels have turned by any angle, which no spring knows.
        turned = robot.data.default_joint_pos + 50.0 * torch.tensor([0.0, 0.0, 0.0, 1.0] * 4)
        stand(env, lift=3.0, joints=turned, speeds=speed)
        sent(env, target * 10 * torch.ones(2, 16))
        env.scene.write_data_to_sim()
        env.sim.forward()
        peak, fastest = wheels(robot.peak_torque), wheels(robot.no_load_speed)
        wanted = 0.071 * peak * (target - share) * fastest
        bounded = wanted.clamp(line[1] * peak, line[0] * peak)
        found = wheels(robot.data.qfrc_actuator)
        torch.testing.assert_close(found, bounded, rtol=1e-4, atol=1e-3)


def test_the_angle_of_a_wheel_is_in_no_observation_and_its_speed_is(
    env: Any, wheeled: LeggedRobot
) -> None:
    home = torch.tensor(wheeled.home)
    turned = home + torch.tensor([0.0, 0.0, 0.0, 2.0] * 4)
    for group, more in (("actor", {}), ("critic", FEET)):
        stand(env)
        before = observed(env, group)
        assert {name: x.shape[1] for name, x in before.items()} == LAYOUT | {
            "joint_vel": 16,
            "actions": 16,
            **more,
        }
        stand(env, joints=turned)
        after = observed(env, group)
        for name, values in after.items():
            torch.testing.assert_close(values, before[name], atol=1e-3, rtol=1e-3)
        stand(env, speeds=torch.tensor([0.0, 0.0, 0.0, 5.0] * 4))
        rolling = wheels(observed(env, group)["joint_vel"])
        torch.testing.assert_close(rolling, torch.full((2, 4), 5.0))


def test_rolling_far_costs_no_reward(env: Any, wheeled: LeggedRobot) -> None:
    ask(env, vx=1.0)
    manager = env.reward_manager
    names = manager.active_terms
    assert not {"air_time", "clearance"} & {*names}
    robot = env.scene["robot"]
    far = torch.tensor(wheeled.home) + torch.tensor([0.0, 0.0, 0.0, 300.0] * 4)
    at = torch.tensor([0.0, 0.0, wheeled.height])
    place(
        env, at, linear=(1.0, 0.0, 0.0), joints=far, speeds=torch.tensor([0, 0, 0, 1 / RADIUS] * 4)
    )
    contact = robot.data.site_lin_vel_w[:, robot.foot_sites, 0] - RADIUS * wheels(
        robot.data.joint_vel
    )
    torch.testing.assert_close(contact, torch.zeros(2, 4), atol=1e-4, rtol=0)  # No slip.
    for _ in range(2):  # The action before was another.
        env.action_manager.process_action(torch.zeros(2, 16))
    manager.compute(dt=env.step_dt)
    found = dict(zip(names, (manager._step_reward[0]).tolist(), strict=True))
    assert found["linear_velocity"] == pytest.approx(1.0, abs=1e-3)
    for name in ("joint_limits", "vertical_velocity", "upper_legs", "action_rate"):
        assert found[name] == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("stage", ["base", "velocity", "terrain", "push"])
def test_no_stage_brings_rewards_of_steps_to_wheels(wheeled: LeggedRobot, stage: str) -> None:
    assert stage in STAGES
    on_feet, on_wheels = (
        environment(Task((one,), stage, ground="uneven"), 2).rewards for one in (member(), wheeled)
    )
    assert {*on_feet} - {*on_wheels} == {"air_time", "clearance"}
    assert {*on_wheels} <= {*on_feet}


def test_wheels_turn_the_robot_along_by_their_radius(env: Any) -> None:
    """Without slip the speed is that of the rim, here from the actions to the ground."""
    env.reset()
    stand(env)
    forward = torch.zeros(2, 16)
    forward[:, 3::4] = torch.tensor([1.0, 0.5])[:, None] * 1.5  # Both the same speed.
    robot = env.scene["robot"]
    for _ in range(75):
        env.step(forward)
    rims = RADIUS * wheels(robot.data.joint_vel).mean(1)
    torch.testing.assert_close(robot.data.root_link_lin_vel_b[:, 0], rims, atol=0.05, rtol=0)
    # The servo is a damper of 0.071 of the peak torque: rolling freely it is at its target.
    np.testing.assert_allclose(rims.numpy(), 1.5 * 4.5 * RADIUS, rtol=0.1)


def test_robots_on_feet_observe_and_act_as_before(flat: Any) -> None:
    for group, more in (("actor", {}), ("critic", FEET)):
        manager = flat.observation_manager
        sizes = [size for (size,) in manager.group_obs_term_dim[group]]
        layout = dict(zip(manager.active_terms[group], sizes, strict=True))
        assert list(layout.items()) == [*LAYOUT.items(), ("height_scan", 187), *more.items()]
    action = flat.action_manager.get_term("joint_pos")
    assert (type(action).__name__, action.scale) == ("Targets", 0.175)
    robot = flat.scene["robot"]
    for actuator in robot.actuators:
        gains = actuator.stiffness / robot.peak_torque[:, actuator.target_ids]
        torch.testing.assert_close(gains, torch.full_like(gains, 1.43))
