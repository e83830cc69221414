"""Native MuJoCo behind mjlab: worlds as MuJoCo computes them, each with numbers of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("mjlab")
pytest.importorskip("mjbatch")

import mujoco
import numpy as np
import torch
from mjlab.envs import ManagerBasedRlEnv
from mjlab.envs import manager_based_rl_env as mjlab_environment
from mjlab.managers.event_manager import RecomputeLevel
from mjlab.sim import Simulation
from mjlab.sim.sim import MujocoCfg, SimulationCfg

from draft.learn.bodies.legged import LeggedRobot
from draft.learn.engine.worlds.native import NativeSimulation
from draft.learn.engine.worlds.simulate import make
from draft.learn.task.config import STAGES, Config
from draft.learn.task.mdp.environment import environment
from draft.learn.task.world.task import Task
from tests.learn.alone import check_masses, compiled
from tests.learn.small import SMALL

# A box with an arm on a plane.
XML = """
<mujoco>
  <worldbody>
    <geom name="ground" type="plane" size="0 0 1"/>
    <body name="box" pos="0 0 .02">
      <freejoint/>
      <geom name="box" type="box" size=".1 .1 .02" mass="1"/>
      <body name="arm" pos="0 0 .03">
        <joint name="swing" axis="0 1 0" damping=".01"/>
        <geom type="capsule" size=".01" fromto="0 0 0 .05 0 .1" mass=".1" contype="0"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="swing"/></actuator>
  <sensor><jointvel joint="swing"/></sensor>
</mujoco>
"""
MUJOCO = MujocoCfg(timestep=0.005, iterations=10, ls_iterations=20)


def sim(worlds: int = 3, threads: int = 1) -> NativeSimulation:
    """Boxes with arms."""
    model = mujoco.MjModel.from_xml_string(XML)
    return NativeSimulation(worlds, SimulationCfg(mujoco=MUJOCO), model, threads=threads)


def drive(boxes: NativeSimulation, steps: int, seed: int = 0) -> None:
    """Move the arms at random."""
    drawn = torch.Generator().manual_seed(seed)
    for _ in range(steps):
        boxes.data.ctrl[:] = 0.1 * torch.randn(boxes.num_envs, 1, generator=drawn)
        boxes.step()


def alone(boxes: NativeSimulation, world: int) -> Any:
    """MuJoCo's own data of one world, in its state."""
    data = mujoco.MjData(boxes.mj_model)
    row = boxes.state[world].numpy().copy()
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    mujoco.mj_setState(boxes.mj_model, data, row, kind)
    mujoco.mj_forward(boxes.mj_model, data)
    return data


# Worlds are what MuJoCo computes.


def test_a_world_is_what_mujoco_alone_computes_bit_by_bit() -> None:
    boxes = sim()
    model = mujoco.MjModel.from_xml_string(XML)
    MUJOCO.apply(model)
    data = mujoco.MjData(model)
    drawn = torch.Generator().manual_seed(0)
    for _ in range(50):
        torque = torch.randn(3, 1, generator=drawn)
        boxes.data.ctrl[:] = torque
        data.ctrl[:] = torque[1].double().numpy()
        boxes.step()
        mujoco.mj_step(model, data)
    row = np.zeros(boxes.state.shape[1])
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    mujoco.mj_getState(model, data, row, kind)
    assert np.array_equal(boxes.state[1].numpy(), row)
    # Derived fields are those of the state before the last step, as mjlab expects.
    assert np.array_equal(boxes.data.xmat[1].numpy(), data.xmat.reshape(-1, 3, 3).astype("f4"))
    assert np.array_equal(boxes.data.sensordata[1].numpy(), data.sensordata.astype("f4"))


def test_threads_change_nothing() -> None:
    one, two = sim(9), sim(9, threads=2)
    for boxes in (one, two):
        drive(boxes, 20)
    assert torch.equal(one.state, two.state)


def test_a_write_in_single_precision_leaves_the_digits_of_what_it_does_not_change() -> None:
    boxes = sim()
    drive(boxes, 20)
    before = boxes.state.clone()
    boxes.data.qvel[1] = boxes.data.qvel[1].clone()
    boxes.data.qvel[1, 2] = 0.5
    boxes.forward()
    changed = (boxes.state != before).nonzero()
    assert changed.tolist() == [[1, 1 + 8 + 2]]  # Time, then 8 positions, then velocities.
    assert boxes.state[1, 11] == 0.5


def test_a_world_given_the_state_of_another_continues_as_that_one() -> None:
    boxes = sim()
    drive(boxes, 20)
    assert not torch.equal(boxes.state[0], boxes.state[2])
    boxes.state[2] = boxes.state[0]
    for _ in range(20):
        boxes.data.ctrl[:] = 0.1
        boxes.step()
    assert torch.equal(boxes.state[0], boxes.state[2])
    assert torch.equal(boxes.data.qpos[0], boxes.data.qpos[2])
    assert not torch.equal(boxes.data.qpos[0], boxes.data.qpos[1])


def test_reset_of_some_worlds_leaves_the_others_as_they_were() -> None:
    boxes, twins = sim(), sim()
    for each in (boxes, twins):
        drive(each, 20)
        each.data.qvel[0, 3] = 1.5  # Written, and not yet taken up.
    state, seen = boxes.state.clone(), boxes.data.xpos.clone()
    boxes.reset(torch.tensor([2]))
    assert torch.equal(boxes.state[:2], state[:2])
    assert torch.equal(boxes.data.xpos[:2], seen[:2])
    assert boxes.data.qpos[2].tolist() == pytest.approx(boxes.mj_model.qpos0)
    assert boxes.data.time[2] == 0
    assert not boxes.data.qvel[2].any()
    for each in (boxes, twins):
        drive(each, 5)
    assert torch.equal(boxes.state[:2], twins.state[:2])
    boxes.reset()
    assert boxes.data.time.tolist() == [0, 0, 0]


def test_a_derived_field_that_is_read_late_is_right_and_changes_nothing() -> None:
    boxes, twins = sim(), sim()
    for each in (boxes, twins):
        drive(each, 20)
    boxes.data.ctrl[1] = 0.3  # Not yet taken up.
    state, lagging = boxes.state.clone(), boxes.data.xpos.clone()
    for name in ("qfrc_bias", "cfrc_int", "geom_xmat", "xanchor"):
        found = getattr(boxes.data, name)
        for world in (0, 2):
            own = getattr(alone(boxes, world), name).reshape(found[world].shape)
            np.testing.assert_allclose(found[world].numpy(), own, rtol=1e-6, atol=1e-6)
    assert torch.equal(boxes.state[[0, 2]], state[[0, 2]])
    assert torch.equal(boxes.data.xpos, lagging)
    twins.data.ctrl[1] = 0.3
    for each in (boxes, twins):
        each.step()
        drive(each, 5)
    assert torch.equal(boxes.state, twins.state)


@pytest.mark.parametrize("stage", STAGES)
def test_no_field_is_bound_in_mid_step(members: tuple[LeggedRobot, ...], stage: str) -> None:
    # It would be of another moment in the first step than in all others, and slices of a run would
    # not add up to one long run.
    config = Config().with_values(SMALL)
    env = make(environment(Task(members[:2], stage, config), 4), "cpu", "native")
    env.reset()
    before = set(vars(env.sim.data))
    for _ in range(3):
        env.step(torch.zeros(4, 12))
    assert set(vars(env.sim.data)) == before


def test_a_state_that_is_no_number_stays_so_until_it_is_reset(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its warnings to a file there.
    boxes, twins = sim(), sim()
    for each in (boxes, twins):
        drive(each, 5)
    boxes.data.qvel[1, 0] = torch.nan
    for each in (boxes, twins):
        drive(each, 5)
    assert boxes.data.qpos[1].isnan().any()
    assert boxes.data.time.tolist() == pytest.approx([0.05] * 3)
    assert torch.equal(boxes.state[[0, 2]], twins.state[[0, 2]])
    boxes.reset(torch.tensor([1]))
    drive(boxes, 5)
    assert boxes.state.isfinite().all()


# Numbers of a world's own.


def test_boxes_slide_as_far_as_the_friction_of_their_worlds_lets_them() -> None:
    boxes, friction = sim(4), torch.tensor([0.01, 0.2, 0.5, 1.0])
    boxes.expand_model_fields(("geom_friction",))
    boxes.model.geom_friction[:, :, 0] = friction[:, None]
    for _ in range(40):
        boxes.step()  # Until they rest on the ground.
    start = boxes.data.qpos[:, 0].clone()
    boxes.data.qvel[:, 0] = 1.0
    for _ in range(200):
        boxes.step()
    far = (boxes.data.qpos[:, 0] - start).tolist()
    # They stop after v^2 / (2 mu g); the first one has not, after a second.
    assert far[1:] == pytest.approx((0.5 / 9.81 / friction[1:]).tolist(), rel=0.05)
    assert far[0] == pytest.approx(1 - 0.01 * 9.81 / 2, rel=0.02)


def test_a_shifted_centre_of_mass_is_that_of_the_worlds_own_physics(
    members: tuple[LeggedRobot, ...],
) -> None:
    env = make(environment(Task(members[:1], ground="flat"), 4), "cpu", "native")
    trunk = env.sim.mj_model.body("robot/trunk").id
    models = []
    for world in range(4):
        (model,) = compiled(members[:1], Config())
        before = model.body_ipos[1].copy()
        model.body_ipos[1] = env.sim.model.body_ipos[world, trunk].numpy()
        assert 1e-4 < np.abs(model.body_ipos[1] - before).max() < 0.03
        mujoco.mj_setConst(model, mujoco.MjData(model))
        models.append(model)
    check_masses(env, models, 1e-9)


def test_every_number_that_randomisation_may_change_has_the_shape_it_has_on_warp(
    members: tuple[LeggedRobot, ...],
) -> None:
    made = [
        make(environment(Task(members[:2], ground="flat"), 4), "cpu", engine)
        for engine in ("native", "warp")
    ]
    native, warp = (env.sim for env in made)
    assert native.expanded_fields == warp.expanded_fields
    assert {"geom_aabb", "body_mass", "geom_friction"} < native.expanded_fields
    for name in sorted(native.expanded_fields):
        ours, theirs = (getattr(one.model, name)[:] for one in (native, warp))
        assert ours.shape == theirs.shape, name
        if name not in ("geom_friction", "body_ipos"):  # Which are drawn.
            torch.testing.assert_close(ours.float(), theirs, rtol=1e-4, atol=1e-6, msg=name)


def test_constants_that_follow_from_masses_are_each_worlds_own() -> None:
    boxes = sim()
    drive(boxes, 20)
    state = boxes.state.clone()
    boxes.expand_model_fields(("body_mass", "dof_armature"))
    boxes.model.body_mass[1, 1] = 10.0
    boxes.model.dof_armature[2, 6] = 0.2
    boxes.recompute_constants(RecomputeLevel.set_const)
    assert torch.equal(boxes.state, state)
    for world in range(3):
        own = mujoco.MjModel.from_xml_string(XML)
        MUJOCO.apply(own)
        own.body_mass[1] = 10.0 if world == 1 else own.body_mass[1]
        own.dof_armature[6] = 0.2 if world == 2 else 0.0
        mujoco.mj_setConst(own, mujoco.MjData(own))
        for name in ("body_subtreemass", "dof_invweight0", "body_invweight0", "actuator_acc0"):
            held = getattr(boxes.model, name)[world].numpy()
            np.testing.assert_allclose(held, getattr(own, name), rtol=1e-12, err_msg=name)
    masses = boxes.model.body_subtreemass[:, 1]
    assert masses.tolist() == pytest.approx([1.1, 10.1, 1.1])
    # What randomisation starts from is what was compiled.
    assert boxes.get_default_field("body_mass").tolist() == pytest.approx([0.0, 1.0, 0.1])
    assert boxes.expanded_fields == {"body_mass", "dof_armature"}


# What it refuses, and where it stands.


def test_what_native_mujoco_cannot_do_is_refused() -> None:
    model = mujoco.MjModel.from_xml_string(XML)
    with pytest.raises(ValueError, match="runs on the CPU, not on 'cuda:0'"):
        NativeSimulation(2, SimulationCfg(), model, device="cuda:0")
    with pytest.raises(ValueError, match="no meshes per world; use MuJoCo Warp"):
        NativeSimulation(2, SimulationCfg(), model, variant_info=[("robot/", None)])
    with pytest.raises(ValueError, match="either model or spec must be given"):
        NativeSimulation(2, SimulationCfg())
    with pytest.raises(NotImplementedError, match="ray-cast sensors need MuJoCo Warp"):
        sim().set_sensor_context(None)


def test_names_that_there_are_not_are_refused() -> None:
    boxes = sim()
    with pytest.raises(ValueError, match=r"not found in model: \['body_weight'\]"):
        boxes.expand_model_fields(("body_mass", "body_weight"))
    with pytest.raises(ValueError, match="'body_weight' not found"):
        boxes.get_default_field("body_weight")
    with pytest.raises(AttributeError, match="no field 'position' per world"):
        boxes.data.position  # noqa: B018  # type: ignore[attr-defined]
    assert not hasattr(boxes.model, "body_weight")
    assert boxes.expanded_fields == set()


def test_the_requested_engine_steps_the_worlds(members: tuple[LeggedRobot, ...]) -> None:
    for engine, kind in (("native", NativeSimulation), ("warp", Simulation)):
        env = make(environment(Task(members[:1], ground="flat"), 2), "cpu", engine)
        assert type(env) is ManagerBasedRlEnv
        assert type(env.sim) is kind
    assert vars(mjlab_environment)["Simulation"] is Simulation
