"""Reward terms in known states, for all three designs at once."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("mjlab")
import torch

from draft.learn.task.constants import Scaled
from draft.learn.task.groups import Rewards
from draft.learn.task.mdp import rewards
from tests.changed_package import ChangedPackage
from tests.learn.task.states import ask, each, first, place, roots, stand, turn, value

TILT = 0.3


def near(found: torch.Tensor, expected: Any, tolerance: float = 1e-5) -> None:
    expected = torch.as_tensor(expected, dtype=torch.float32).expand_as(found)
    torch.testing.assert_close(found, expected, rtol=tolerance, atol=tolerance)


@pytest.mark.parametrize(
    ("axis", "angle", "tilt"),
    [("z", 0.0, 0.0), ("z", 2.0, 0.0), ("x", TILT, TILT), ("y", TILT, TILT)],
)
def test_an_upright_robot_gets_1_and_a_tilted_one_less(
    flat: Any, axis: str, angle: float, tilt: float
) -> None:
    stand(flat, quat=turn(axis, angle))
    sigma = 0.45 / roots(flat)
    near(value(flat, "upright"), torch.exp(-(math.sin(tilt) ** 2) / sigma**2))


def test_a_robot_along_a_slope_is_upright(base: Any) -> None:
    origins = base.scene.terrain.terrain_origins
    column = list(base.scene.terrain.cfg.terrain_generator.sub_terrains).index("slope")
    origin = origins[5, column]
    x, y = torch.meshgrid(
        torch.linspace(-0.8, 0.8, 17), torch.linspace(-0.5, 0.5, 11), indexing="ij"
    )
    points = torch.stack((x, y), dim=-1).reshape(-1, 2)
    aside = torch.tensor([2.0125, 0.0125, 1.0])  # In the middle of the map's cells.
    heights = base.scene["ground"].ground(points + origin[:2] + aside[:2])
    # The plane of least squares; nearly all of its slope is along x.
    sides = torch.cat((points, torch.ones(len(points), 1)), dim=1)
    plane = torch.linalg.lstsq(sides, heights[:, None]).solution[:, 0]
    slope = float(plane[:2].norm())
    assert slope > 0.2
    tilt = math.atan(slope)
    axis = torch.tensor([float(plane[1]), -float(plane[0]), 0.0]) / slope
    quat = torch.cat((torch.tensor([math.cos(tilt / 2)]), math.sin(tilt / 2) * axis))
    place(base, origin + aside, quat=quat)
    near(value(base, "upright"), 1.0, 1e-3)
    place(base, origin + aside)
    sigma = 0.45 / roots(base)
    near(value(base, "upright"), torch.exp(-(math.sin(tilt) ** 2) / sigma**2), 1e-3)


def test_tracking_of_the_velocity_is_taken_in_the_trunks_frame(flat: Any) -> None:
    ask(flat, 0.5, 0.2)
    # Turned to the left by a quarter: forwards is the world's y.
    stand(flat, quat=turn("z", math.pi / 2), linear=(-0.4, 0.3, 0.1))
    error = (0.5 - 0.3) ** 2 + (0.2 - 0.4) ** 2 + 0.1**2
    sigma = 0.5 * roots(flat)
    near(value(flat, "linear_velocity"), torch.exp(-error / sigma**2))
    ask(flat, 0.3, 0.4)
    stand(flat, quat=turn("z", math.pi / 2), linear=(-0.4, 0.3, 0.0))
    near(value(flat, "linear_velocity"), 1.0)


def test_tracking_of_the_yaw_rate_counts_roll_and_pitch_rates(flat: Any) -> None:
    ask(flat, wz=0.4)
    stand(flat, quat=turn("z", 1.0), angular=(0.0, 0.0, 0.4))
    near(value(flat, "angular_velocity"), 1.0)
    stand(flat, quat=turn("z", 1.0), angular=(0.1, 0.2, 0.1))
    sigma = 0.5 / roots(flat)
    error = 0.3**2 + 0.1**2 + 0.2**2
    near(value(flat, "angular_velocity"), torch.exp(-error / sigma**2))


def test_the_height_is_that_above_the_ground_on_a_mound_as_on_flat_ground(base: Any) -> None:
    generator = base.scene.terrain.cfg.terrain_generator
    target, sigma = 0.43 * roots(base) ** 2, 0.11 * roots(base) ** 2
    tops = []
    for name in ("flat", "stairs", "stairs_pit"):
        origin = base.scene.terrain.terrain_origins[-1, list(generator.sub_terrains).index(name)]
        tops.append(float(origin[2]))
        for above in (0.0, 0.05):
            at = origin.expand(base.num_envs, 3).clone()
            at[:, 2] += target + above
            place(base, at)
            near(value(base, "height"), torch.exp(-((above / sigma) ** 2)), 1e-4)
    assert tops[0] == pytest.approx(0, abs=1e-3)
    assert tops[1] > 0.5 > -0.5 > tops[2]


def test_feet_in_the_air_count_while_it_is_short(flat: Any) -> None:
    time = flat.scene["feet_contact"]._air_time_state.current_air_time
    most = 0.35 * roots(flat)
    ask(flat, 1.0)
    stand(flat, lift=1.0)
    time[:, 0], time[:, 1] = 0.0, 0.01
    time[:, 2], time[:, 3] = most - 0.01, most + 0.01
    near(value(flat, "air_time"), 2.0)


def test_a_falling_robots_feet_are_in_the_air_for_as_long_as_it_falls(flat: Any) -> None:
    ask(flat, 1.0)
    stand(flat, lift=1.0)
    for _ in range(8):
        flat.sim.step()
        flat.scene.update(dt=0.005)
    time = flat.scene["feet_contact"].data.current_air_time
    near(time, 0.04, 1e-4)
    near(value(flat, "air_time"), 4.0)


@pytest.mark.parametrize("part", [(1.0, 0.0, 0.0), (0.6, -0.8, 0.0), (0.0, 0.0, -1.0)])
def test_air_time_and_clearance_need_a_command_to_move(flat: Any, part: Any) -> None:
    stand(flat, lift=0.3, linear=(0.5, 0.0, 0.0))
    flat.scene["feet_contact"]._air_time_state.current_air_time[:] = 0.1
    for name, gate in (("air_time", 0.1 * roots(flat)), ("clearance", 0.05)):
        for factor, moves in ((0.98, False), (1.02, True)):
            ask(flat, *(p * gate * factor for p in part))
            assert ((value(flat, name) > 0) == moves).all(), (name, factor)


def test_clearance_is_the_miss_of_each_foot_times_its_speed(flat: Any) -> None:
    ask(flat, 1.0)
    s = roots(flat) ** 2
    robot = flat.scene["robot"]
    stand(flat, lift=0.3, linear=(0.3, -0.4, 0.7))
    # Higher than 1 m is not told apart.
    heights = robot.data.site_pos_w[:, robot.foot_sites, 2].clamp(0.0, 1.0)
    cost = (heights - 0.10 * s[:, None]).abs().sum(1) * 0.5
    assert (cost > 0.1).all()
    near(value(flat, "clearance"), cost * s**-1.5)
    stand(flat, lift=0.3)
    near(value(flat, "clearance"), 0.0)


def test_vertical_velocity_is_squared_in_the_trunks_frame(flat: Any) -> None:
    s = roots(flat) ** 2
    stand(flat, linear=(0.0, 0.0, -0.5))
    near(value(flat, "vertical_velocity"), 0.25 / s)
    stand(flat, quat=turn("y", math.pi / 2), linear=(0.5, 0.0, 0.0))
    near(value(flat, "vertical_velocity"), 0.25 / s)


def test_joint_limits_add_up_what_is_past_the_soft_limits(flat: Any) -> None:
    ranges = flat.scene["robot"].data.joint_pos_limits
    middle, half = ranges.mean(-1), (ranges[..., 1] - ranges[..., 0]) / 2
    soft = middle + 0.9 * half
    joints = middle.clone()
    stand(flat, joints=joints)
    near(value(flat, "joint_limits"), 0.0)
    joints[:, 0] = soft[:, 0] + 0.05
    joints[:, 4] = 2 * middle[:, 4] - soft[:, 4] - 0.02
    joints[:, 8] = soft[:, 8] - 0.01
    stand(flat, joints=joints)
    near(value(flat, "joint_limits"), 0.07)


def test_upper_legs_count_those_that_touch_the_ground(flat: Any) -> None:
    stand(flat)
    near(value(flat, "upper_legs"), 0.0)
    place(flat, (0.0, 0.0, 0.02))
    near(value(flat, "upper_legs"), 4.0)
    # On its right side, so that the left legs are in the air.
    place(flat, (0.0, 0.0, 0.1), quat=turn("x", math.pi / 2))
    near(first(flat, value(flat, "upper_legs")), 2.0)
    place(flat, (0.0, 0.0, 3.0), quat=turn("x", math.pi / 2))
    near(value(flat, "upper_legs"), 0.0)


def test_thighs_that_touch_each_other_do_not_count(flat: Any) -> None:
    # Rolled inwards so that left and right thighs cross, high above the ground.
    joints = flat.scene["robot"].data.default_joint_pos.clone()
    member = flat.cfg.scene.entities["robot"].members[0]
    for leg, joint in zip(member.leg_joints, member.mirror_sign[::3], strict=True):
        joints[:, leg[0]] = 0.8 if joint > 0 else -0.8
    stand(flat, lift=2.0, joints=joints)
    near(value(flat, "upper_legs"), 0.0)
    near(flat.scene["feet_contact"].data.found.float(), 0.0)


def test_action_rate_is_the_squared_change_of_the_raw_action(flat: Any) -> None:
    flat.action_manager.process_action(torch.full((flat.num_envs, 12), 0.5))
    flat.action_manager.process_action(torch.full((flat.num_envs, 12), 0.2))
    near(value(flat, "action_rate"), 12 * 0.3**2)
    flat.action_manager.process_action(torch.full((flat.num_envs, 12), 0.2))
    near(value(flat, "action_rate"), 0.0)


CAPS = (3.678, 4.519, 2.661)  # v_cap = 1.5 v_est [m/s] (study, section 11).


def test_speed_counts_up_to_the_cap_in_the_commanded_direction(velocity: Any) -> None:
    cap = each(velocity, CAPS)
    ask(velocity, -0.6 * cap)
    for share, gets in ((-0.5, 0.5), (-1.5, 1.0), (0.5, 0.0)):
        stand(velocity, lift=1.0, linear=_along_x(share * cap))
        near(value(velocity, "speed"), gets, 1e-3)
    ask(velocity, -0.49 * cap)
    stand(velocity, lift=1.0, linear=_along_x(-0.5 * cap))
    near(value(velocity, "speed"), 0.0)


def test_the_velocity_stage_tracks_with_a_width_of_its_cap(velocity: Any) -> None:
    cap = each(velocity, CAPS)
    ask(velocity, 5.0, 0.1)
    stand(velocity, lift=1.0, linear=(4.0, 0.0, 0.2))
    error = 1.0**2 + 0.1**2 + 0.2**2
    near(value(velocity, "linear_velocity"), torch.exp(-error / (0.4 * cap) ** 2), 1e-3)


def _along_x(speed: torch.Tensor) -> torch.Tensor:
    return torch.stack((speed, 0 * speed, 0 * speed), dim=1)


def test_the_push_stage_tracks_with_the_same_width_for_all(push: Any) -> None:
    ask(push, 1.0)
    stand(push, linear=(0.6, 0.0, 0.0))
    near(value(push, "linear_velocity"), math.exp(-(0.4**2) / 0.5**2))


def test_the_terrain_stage_tracks_narrower_where_commands_are_held(terrain: Any) -> None:
    ask(terrain, 0.5)
    place(terrain, (0.0, 0.0, 5.0), linear=(0.2, 0.0, 0.0))
    held = each(terrain, (1.0, 1.0, 0.5 * 1.77356 / 1.645701))
    sigma = 0.5 * roots(terrain) * held
    near(value(terrain, "linear_velocity"), torch.exp(-(0.3**2) / sigma**2), 1e-4)


def test_a_step_is_rewarded_by_weight_value_and_time(flat: Any) -> None:
    ask(flat, 0.5)
    stand(flat, quat=turn("x", TILT), linear=(0.2, 0.0, 0.3))
    manager = flat.reward_manager
    total = sum(
        manager.get_term_cfg(name).weight * value(flat, name) for name in manager.active_terms
    )
    near(manager.compute(dt=0.02), 0.02 * torch.as_tensor(total))


# --- the recipe of CONTRIBUTING ------------------------------------------------------------

FUNCTION = '''

@reward(limit="still_limit")
def still(env: ManagerBasedRlEnv, limit: Scaled) -> torch.Tensor:
    """Whether the trunk is slower than `limit` [m/s]."""
    robot = robot_of(env)
    return (robot.data.root_link_lin_vel_b.norm(dim=1) < robot.scaled(limit)).float()
'''
NUMBERS = """    still_weight: float = choice(0.25, "1", "a trunk at rest", DRAFT)
    still_limit: float = choice(0.1, "m/s", "its largest speed", DRAFT, 0.5)
"""
PROGRAM = """
import json

import torch
from mjlab.envs import ManagerBasedRlEnv

from draft.design.references import open_designs
from draft.learn.task.config import STAGES
from draft.learn.task.world.task import Task
from draft.learn.task.mdp.environment import environment
from draft.learn.bodies.legged import legged_robot

members = (legged_robot(open_designs(["cheetah"])[0]),)
stages = [s for s in STAGES if "still" in environment(Task(members, s, ground="flat"), 1).rewards]
env = ManagerBasedRlEnv(environment(Task(members, ground="flat"), 2), "cpu")
env.reset()
env.sim.data.qvel[1, 0] = 0.2
env.sim.forward()
env.reward_manager.compute(dt=env.step_dt)
column = env.reward_manager.active_terms.index("still")
values = env.reward_manager._step_reward[:, column].tolist()
print(json.dumps({"stages": stages, "values": values}))
"""


def test_a_reward_is_added_by_a_function_and_its_numbers(tmp_path: Path) -> None:
    inserted = {
        "learn/task/mdp/rewards.py": {"\n\ndef reward_cfgs(": FUNCTION},
        # What follows `Rewards`.
        "learn/task/groups.py": {"\n\n@dataclass(frozen=True)\nclass Episodes": NUMBERS},
    }
    found = ChangedPackage(tmp_path, inserted).run("-c", PROGRAM)
    stages = ["base", "velocity", "terrain", "push", "any"]
    assert found == {"stages": stages, "values": [0.25, 0.0]}


def test_a_reward_without_its_numbers_or_with_a_used_name_is_refused() -> None:
    def height(env: Any) -> torch.Tensor:
        return torch.zeros(env.num_envs)

    for wrong, words in (
        (rewards.reward(), "there is a reward 'height' already: rename one"),
        (
            rewards.reward("still"),
            "reward 'still': config.Rewards has no number 'still_weight': add its line there",
        ),
        (
            rewards.reward("still", weight="height_weight", limit="still_limit"),
            "has no number 'still_limit'",
        ),
    ):
        with pytest.raises(ValueError, match=words):
            wrong(height)
    assert "still" not in rewards.REWARDS
    # Numbers of a reward are those of the configuration.
    term = rewards.REWARDS["height"].cfg(Rewards(height_weight=0.7, height=0.5))
    assert (term.func, term.weight) == (rewards.height, 0.7)
    assert term.params == {"target": Scaled(0.5, 1.0), "sigma": Scaled(0.11, 1.0)}


def test_power_is_that_of_motors_and_heat_per_weight_and_command(flat: Any) -> None:
    stand(flat)
    flat.step(torch.linspace(-3, 3, 12).expand(flat.num_envs, 12))
    torque, speed = flat.sim.data.qfrc_actuator[:, 6:], flat.sim.data.qvel[:, 6:]
    assert (torque * speed < 0).any()  # Some brake, and return nothing.
    robots = flat.scene["robot"].cfg.members
    # The cheetah's module at its rated torque: a cylinder of 63 mm by 46 mm, 900 W/m2.
    assert robots[0].motor_heat[0] == pytest.approx(900 * 0.043146 / 24.777**2, rel=1e-3)
    loss = torch.tensor([m.motor_heat for m in robots])
    heat = torque.square() * loss[flat.scene["robot"].member]
    watts = ((torque * speed).clamp(min=0.0) + heat).sum(1)
    weight = each(flat, [9.81 * m.mass for m in robots])
    for asked, counted in ((2.0, torch.tensor(2.0)), (0.0, 0.5 * roots(flat))):
        ask(flat, asked)
        near(rewards.power(flat, Scaled(0.5, 0.5)), watts / (weight * counted))
