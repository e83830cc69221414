"""What learning reads off a design, what it refuses, and real quadrupeds."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import json
import os
import shutil
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

import draft
from draft.errors import DraftError, RefusedError
from draft.learn.bodies.legged import (
    CLASSES,
    LeggedRobot,
    check_family,
    legged_robot,
    lowest_point,
)
from draft.learn.bodies.legged_batch import legged_robots
from tests.helpers import wheeled
from tests.learn.small import member

SHIPPED = Path(draft.__file__).parent / "robots" / "quadruped"
SHARED = Path(os.environ.get("DRAFT_SHARED", Path(__file__).parents[3].parent / "shared"))
ROBOTS = SHARED / "robots"
REAL = {
    "go2": "twins/go2/go2_description.urdf",
    "b2": "twins/b2/b2_description.urdf",
    "anymal_c": "survey/anymal_c.urdf",
    "lite3": "survey/deeprobotics_lite3.urdf",
    "a2": "survey/unitree_a2.urdf",
    "zsl1": "survey/zsibot_zsl1.urdf",
}
# Leg [m], scale, torque [N m], speed [rad/s], estimated top speed [m/s]: study, sections 2 and 7.
NUMBERS = {
    "cheetah": (0.48, 1.000, 72, 40, 2.452),
    "bear": (0.74, 1.542, 450, 11.31, 3.013),
    "giraffe": (1.30, 2.708, 332, 3.93, 1.774),
}


def changed(folder: Path, *edits: tuple[str, str]) -> draft.Design:
    """The shipped quadruped with its tree changed."""
    shutil.copytree(SHIPPED, folder)
    tree = folder / "tree.yaml"
    text = tree.read_text(encoding="utf-8")
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    tree.write_text(text, encoding="utf-8")
    return draft.load(folder).resolve()


@pytest.mark.parametrize("name", NUMBERS)
def test_numbers_of_the_shipped_designs(name: str) -> None:
    found = member(name)
    leg, scale, torque, speed, top = NUMBERS[name]
    assert found.name == f"quadruped:{name}"
    assert found.leg_length == pytest.approx(leg)
    assert found.scale == pytest.approx(scale, abs=5e-4)
    assert found.peak_torque == pytest.approx((torque,) * 12)
    assert found.no_load_speed == pytest.approx((speed,) * 12)
    assert found.top_speed == pytest.approx(top, abs=5e-4)
    assert found.home == (0.0, 0.5, -1.0) * 4
    assert found.ranges == ((-0.8, 0.8), (-2.5, 2.5), (-2.8, 0.0)) * 4
    assert found.feet == ("FL_foot", "FR_foot", "RL_foot", "RR_foot")
    assert found.leg_joints == ((0, 1, 2), (3, 4, 5), (6, 7, 8), (9, 10, 11))
    assert [found.joints[i] for i in found.leg_joints[1]] == [
        "FR_hip_roll",
        "FR_hip_pitch",
        "FR_knee",
    ]
    assert found.leg_mirror == (1, 0, 3, 2)
    assert found.mirror == (3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8)
    assert found.mirror_sign == (-1.0, 1.0, 1.0) * 4
    # Near the crouch's 0.878 L and the foot's radius (study, section 5).
    assert found.height == pytest.approx(0.878 * leg + found.foot_radius, abs=1e-3 * leg)


def test_it_goes_through_json() -> None:
    found = member("bear")
    assert LeggedRobot.from_dict(json.loads(json.dumps(found.as_dict()))) == found
    with pytest.raises(KeyError):
        LeggedRobot.from_dict({"name": "bear"})


def assert_mirrored(found: LeggedRobot, seed: int, tolerance: float = 1e-9) -> None:
    """Check that a random pose mirrored in y has the mirrored feet, and anchors of joints."""
    model = mujoco.MjModel.from_xml_string(found.xml)
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    low, high = np.array(found.ranges).T
    pose, mirror = rng.uniform(low, high), list(found.mirror)
    other = (np.array(found.mirror_sign) * pose)[mirror]
    ids = [model.joint(name).id for name in found.joints]
    feet, anchors = [], []
    for angles in (pose, other):
        data.qpos[:7], data.qpos[7:] = (0, 0, 0, 1, 0, 0, 0), angles
        mujoco.mj_kinematics(model, data)
        feet.append(np.array([data.site(name).xpos for name in found.feet]))
        anchors.append(data.xanchor[ids].copy())
    sides = list(found.leg_mirror)
    np.testing.assert_allclose(feet[1][sides], feet[0] * (1, -1, 1), atol=tolerance)
    np.testing.assert_allclose(anchors[1][mirror], anchors[0] * (1, -1, 1), atol=tolerance)


@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("seed", range(5))
def test_a_mirrored_pose_has_mirrored_feet(name: str, seed: int) -> None:
    assert_mirrored(member(name), seed)


@pytest.mark.skipif(not ROBOTS.is_dir(), reason="the robots are not beside this folder")
@pytest.mark.parametrize("name", REAL)
@pytest.mark.filterwarnings("ignore")
def test_real_quadrupeds_come_through_the_import(name: str, tmp_path: Path) -> None:
    from draft.imports.importer import import_robot

    found = legged_robot(import_robot(ROBOTS / REAL[name], tmp_path / name).spec.resolve())
    assert_mirrored(found, 0, 2e-3)  # Makers round their descriptions of the two sides.
    assert sorted(i for leg in found.leg_joints for i in leg) == list(range(12))
    assert all(len(leg) > 0 for leg in found.upper_legs)
    assert 0.4 * found.leg_length < found.height < found.leg_length + 2 * found.foot_radius
    if name == "go2":
        assert found.leg_length == pytest.approx(0.213 * 2, abs=1e-3)
        assert found.peak_torque == pytest.approx((23.7, 23.7, 45.43) * 4)
        assert found.no_load_speed == pytest.approx((30.1, 30.1, 15.7) * 4)


ROLL = "name: hip_roll, axis: x"
SPHERE = """      type: sphere
      joint: {name: knee, axis: y, range: [-2.8, 0], actuator: leg, home: -crouch}
      link: {axis: -z, length: shank_length, segment: shank, radius: shank_radius}
      sphere: {radius: foot_radius, site: foot}"""
PLATE = """      type: foot
      joint: {name: knee, axis: y, range: [-2.8, 0], actuator: leg, home: -crouch}
      link: {axis: -z, length: shank_length, segment: shank, radius: shank_radius}
      plate: {length: 0.1, width: 0.05, thickness: 0.01, offset: 0, site: foot}"""
RIGHT_REAR = (
    "    - {chain: leg, prefix: RR_, at: [trunk_length / 2, hip_spacing / 2, 0], mirror: xy}\n"
)
ONLY = (
    "use a robot with left and right legs, each with a knee (a driven hinge of a link of "
    "`segment: shank`) and a foot with a site, whose joints are all driven"
)
LEG = "    - {chain: leg, prefix: FL_,"
MIDDLE = "".join(
    f"    - {{chain: leg, prefix: {side}, at: [0, hip_spacing / 2, 0]{mirror}}}\n"
    for side, mirror in (("ML_", ""), ("MR_", ", mirror: y"))
)


def arm(axis: str = "y", at: str = "") -> tuple[tuple[str, str], ...]:
    """Edits that hang a one-jointed arm from the trunk."""
    chain = f"""
  arm:
    - name: shoulder_motor
      motor: {{actuator: leg, axis: y}}
    - name: upper_arm
      joint: {{name: shoulder, axis: {axis}, range: [-1, 1], actuator: leg}}
      link: {{axis: z, length: 0.2, segment: thigh}}

tree:"""
    return ("\ntree:", chain), (LEG, f"    - {{chain: arm{at}}}\n{LEG}")


MOTOR = "    - name: shoulder_motor\n      motor: {actuator: leg, axis: y}\n"
NO_MOTOR = (MOTOR, ""), ("range: [-1, 1], actuator: leg}", "range: [-1, 1]}")


def walker(name: str, folder: Path) -> LeggedRobot:
    """A robot that is no quadruped with three joints on every leg, or is one with other axes."""
    edits = {
        "hexapod": ((LEG, MIDDLE + LEG),),
        "yaw": ((ROLL, "name: hip_roll, axis: z"),),
        "plates": ((SPHERE, PLATE),),
        "arm": arm(),
    }
    return member(name) if name not in edits else legged_robot(changed(folder, *edits[name]))


@pytest.mark.parametrize(
    ("name", "legs", "classes"),
    [
        ("hexapod", 6, ("hip roll", "hip pitch", "knee")),
        ("arm", 4, ("shoulder", "hip roll", "hip pitch", "knee")),
        ("plates", 4, CLASSES),
        ("yaw", 4, CLASSES),
        (
            "humanoid",
            2,
            (
                *("shoulder pitch", "shoulder roll", "shoulder yaw", "elbow"),
                *("wrist yaw", "wrist pitch", "wrist roll"),
                *("waist roll", "waist pitch", "waist yaw"),
                *("hip pitch", "hip roll", "hip yaw", "knee", "ankle pitch", "ankle roll"),
            ),
        ),
    ],
)
def test_other_legged_robots_are_found_by_their_structure(
    name: str, legs: int, classes: tuple[str, ...], tmp_path: Path
) -> None:
    found = walker(name, tmp_path / "robot")
    assert len(found.feet) == len(found.leg_joints) == len(found.upper_legs) == legs
    assert all(found.upper_legs)
    assert found.classes == classes
    names = [joint.replace("_", " ") for joint in found.joints]
    assert all(n.endswith(classes[k]) for n, k in zip(names, found.joint_classes, strict=True))
    assert_mirrored(found, 3)


def test_feet_touch_the_ground_in_the_home_pose(tmp_path: Path) -> None:
    for name in ("cheetah", "hexapod", "plates", "humanoid"):
        found = walker(name, tmp_path / name)
        spec = mujoco.MjSpec.from_string(found.xml)
        floor = mujoco.mjtGeom.mjGEOM_PLANE
        spec.worldbody.add_geom(name="floor", type=floor, size=[5, 5, 1])
        model = spec.compile()
        data = mujoco.MjData(model)
        data.qpos[:7] = (0, 0, found.height + 1e-4, 1, 0, 0, 0)
        data.qpos[7:] = found.home
        mujoco.mj_forward(model, data)
        gaps = [
            mujoco.mj_geomDistance(
                model, data, model.geom(geom).id, model.geom("floor").id, 1, None
            )
            for geom in found.foot_geoms
        ]
        assert min(gaps) == pytest.approx(1e-4, abs=1e-6)


@pytest.mark.parametrize(
    ("edits", "cause"),
    [
        (((RIGHT_REAR, ""),), "its legs are not pairs of a left and a right one"),
        (arm(at=", at: [0, 0.1, 0]"), "its joint shoulder has no counterpart on the other side"),
        ((*arm(), *NO_MOTOR), "its joint shoulder has no actuator"),
    ],
    ids=["three legs", "an arm on one side", "a passive joint"],
)
def test_robots_that_cannot_be_trained_are_refused_with_the_cause(
    tmp_path: Path, edits: tuple[tuple[str, str], ...], cause: str
) -> None:
    with pytest.raises(DraftError) as caught:
        legged_robot(changed(tmp_path / "robot", *edits))
    assert str(caught.value) == f"quadruped cannot be trained: {cause}\n  {ONLY}"


def test_a_robot_on_driven_wheels_is_trained_with_the_speeds_of_its_wheels() -> None:
    found = legged_robot(wheeled().resolve())
    wheels = [name for name, rolls in zip(found.joints, found.rolls, strict=True) if rolls]
    assert wheels == ["FL_roll", "FR_roll", "RL_roll", "RR_roll"]
    assert found.foot_radius == 0.09


@pytest.mark.parametrize("tilt", [0.0, 0.2, -0.7, np.pi / 2])
def test_a_wheel_with_a_tilted_axle_stands_on_its_rim(tilt: float) -> None:
    quat = f"{np.cos(np.pi / 4 + tilt / 2)} {np.sin(np.pi / 4 + tilt / 2)} 0 0"
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><worldbody><body pos="0 0 1"><geom name="wheel" type="cylinder"
        size="0.09 0.02" quat="{quat}"/></body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    angle = np.linspace(0, 2 * np.pi, 721)
    rims = [(0.09 * np.cos(a), 0.09 * np.sin(a), side) for a in angle for side in (-0.02, 0.02)]
    points = data.geom("wheel").xpos + np.array(rims) @ data.geom("wheel").xmat.reshape(3, 3).T
    assert lowest_point(model, data, "wheel") == pytest.approx(points[:, 2].min(), abs=1e-6)


@pytest.mark.parametrize("angle", [0.0, 0.4])
def test_legs_without_a_home_pose_crouch_and_other_joints_stay(
    angle: float, tmp_path: Path
) -> None:
    bare = ((", home: crouch / 2", ""), (", home: -crouch", ""))
    stated = ("range: [-1, 1], actuator: leg}", f"range: [-1, 1], actuator: leg, home: {angle}}}")
    design = changed(tmp_path / "robot", *bare, *arm(), stated)
    found = legged_robot(design)
    home = dict(zip(found.joints, found.home, strict=True))
    assert home["shoulder"] == angle
    assert home["FL_knee"] < -0.5
    lengths = np.array([0.22, 0.25])
    many = draft.load(tmp_path / "robot").resolve({"thigh_length": lengths})
    for row, one in legged_robots(many, np.arange(2)).items():
        assert one.home == pytest.approx(legged_robot(many[row]).home, rel=1e-12)


@pytest.mark.parametrize(("least", "share"), [(-2.8, 1.0), (-0.95, 0.9), (-0.55, 0.5)])
def test_the_crouch_is_as_deep_as_the_ranges_allow(
    least: float, share: float, tmp_path: Path
) -> None:
    bare = ((", home: crouch / 2", ""), (", home: -crouch", ""))
    edits = (*bare, ("range: [-2.8, 0]", f"range: [{least}, 0]"))
    found = legged_robot(changed(tmp_path / "robot", *edits))
    home = dict(zip(found.joints, found.home, strict=True))
    deepest = legged_robot(changed(tmp_path / "deepest", *bare)).home
    knee = found.joints.index("FL_knee")
    assert home["FL_knee"] == pytest.approx(share * deepest[knee])
    assert home["FL_hip_pitch"] == pytest.approx(share * deepest[knee - 1])


def test_an_anchor_of_a_joint_in_the_middle_may_lie_aside_on_its_axis(tmp_path: Path) -> None:
    found = legged_robot(changed(tmp_path / "robot", *arm("y", at=", at: [0, 0.05, 0]")))
    shoulder = found.joints.index("shoulder")
    assert (found.mirror[shoulder], found.mirror_sign[shoulder]) == (shoulder, 1.0)


@pytest.mark.parametrize(("axis", "sign"), [("x", -1.0), ("y", 1.0), ("z", -1.0)])
def test_a_joint_in_the_middle_mirrors_to_itself(axis: str, sign: float, tmp_path: Path) -> None:
    found = legged_robot(changed(tmp_path / "robot", *arm(axis)))
    shoulder = found.joints.index("shoulder")
    assert (found.mirror[shoulder], found.mirror_sign[shoulder]) == (shoulder, sign)


def test_a_robot_on_one_leg_and_a_design_that_the_filter_refuses_are_refused() -> None:
    with pytest.raises(DraftError, match="hopper cannot be trained: it has one leg"):
        legged_robot(draft.load("hopper").resolve())
    with pytest.raises(RefusedError):
        legged_robot(draft.load("quadruped").resolve({"actuators.leg.peak_torque": 600}))


def test_designs_of_another_topology_are_no_family() -> None:
    first = member("cheetah")
    check_family([first, member("bear"), member("giraffe")])
    other = replace(first, name="other", feet=("a", "b", "c", "d"))
    with pytest.raises(
        DraftError, match="other has another topology than quadruped:cheetah: its feet"
    ):
        check_family([first, other])
