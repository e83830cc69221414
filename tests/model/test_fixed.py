"""Robots whose base is bolted to the world: models, exports, statics and what is judged of them."""

from __future__ import annotations

import io
import json
import math
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from draft.design.loads import home_loads
from draft.design.machine import machine
from draft.model import picture
from draft.model.batch import build_batch
from draft.model.model import preview
from draft.values import scalar
from tests import fixed
from tests.helpers import ids, robot
from tests.model.test_batch import (
    TOLERANCE,
    assert_within,
    errors_of_dynamics,
    errors_of_fields,
    values_of,
)

GRAVITY = 9.81
SPECS = {"arm": fixed.arm, "hand": fixed.hand}


@pytest.mark.parametrize("name", SPECS)
def test_the_base_is_welded_to_the_world_and_the_joints_alone_move(name: str) -> None:
    model = SPECS[name]().resolve().build()
    compiled, joints = model.mujoco, model.design.joints
    assert (compiled.nq, compiled.nv) == (len(joints), len(joints))
    assert [compiled.joint(i).name for i in range(compiled.njnt)] == [*joints]
    assert compiled.body_weldid[1] == 0
    assert "freejoint" not in model.xml
    assert float(compiled.body_mass.sum()) == pytest.approx(scalar(model.design.mass))


def test_the_base_stands_where_its_file_puts_it() -> None:
    model = fixed.hand().resolve().build()
    data = mujoco.MjData(model.mujoco)
    mujoco.mj_kinematics(model.mujoco, data)
    assert data.body("palm").xpos == pytest.approx([0, 0, 0.3])
    roll, pitch, yaw = (np.eye(3) for _ in range(3))
    for matrix, angle, a, b in ((roll, 0.2, 1, 2), (pitch, -0.4, 2, 0), (yaw, 1.0, 0, 1)):
        matrix[[a, b], [a, b]] = math.cos(angle)
        matrix[b, a], matrix[a, b] = math.sin(angle), -math.sin(angle)
    assert data.body("palm").xmat.reshape(3, 3) == pytest.approx(yaw @ pitch @ roll)
    assert model.design.lowest() == 0.3
    palm = model.mujoco.geom("palm_pedestal")
    assert palm.type[0] == mujoco.mjtGeom.mjGEOM_CYLINDER
    assert palm.size[:2] == pytest.approx([0.05, 0.015])
    assert palm.pos == pytest.approx([0, 0, 0.015])
    assert model.mujoco.body("palm").mass[0] == 0


@pytest.mark.parametrize("name", SPECS)
def test_the_home_pose_of_the_scene_has_the_joints_alone_and_is_held(name: str) -> None:
    model = SPECS[name]().resolve().build()
    scene = model.scene()
    assert scene.key("home").qpos == pytest.approx([j.home for j in model.design.joints.values()])
    data = mujoco.MjData(scene)
    mujoco.mj_resetDataKeyframe(scene, data, 0)
    for _ in range(500):
        mujoco.mj_step(scene, data)
    # The targets of the servos lead by what gravity would take.
    assert data.qpos == pytest.approx(scene.key("home").qpos, abs=5e-3)
    assert ids(model.simulate()) == ids(model.design)


@pytest.mark.parametrize("name", SPECS)
def test_models_of_a_batch_are_those_compiled_alone(name: str) -> None:
    spec = SPECS[name]()
    design = spec.resolve(values_of(spec, 40, 0.1))
    batch = build_batch(design, np.flatnonzero(design.accepted)[:4])
    assert len(batch) == 4
    rng = np.random.default_rng(2)
    for place, row in enumerate(batch.rows):
        alone, model = batch.design[row].build().mujoco, batch.model(place)
        assert_within(TOLERANCE, errors_of_fields(alone, model))
        assert_within(TOLERANCE, errors_of_dynamics(alone, model, rng))


def number(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers of six decimals: MuJoCo reads no denormal ones."""
    return st.floats(low, high).map(lambda value: round(value, 6))


ANGLE, LENGTH = number(-3.14, 3.14), number(0.1, 0.6)
AXIS = st.sampled_from(["x", "y", "z", [1, 1, 0.5], [0.3, -1, 2]])
LINK = st.tuples(AXIS, AXIS, LENGTH, number(0.2, 5.0), ANGLE)


def random_arm(links: list[Any], at: list[float], rpy: list[float]) -> draft.Spec:
    """An arm of links in series, each with the axes of joint and member, length, mass and turn."""
    chain = [
        {
            "name": f"link{k}",
            "rpy": [0.1, turn, -0.2],
            "joint": {"name": f"joint{k}", "axis": axis, "range": [-4, 4]},
            "link": {"axis": along, "length": length, "mass": mass},
        }
        for k, (axis, along, length, mass, turn) in enumerate(links)
    ]
    tree = {
        **{"name": "base", "type": "fixed", "at": at, "rpy": rpy},
        "pedestal": {"radius": 0.1, "height": 0.2, "mass": 3},
        "children": [{"chain": "arm"}],
    }
    parameters = {"name": "random_arm", "population": "humanoid", "parameters": {}, "actuators": {}}
    files = {"parameters.yaml": parameters, "tree.yaml": {"chains": {"arm": chain}, "tree": tree}}
    return draft.Spec.parse(files)


@settings(max_examples=25, deadline=None)
@given(
    links=st.lists(LINK, min_size=1, max_size=6),
    at=st.lists(LENGTH, min_size=3, max_size=3),
    rpy=st.lists(ANGLE, min_size=3, max_size=3),
    seed=st.integers(0, 2**16),
)
def test_mass_matrix_and_gravity_are_those_of_pinocchio_from_the_urdf(
    tmp_path_factory: pytest.TempPathFactory,
    links: list[Any],
    at: list[float],
    rpy: list[float],
    seed: int,
) -> None:
    pinocchio = pytest.importorskip("pinocchio")
    model = random_arm(links, at, rpy).resolve().build()
    folder = model.save(tmp_path_factory.mktemp("arm") / "out", ("urdf",))
    read = pinocchio.buildModelFromUrdf(str(folder / "robot.urdf"))
    assert read.nq == model.mujoco.nq == len(links)
    rng = np.random.default_rng(seed)
    q, speed = rng.uniform(-3, 3, read.nq), rng.normal(size=read.nv)
    own, other = mujoco.MjData(model.mujoco), read.createData()
    own.qpos[:], own.qvel[:] = q, speed
    mujoco.mj_forward(model.mujoco, own)
    mass = np.empty((read.nv, read.nv))
    mujoco.mj_fullM(model.mujoco, own, mass)
    expected = pinocchio.crba(read, other, q)
    expected = np.triu(expected) + np.triu(expected, 1).T
    assert mass == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.abs(expected).max())
    forces = pinocchio.nle(read, other, q, speed)
    assert own.qfrc_bias == pytest.approx(forces, rel=1e-6, abs=1e-5 * (1 + np.abs(forces).max()))


@pytest.mark.parametrize("name", SPECS)
def test_mujoco_reads_the_urdf_as_the_mjcf(name: str, tmp_path: Path) -> None:
    model = SPECS[name]().resolve().build()
    folder = model.save(tmp_path / "out", ("urdf", "mjcf"))
    text = (folder / "robot.urdf").read_text()
    base = model.design.bodies[0].name
    assert '<link name="world"/>' in text
    assert f'<joint name="{base}_weld" type="fixed">' in text
    assert not (folder / "meshes").exists()
    read = mujoco.MjModel.from_xml_path(str(folder / "robot.urdf"))
    rng = np.random.default_rng(0)
    q, speed = rng.uniform(-0.2, 1.0, read.nq), rng.normal(size=read.nv)
    energies = []
    for one in (read, model.mujoco):
        one.dof_armature[:] = 0.0  # URDF holds none
        one.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
        data = mujoco.MjData(one)
        data.qpos[:], data.qvel[:] = q, speed
        mujoco.mj_forward(one, data)
        energies.append(data.energy.copy())
    assert energies[0] == pytest.approx(energies[1], rel=1e-6)
    table = json.loads((folder / "actuators.json").read_text())
    assert table["base_fixed"] is True


@settings(max_examples=50, deadline=None)
@given(
    length=number(0.05, 2.0),
    mass=number(0.05, 15.0),
    tilt=number(-1.5, 1.5),
    home=number(-2.5, 2.5),
)
def test_one_link_takes_its_weight_times_its_lever(
    length: float, mass: float, tilt: float, home: float
) -> None:
    spec = fixed.pendulum(at=[0.1, 0.2, "high"], rpy=[0, tilt, 0.7], home=home)
    design = spec.resolve({"length": length, "mass": mass, "high": 10})
    (load,) = home_loads(design)
    # About an axis that stays level, the link points down by the sum of both angles.
    expected = -mass * GRAVITY * length / 2 * math.cos(tilt + home)
    assert load.torque == pytest.approx(expected, abs=1e-9)
    model = preview(design).mujoco
    data = mujoco.MjData(model)
    data.qpos[0] = home
    mujoco.mj_forward(model, data)
    assert data.qfrc_bias[0] == pytest.approx(expected, abs=1e-6)
    peak, rated = load.actuator.peak_torque, load.actuator.rated_torque
    assert ("cannot_hold" in ids(design)) == (abs(expected) > peak * 1.001)
    assert ("thermal" in ids(design)) == (abs(expected) > rated * 1.001)


@pytest.mark.parametrize("name", SPECS)
def test_the_torques_of_the_home_pose_are_mujocos(name: str) -> None:
    model = SPECS[name]().resolve().build()
    data = mujoco.MjData(model.mujoco)
    data.qpos[:] = [joint.home for joint in model.design.joints.values()]
    mujoco.mj_forward(model.mujoco, data)
    loads = {load.joint.names[0]: load.torque for load in home_loads(model.design)}
    assert [*loads] == [*model.design.joints]
    assert data.qfrc_bias == pytest.approx([*loads.values()], abs=1e-6)


def test_a_machine_is_named_by_its_base_and_its_limbs() -> None:
    assert machine(fixed.arm().resolve()) == "fixed arm"
    assert machine(fixed.hand().resolve()) == "hand of 4 fingers on a fixed base"
    assert machine(robot().resolve()) == "robot on 1 leg"
    assert machine(robot(children=[]).resolve()) == "floating robot without legs"


@pytest.mark.parametrize("name", SPECS)
def test_no_finding_of_a_fixed_base_is_about_legs(name: str) -> None:
    design = SPECS[name]().resolve()
    assert design.accepted
    assert design.judged
    about_legs = {"no_legs", "cannot_stand", "uneven_feet", "total_mass", "actuator_share"}
    assert not ids(design) & about_legs
    assert not any("feet" in found.message for found in design.findings)


def test_what_reaches_below_the_floor_is_named() -> None:
    low = fixed.pendulum(at=[0, 0, 0.1], home=1.2).resolve()
    (found,) = [one for one in low.findings if one.id == "below_floor"]
    assert "below the floor" in found.message
    assert "below_floor" not in ids(fixed.pendulum(at=[0, 0, 1]).resolve())


def test_masses_by_the_trends_of_legs_are_named() -> None:
    files = dict(fixed.ARM)
    files["tree.yaml"] = files["tree.yaml"].replace("mass: 1.2", "segment: forearm")
    found = [one for one in draft.Spec.parse(files).resolve().findings if one.id == "outside_data"]
    assert any("robots with legs" in one.message for one in found)


def test_a_pedestal_may_stand_beside_its_base() -> None:
    shifted = {"size": [0.2, 0.1, 0.3], "shift": [0.1, -0.2, -0.05], "mass": 3}
    model = fixed.pendulum(pedestal=shifted).resolve().build().mujoco
    assert model.geom("base_pedestal").pos == pytest.approx((0.1, -0.2, 0.1))
    assert model.body("base").mass[0] == pytest.approx(3.0)


def test_the_pedestal_counts_in_the_mass_and_moves_nothing() -> None:
    spec = fixed.arm()
    light, heavy = (spec.resolve({"pedestal_mass": mass}) for mass in (0, 20))
    assert heavy.mass - light.mass == pytest.approx(20)
    assert heavy.structure_mass - light.structure_mass == pytest.approx(20)
    assert light.carried_mass == pytest.approx(0.5)  # the tool alone
    torques = [[load.torque for load in home_loads(design)] for design in (light, heavy)]
    assert torques[0] == torques[1]


@pytest.mark.parametrize("name", SPECS)
def test_gltf_and_pictures_show_it_where_it_is_bolted(name: str, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    model = SPECS[name]().resolve().build()
    folder = model.save(tmp_path / "out", ("glb",))
    read = trimesh.load(io.BytesIO((folder / "robot.glb").read_bytes()), file_type="glb")
    data = mujoco.MjData(model.mujoco)
    data.qpos[:] = [joint.home for joint in model.design.joints.values()]
    mujoco.mj_kinematics(model.mujoco, data)
    up = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # y points up in glTF
    staged, poses = picture.stage([picture.exhibit(model, (1.0, 2.0), math.pi / 2)])
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    for i in range(model.mujoco.ngeom):
        geom = model.mujoco.geom(i).name
        place, _ = read.graph[geom]
        assert up @ place[:3, 3] == pytest.approx(data.geom_xpos[i], abs=1e-6)
        shown = poses.geom(f"0_{geom}").xpos
        assert shown == pytest.approx(turn @ data.geom_xpos[i] + [1, 2, 0], abs=1e-6)
    assert staged.nq == model.mujoco.nq
