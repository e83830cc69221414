"""A scene with another robot swapped in is the scene compiled with that robot."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import draft
from draft.model import Model
from draft.model.batch_text import arrays
from draft.model.model import preview
from draft.model.swap import swapped
from tests.helpers import leg, loaded, robot

# For drawing: `mj_setConst` of MuJoCo 4 leaves them as they were.
VIEW = ("meanmass", "meansize", "extent", "center") if mujoco.__version__.startswith("3.") else ()
EDITS = [
    ("quadruped", {"thigh_length": 0.31, "shank_length": 0.2}),
    ("quadruped", {"trunk_length": 0.6}),  # another mesh, of the same faces
    ("quadruped", {"actuators.leg.peak_torque": 95.0, "actuators.leg.gear_ratio": 7.0}),
    ("humanoid", {"thigh_length": 0.23, "shank_length": 0.3}),
    ("hopper", {"shin_length": 0.25}),
]


def on_plane(model: Model) -> mujoco.MjModel:
    spec = mujoco.MjSpec.from_string(model.xml)
    spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0, 0, 0.05))
    box = mujoco.mjtGeom.mjGEOM_BOX
    spec.worldbody.add_geom(name="box", type=box, size=(0.1, 0.2, 0.3), pos=(2, 0, 0.3))
    return spec.compile()


def built(name: str, values: dict[str, float] | None = None) -> Model:
    return preview(draft.load(name).resolve(values or {}))


def fallen(model: mujoco.MjModel) -> np.ndarray:
    """Path of a drop of 100 steps."""
    data = mujoco.MjData(model)
    data.qpos[2] += 0.02
    path = []
    for _ in range(100):
        mujoco.mj_step(model, data)
        path.append([*data.qpos, *data.qvel])
    assert data.ncon or data.qpos[2] < path[0][2]
    return np.array(path)


@pytest.mark.parametrize(("name", "values"), EDITS)
def test_it_is_the_scene_compiled_with_the_other_robot(name: str, values: dict[str, float]) -> None:
    robot, other = built(name), built(name, values)
    scene = on_plane(robot)
    model, alone = swapped(scene, robot.mujoco, other.mujoco), on_plane(other)
    assert model is not None
    mujoco.mj_setConst(model, mujoco.MjData(model))
    assert not np.array_equal(model.body_mass, scene.body_mass)
    for field in arrays():
        np.testing.assert_array_equal(getattr(model, field), getattr(alone, field), field)
    for number in ("meaninertia", *VIEW):
        np.testing.assert_array_equal(getattr(model.stat, number), getattr(alone.stat, number))
    found = []
    for each in (model, alone):
        data, inertia = mujoco.MjData(each), np.zeros((each.nv, each.nv))
        data.qpos[7:] += np.random.default_rng(0).normal(size=each.nq - 7)
        mujoco.mj_forward(each, data)
        mujoco.mj_fullM(each, data, inertia)
        found.append(inertia)
    np.testing.assert_array_equal(*found)
    np.testing.assert_array_equal(fallen(model), fallen(alone))


def test_the_scene_itself_stays_as_it_was() -> None:
    robot, other = built("hopper"), built("hopper", {"shin_length": 0.25})
    scene = on_plane(robot)
    before = {field: getattr(scene, field).copy() for field in arrays()}
    assert swapped(scene, robot.mujoco, other.mujoco) is not None
    for field, values in before.items():
        np.testing.assert_array_equal(getattr(scene, field), values, field)


def test_options_of_the_scene_are_kept() -> None:
    robot, other = built("hopper"), built("hopper", {"shin_length": 0.25})
    scene = on_plane(robot)
    scene.opt.timestep = 0.004
    model = swapped(scene, robot.mujoco, other.mujoco)
    assert model is not None
    assert model.opt.timestep == 0.004


def test_a_robot_of_another_topology_is_left_to_the_compiler() -> None:
    one, other = built("quadruped"), built("hopper")
    assert swapped(on_plane(one), one.mujoco, other.mujoco) is None


def test_a_part_of_another_name_or_kind_is_left_to_the_compiler() -> None:
    first = preview(robot(leg()).resolve())
    others = [
        leg(shank={"sphere": {"radius": 0.02, "site": "toe"}}),
        leg(shank={"type": "basic", "sphere": None}),
    ]
    for chain in others:
        other = preview(robot(chain).resolve())
        assert swapped(on_plane(first), first.mujoco, other.mujoco) is None


def test_boxes_that_nest_otherwise_are_left_to_the_compiler() -> None:
    """MuJoCo's tree of boxes around the geoms of the trunk changes with the payload's centre."""
    spec = loaded()
    first, second = (preview(spec.resolve({"payload": mass})) for mass in (0.5, 0.0))
    assert not np.array_equal(first.mujoco.bvh_nodeid, second.mujoco.bvh_nodeid)
    assert swapped(on_plane(first), first.mujoco, second.mujoco) is None
