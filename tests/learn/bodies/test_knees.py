"""Knee of a leg: the joint in the middle of the way from hip to foot, whatever the pose."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.design import Design
from draft.learn.bodies.generated import KINDS, generate_kind
from draft.learn.bodies.knees import knee_of
from draft.learn.bodies.legged import LeggedRobot, legged_robot
from draft.learn.bodies.slots import ROLES, slots_of
from draft.learn.bodies.topology import topology
from draft.learn.policy.matching import structure_of
from draft.values import Array

SHIPPED = [
    f"{robot}:{design}"
    for robot in ("quadruped", "hexapod", "biped", "humanoid")
    for design in ("default", *draft.load(robot).designs)
]
SHARED = Path(os.environ.get("DRAFT_SHARED", Path(__file__).parents[3].parent / "shared"))
ROBOTS = SHARED / "robots"
# With long links between hip and thigh, a knee near the hip, axes across the leg that are not
# level, knees that point at each other, and a foot whose inertia is a placeholder.
REAL = (
    *("survey/limx_oli_d04.urdf", "survey/agibot_x1.urdf", "survey/cassie.urdf"),
    *("survey/g1.urdf", "survey/berkeley_humanoid.urdf", "survey/noetix_n2.urdf"),
    *("survey/anymal_b.urdf", "survey/anymal_c.urdf", "survey/unitree_a1.urdf"),
    *("survey/dfki_quad.urdf", "survey/xiaomi_cyberdog2.urdf", "twins/go2/go2_description.urdf"),
)
PITCH, ROLL, YAW = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def down(*lengths: float) -> Array:
    """Points on a straight leg, at these distances from each other [m]."""
    points = np.zeros((len(lengths) + 1, 3))
    points[1:, 2] = -np.cumsum(lengths)
    return points


def folded(points: Array, axes: Array, angles: Array) -> tuple[Array, Array]:
    """Points and axes of a leg with its joints at these angles from there [rad]."""
    points, axes = points.copy(), axes.copy()
    for i, angle in enumerate(angles):
        x, y, z = axes[i]
        skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        turn = np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew
        points[i + 1 :] = (points[i + 1 :] - points[i]) @ turn.T + points[i]
        axes[i + 1 :] = axes[i + 1 :] @ turn.T
    return points, axes


def knees(member: LeggedRobot) -> set[str]:
    """Names of the joints in the slots of knees."""
    slots = zip(member.joints, slots_of(member).joints, strict=True)
    return {joint for joint, slot in slots if slot >= 0 and ROLES[slot % len(ROLES)] == "knee"}


def assert_knees_are_those_of(design: Design) -> None:
    """Check that slots take the hinges of the design's shanks for its knees."""
    chains = topology(design)[1]
    assert knees(legged_robot(design)) == {chain.joints[chain.knee] for chain in chains}


@pytest.mark.parametrize("name", SHIPPED)
def test_the_knees_of_shipped_robots_turn_their_shanks(name: str) -> None:
    robot, _, design = name.partition(":")
    spec = draft.load(robot)
    assert_knees_are_those_of(spec.resolve() if design == "default" else spec.resolve(design))


@pytest.mark.parametrize("kind", KINDS)
def test_the_knees_of_drawn_bodies_turn_their_shanks(kind: str) -> None:
    for member in generate_kind(kind, 20, seed=4).members:
        found = knees(member)
        assert len(found) == len(member.feet)
        assert all(name.endswith("knee") for name in found)


def test_a_drawn_humanoid_with_its_hip_yaw_halfway_down_the_thigh_bends_at_its_knees() -> None:
    (member,) = generate_kind("humanoid", 1, seed=45).members
    assert knees(member) == {"left_knee", "right_knee"}


@pytest.mark.skipif(not ROBOTS.is_dir(), reason="the robots are not beside this folder")
@pytest.mark.parametrize("file", REAL)
@pytest.mark.filterwarnings("ignore")
def test_the_knees_of_real_robots_turn_their_shanks(file: str, tmp_path: Path) -> None:
    from draft.imports.importer import import_robot

    assert_knees_are_those_of(import_robot(ROBOTS / file, tmp_path / "robot").spec.resolve())


ANGLES = st.lists(st.floats(-1.2, 1.2), min_size=5, max_size=5).map(np.array)


@given(share=st.floats(0.0, 1.0), shank=st.floats(0.25, 0.5), angles=ANGLES)
def test_no_place_of_a_yaw_joint_on_the_thigh_makes_it_the_knee(
    share: float, shank: float, angles: Array
) -> None:
    """Nor any angle of the knee, of the ankle or of the yaw itself."""
    axes = np.array([PITCH, ROLL, YAW, PITCH, PITCH])
    thigh = 0.4
    leg = down(0.05, share * thigh, (1 - share) * thigh, shank, 0.06)
    assert knee_of(*folded(leg, axes, angles * [1, 0.3, 1, 1, 0.3]))[0] == 3


@given(thigh=st.floats(0.2, 0.5), shank=st.floats(0.2, 0.5), angles=ANGLES)
def test_the_knee_is_the_same_in_all_poses(thigh: float, shank: float, angles: Array) -> None:
    axes = np.array([ROLL, PITCH, PITCH])
    leg = down(0.08, thigh, shank)
    assert knee_of(leg, axes)[0] == 2
    assert knee_of(*folded(leg, axes, angles[:3]))[0] == 2


@given(angle=st.floats(-2.5, 2.5), turn=st.sampled_from((-1.0, 1.0)))
def test_the_bend_is_the_angle_from_the_straight_leg_about_the_axis(
    angle: float, turn: float
) -> None:
    axes = np.array([ROLL, PITCH, turn * PITCH])
    leg = folded(down(0.05, 0.3, 0.3), axes, np.array([0.4, -0.5, angle]))
    assert knee_of(*leg) == (2, pytest.approx(angle))


def test_a_leg_of_one_joint_has_it_for_its_knee_and_no_bend() -> None:
    assert knee_of(down(0.3), PITCH[None]) == (0, 0.0)


def test_knees_that_a_policy_is_matched_by_are_those_of_the_slots() -> None:
    member = legged_robot(draft.load("quadruped").resolve())
    bends = structure_of(member).bends
    assert {member.joints[i] for i in np.flatnonzero(bends)} == knees(member)
