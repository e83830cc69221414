"""The robot's MJCF says what the design says, and nothing that a user of it must take out."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from tests.helpers import DRIVE, leg, robot
from tests.written import edit, write_robot


def test_every_joint_has_the_numbers_of_the_design(model: draft.Model) -> None:
    design, compiled = model.design, model.mujoco
    for name, joint in design.joints.items():
        found = compiled.joint(name)
        assert bool(compiled.jnt_limited[found.id]) != joint.rolls
        assert found.range == pytest.approx((0, 0) if joint.rolls else joint.range)
        assert found.axis == pytest.approx(np.array(joint.axis, dtype=float))
        a = design.actuators[joint.actuator or ""]
        limits = compiled.jnt_actfrcrange[found.id]
        assert compiled.jnt_actfrclimited[found.id] == 1
        assert limits == pytest.approx([-a.peak_torque, a.peak_torque])
        dof = int(compiled.jnt_dofadr[found.id])
        for value, expected in (
            (compiled.dof_armature[dof], a.armature),
            (compiled.dof_damping[dof], a.damping),
            (compiled.dof_frictionloss[dof], a.friction_loss),
        ):
            assert np.ravel(value)[0] == pytest.approx(expected)


def test_joints_come_in_the_order_of_the_tree_after_the_floating_base(model: draft.Model) -> None:
    compiled = model.mujoco
    names = [compiled.joint(i).name for i in range(compiled.njnt)]
    floats = model.design.floating
    assert names == [*(["floating_base"] if floats else []), *model.design.joints]
    assert (compiled.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE) == floats
    assert [compiled.body(i).name for i in range(1, compiled.nbody)] == [
        body.name for body in model.design.bodies
    ]


def test_the_robots_file_has_no_actuators_no_scene_and_no_other_file(model: draft.Model) -> None:
    root = ET.fromstring(model.xml)
    tags = {element.tag for element in root.iter()}
    assert not tags & {"actuator", "keyframe", "option", "include", "light", "custom"}
    assert [e.tag for e in root.iter() if "file" in e.attrib] == []
    assert model.mujoco.nu == 0


def test_drawn_size_and_place_of_every_actuator_are_the_designs(model: draft.Model) -> None:
    for body in model.design.bodies:
        if body.actuator is None:
            continue
        geom, a = model.mujoco.geom(f"{body.name}_motor"), body.actuator
        sizes = [a.height / 2, a.width / 2] if a.is_box else [a.radius]
        assert geom.size[: len(sizes) + 1] == pytest.approx([*sizes, a.length / 2])
        z = np.empty(3)
        mujoco.mju_rotVecQuat(z, np.array([0.0, 0.0, 1.0]), geom.quat)
        assert body.link.motor is not None
        axis = np.array(body.link.motor.axis, dtype=float)
        assert abs(z @ axis) == pytest.approx(1)


def test_all_that_a_robot_does_not_weigh_touches_nothing(model: draft.Model) -> None:
    for i in range(model.mujoco.ngeom):
        geom = model.mujoco.geom(i)
        drawn = geom.name.endswith("_pulley")
        assert geom.conaffinity[0] == (0 if drawn else 1)
        assert geom.contype[0] == 0


def test_a_robot_at_zero_angles_stands_on_the_floor(model: draft.Model) -> None:
    if not model.design.floating:
        pytest.skip("its base is fixed")
    data = mujoco.MjData(model.mujoco)
    mujoco.mj_forward(model.mujoco, data)
    feet = [i for i in range(model.mujoco.ngeom) if model.mujoco.geom(i).name.endswith("_end")]
    lows = []
    for i in feet:
        half = model.mujoco.geom_size[i]
        box = model.mujoco.geom_type[i] == mujoco.mjtGeom.mjGEOM_BOX  # Axles of wheels are level.
        down = half[0] if not box else np.abs(data.geom_xmat[i].reshape(3, 3)[2]) @ half
        lows.append(data.geom_xpos[i, 2] - down)
    assert min(lows) == pytest.approx(0, abs=1e-6)


def test_two_builds_of_a_design_are_the_same_text(model: draft.Model) -> None:
    design = model.design
    again = draft.load(design.name).resolve(None if design.label == "default" else design.label)
    rebuilt = again.build()
    assert rebuilt.xml == model.xml
    assert rebuilt.scene_xml == model.scene_xml


def test_a_passive_joint_has_neither_motor_nor_limit() -> None:
    tail = {
        "name": "tail",
        "joint": {"name": "wag", "axis": "z", "range": [-0.4, 0.5]},
        "link": {"axis": "-x", "length": 0.2, "mass": 0.1, "radius": 0.01},
    }
    model = robot(leg(), [{"chain": "leg"}, tail]).resolve().build()
    joint = model.mujoco.joint("wag")
    assert list(joint.range) == [-0.4, 0.5]
    assert model.mujoco.jnt_actfrclimited[joint.id] == 0
    assert model.mujoco.dof_armature[joint.dofadr[0]] == 0
    assert model.scene().nu == 2


def test_a_link_turned_by_rpy_is_turned_in_mujoco() -> None:
    chain = leg(thigh={"rpy": [0.3, -0.2, 0.5]})
    design = robot(chain).resolve()
    model = design.build().mujoco
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for body, (origin, rotation) in zip(design.bodies, design.frames(), strict=True):
        place = data.body(body.name)
        at = np.array(origin, dtype=float) + data.body("trunk").xpos
        assert place.xpos == pytest.approx(at, abs=1e-8)
        turn = np.eye(3) if rotation is None else np.array(rotation, dtype=float)
        assert place.xmat.reshape(3, 3) == pytest.approx(turn, abs=1e-8)


directions = st.tuples(*[st.integers(-9, 9)] * 3).filter(any)


@settings(max_examples=15)
@given(directions, directions)
def test_members_and_actuators_lie_along_their_axes(
    along: tuple[int, ...], across: tuple[int, ...]
) -> None:
    chain = leg(
        thigh={
            "link": {"axis": list(along), "length": 0.3, "segment": "thigh"},
            "motor": {"actuator": "leg", "axis": list(across)},
        }
    )
    children = [{"chain": "leg", "prefix": "L_", "at": [0, 0.3, 0]}]
    children.append({**children[0], "prefix": "R_", "mirror": "y"})
    model = robot(chain, children, allow=["actuator_overlap"]).resolve().build().mujoco
    for side, mirror in (("L_", 1), ("R_", -1)):
        # The thigh's rod is written in two halves.
        for part, axis, middle in (
            ("link", along, 0.075),
            ("link_far", along, 0.225),
            ("motor", across, 0.3),
        ):
            geom = model.geom(f"{side}thigh_{part}")
            z = np.empty(3)
            mujoco.mju_rotVecQuat(z, np.array([0.0, 0.0, 1.0]), geom.quat)
            line = np.array(axis) * (1, mirror, 1) / np.linalg.norm(axis)
            assert abs(z @ line) == pytest.approx(1, abs=1e-9)
            place = np.array(along) * (1, mirror, 1) / np.linalg.norm(along)
            assert geom.pos == pytest.approx(middle * place, abs=1e-9)


def test_a_stated_armature_and_friction_reach_the_joints() -> None:
    drive = {**DRIVE, "armature": 0.123, "friction_loss": 0.4, "damping": 0.05}
    model = robot(actuators={"leg": drive}).resolve().build().mujoco
    assert list(model.dof_armature[6:]) == [0.123, 0.123]
    # Newer releases keep a column per polynomial term; the first is the linear one.
    assert list(model.dof_damping.reshape(model.nv, -1)[6:, 0]) == [0.05, 0.05]
    assert list(model.dof_frictionloss[6:]) == [0.4, 0.4]


@pytest.mark.parametrize(
    "name",
    [
        "floor",
        "thigh_link",
        "thigh_link_far",
        "thigh_motor",
        "shank_end",
        "shank_pulley",
        "thigh_trunk",
    ],
)
def test_the_trunk_may_have_any_name_that_no_link_has(name: str, tmp_path: Path) -> None:
    folder = write_robot(tmp_path / "robot")
    edit(folder, "tree.yaml", "name: trunk", f"name: {name}")
    pulley = "      pulley: {axis: y, radius: 0.01, length: 0.01}\n      sphere"
    edit(folder, "tree.yaml", "      sphere", pulley)
    scene = draft.load(folder).resolve().build().scene()
    geoms = [scene.geom(i).name for i in range(scene.ngeom)]
    assert len(set(geoms)) == len(geoms)
    assert {f"{name}_trunk", "floor", "thigh_link", "shank_end"} <= set(geoms)
