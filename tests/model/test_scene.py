"""The scene puts a robot on the floor in its home pose, with servos that hold it there."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pytest

import draft
from tests.helpers import DRIVE, leg, robot
from tests.model.shipped import built

QUADRUPEDS = [None, *draft.load("quadruped").designs]


def _at_home(scene: mujoco.MjModel) -> mujoco.MjData:
    data = mujoco.MjData(scene)
    mujoco.mj_resetDataKeyframe(scene, data, scene.key("home").id)
    mujoco.mj_forward(scene, data)
    return data


def _lowest(scene: mujoco.MjModel, data: mujoco.MjData, geom: int) -> float:
    half = scene.geom_size[geom]
    if scene.geom_type[geom] == mujoco.mjtGeom.mjGEOM_SPHERE:
        return data.geom_xpos[geom, 2] - half[0]
    if scene.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER:  # A wheel with a level axle.
        assert abs(data.geom_xmat[geom, 8]) < 1e-9
        return data.geom_xpos[geom, 2] - half[0]
    return data.geom_xpos[geom, 2] - np.abs(data.geom_xmat[geom].reshape(3, 3)[2]) @ half


def _feet(scene: mujoco.MjModel) -> list[int]:
    """End effectors that are not hands or a head: those that belong to legs."""
    names = {i: scene.geom(i).name for i in range(scene.ngeom)}
    return [
        i for i, n in names.items() if n.endswith("_end") and "hand" not in n and "head" not in n
    ]


def test_every_foot_touches_the_floor_in_the_home_pose(model: draft.Model) -> None:
    if not model.design.floating:
        pytest.skip("its base is fixed")
    scene = model.scene()
    data = _at_home(scene)
    feet = _feet(scene)
    assert len(feet) == {"quadruped": 4, "humanoid": 2, "biped": 2, "hexapod": 6, "wheeled": 4}.get(
        model.design.name, 1
    )
    for foot in feet:
        assert _lowest(scene, data, foot) == pytest.approx(0, abs=1e-6)


def test_the_home_pose_has_the_designs_home_angles(model: draft.Model) -> None:
    scene = model.scene()
    data = _at_home(scene)
    for name, joint in model.design.joints.items():
        assert data.joint(name).qpos[0] == pytest.approx(joint.home)
    if model.design.floating:
        assert list(data.qpos[3:7]) == [1, 0, 0, 0]
        assert list(data.qpos[:2]) == [0, 0]


def test_every_driven_joint_has_a_servo_and_its_motors_data(model: draft.Model) -> None:
    scene, design = model.scene(), model.design
    assert [scene.actuator(i).name for i in range(scene.nu)] == list(design.joints)
    for name, joint in design.joints.items():
        a = design.actuators[joint.actuator or ""]
        servo = scene.actuator(name)
        assert scene.actuator_trnid[servo.id, 0] == scene.joint(name).id
        if joint.rolls:  # See test_wheels.
            continue
        assert servo.gainprm[0] == pytest.approx(1.43 * a.peak_torque)
        bias = [0, -1.43 * a.peak_torque, -0.071 * a.peak_torque]
        assert servo.biasprm[:3] == pytest.approx(bias)
        assert servo.forcerange == pytest.approx([-a.peak_torque, a.peak_torque])
        assert servo.ctrlrange == pytest.approx(joint.range)
        motor = scene.numeric(f"{name}_dc_motor").data
        assert list(motor) == pytest.approx([a.peak_torque, a.no_load_speed])


def test_home_targets_stay_in_the_joints_ranges(model: draft.Model) -> None:
    scene = model.scene()
    targets = scene.key("home").ctrl
    for i, joint in enumerate(model.design.joints.values()):
        low, high = joint.range
        assert low <= targets[i] <= high


@pytest.mark.parametrize("label", QUADRUPEDS)
def test_a_quadruped_stands_for_five_seconds_under_its_own_servos(label: str | None) -> None:
    scene = built("quadruped", label).scene()
    data = _at_home(scene)
    height = data.qpos[2]
    worst = 0.0
    while data.time < 5:
        mujoco.mj_step(scene, data)
        # The trunk's z axis against the vertical.
        worst = max(worst, float(np.degrees(np.arccos(min(data.body("trunk").xmat[8], 1.0)))))
    assert worst < 10
    assert data.qpos[2] > 0.9 * height
    # The home targets lead by what gravity takes, so that the legs do not sag.
    assert data.qpos[7:] == pytest.approx(scene.key("home").qpos[7:], abs=0.01)
    assert scene.key("home").ctrl != pytest.approx(scene.key("home").qpos[7:], abs=0.001)


def test_the_scene_includes_the_robot_and_adds_a_floor(model: draft.Model) -> None:
    root = ET.fromstring(model.scene_xml)
    assert [e.get("file") for e in root.iter("include")] == ["robot.xml"]
    scene = model.scene()
    assert scene.ngeom == model.mujoco.ngeom + 1
    assert scene.geom("floor").type[0] == mujoco.mjtGeom.mjGEOM_PLANE
    assert scene.body_subtreemass[0] == pytest.approx(model.mujoco.body_subtreemass[0])


def test_no_part_of_a_robot_is_below_the_floor_at_home(model: draft.Model) -> None:
    scene = model.scene()
    data = _at_home(scene)
    depths = [data.contact[i].dist for i in range(data.ncon)]
    assert min(depths, default=0) > -1e-6


def test_the_target_of_an_arm_in_the_air_makes_up_for_its_weight_alone() -> None:
    arm = {
        "name": "arm",
        "type": "sphere",
        "joint": {"name": "shoulder", "axis": "y", "range": [-2, 2], "actuator": "leg"},
        "link": {"axis": "x", "length": 0.3, "mass": 0.2, "segment": "shank"},
        "sphere": {"radius": 0.02, "mass": 0.05},
    }
    mount = {"name": "mount", "at": [0.2, 0, 0.2], "motor": {"actuator": "leg", "axis": "y"}}
    children = [{"chain": "leg", "at": [0, 0, -0.2]}, {**mount, "children": [arm]}]
    scene = robot(children=children).resolve().build().scene()
    # 0.15 kg of rod at its middle and 0.05 kg of hand at its end pull the arm down, about +y.
    torque = -9.81 * (0.15 * 0.15 + 0.05 * 0.3)
    target = scene.key("home").ctrl[scene.actuator("shoulder").id]
    assert target == pytest.approx(torque / (1.43 * DRIVE["peak_torque"]), rel=1e-6)


def test_a_robot_without_feet_stands_on_its_lowest_part() -> None:
    chain = leg(shank={"type": "basic", "sphere": None})
    chain[2]["link"]["radius"] = 0.01
    scene = robot(chain).resolve().build().scene()
    data = _at_home(scene)
    shank = data.geom("shank_link")
    assert shank.xpos[2] - 0.25 / 2 == pytest.approx(0, abs=1e-6)


def test_a_robot_without_a_driven_joint_has_a_scene_without_servos() -> None:
    tail = {
        "name": "tail",
        "joint": {"name": "wag", "axis": "z", "range": [-1, 1]},
        "link": {"axis": "-x", "length": 0.2, "mass": 0.1},
    }
    scene = robot([tail], actuators={"leg": DRIVE}).resolve().build().scene()
    assert scene.nu == 0
    assert scene.nkey == 1
