"""Export to SDFormat, for Gazebo, Drake and others.

All numbers are those of the compiled MuJoCo model, as in the URDF. The frame of a joint is that of
its link and is stated in its parent. A joint that follows another has a `mimic`; a joint without an
actuator has no effort, so that no reader gives it one. A joint that is named as a link is has
`_joint` after its name, as the two share their names here. The armature, for which SDFormat has no
place, and the `mimic` once more are in Drake's own elements, which other programs skip.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco

from draft.design.design import Body, Design
from draft.model.mjcf import colors
from draft.model.shapes import Shape, matrix, mesh_geoms, shapes
from draft.model.urdf import (
    DECLARATION,
    LEAST_MASS,
    distinct_name,
    joint_name,
    mesh_file,
    rpy,
    tensor,
)
from draft.model.xml import Element
from draft.spec.primitives.base import Color
from draft.spec.primitives.loft import Loft
from draft.spec.primitives.mesh import Mesh
from draft.values import scalar

if TYPE_CHECKING:
    from draft.model.model import Model

VERSION = "1.11"  # The first with `mimic`.


def robot_sdf(model: Model) -> str:
    """SDFormat text of the robot; it refers to the files of `meshes` in the same folder."""
    design, compiled = model.design, model.mujoco
    root = Element("sdf", version=VERSION, **{"xmlns:drake": "http://drake.mit.edu"})
    robot = root.add("model", name=design.name, canonical_link=design.bodies[0].name)
    drawn, paint = shapes(compiled, design), colors(design)
    for i, body in enumerate(design.bodies):
        own = [shape for shape in drawn if shape.body == i + 1]
        if body.parent is None and design.floating:
            robot.put("pose", (*compiled.body_pos[1], *rpy(matrix(compiled.body_quat[1]))))
            _link(robot, compiled, i + 1, own, None, paint)
        else:
            joint = distinct_name(design, joint_name(design, body))
            _link(robot, compiled, i + 1, own, joint, paint)
            _joint(robot, model, body, i + 1)
    return DECLARATION + root.text()


def model_config(model: Model) -> str:
    """Text of model.config, by which Gazebo finds `robot.sdf` in a folder of its models."""
    root = Element("model")
    root.put("name", model.design.name)
    root.put("version", "1.0")
    root.put("sdf", "robot.sdf", version=VERSION)
    root.put("description", f"{model.design.reference}, written by Draft")
    return DECLARATION + root.text()


def meshes(design: Design) -> dict[str, str]:
    """Texts of the meshes of trunk and parts (Wavefront OBJ, [m]) by their paths.

    Drake finds contacts with OBJ, and refuses STL.
    """
    found = (geom.mesh for geom in mesh_geoms(design).values())
    return {_path(mesh): _obj(mesh) for mesh in found if mesh is not None}


def _path(mesh: Loft | Mesh) -> str:
    return mesh_file(mesh).removesuffix(".stl") + ".obj"


def _obj(mesh: Loft | Mesh) -> str:
    points = (" ".join(f"{x:.10g}" for x in point) for point in mesh.vertices.tolist())
    faces = (" ".join(map(str, face)) for face in (mesh.faces() + 1).tolist())
    return "\n".join([*(f"v {point}" for point in points), *(f"f {face}" for face in faces)]) + "\n"


def _link(
    robot: Element,
    compiled: mujoco.MjModel,
    i: int,
    drawn: list[Shape],
    joint: str | None,
    paint: dict[str, Color],
) -> None:
    link = robot.add("link", name=compiled.body(i).name)
    if joint is not None:
        link.put("pose", (0,) * 6, relative_to=joint)
    mass = float(compiled.body_mass[i])
    inertial = link.add("inertial")
    inertial.put("pose", (*compiled.body_ipos[i], 0, 0, 0))
    inertial.put("mass", mass or LEAST_MASS)  # SDFormat has no link without mass.
    inertia = inertial.add("inertia")
    for name, value in tensor(compiled, i).items():
        inertia.put(name, value)
    for shape in drawn:
        if shape.drawn:
            visual = _shape(link, "visual", shape, shape.name)
            material = visual.add("material")
            material.put("ambient", paint[shape.kind])
            material.put("diffuse", paint[shape.kind])
        if shape.collides:
            _shape(link, "collision", shape, f"{shape.name}_collision")


def _shape(link: Element, use: str, shape: Shape, name: str) -> Element:
    element = link.add(use, name=name)
    element.put("pose", (*shape.position, *rpy(shape.rotation)))
    geometry = element.add("geometry").add(shape.form)
    if shape.mesh is not None:
        geometry.put("uri", _path(shape.mesh))
    elif shape.form == "box":
        geometry.put("size", 2 * shape.size)
    else:
        geometry.put("radius", float(shape.size[0]))
        if shape.form == "cylinder":
            geometry.put("length", float(2 * shape.size[1]))
    return element


def _joint(robot: Element, model: Model, body: Body, i: int) -> None:
    compiled, design, joint = model.mujoco, model.design, body.joint
    name, parent = joint_name(design, body), compiled.body_parentid[i]
    kind = "fixed" if joint is None else joint.kind
    element = robot.add("joint", name=distinct_name(design, name), type=kind)
    pose = (*compiled.body_pos[i], *rpy(matrix(compiled.body_quat[i])))
    above = compiled.body(parent).name if parent else None
    element.put("pose", pose, relative_to=above or "__model__")
    element.put("parent", above or "world")
    element.put("child", body.name)
    if joint is None:
        return
    hinge, drive = compiled.joint(name), design.drive(joint)
    axis = element.add("axis")
    axis.put("xyz", hinge.axis)
    limit = axis.add("limit")
    if not joint.continuous:
        limit.put("lower", float(hinge.range[0]))
        limit.put("upper", float(hinge.range[1]))
    limit.put("effort", scalar(drive.peak_torque) if drive else 0.0)
    if drive:
        limit.put("velocity", scalar(drive.no_load_speed))
        dynamics = axis.add("dynamics")
        dynamics.put("damping", scalar(drive.damping))
        dynamics.put("friction", scalar(drive.friction_loss))
        element.put("drake:rotor_inertia", float(hinge.armature[0]))
        element.put("drake:gear_ratio", 1.0)
    if (follows := joint.follows) is not None:
        leader = distinct_name(design, follows.joint)
        ratio, offset = scalar(follows.ratio), scalar(follows.offset)
        mimic = axis.add("mimic", joint=leader)
        mimic.put("multiplier", ratio)
        mimic.put("offset", offset)
        mimic.put("reference", 0.0)
        element.add("drake:mimic", joint=leader, multiplier=ratio, offset=offset)
