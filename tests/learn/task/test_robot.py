"""The robot in mjlab: torque-speed line, gains and numbers of every world."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

pytest.importorskip("mjlab")
import numpy as np
import torch

from tests.learn.task.states import each, stand

TORQUE, SPEED = (72.0, 450.0, 332.0), (40.0, 11.31, 3.93)
# Speeds per no-load speed: driving, braking, and beyond no-load speed.
SHARES = (-3.0, -2.0, -1.5, -1.0, -0.5, 0.0, 0.25, 0.5, 0.99, 1.0, 1.5, 2.0, 3.0)


@pytest.fixture(scope="module", params=range(3), ids=["cheetah", "bear", "giraffe"])
def alone(request: pytest.FixtureRequest, build: Any, members: Any) -> Any:
    """Each design in a simulation of its own."""
    return build(2, members=(members[request.param],), ground="flat")


def torques(env: Any, share: float, ask: float) -> tuple[torch.Tensor, torch.Tensor]:
    """Torques that reach the joints, and the speed, at a share of the no-load speed.

    The target is so far off that the PD law asks for `ask` times the peak torque.
    """
    robot = env.scene["robot"]
    speed = share * robot.no_load_speed
    stand(env, lift=3.0, speeds=speed)
    far = (ask * robot.peak_torque + robot.peak_torque * 0.071 * speed) / (1.43 * robot.peak_torque)
    robot.set_joint_position_target(robot.data.default_joint_pos + far)
    env.scene.write_data_to_sim()
    env.sim.forward()
    return robot.data.qfrc_actuator.clone(), speed


@pytest.mark.parametrize("share", SHARES)
def test_torque_is_clipped_by_the_torque_speed_line_and_its_mirror(
    alone: Any, share: float
) -> None:
    peak = alone.scene["robot"].peak_torque
    # Beyond twice the no-load speed the line is not drawn out further.
    held = max(-2.0, min(2.0, share))
    most, least = min(1.0, 1.0 - held), max(-1.0, -1.0 - held)
    for ask in (-5.0, 5.0):
        found, _ = torques(alone, share, ask)
        expected = most if ask > 0 else least
        torch.testing.assert_close(found, expected * peak, rtol=1e-4, atol=1e-2)


@pytest.mark.parametrize(("share", "ask"), [(0.0, 0.5), (0.4, 0.3), (0.4, -0.9), (-0.4, 0.9)])
def test_within_the_line_the_pd_law_holds(alone: Any, share: float, ask: float) -> None:
    found, _ = torques(alone, share, ask)
    peak = alone.scene["robot"].peak_torque
    torch.testing.assert_close(found, ask * peak, rtol=1e-3, atol=1e-2)


def test_each_joint_has_the_line_of_its_own_motor(build: Any, members: Any) -> None:
    torque, speed = (72.0, 60.0, 50.0) * 4, (40.0, 30.0, 20.0) * 4
    mixed = replace(members[0], peak_torque=torque, no_load_speed=speed)
    found, speeds = torques(build(2, members=(mixed,), ground="flat"), 0.25, 5.0)
    torch.testing.assert_close(found, 0.75 * torch.tensor(torque).expand(2, 12))
    torch.testing.assert_close(speeds, 0.25 * torch.tensor(speed).expand(2, 12))


def test_a_motor_with_a_corner_has_its_peak_torque_up_to_there(build: Any, members: Any) -> None:
    corner = tuple(0.5 * speed for speed in members[0].no_load_speed)
    cornered = replace(members[0], corner_speed=corner)
    env = build(2, members=(cornered,), ground="flat")
    robot = env.scene["robot"]
    torch.testing.assert_close(robot.stall_torque, 2 * robot.peak_torque)
    for share, most in ((0.0, 1.0), (0.49, 1.0), (0.75, 0.5), (1.0, 0.0), (-1.0, 1.0)):
        found, _ = torques(env, share, 5.0)
        torch.testing.assert_close(found, most * robot.peak_torque, rtol=1e-4, atol=1e-2)
    state = robot.numbers()
    older = {name: x for name, x in state.items() if name != "stall_torque"}
    robot.restore(older)
    torch.testing.assert_close(robot.stall_torque, robot.peak_torque)


def test_every_world_has_the_numbers_of_its_design(flat: Any) -> None:
    robot, members = flat.scene["robot"], flat.scene["robot"].cfg.members
    assert robot.member.tolist() == [0, 1, 2] * 4
    for name, values in (("peak_torque", TORQUE), ("no_load_speed", SPEED)):
        expected = each(flat, values)[:, None].expand(-1, 12)
        torch.testing.assert_close(getattr(robot, name), expected, rtol=0.01, atol=0)
    for world, member in enumerate([*members] * 4):
        ranges = torch.tensor(member.ranges)
        torch.testing.assert_close(robot.data.joint_pos_limits[world], ranges)
        soft = robot.data.soft_joint_pos_limits[world]
        middle = ranges.mean(1)
        torch.testing.assert_close(soft.mean(1), middle)
        torch.testing.assert_close(soft[:, 1] - soft[:, 0], 0.9 * (ranges[:, 1] - ranges[:, 0]))
        torch.testing.assert_close(robot.data.default_joint_pos[world], torch.tensor(member.home))
        assert float(robot.height[world]) == pytest.approx(member.height)
        assert float(robot.top_speed[world]) == pytest.approx(member.top_speed)


def test_the_model_is_loaded_as_it_was_written(build: Any, members: Any) -> None:
    import mujoco

    written: Any = mujoco.MjModel.from_xml_string(members[0].xml)
    model = build(2, members=members[:1], ground="flat").sim.mj_model
    ids = [model.body(f"robot/{written.body(i).name}").id for i in range(1, written.nbody)]
    for field in ("body_mass", "body_pos", "body_quat", "body_ipos", "body_inertia"):
        ours, theirs = getattr(model, field)[ids], getattr(written, field)[1:]
        np.testing.assert_array_equal(ours, theirs, field)
    for field in ("dof_armature", "dof_frictionloss", "dof_damping"):
        np.testing.assert_array_equal(getattr(model, field), getattr(written, field), field)
    np.testing.assert_array_equal(model.jnt_range, written.jnt_range)


def test_only_feet_and_thighs_meet_the_ground_and_nothing_meets_the_robot(flat: Any) -> None:
    model, first = flat.sim.mj_model, flat.scene["robot"].cfg.members[0]
    thighs = {geom for leg in first.upper_legs for geom in leg}
    for i in range(model.ngeom):
        name = model.geom(i).name.removeprefix("robot/")
        if name in first.foot_geoms or name in thighs:
            assert (model.geom_contype[i], model.geom_conaffinity[i]) == (0, 1)
            assert model.geom_condim[i] == 3
            assert model.geom_priority[i] == (name in first.foot_geoms)
        elif name != "terrain":
            assert (model.geom_contype[i], model.geom_conaffinity[i]) == (0, 0), name
