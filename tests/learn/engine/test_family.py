"""Families: many designs in one simulation are what each is alone."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest

pytest.importorskip("mjlab")

import mujoco
import numpy as np
import torch
from mjlab.envs import ManagerBasedRlEnv

import draft
from draft.design.references import open_designs
from draft.errors import DraftError
from draft.learn.bodies.designs import family
from draft.learn.bodies.features import FEATURES, family_features, features
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.engine.worlds.simulate import make
from draft.learn.task.config import Config
from draft.learn.task.mdp.environment import environment
from draft.learn.task.mdp.world_models import ACTUATOR_FIELDS, FIELDS, assume_designs, redraw
from draft.learn.task.world.task import Task
from draft.learn.training.ppo.snapshot import capture, restore
from draft.model.batch import indices, kind_of
from draft.model.batch_text import DERIVED, differences
from draft.model.scene import DAMPING, STIFFNESS
from draft.model.texts import Text
from tests.learn.alone import check_masses, compiled

STEPS, WORLDS, DROP = 40, 8, 0.002
# Nothing is drawn: what is left of the randomisation has no width.
CALM = Config().with_values(
    {
        "episodes.centre": 0.0,
        "episodes.friction": (0.8, 0.8),
        "episodes.encoder": 0.0,
        "episodes.push_linear": (0.0, 0.0, 0.0),
        "episodes.push_angular": (0.0, 0.0, 0.0),
        "episodes.spawn": 0.0,
        "episodes.yaw": 0.0,
        # Feet just at the ground touch it or not, by the last bit of a number.
        "episodes.drop": (DROP, DROP),
        "commands.standing": 1.0,
    }
)
SWEPT = {
    "thigh_length": np.array([0.22, 0.30, 0.36]),
    "shank_length": np.array([0.30, 0.24, 0.36]),
    "trunk_length": np.array([0.50, 0.70, 0.60]),
    "actuators.leg.peak_torque": np.array([60.0, 75.0, 100.0]),
}


@pytest.fixture(scope="module")
def members() -> tuple[LeggedRobot, ...]:
    """Three shipped designs and three of a sweep."""
    swept = draft.load("quadruped").resolve("cheetah", SWEPT)
    return family([*open_designs(["cheetah", "bear", "giraffe"]), swept])


@pytest.fixture(scope="module")
def models(members: tuple[LeggedRobot, ...]) -> list[Any]:
    return compiled(members, CALM)


@pytest.fixture(scope="module")
def env(members: tuple[LeggedRobot, ...]) -> Iterator[Any]:
    """Eight worlds on a plane, without chance; the last two have the first two designs again."""
    made = _env(members, see_design=True)
    yield made
    made.close()


def _env(members: tuple[LeggedRobot, ...], worlds: int = WORLDS, **task: Any) -> Any:
    task = {"config": CALM, "ground": "flat", **task}
    with warnings.catch_warnings():
        # MuJoCo Warp: cylinders and boxes touch in one point only.
        warnings.filterwarnings("ignore", "MULTICCD is enabled", UserWarning)
        play = task.pop("play", False)
        return ManagerBasedRlEnv(environment(Task(members, **task), worlds, play), "cpu")


@pytest.fixture(scope="module")
def alone(members: tuple[LeggedRobot, ...]) -> Iterator[list[Any]]:
    """Each design in two worlds of its own, in the same way."""
    made = [_env((member,), 2) for member in members]
    yield made
    for one in made:
        one.close()


@pytest.mark.parametrize(("engine", "tolerance"), [("native", 1e-9), ("warp", 1e-5)])
def test_every_worlds_mass_matrix_is_that_of_its_own_model(
    env: Any, members: tuple[LeggedRobot, ...], models: list[Any], engine: str, tolerance: float
) -> None:
    if engine == "native":
        pytest.importorskip("mjbatch")
        task = Task(members, config=CALM, ground="flat")
        env = make(environment(task, WORLDS), "cpu", engine)
    check_masses(env, models, tolerance)


def test_every_worlds_numbers_are_those_of_its_own_model(env: Any, models: list[Any]) -> None:
    for world in range(WORLDS):
        _assert_own(env, world, models[0], models[world % 6])


def _assert_own(env: Any, world: int, first: Any, own: Any, tolerance: float = 2e-6) -> None:
    """A world has the numbers of a model; meshes are those of the first."""
    ids = indices(first, env.sim.mj_model, "robot/")
    solid = first.geom_type[ids["own geom"]] != mujoco.mjtGeom.mjGEOM_MESH
    for key in ("geom", "own geom"):
        ids[key] = ids[key][solid]
    # Both are in the order of the joints.
    ids["actuator"] = ids["own actuator"] = np.arange(first.nu)
    for name in (*FIELDS, *(name for name in DERIVED if name != "dof_M0")):
        kind = "actuator" if name.startswith("actuator") else kind_of(name)
        expected = getattr(own, name)[ids[f"own {kind}"]]
        held = getattr(env.sim.model, name)[world].numpy()[ids[kind]].reshape(expected.shape)
        np.testing.assert_allclose(held, expected, rtol=tolerance, atol=2e-7, err_msg=name)


def test_nothing_that_designs_differ_in_is_forgotten(models: list[Any]) -> None:
    found = set().union(*(differences(models[0], model) for model in models[1:]))
    assert found <= {*FIELDS, *DERIVED}
    assert {"body_inertia", "dof_armature", "geom_size", "site_pos", "qpos0"} <= found
    assert set(ACTUATOR_FIELDS) <= found


def test_every_field_is_held_for_each_world(env: Any) -> None:
    for name in (*FIELDS, "body_subtreemass", "body_invweight0", "dof_invweight0"):
        assert getattr(env.sim.wp_model, name).shape[0] == WORLDS, name


def _rollout(env: Any) -> list[torch.Tensor]:
    """Positions about the world's origin, velocities and rewards along a fixed motion."""
    env.reset(seed=0)
    generator = torch.Generator().manual_seed(1)
    found = []
    for _ in range(STEPS):
        action = 2 * torch.rand(12, generator=generator) - 1
        _, reward, fallen, _, _ = env.step(action.expand(env.num_envs, 12).clone())
        assert not fallen.any()
        position = env.sim.data.qpos[:].clone()
        position[:, :3] -= env.scene.env_origins
        found.append(torch.cat((position, env.sim.data.qvel[:], reward[:, None]), dim=1))
    return found


def test_a_rollout_in_the_batch_is_that_of_each_design_alone(
    env: Any, alone: list[Any], members: tuple[LeggedRobot, ...]
) -> None:
    together = torch.stack(_rollout(env))
    assert not torch.allclose(together[:, 0], together[:, 1], atol=0.1)
    for i, (member, own) in enumerate(zip(members, alone, strict=True)):
        error = (together[:, i] - torch.stack(_rollout(own))[:, 0]).abs()
        # Single precision and a solver that stops at 1e-6, through 160 physics steps with
        # contacts: positions of 1 m agree to 1e-5, velocities of 10/s to 1e-3.
        assert error[:, :19].max() < 1e-5, member.name
        assert error[:, 19:37].max() < 1e-3, member.name
        assert error[:, 37].max() < 1e-5, member.name


def _rewards(env: Any) -> dict[str, torch.Tensor]:
    """Every reward term at home, moving, with a command."""
    env.reset(seed=0)
    env.sim.data.qvel[:, :6] = torch.tensor([0.4, 0.1, -0.05, 0.1, -0.2, 0.3])
    env.command_manager.get_command("twist")[:] = torch.tensor([0.5, 0.1, 0.2])
    env.sim.forward()
    env.scene.update(dt=0.0)
    manager = env.reward_manager
    terms = {name: manager.get_term_cfg(name) for name in manager.active_terms}
    return {name: term.func(env, **term.params) for name, term in terms.items()}


def test_rewards_at_home_are_those_of_each_design_alone(env: Any, alone: list[Any]) -> None:
    together = _rewards(env)
    assert len(set(together["height"][:3].tolist())) == 3
    for i, own in enumerate(map(_rewards, alone)):
        for name, values in together.items():
            assert values[i] == pytest.approx(float(own[name][0]), rel=1e-4, abs=1e-6), name


def test_feet_start_just_above_the_ground(env: Any, members: tuple[LeggedRobot, ...]) -> None:
    env.reset(seed=0)
    feet = [env.sim.mj_model.geom(f"robot/{name}").id for name in members[0].foot_geoms]
    lowest = env.sim.data.geom_xpos[:, feet, 2] - env.sim.model.geom_size[:, feet, 0]
    assert lowest.min(dim=1).values.numpy() == pytest.approx(np.full(WORLDS, DROP), abs=2e-6)
    assert len({member.height for member in members}) == len(members)


def test_gains_and_torque_speed_lines_are_each_designs_own(
    env: Any, members: tuple[LeggedRobot, ...]
) -> None:
    (motor,) = env.scene["robot"].actuators
    for world in range(WORLDS):
        member = members[world % 6]
        torque, speed = member.peak_torque[0], member.no_load_speed[0]
        assert motor.stiffness[world].numpy() == pytest.approx(STIFFNESS * torque)
        assert motor.damping[world].numpy() == pytest.approx(DAMPING * torque)
        limits = env.sim.model.actuator_forcerange[world].numpy()
        assert limits == pytest.approx(np.tile([-torque, torque], (12, 1)))
        assert _torque(env, world, 0.5, 0.0) == pytest.approx(0.5 * STIFFNESS * torque, rel=1e-4)
        # Beyond the peak at rest, and at half the no-load speed.
        assert _torque(env, world, 9.0, 0.0) == pytest.approx(torque, rel=1e-4)
        assert _torque(env, world, 9.0, 0.5 * speed) == pytest.approx(0.5 * torque, rel=1e-4)


def _torque(env: Any, world: int, error: float, speed: float) -> float:
    """Torque of the first joint at a distance from its target [rad] and a speed [rad/s]."""
    robot = env.scene["robot"]
    worlds = env.num_envs
    robot.write_joint_state_to_sim(torch.zeros(worlds, 12), torch.full((worlds, 12), speed))
    robot.set_joint_position_target(torch.full((worlds, 12), error))
    env.sim.forward()
    robot.write_data_to_sim()
    return float(env.sim.data.ctrl[world, 0])


def test_a_time_out_is_after_20_root_s_of_each_design(
    env: Any, members: tuple[LeggedRobot, ...]
) -> None:
    env.reset(seed=0)
    term = env.termination_manager.get_term_cfg("time_out")
    steps = torch.tensor([np.ceil(20 * members[i % 6].scale ** 0.5 / 0.02) for i in range(WORLDS)])
    env.episode_length_buf[:] = steps - 1
    assert not term.func(env, **term.params).any()
    env.episode_length_buf[:] = steps
    assert term.func(env, **term.params).all()
    assert env.max_episode_length >= steps.max()
    env.reset(seed=0)


def test_the_first_event_gives_worlds_their_designs_also_where_one_watches(
    members: tuple[LeggedRobot, ...], models: list[Any]
) -> None:
    for play in (False, True):
        made = environment(Task(members, ground="flat"), 2, play=play)
        assert next(iter(made.events)) == "designs"
    watched = _env(members, 2, play=True)
    trunk = watched.sim.mj_model.body("robot/trunk").id
    masses = [float(watched.sim.model.body_mass[world, trunk]) for world in (0, 1)]
    assert masses == pytest.approx([models[0].body_mass[1], models[1].body_mass[1]])
    # What follows from them too, with no other event to work it out anew.
    weight = watched.sim.model.body_invweight0[1, trunk].numpy()
    assert weight == pytest.approx(models[1].body_invweight0[1], rel=1e-5)
    assert "designs" not in environment(Task(members[:1]), 2).events


def test_one_world_has_the_first_design(
    members: tuple[LeggedRobot, ...], models: list[Any]
) -> None:
    model = _env(members[:2], 1).sim.model
    assert model.body_mass[0].sum() == pytest.approx(members[0].mass, rel=1e-5)
    assert model.dof_armature[0, -1] == pytest.approx(models[0].dof_armature[-1])


def test_other_events_work_on_top_of_each_worlds_design(
    members: tuple[LeggedRobot, ...], models: list[Any]
) -> None:
    made = _env(members[:3], 6, config=Config())
    trunk = made.sim.mj_model.body("robot/trunk").id
    feet = [made.sim.mj_model.geom(f"robot/{name}").id for name in members[0].foot_geoms]
    for world in range(6):
        own, scale = models[world % 3].body_ipos[1], members[world % 3].scale
        shift = np.abs(made.sim.model.body_ipos[world, trunk].numpy() - own)
        assert 0 < shift.max() <= 0.02 * scale + 1e-6
        friction = made.sim.model.geom_friction[world, feet, 0]
        assert 0.4 <= friction.min() == friction.max() <= 1.1
    base = made.sim.get_default_field("body_mass")
    assert base[:3, trunk].numpy() == pytest.approx([m.body_mass[1] for m in models[:3]])


def test_a_world_keeps_its_shift_of_the_centre_per_leg_length(
    members: tuple[LeggedRobot, ...], models: list[Any]
) -> None:
    made = _env(members[:2], 2, config=Config())
    trunk, giraffe = made.sim.mj_model.body("robot/trunk").id, 2
    before = made.sim.model.body_ipos[0, trunk].numpy() - models[0].body_ipos[1]
    redraw(made, torch.tensor([0]), [members[giraffe]])
    after = made.sim.model.body_ipos[0, trunk].numpy() - models[giraffe].body_ipos[1]
    assert np.abs(before).max() > 0
    ratio = members[giraffe].scale / members[0].scale
    assert ratio > 2
    np.testing.assert_allclose(after, ratio * before, atol=1e-6)


def test_designs_that_one_simulation_cannot_hold_are_refused(
    members: tuple[LeggedRobot, ...],
) -> None:
    xml = members[1].xml
    long_foot = r'\1type="capsule"\2size="\3 0.01"'
    odd_xml = re.sub(r'(name="RR_lower_leg_end".*)type="sphere"(.*)size="(\S+)"', long_foot, xml)
    odd = replace(members[1], text=Text(odd_xml))
    with pytest.raises(DraftError, match=r"bear differs from .*cheetah in .*geom_type"):
        _env((members[0], odd), 2)
    renamed = replace(members[1], text=Text(xml.replace("FL_hip_housing_motor", "extra")))
    with pytest.raises(DraftError, match=r"bear differs from .*cheetah in names"):
        _env((members[0], renamed), 2)


def test_a_mesh_that_collides_is_refused(env: Any) -> None:
    scene = env.sim.mj_model
    trunk = scene.geom("robot/trunk_trunk").id
    scene.geom_conaffinity[trunk] = 1
    with pytest.raises(DraftError, match="'trunk_trunk' of quadruped:cheetah is a mesh that "):
        assume_designs(env, None)
    scene.geom_conaffinity[trunk] = 0
    assume_designs(env, None)


@pytest.mark.parametrize("engine", ["native", "warp"])
def test_worlds_are_given_other_designs_while_a_simulation_runs(
    members: tuple[LeggedRobot, ...], models: list[Any], engine: str
) -> None:
    if engine == "native":
        pytest.importorskip("mjbatch")
    task = Task(members[:2], config=CALM, ground="flat")
    (made, fresh) = (make(environment(task, 4, False), "cpu", engine) for _ in range(2))
    made.reset(seed=0)
    for _ in range(3):
        made.step(torch.zeros(4, 12))
    worlds = torch.tensor([3, 0])
    redraw(made, worlds, [members[4], members[2]])
    made.reset(env_ids=worlds)
    for world, own in enumerate((2, 1, 0, 4)):
        _assert_own(made, world, models[0], models[own], 2e-6 if engine == "warp" else 1e-9)
    robot = made.scene["robot"]
    assert robot.height.numpy() == pytest.approx([members[i].height for i in (2, 1, 0, 4)])
    (motor,) = robot.actuators
    torque = [STIFFNESS * members[i].peak_torque[0] for i in (2, 1, 0, 4)]
    assert motor.stiffness[:, 0].numpy() == pytest.approx(torque)
    scale = [members[i].scale for i in (2, 1, 0, 4)]
    commands: list[Any] = [one.command_manager.get_term("twist") for one in (made, fresh)]
    turn, first = commands[0].largest[:, 2].numpy(), float(commands[1].largest[0, 2])
    assert turn == pytest.approx(first * (np.array(scale) / scale[2]) ** -0.5)
    # A saved state has them: another simulation continues from it with the same designs.
    fresh.reset()
    saved = capture(made)
    if engine == "native":  # States of before gains could follow the weight lack a number.
        gains = [name for name in saved["tensors"] if name.endswith(".servo_torque")]
        assert gains
        for name in gains:
            del saved["tensors"][name]
        del saved["designs"]["servo_torque"]
    restore(fresh, saved)
    assert torch.equal(robot.servo_torque, fresh.scene["robot"].servo_torque)
    for each in (made, fresh):
        for _ in range(5):
            each.step(0.1 * torch.ones(4, 12))
    # On Warp redrawn worlds part in the last digits, though model, state and numbers of the robot
    # are equal to the bit after the restore. Why is not known; native MuJoCo repeats to the bit.
    precision = 1e-6 if engine == "warp" else 0.0
    ours, theirs = (one.sim.data.qpos[:] for one in (made, fresh))
    torch.testing.assert_close(ours, theirs, atol=precision, rtol=0.0)
    assert torch.equal(robot.peak_torque, fresh.scene["robot"].peak_torque)
    for each in (made, fresh):
        each.close()


@pytest.mark.parametrize("delay", [(0.0, 0.0), (0.005, 0.015)], ids=["at once", "late"])
def test_targets_are_about_the_home_pose_of_the_design_that_a_world_was_given(
    members: tuple[LeggedRobot, ...], delay: tuple[float, float]
) -> None:
    pytest.importorskip("mjbatch")
    config = CALM.with_values({"episodes.delay": delay})
    made = make(
        environment(Task(members[:2], config=config, ground="flat"), 4, False), "cpu", "native"
    )
    made.reset(seed=0)
    straighter = replace(members[4], home=tuple(0.8 * angle for angle in members[4].home))
    redraw(made, torch.tensor([3]), [straighter])
    made.reset(env_ids=torch.tensor([3]))
    targets: Any = made.action_manager.get_term("joint_pos")
    targets.process_actions(torch.zeros(4, 12))
    for world, member in ((0, members[0]), (1, members[1]), (3, straighter)):
        found = targets._processed_actions[world]
        assert found.numpy() == pytest.approx(member.home, abs=1e-6)
    made.close()


def test_designs_that_do_not_fit_a_running_simulation_are_refused(
    env: Any, alone: list[Any], members: tuple[LeggedRobot, ...]
) -> None:
    with pytest.raises(DraftError, match="1 design cannot fill 2 worlds"):
        redraw(env, torch.tensor([0, 1]), members[:1])
    other = replace(members[1], joints=members[1].joints[::-1])
    with pytest.raises(DraftError, match="its joints differ"):
        redraw(env, torch.tensor([0]), [other])
    with pytest.raises(DraftError, match="the simulation holds one design, quadruped:cheetah"):
        redraw(alone[0], torch.tensor([0]), members[1:2])


def test_the_policy_sees_a_vector_for_each_design(
    env: Any, members: tuple[LeggedRobot, ...]
) -> None:
    seen, _ = env.reset(seed=0)
    blind = environment(Task(members), 2)
    assert "design" not in blind.observations["actor"].terms
    assert seen["actor"].shape[1] == 235 + len(FEATURES)
    assert seen["critic"].shape[1] == 259 + len(FEATURES)
    vectors = env.scene["robot"].design
    assert torch.isfinite(vectors).all()
    apart = torch.cdist(vectors[:6], vectors[:6]) + 9 * torch.eye(6)
    assert apart.min() > 0.1
    assert torch.equal(vectors[0], vectors[6])
    assert vectors[1].tolist() == pytest.approx(features(members[1]))


def test_features_are_the_same_for_a_design_of_another_size() -> None:
    spec = draft.load("quadruped")
    (base,) = family([spec.resolve("cheetah")])
    (longer,) = family([spec.resolve("cheetah", {"trunk_length": 0.60})])
    (swapped,) = family([spec.resolve("cheetah", {"thigh_length": 0.23, "shank_length": 0.25})])
    at = dict(zip(FEATURES, zip(*map(features, (base, longer, swapped)), strict=True), strict=True))
    assert at["stance length"][1] > at["stance length"][0] + 0.05
    assert at["leg length"] == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert at["thigh"] == pytest.approx(np.log([0.25 / 0.48, 0.25 / 0.48, 0.23 / 0.48]))
    assert at["mass"][0] == pytest.approx(np.log(base.mass / 30))
    weight = base.mass * 9.81 * 0.48
    assert at["peak torque of knee"][0] == pytest.approx(np.log(base.peak_torque[2] / weight))


def test_features_of_a_family_are_those_of_each_design(members: tuple[LeggedRobot, ...]) -> None:
    for found, member in zip(family_features(members), members, strict=True):
        assert found == pytest.approx(features(member), rel=1e-9)
