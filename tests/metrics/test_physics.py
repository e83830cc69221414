"""The formulas behind the metrics, against MuJoCo, by hand, and by laws that physics keeps."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.design import loads
from draft.design.crouch import CROUCH, leg_frames
from draft.design.legs import crouch, legs
from draft.metrics import impact, of_design, statics
from draft.model.model import TOLERANCE
from draft.values import Array
from tests.helpers import leg, robot
from tests.metrics.test_registry import SHIPPED, shipped

HIP: dict[str, Any] = {"name": "hip", "axis": "y", "range": [-2, 2], "actuator": "leg"}
KNEE: dict[str, Any] = {"name": "knee", "axis": "y", "range": [-2.5, 0], "actuator": "leg"}
PLANAR = robot(leg(thigh={"joint": HIP}, shank={"joint": KNEE}))
A, B = 0.3, 0.25


def tuned(design: draft.Design, **factors: float) -> draft.Design:
    """The same robot with some numbers of its actuators multiplied."""
    actuators = {
        name: replace(a, **{key: getattr(a, key) * by for key, by in factors.items()})
        for name, a in design.actuators.items()
    }
    return replace(design, actuators=actuators)


def posed(model: draft.Model, home: bool = False) -> tuple[mujoco.MjData, dict[str, Array], Array]:
    """The model in the crouch or at home: data, Jacobian (3, nv) of every foot, and M(q)."""
    robot, design = model.mujoco, model.design
    data = mujoco.MjData(robot)
    data.qpos[:] = 0
    data.qpos[3] = 1
    at_home = {name: joint.home for name, joint in design.joints.items()}
    angles = at_home if home else crouch(design)
    for name, angle in angles.items():
        data.qpos[robot.joint(name).qposadr[0]] = angle
    mujoco.mj_forward(robot, data)
    feet = {}
    for kind in legs(design):
        for foot in kind.feet:
            body = design.bodies[foot]
            here = robot.body(body.name).id
            tip = np.array(body.link.tip, dtype=float)
            jacobian = np.empty((3, robot.nv))
            point = data.xpos[here] + data.xmat[here].reshape(3, 3) @ tip
            mujoco.mj_jac(robot, data, jacobian, None, point, here)
            feet[body.name] = jacobian
    inertia = np.empty((robot.nv, robot.nv))
    mujoco.mj_fullM(robot, data, inertia)
    return data, feet, inertia


# --- kinematics ----------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "label"), SHIPPED)
def test_levers_are_those_of_mujoco(name: str, label: str | None) -> None:
    design = shipped(name, label)
    model = design.build()
    _, feet, _ = posed(model)
    for kind in legs(design):
        for place, foot in enumerate(kind.feet):
            jacobian = feet[design.bodies[foot].name]
            for joint in kind.joints:
                column = jacobian[:, model.mujoco.joint(joint.names[place]).dofadr[0]]
                assert abs(joint.lift) == pytest.approx(abs(column[2]), abs=1e-12)
                assert abs(joint.sweep) == pytest.approx(abs(column[0]), abs=1e-12)


@pytest.mark.parametrize(("name", "label"), SHIPPED)
@pytest.mark.parametrize("home", [False, True], ids=["crouch", "home"])
def test_torques_are_mujocos_inverse_statics(name: str, label: str | None, home: bool) -> None:
    design = shipped(name, label)
    model = design.build()
    data, feet, _ = posed(model, home)
    force = model.mujoco.body_subtreemass[1] * 9.81 / len(feet)
    held = data.qfrc_bias - sum(force * jacobian[2] for jacobian in feet.values())
    found = loads.home_loads(design) if home else statics.loads(design)
    for load in found:
        for joint in load.joint.names:
            torque = held[model.mujoco.joint(joint).dofadr[0]]
            assert abs(torque) == pytest.approx(abs(load.torque), rel=TOLERANCE, abs=1e-9)


@pytest.mark.parametrize(("name", "label"), SHIPPED)
def test_the_foot_is_below_the_hip_at_the_crouch(name: str, label: str | None) -> None:
    design = shipped(name, label)
    for kind in legs(design):
        angles = {joint.body: joint.angle for joint in kind.joints}
        frames = leg_frames(design, kind.joints[0].body, angles)
        pitch = [j for j in kind.joints if abs(j.sweep) > 1e-3]
        hip: Any = frames[pitch[0].body][0]
        ankle: Any = frames[pitch[-1].body][0]
        if pitch[-1] is kind.knee:
            tip: Any = design.bodies[kind.feet[0]].link.tip
            origin: Any
            origin, rotation = frames[kind.feet[0]]
            rows: Any = np.eye(3) if rotation is None else rotation
            ankle = np.array(origin) + np.array(rows, dtype=float) @ np.array(tip)
        assert ankle[0] - hip[0] == pytest.approx(0, abs=1e-12)
        assert hip[2] - ankle[2] == pytest.approx(CROUCH * kind.length)


def test_legs_of_the_shipped_robots() -> None:
    found = {
        name: [(k.copies, len(k.joints)) for k in legs(shipped(name, d))] for name, d in SHIPPED
    }
    assert found == {"quadruped": [(2, 3), (2, 3)], "humanoid": [(2, 6)], "hopper": [(1, 2)]}


# --- statics -------------------------------------------------------------------------------


def test_a_planar_leg_by_hand() -> None:
    design = PLANAR.resolve()
    found = of_design(design)
    span = CROUCH * (A + B)
    bend = math.acos((span**2 - A**2 - B**2) / (2 * A * B))
    # Distance of the knee from the line from hip to foot: twice the triangle's area over its base.
    lever = A * B * math.sin(bend) / span
    drive = design.actuators["leg"]
    assert found["leg_length"] == pytest.approx(A + B)
    assert found["reach"] == pytest.approx(A + B + 0.02)
    assert found["foot_force"] == pytest.approx(drive.peak_torque / lever / (9.81 * design.mass))
    knee_height = math.sqrt(B**2 - lever**2)
    assert found["foot_speed"] == pytest.approx(drive.no_load_speed * (span + knee_height))
    assert found["top_speed"] == pytest.approx(
        min(0.74 * drive.no_load_speed * B, 1.13 * math.sqrt(9.81 * (A + B)))
    )
    (kind,) = legs(design)
    assert abs(kind.knee.lift) == pytest.approx(lever)
    assert abs(kind.joints[0].lift) == pytest.approx(0, abs=1e-12)


@given(st.floats(0.1, 10))
def test_more_torque_holds_and_presses_more_and_heats_no_more(by: float) -> None:
    design = draft.load("quadruped").resolve("bear")
    before, after = of_design(design), of_design(tuned(design, peak_torque=by))
    assert after["torque_margin"] == pytest.approx(by * before["torque_margin"])
    assert after["foot_force"] == pytest.approx(by * before["foot_force"])
    # By the line the heat falls with the torque; by the rating, which is what it was, it stays.
    drive = design.actuators["leg"]
    line = 0.453125 * float(drive.no_load_speed) / (by * float(drive.peak_torque))
    heat = min(line / float(drive.copper_loss), 1.0)
    assert after["cost_of_standing"] == pytest.approx(before["cost_of_standing"] * heat)
    assert after["foot_speed"] == before["foot_speed"]


@pytest.mark.parametrize(("name", "label"), SHIPPED)
def test_gravity_doubles_every_torque(
    name: str, label: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = of_design(shipped(name, label))
    monkeypatch.setattr(statics, "GRAVITY", 2 * statics.GRAVITY)
    monkeypatch.setattr(loads, "GRAVITY", 2 * loads.GRAVITY)
    after = of_design(shipped(name, label))
    assert after["torque_margin"] == pytest.approx(before["torque_margin"] / 2)
    assert after["cost_of_standing"] == pytest.approx(before["cost_of_standing"] * 4)
    assert after["foot_force"] == pytest.approx(before["foot_force"] / 2)


def test_who_cannot_stand_has_no_payload() -> None:
    weak = tuned(draft.load("quadruped").resolve("cheetah"), peak_torque=0.05)
    assert statics.torque_margin(weak) < 1
    assert statics.payload_peak(weak) < 0


# --- impact --------------------------------------------------------------------------------


def with_armature(design: draft.Design, armature: float) -> draft.Model:
    """A model of the design whose rotors all have another inertia."""
    model = design.build()
    driven = model.mujoco.dof_armature > 0
    model.mujoco.dof_armature[driven] = armature
    return model


@pytest.mark.parametrize(("name", "label"), SHIPPED)
def test_infinite_rotors_mitigate_nothing(name: str, label: str | None) -> None:
    design = shipped(name, label)
    free, real = (with_armature(design, x) for x in (1e-9, 0.1))
    stiff = with_armature(design, 1e9)
    assert 1 > impact.impact_mitigation(free) > impact.impact_mitigation(real) > 0
    assert impact.impact_mitigation(stiff) == pytest.approx(0, abs=1e-6)
    assert impact.reflected_share(free) == pytest.approx(0, abs=1e-6)
    assert impact.reflected_share(stiff) == pytest.approx(1, abs=1e-6)
    assert impact.foot_inertia(stiff) > impact.foot_inertia(real) > impact.foot_inertia(free)


@pytest.mark.parametrize(("name", "label"), SHIPPED)
def test_an_impulse_at_the_foot_moves_it_by_its_apparent_mass(name: str, label: str | None) -> None:
    design = shipped(name, label)
    model = design.build()
    _, feet, inertia = posed(model)
    for foot, (free, locked) in impact.apparent_masses(model).items():
        row = feet[foot][2]
        speeds = np.linalg.inv(inertia) @ row
        assert row @ speeds == pytest.approx(1 / free)
        assert 0 < free < locked <= design.mass * (1 + 1e-9)


def test_a_foot_below_the_whole_mass_carries_all_of_it_when_locked() -> None:
    (pair,) = impact.apparent_masses(PLANAR.resolve().build()).values()
    mass = PLANAR.resolve().mass
    # The trunk's centre is above the foot up to what the leg leans.
    assert pair[1] == pytest.approx(mass, rel=0.02)
