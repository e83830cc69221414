"""Contacts, motors and friction that differ between worlds, and targets that arrive late."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("mjlab")
pytest.importorskip("mjbatch")
import torch

from draft.learn.bodies.legged import LeggedRobot
from draft.learn.engine.worlds.simulate import make
from draft.learn.task.config import Config
from draft.learn.task.mdp.environment import environment
from draft.learn.task.mdp.world_models import redraw
from draft.learn.task.world.task import Task
from draft.learn.training.ppo.snapshot import capture, restore
from tests.learn.conftest import WORLDS
from tests.learn.task.states import place

ERRORS = {
    "episodes.contact_time": (0.01, 0.02),
    "episodes.delay": (0.005, 0.015),
    "episodes.motor": (0.9, 1.1),
    "episodes.joint_friction": (0.0, 0.05),
}


def built(members: tuple[LeggedRobot, ...]) -> Any:
    task = Task(members, ground="flat", config=Config().with_values(ERRORS))
    made = make(environment(task, WORLDS), "cpu", "native")
    made.reset()
    return made


@pytest.fixture(scope="module")
def env(members: tuple[LeggedRobot, ...]) -> Any:
    return built(members)


@pytest.fixture
def robot(env: Any) -> Any:
    return env.scene["robot"]


def send(env: Any, value: float) -> list[torch.Tensor]:
    """Joint targets at the physics steps of one action, per action unit above home."""
    term = env.action_manager.get_term("joint_pos")
    robot = env.scene["robot"]
    term.process_actions(torch.full((env.num_envs, 12), value))
    targets = []
    for _ in range(env.cfg.decimation):
        term.apply_actions()
        data = robot.data
        targets.append((data.joint_pos_target - data.default_joint_pos + data.encoder_bias) / 0.175)
    return targets


def test_without_errors_there_are_no_terms_for_them(flat: Any) -> None:
    names = [name for names in flat.event_manager.active_terms.values() for name in names]
    assert not {"contact_time", "motor_errors"} & set(names)
    assert type(flat.action_manager.get_term("joint_pos")).__name__ == "Targets"


def test_the_feet_of_a_world_share_one_contact_time(env: Any, robot: Any) -> None:
    feet = [env.sim.mj_model.geom(f"robot/{n}").id for n in robot.cfg.members[0].foot_geoms]
    times = env.sim.model.geom_solref[:, feet, 0]
    assert (times == times[:, :1]).all()
    assert len(times[:, 0].unique()) == env.num_envs
    assert times.min() >= 0.01 - 1e-6
    assert times.max() <= 0.02 + 1e-6
    others = [i for i in range(env.sim.mj_model.ngeom) if i not in feet]
    assert (env.sim.model.geom_solref[:, others, 0] == 0.02).all()


def test_a_target_arrives_after_the_delay_of_its_world(env: Any) -> None:
    env.reset(seed=0)
    delay = env.action_manager.get_term("joint_pos")._delay
    assert delay.min() >= 0.005
    assert delay.max() <= 0.015
    assert len(delay.unique()) == env.num_envs
    home = torch.zeros(env.num_envs, 12)
    for before, now in ((home, 1.0), (home + 1.0, -0.5)):
        for step, targets in enumerate(send(env, now)):
            late = step * 0.005 < delay - 1e-6
            expected = torch.where(late[:, None], before, torch.tensor(now))
            torch.testing.assert_close(targets, expected, atol=1e-5, rtol=0)


def test_a_reset_draws_another_delay_for_those_worlds_alone(env: Any) -> None:
    term = env.action_manager.get_term("joint_pos")
    before = term._delay.clone()
    term.reset(torch.tensor([1, 4]))
    changed = (term._delay != before).nonzero().flatten()
    assert changed.tolist() == [1, 4]


def test_a_motor_gives_its_factor_of_every_torque(env: Any, robot: Any) -> None:
    place(env, (0, 0, 3))
    factors = robot._motors
    assert len(factors.unique()) == factors.numel()
    assert ((factors >= 0.9) & (factors <= 1.1)).all()
    found = torch.zeros_like(factors)
    for offset, expected in (
        (0.01, 0.01 * robot.cfg.actuation.stiffness * robot.peak_torque),
        (100.0, robot.peak_torque),
    ):
        robot.data.joint_pos_target[:] = robot.data.joint_pos + offset
        robot.write_data_to_sim()
        found[:] = env.sim.data.ctrl
        torch.testing.assert_close(found, factors * expected, rtol=1e-4, atol=1e-4)


def test_friction_is_viscous_and_on_top_of_that_of_the_design(env: Any, robot: Any) -> None:
    at = robot.indexing.joint_v_adr
    added = env.sim.model.dof_damping[:, at] - env.sim.get_default_field("dof_damping")[..., at]
    share = added * robot.no_load_speed / robot.peak_torque
    assert (share >= -1e-6).all()
    assert (share <= 0.05 + 1e-6).all()
    assert share.max() > 0.04
    assert len(share.unique()) == share.numel()


def test_a_world_with_another_design_keeps_its_errors(env: Any, robot: Any) -> None:
    factors, worlds = robot._motors.clone(), torch.tensor([0, 3])
    term = env.event_manager.get_term_cfg("motor_errors").func
    bear = robot.cfg.members[1]
    redraw(env, worlds, [bear, bear])
    (motors,) = robot.actuators[:1]
    limit = motors.force_limit[worlds]
    torques = torch.tensor(bear.peak_torque, dtype=torch.float32)[motors.target_ids]
    torch.testing.assert_close(limit, factors[worlds][:, motors.target_ids] * torques)
    at = robot.indexing.joint_v_adr
    added = env.sim.model.dof_damping[:, at] - env.sim.get_default_field("dof_damping")[..., at]
    expected = term._friction * robot.peak_torque / robot.no_load_speed
    torch.testing.assert_close(added, expected.to(added.dtype), atol=1e-5, rtol=1e-5)


def test_a_saved_state_has_the_delays_and_what_is_under_way(
    env: Any, members: tuple[LeggedRobot, ...]
) -> None:
    env.reset(seed=1)
    torch.manual_seed(5)
    for _ in range(3):
        env.step(0.5 * torch.randn(env.num_envs, 12))
    state = capture(env)
    other = built(members)
    restore(other, state)
    for _ in range(4):
        action = 0.5 * torch.randn(env.num_envs, 12)
        (one, *_), (two, *_) = env.step(action), other.step(action)
        torch.testing.assert_close(one["critic"], two["critic"], atol=0, rtol=0)
