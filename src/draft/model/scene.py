"""MJCF of the scene of a robot, `scene.xml`: floor, light, home pose, servos and motor data.

Servo gains per peak torque are those of arXiv 2609.38405. A servo deflects under the weight of the
robot, which makes robots with long legs fall over. The home targets compensate for the deflection:
target = angle + torque / stiffness. The servo of a driven wheel has the same damping and no
stiffness: its target is a speed [rad/s], 0 in the home pose.
"""

from __future__ import annotations

import mujoco
import numpy as np

import draft.mujoco_log  # noqa: F401 - before anything is simulated
from draft.design.design import Design
from draft.model.pose import UPRIGHT, base_coordinates
from draft.model.xml import Element
from draft.values import Array, scalar

STIFFNESS = 1.43
DAMPING = 0.071
TIMESTEP = 0.002
# Largest height above the floor at which a point of a foot is in contact in the home pose [m].
_TOUCH = 1e-3


def scene_xml(design: Design, robot: mujoco.MjModel) -> str:
    """MJCF text of the scene, which includes `robot.xml` from the same folder.

    Args:
        design: one design.
        robot: its compiled model.
    """
    pose = home_position(design)
    root = Element("mujoco", model=f"{design.name} scene")
    root.add("include", file="robot.xml")
    root.add("option", timestep=TIMESTEP, integrator="implicitfast")
    _surroundings(root, *_extent(design, robot, pose))
    custom = root.add("custom")
    servos = root.add("actuator")
    keyframe = root.add("keyframe")
    torque_of = dict(zip(design.joints, _gravity_torques(robot, pose), strict=True))
    for name, joint in design.joints.items():
        if (follows := joint.follows) is not None:
            torque_of[follows.joint] += scalar(follows.ratio) * torque_of[name]
    targets = []
    for name, joint in design.joints.items():
        if (actuator := design.drive(joint)) is None:
            continue
        peak, speed = scalar(actuator.peak_torque), scalar(actuator.no_load_speed)
        stall = (scalar(actuator.stall_torque),) if actuator.has_corner else ()
        custom.add("numeric", name=f"{name}_dc_motor", data=(peak, speed, *stall))
        if joint.rolls:
            servos.add(
                "velocity",
                name=name,
                joint=name,
                kv=DAMPING * peak,
                ctrlrange=(-speed, speed),
                forcerange=(-peak, peak),
            )
            targets.append(0.0)
            continue
        stiffness = STIFFNESS * peak
        servos.add(
            "position",
            name=name,
            joint=name,
            kp=stiffness,
            kv=DAMPING * peak,
            forcerange=(-peak, peak),
            inheritrange=1,
        )
        low, high = (scalar(end) for end in joint.range)
        lead = np.clip(torque_of[name], -peak, peak) / stiffness
        targets.append(float(np.clip(scalar(joint.home) + lead, low, high)))
    keyframe.add("key", name="home", qpos=pose.tolist(), ctrl=targets or None)
    return root.text()


def home_position(design: Design) -> Array:
    """Position `qpos` of the home pose with the feet on the floor [m, rad], shape (nq,)."""
    joints = [scalar(joint.home) for joint in design.joints.values()]
    if not design.floating:
        return np.array(joints)
    return np.array([0.0, 0.0, scalar(design.lowest(home=True)), *UPRIGHT[3:], *joints])


def home(design: Design, robot: mujoco.MjModel) -> mujoco.MjData:
    """State of a robot in its home pose, standing at z = 0 above the origin."""
    data = mujoco.MjData(robot)
    data.qpos[:] = home_position(design)
    mujoco.mj_kinematics(robot, data)
    return data


def _extent(
    design: Design, robot: mujoco.MjModel, pose: Array
) -> tuple[tuple[float, float, float], float]:
    """Centre [m] and extent [m] of what a viewer shows first."""
    if design.floating:
        return (0, 0, pose[2] / 2), 1.5 * abs(pose[2]) + 0.3
    x, y, z = robot.stat.center
    return (x, y, z), robot.stat.extent


def _surroundings(root: Element, center: tuple[float, float, float], extent: float) -> None:
    root.add("statistic", center=center, extent=extent)
    visual = root.add("visual")
    visual.add("global", azimuth=130, elevation=-15)
    visual.add("headlight", ambient=(0.35, 0.35, 0.35), diffuse=(0.5, 0.5, 0.5))
    asset = root.add("asset")
    asset.add(
        "texture",
        name="sky",
        type="skybox",
        builtin="gradient",
        rgb1=(0.92, 0.94, 0.97),
        rgb2=(0.75, 0.80, 0.86),
        width=256,
        height=256,
    )
    asset.add(
        "texture",
        name="floor",
        type="2d",
        builtin="checker",
        rgb1=(0.82, 0.84, 0.86),
        rgb2=(0.76, 0.78, 0.80),
        width=256,
        height=256,
    )
    asset.add("material", name="floor", texture="floor", texrepeat=(2, 2), texuniform="true")
    world = root.add("worldbody")
    world.add("light", pos=(1, -1.5, 4), dir=(-0.25, 0.35, -1), type="directional")
    world.add("geom", name="floor", type="plane", size=(0, 0, 0.05), material="floor")


def _gravity_torques(robot: mujoco.MjModel, pose: Array) -> Array:
    """Joint torques of a robot standing in a pose, or bolted to the world [N m], shape (joints,).

    The contact forces are vertical, act at the points of the feet that touch the floor, and have
    the smallest norm of all forces that balance the weight.
    """
    data = mujoco.MjData(robot)
    data.qpos[:] = pose
    mujoco.mj_forward(robot, data)
    _, dofs = base_coordinates(robot)
    torques = data.qfrc_bias[dofs:].copy()
    points = foot_points(robot, data)
    if not dofs or not points:
        return torques
    x = np.array([point - data.subtree_com[1] for _, point in points])
    balance = np.vstack([np.ones(len(x)), x[:, 0], x[:, 1]])
    weight = robot.body_subtreemass[1] * -robot.opt.gravity[2]
    forces = np.linalg.lstsq(balance, np.array([weight, 0.0, 0.0]), rcond=None)[0]
    jacobian = np.zeros((3, robot.nv))
    for (body, point), force in zip(points, forces, strict=True):
        mujoco.mj_jac(robot, data, jacobian, None, point, body)
        torques -= jacobian[2, dofs:] * force
    return torques


def foot_points(robot: mujoco.MjModel, data: mujoco.MjData) -> list[tuple[int, Array]]:
    """Body and position [m] of each point of a foot that touches the floor."""
    points = []
    for i in range(robot.ngeom):
        if not robot.geom(i).name.endswith("_end"):
            continue
        center, size = data.geom_xpos[i], robot.geom_size[i]
        if robot.geom_type[i] == mujoco.mjtGeom.mjGEOM_SPHERE:
            corners = [center - np.array([0, 0, size[0]])]
        elif robot.geom_type[i] == mujoco.mjtGeom.mjGEOM_CYLINDER:
            axis = data.geom_xmat[i].reshape(3, 3)[:, 2]
            down = axis[2] * axis - np.array([0.0, 0.0, 1.0])
            corners = [center + size[0] * down / max(float(np.linalg.norm(down)), 1e-9)]
        else:
            frame = data.geom_xmat[i].reshape(3, 3)
            signs = [np.array([a, b, -1]) for a in (1, -1) for b in (1, -1)]
            corners = [center + frame @ (sign * size) for sign in signs]
        points += [(int(robot.geom_bodyid[i]), c) for c in corners if abs(c[2]) < _TOUCH]
    return points
