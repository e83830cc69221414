"""Export to URDF, with the mesh of the trunk and a table of the actuators.

All numbers are those of the compiled MuJoCo model: frames, shapes, and inertials as full tensors
about the centre of mass in the axes of the link. Bodies without a joint are links on fixed joints.
The root link is the trunk; the program that reads the file adds its six degrees of freedom. A fixed
base is on a fixed joint of the link `world`, which readers of URDF take for the world. MuJoCo reads
its settings from the element `mujoco`, which other programs ignore.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from draft.design.design import Body, Design
from draft.model.mjcf import colors
from draft.model.scene import DAMPING, STIFFNESS
from draft.model.shapes import Shape, matrix, mesh_geoms, shapes
from draft.model.xml import Element
from draft.spec.primitives.base import HIDDEN
from draft.spec.primitives.loft import Loft
from draft.spec.primitives.mesh import Mesh
from draft.values import Array, scalar

if TYPE_CHECKING:
    from draft.model.model import Model

DECLARATION = '<?xml version="1.0"?>\n'
TRUNK = "meshes/trunk.stl"
# URDF requires a velocity limit, also for a joint without an actuator [rad/s or m/s].
_NO_LIMIT = 1000.0
_GIMBAL = 1e-9
# Of a link without mass, where a format has none [kg], [kg m2]; Gazebo takes 1e-6 kg for none.
LEAST_MASS, LEAST_INERTIA = 1e-5, 1e-8
# Quantities of a module that its joint has under another name, or does not show.
_OF_MODULE = (
    *("aspect_ratio", "mass", "volume", "radius", "length", "width", "height"),
    "rotor_inertia",
)
_FOLLOWS = ("joint", "ratio", "offset")  # What is told of a joint that follows another.
# Torque over speed of an actuator that drives its joint, in the table of the actuators.
_LINE = "available = peak_torque * (1 - |speed| / no_load_speed) when driving"
_CORNERED = (
    "available = min(peak_torque, stall_torque * (1 - |speed| / no_load_speed)) when driving; "
    "without a stall_torque it is the peak_torque"
)


def robot_urdf(model: Model) -> str:
    """URDF text of the robot; it refers to the meshes of `meshes` in the same folder."""
    root = robot_element(model)
    root.add("mujoco").add(
        "compiler",
        strippath="false",
        fusestatic="false",
        discardvisual="false",
        inertiafromgeom="false",
    )
    return DECLARATION + root.text()


def robot_element(model: Model, prefix: str = "", gazebo: bool = False) -> Element:
    """URDF of the robot as elements.

    Args:
        model: the model.
        prefix: what stands before the paths of meshes.
        gazebo: whether it is for Gazebo, which needs a mass of every link, and names of joints that
            differ from those of links.
    """
    root = Element("robot", name=model.design.name)
    for name, color in colors(model.design).items():
        if name != HIDDEN:
            root.add("material", name=name).add("color", rgba=color)
    if not model.design.floating:
        root.add("link", name="world")
    drawn = shapes(model.mujoco, model.design)
    for i, body in enumerate(model.design.bodies):
        own = [shape for shape in drawn if shape.body == i + 1]
        _link(root, model.mujoco, i + 1, own, prefix, gazebo)
        if body.parent is not None or not model.design.floating:
            _joint(root, model, body, i + 1, gazebo)
    return root


def actuators(design: Design) -> dict[str, Any]:
    """Actuators of the joints as plain data, in SI units at the joint unless a key says otherwise.

    Gains are those of the servos in `scene.xml`: torque = kp (target - angle) - kd speed; of a
    driven wheel, which has no range, torque = kd (target - speed).
    """
    joints: dict[str, object] = {}
    cornered = any(a.has_corner for a in design.actuators.values())
    for name, joint in design.joints.items():
        entry: dict[str, object] = {
            "type": joint.kind,
            **({} if joint.rolls else {"range": list(joint.range), "home": joint.home}),
            "class": joint.actuator,
        }
        if (follows := joint.follows) is not None:
            entry["follows"] = {name: getattr(follows, name) for name in _FOLLOWS}
        if (transmission := joint.transmission) is not None:
            entry["transmission"] = transmission._asdict()
        if (a := design.drive(joint)) is not None:
            entry |= {
                "like": a.like,
                **{name: getattr(a, name) for name in a.quantities if name not in _OF_MODULE},
                **({"stall_torque": a.stall_torque} if a.has_corner else {}),
                "rotor_inertia_motor_side": a.rotor_inertia,
                "kp": 0.0 if joint.rolls else STIFFNESS * a.peak_torque,
                "kd": DAMPING * a.peak_torque,
            }
        joints[name] = entry
    return {
        "robot": design.name,
        "design": design.label,
        "base": design.bodies[0].name,
        "base_fixed": not design.floating,
        "base_height_at_home": design.lowest(home=True),
        "units": "N m, rad/s, W, kg m2, N m s/rad, N m/rad, rad; m for prismatic joints",
        "torque_speed": _LINE if not cornered else _CORNERED,
        "joints": joints,
    }


def meshes(design: Design) -> dict[str, bytes]:
    """Bytes of the meshes of the trunk and of parts by their paths."""
    found = (geom.mesh for geom in mesh_geoms(design).values())
    return {mesh_file(mesh): stl(mesh) for mesh in found if mesh is not None}


def mesh_file(mesh: Loft | Mesh) -> str:
    """Path of a mesh in the folder of a model."""
    return f"meshes/{mesh.name}.stl" if isinstance(mesh, Mesh) else TRUNK


def stl(mesh: Loft | Mesh) -> bytes:
    """Bytes of a binary STL file of a mesh in its own frame [m]."""
    corners = mesh.vertices[mesh.faces()]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    record = np.zeros(len(corners), dtype=[("numbers", "<f4", (4, 3)), ("attribute", "<u2")])
    record["numbers"][:, 0] = normals / np.maximum(lengths, np.finfo(float).tiny)
    record["numbers"][:, 1:] = corners
    # A header that begins with "solid" marks the text format.
    what = f"of {mesh.name}" if isinstance(mesh, Mesh) else "of a trunk"
    heading = f"binary STL {what[:48]}, in metres".encode().ljust(80)
    return heading + len(corners).to_bytes(4, "little") + record.tobytes()


def rpy(rotation: Array) -> tuple[float, float, float]:
    """Roll, pitch and yaw [rad] of a rotation matrix, shape (3, 3)."""
    level = math.hypot(rotation[0, 0], rotation[1, 0])
    pitch = math.atan2(-rotation[2, 0], level)
    if level < _GIMBAL:  # gimbal lock: roll and yaw share an axis, so yaw is zero
        return math.atan2(-rotation[1, 2], rotation[1, 1]), pitch, 0.0
    roll = math.atan2(rotation[2, 1], rotation[2, 2])
    return roll, pitch, math.atan2(rotation[1, 0], rotation[0, 0])


def tensor(model: mujoco.MjModel, i: int) -> dict[str, float]:
    """Inertia of a body about its centre of mass in the axes of its link [kg m2], as URDF says.

    That of a body without mass is the least one.
    """
    if not model.body_mass[i]:
        return {
            f"i{a}{b}": LEAST_INERTIA * (a == b) for a, b in ("xx", "xy", "xz", "yy", "yz", "zz")
        }
    axes = matrix(model.body_iquat[i])
    full = axes @ np.diag(model.body_inertia[i]) @ axes.T
    indices = {"xx": (0, 0), "xy": (0, 1), "xz": (0, 2), "yy": (1, 1), "yz": (1, 2), "zz": (2, 2)}
    return {f"i{name}": float(full[at]) for name, at in indices.items()}


def _link(
    root: Element, model: mujoco.MjModel, i: int, drawn: list[Shape], prefix: str, least: bool
) -> None:
    link = root.add("link", name=model.body(i).name)
    mass = float(model.body_mass[i]) or (LEAST_MASS if least else 0.0)
    if mass > 0:
        inertial = link.add("inertial")
        inertial.add("origin", xyz=model.body_ipos[i], rpy=(0, 0, 0))
        inertial.add("mass", value=mass)
        inertial.add("inertia", **tensor(model, i))
    for shape in drawn:
        if shape.drawn:
            visual = _shape(link, "visual", shape, shape.name, prefix)
            visual.add("material", name=shape.kind)
        if shape.collides:
            _shape(link, "collision", shape, f"{shape.name}_collision", prefix)


def _shape(link: Element, use: str, shape: Shape, name: str, prefix: str) -> Element:
    element = link.add(use, name=name)
    element.add("origin", xyz=shape.position, rpy=rpy(shape.rotation))
    geometry = element.add("geometry")
    size = shape.size
    if shape.mesh is not None:
        geometry.add("mesh", filename=prefix + mesh_file(shape.mesh))
    elif shape.form == "box":
        geometry.add("box", size=2 * size)
    elif shape.form == "sphere":
        geometry.add("sphere", radius=float(size[0]))
    else:
        geometry.add("cylinder", radius=float(size[0]), length=float(2 * size[1]))
    return element


def _joint(root: Element, model: Model, body: Body, i: int, gazebo: bool) -> None:
    compiled, design, joint = model.mujoco, model.design, body.joint
    parent = compiled.body(compiled.body_parentid[i]).name
    kind = "fixed" if joint is None else joint.kind
    name = joint_name(design, body)
    element = root.add("joint", name=distinct_name(design, name) if gazebo else name, type=kind)
    element.add("origin", xyz=compiled.body_pos[i], rpy=rpy(matrix(compiled.body_quat[i])))
    element.add("parent", link=parent)
    element.add("child", link=body.name)
    if joint is None:
        return
    hinge = compiled.joint(name)
    element.add("axis", xyz=hinge.axis)
    a = design.drive(joint)
    element.add(
        "limit",
        lower=None if joint.continuous else float(hinge.range[0]),
        upper=None if joint.continuous else float(hinge.range[1]),
        effort=scalar(a.peak_torque) if a else 0.0,
        velocity=scalar(a.no_load_speed) if a else _NO_LIMIT,
    )
    if (follows := joint.follows) is not None:
        multiplier, offset = scalar(follows.ratio), scalar(follows.offset)
        leader = distinct_name(design, follows.joint) if gazebo else follows.joint
        element.add("mimic", joint=leader, multiplier=multiplier, offset=offset)
    if a:
        element.add("dynamics", damping=scalar(a.damping), friction=scalar(a.friction_loss))


def distinct_name(design: Design, joint: str) -> str:
    """Name for a joint that differs from that of every link, as SDFormat needs."""
    while any(joint == body.name for body in design.bodies):
        joint += "_joint"
    return joint


def joint_name(design: Design, body: Body) -> str:
    """Name of the joint of a body; a fixed one has a name different from every moving joint's."""
    if body.joint is not None:
        return body.prefix + body.joint.name
    name = f"{body.name}_weld"
    while name in design.joints:
        name += "_"
    return name
