"""Design -> MJCF text of the robot alone, `robot.xml`, which everything loads.

Geoms carry densities, so that MuJoCo's own masses and inertias follow from the drawn shapes; the
trunk's mesh asks for its exact inertia. A part's drawn size and its mass are separate numbers:
the density is their quotient.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from draft import geometry as g
from draft.design.design import Body, Design
from draft.geometry import Vector
from draft.model.xml import Element
from draft.spec.primitives import LINKS
from draft.spec.primitives.base import Color, Geom
from draft.values import Value, both, either, is_array, sqrt, where

# Kinds of geom that every robot may have, and their colours.
_COMMON: dict[str, Color] = {
    "trunk": (0.21, 0.38, 0.56, 1),
    "structure": (0.86, 0.87, 0.88, 1),
    "actuator": (0.24, 0.25, 0.28, 1),
    "foot": (0.16, 0.16, 0.17, 1),
    "drawn": (0.95, 0.55, 0.20, 1),
}
COLORS = _COMMON | {
    kind: color for link in LINKS if link.end is not None for kind, color in link.end.colors.items()
}
# Forms that the geoms of a kind have unless they say otherwise.
FORMS = {"trunk": "mesh", "structure": "cylinder", "actuator": "cylinder", "drawn": "cylinder"}


def colors(design: Design) -> dict[str, Color]:
    """Kinds of geom that a robot has, with their colours; those of all robots first."""
    ends = [body.link.end for body in design.bodies if body.link.end is not None]
    return _COMMON | {kind: color for end in ends for kind, color in end.colors.items()}


def robot_xml(design: Design) -> str:
    """MJCF of the robot alone: bodies, joints, geoms, sites and sensors, no actuators block."""
    return robot_element(design).text()


def robot_element(design: Design) -> Element:
    """MJCF of the robot alone as elements.

    For N designs, every number that differs is an array of shape (N,) among its attribute's
    numbers, and the vertices of the trunk have shape (corners * 3, N). Only the elements of one
    design can be written as text.
    """
    height = design.lowest()
    root = Element("mujoco", model=design.name)
    root.add("compiler", angle="radian", autolimits="true")
    _defaults(root, design)
    _trunk_mesh(root.add("asset"), design)
    world = root.add("worldbody")
    elements: list[Element] = []
    # A geom is called after its body, with a suffix that no two kinds share: no two can clash.
    for body in design.bodies:
        if body.parent is None:
            element = world.add("body", name=body.name, pos=(0, 0, height))
            element.add("freejoint", name="floating_base")
            element.add(
                "geom",
                name=body.name + design.trunk.suffix,
                class_="trunk",
                mesh=body.name,
                density=design.trunk.density,
            )
            element.add("site", name=design.trunk.site)
        else:
            parent = elements[body.parent]
            element = parent.add("body", name=body.name, pos=body.position, quat=_quaternion(body))
            _joint(element, design, body)
        _parts(element, body)
        elements.append(element)
    sensor = root.add("sensor")
    sensor.add("gyro", name="imu_ang_vel", site=design.trunk.site)
    sensor.add("velocimeter", name="imu_lin_vel", site=design.trunk.site)
    sensor.add("accelerometer", name="imu_lin_acc", site=design.trunk.site)
    sensor.add("subtreeangmom", name="root_angmom", body=design.bodies[0].name)
    return root


def _f(value: Any) -> float:
    return float(value)


def _defaults(root: Element, design: Design) -> None:
    """Geom classes. Robot geoms meet the floor and objects but not each other."""
    default = root.add("default")
    for name, color in colors(design).items():
        kind = default.add("default", class_=name)
        touches = 0 if name == "drawn" else 1
        kind.add(
            "geom",
            type=FORMS.get(name),
            group=2,
            contype=0,
            conaffinity=touches,
            rgba=color,
            mass=0 if name == "drawn" else None,
        )
    default.add("site", size=(0.005,), group=4)


def _trunk_mesh(asset: Element, design: Design) -> None:
    loft = design.trunk.loft
    vertices: Any = loft.vertices
    faces: Any = ()
    if vertices.ndim == 2:
        vertices, faces = vertices.ravel().tolist(), loft.faces().ravel().tolist()
    asset.add("mesh", name=design.bodies[0].name, inertia="exact", vertex=vertices, face=faces)


def _joint(element: Element, design: Design, body: Body) -> None:
    joint = body.joint
    if joint is None:
        return
    a = design.actuators[joint.actuator] if joint.actuator is not None else None
    element.add(
        "joint",
        name=body.prefix + joint.name,
        type="slide" if joint.slide else None,
        axis=body.joint_axis,
        range=joint.range,
        limited="false" if joint.continuous else None,
        armature=a.armature if a else None,
        damping=a.damping if a else None,
        frictionloss=a.friction_loss if a else None,
        actuatorfrcrange=(-a.peak_torque, a.peak_torque) if a else None,
    )


def _parts(element: Element, body: Body) -> None:
    """Geoms and sites of one body."""
    for geom in body.geoms():
        _geom(element, body.name, geom)
    end = body.link.end
    if end is not None and end.site is not None:
        for suffix, place in zip(end.sites, end.site_places(body.link.tip), strict=True):
            element.add("site", name=body.prefix + end.site + suffix, pos=place)


def _geom(element: Element, body: str, geom: Geom) -> None:
    """A geom with the density that gives its mass; none where it is only drawn."""
    form, size = geom.form, geom.size
    if form == "cylinder":
        size = (size[0], size[1] / 2)
    elif form == "box":
        size = tuple(side / 2 for side in size)
    element.add(
        "geom",
        name=body + geom.suffix,
        class_=geom.kind,
        type=None if FORMS.get(geom.kind) == form else form,
        pos=geom.center,
        quat=_toward(geom.axis) if form == "cylinder" else None,
        size=size,
        density=None if geom.mass is None else geom.mass / geom.volume,
        conaffinity=None if geom.collides or geom.kind == "drawn" else 0,
    )


_AXIS_QUATERNIONS: dict[Vector, tuple[float, ...] | None] = {
    (0.0, 0.0, 1.0): None,
    (0.0, 0.0, -1.0): None,
    (1.0, 0.0, 0.0): (1, 0, 1, 0),
    (-1.0, 0.0, 0.0): (1, 0, 1, 0),
    (0.0, 1.0, 0.0): (1, 1, 0, 0),
    (0.0, -1.0, 0.0): (1, 1, 0, 0),
}


def _toward(axis: Vector) -> tuple[Value, ...] | None:
    """Rotation (w, x, y, z) that lays the z axis along the line of a unit vector.

    A cylinder does not change when it is turned about, so a vector and its opposite are one line.
    """
    if any(is_array(c) for c in axis):
        return _toward_each(axis)
    if axis in _AXIS_QUATERNIONS:
        return _AXIS_QUATERNIONS[axis]
    x, y, z = (_f(c) for c in axis)
    if z < 0:
        x, y, z = -x, -y, -z
    w = math.sqrt((1 + z) / 2)
    return (w, -y / (2 * w), x / (2 * w), 0.0)


def _toward_each(axis: Vector) -> tuple[Value, ...]:
    """`_toward` for N designs: the general rotation, except along x and y."""
    x, y, z = axis
    flip = where(either(z < 0, both(z == 0, either(x == -1, y == 1))), -1.0, 1.0)
    x, y, z = flip * x, flip * y, flip * z
    w = sqrt((1 + z) / 2)
    return (w, -y / (2 * w), x / (2 * w), 0.0)


def _quaternion(body: Body) -> tuple[Value, ...] | None:
    return None if body.rotation is None else g.quaternion(body.rotation)


def body_masses(design: Design) -> np.ndarray:
    """Mass of every body of the design [kg], in MuJoCo's order after the world, shape (bodies,)."""
    return np.array([_f(mass) for mass in design.body_masses().values()])
