"""A driven wheel is a joint without limits and a servo of its speed, and rolls on a floor."""

from __future__ import annotations

import json
import math
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
import pytest

import draft
from draft.model.scene import DAMPING
from draft.model.simulate import simulate
from draft.values import scalar
from tests.helpers import parameter, wheeled


@pytest.fixture(scope="module")
def model() -> draft.Model:
    return wheeled().resolve().build()


def rolls(model: draft.Model) -> list[str]:
    """Names of the joints of wheels."""
    return [name for name, joint in model.design.joints.items() if joint.rolls]


def test_a_driven_wheel_has_a_servo_of_its_speed_and_no_limits(model: draft.Model) -> None:
    scene, wheels = model.scene(), rolls(model)
    assert len(wheels) == 4
    for name in wheels:
        a = model.design.actuators["wheel"]
        peak, speed = scalar(a.peak_torque), scalar(a.no_load_speed)
        servo, joint = scene.actuator(name), scene.joint(name)
        assert scene.jnt_limited[joint.id] == 0
        assert joint.range.tolist() == [0.0, 0.0]
        assert servo.gainprm[0] == pytest.approx(DAMPING * peak)
        assert servo.biasprm[:3] == pytest.approx([0.0, 0.0, -DAMPING * peak])
        assert servo.ctrlrange == pytest.approx([-speed, speed])
        assert servo.forcerange == pytest.approx([-peak, peak])
        assert scene.numeric(f"{name}_dc_motor").data == pytest.approx([peak, speed])
        assert scene.key("home").ctrl[servo.id] == 0.0
    assert scene.nu == len(model.design.joints)


def test_a_wheel_on_a_stand_spins_up_as_a_motor_with_a_straight_line_does(
    model: draft.Model,
) -> None:
    """J w' = T0 (1 - w / w0) - b w - f: exponential, to w* = (T0 - f) / (T0 / w0 + b)."""
    stand = mujoco.MjModel.from_xml_string(model.xml)
    stand.opt.gravity[:] = 0.0
    stand.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    stand.opt.timestep = 1e-4
    data = mujoco.MjData(stand)
    motor, dofs = model.design.actuators["wheel"], []
    for name in rolls(model):  # All turn alike and opposite pairs hold the trunk still.
        dofs.append(int(stand.joint(name).dofadr[0]))
    stand.body_mass[1:3] *= 1e6
    stand.body_inertia[1] *= 1e6
    for name in (n for n in model.design.joints if n not in rolls(model)):
        stand.dof_armature[stand.joint(name).dofadr[0]] += 1e6
    mujoco.mj_setConst(stand, data)
    disc = 0.6 * 0.09**2 / 2
    inertia = disc + scalar(motor.armature)
    peak, speed = scalar(motor.peak_torque), scalar(motor.no_load_speed)
    slope = peak / speed + scalar(motor.damping)
    final = (peak - scalar(motor.friction_loss)) / slope
    while data.time < 2 * inertia / slope:
        data.qfrc_applied[dofs] = [scalar(motor.available(abs(w))) for w in data.qvel[dofs]]
        mujoco.mj_step(stand, data)
        wanted = final * (1 - math.exp(-slope * data.time / inertia))
        assert data.qvel[dofs] == pytest.approx(wanted, rel=0.01, abs=0.05)
    assert data.qvel[dofs[0]] > 0.8 * final


def test_the_servos_roll_the_robot_at_the_speed_that_they_are_told(model: draft.Model) -> None:
    scene = model.scene()
    data = mujoco.MjData(scene)
    mujoco.mj_resetDataKeyframe(scene, data, 0)
    wheels = [scene.actuator(name).id for name in rolls(model)]
    while data.time < 3.0:
        data.ctrl[wheels] = min(5.0 * data.time, 10.0)
        mujoco.mj_step(scene, data)
    assert data.qvel[0] == pytest.approx(0.09 * 10.0, rel=0.1)
    assert abs(data.qpos[1]) < 0.05
    assert not [one for one in simulate(model.design, scene) if one.id != "start_penetration"]


def test_exports_know_a_wheel_as_continuous_and_give_the_gain_of_its_speed(
    model: draft.Model, tmp_path: Path
) -> None:
    folder = model.save(tmp_path / "out", formats=("urdf", "glb", "mjcf"))
    root = ET.parse(folder / "robot.urdf").getroot()
    found = {joint.get("name"): joint for joint in root.iter("joint")}
    table = json.loads((folder / "actuators.json").read_text())["joints"]
    for name in rolls(model):
        limit = found[name].find("limit")
        assert found[name].get("type") == "continuous"
        assert limit is not None
        assert limit.get("lower") is None
        assert "range" not in table[name]
        assert table[name]["kp"] == 0.0
        assert table[name]["kd"] == pytest.approx(DAMPING * 12.0)
    again = mujoco.MjModel.from_xml_path(str(folder / "robot.urdf"))
    assert sorted(again.joint(i).name for i in range(again.njnt) if not again.jnt_limited[i]) == (
        sorted(rolls(model))
    )


def test_many_robots_on_wheels_are_those_built_one_by_one() -> None:
    disc = {"radius": "tyre", "width": 0.04, "axis": "y", "mass": 0.6, "site": "foot"}
    spec = wheeled({"wheel": disc}, parameters={"tyre": parameter(0.09, 0.05, 0.2)})
    many = spec.resolve({"tyre": np.array([0.07, 0.11])})
    batch = many.build_batch()
    for row in range(2):
        alone = many[row].build().mujoco
        geom = alone.geom("FL_rim_end").id
        assert batch.model(row).geom_size[geom] == pytest.approx(alone.geom_size[geom])
        assert batch.model(row).jnt_limited.tolist() == alone.jnt_limited.tolist()
