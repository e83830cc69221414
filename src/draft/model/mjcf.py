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
from draft.design.parts import Member, Plate, Sphere
from draft.design.solids import plate_corners
from draft.geometry import Vector
from draft.model.xml import Element
from draft.trends.structure import MIDDLE

SITES = ("_front_left", "_front_right", "_rear_left", "_rear_right")

COLORS = {
    "trunk": (0.21, 0.38, 0.56, 1),
    "structure": (0.86, 0.87, 0.88, 1),
    "actuator": (0.24, 0.25, 0.28, 1),
    "foot": (0.16, 0.16, 0.17, 1),
    "drawn": (0.95, 0.55, 0.20, 1),
}


def robot_xml(design: Design) -> str:
    """MJCF of the robot alone: bodies, joints, geoms, sites and sensors, no actuators block."""
    height = float(design.lowest())  # type: ignore[arg-type]
    root = Element("mujoco", model=design.name)
    root.add("compiler", angle="radian", autolimits="true")
    _defaults(root)
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
                name=f"{body.name}_trunk",
                class_="trunk",
                mesh=body.name,
                density=design.trunk.density,
            )
            element.add("site", name="imu")
        else:
            parent = elements[body.parent]
            element = parent.add("body", name=body.name, pos=body.position, quat=_quaternion(body))
            _joint(element, design, body)
        _geoms(element, body)
        elements.append(element)
    sensor = root.add("sensor")
    sensor.add("gyro", name="imu_ang_vel", site="imu")
    sensor.add("velocimeter", name="imu_lin_vel", site="imu")
    sensor.add("accelerometer", name="imu_lin_acc", site="imu")
    sensor.add("subtreeangmom", name="root_angmom", body=design.bodies[0].name)
    return root.text()


def _f(value: Any) -> float:
    return float(value)


def _defaults(root: Element) -> None:
    """Geom classes. Robot geoms meet the floor and objects but not each other."""
    default = root.add("default")
    for name, color in COLORS.items():
        kind = default.add("default", class_=name)
        touches = 0 if name == "drawn" else 1
        kind.add(
            "geom",
            type={"trunk": "mesh", "foot": None}.get(name, "cylinder"),
            group=2,
            contype=0,
            conaffinity=touches,
            rgba=color,
            mass=0 if name == "drawn" else None,
        )
    default.add("site", size=(0.005,), group=4)


def _trunk_mesh(asset: Element, design: Design) -> None:
    loft = design.trunk.loft
    vertices: Any = loft.vertices.ravel().tolist()
    faces: Any = loft.faces().ravel().tolist()
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
        armature=a.armature if a else None,
        damping=a.damping if a else None,
        frictionloss=a.friction_loss if a else None,
        actuatorfrcrange=(-a.peak_torque, a.peak_torque) if a else None,  # type: ignore[operator]
    )


def _geoms(element: Element, body: Body) -> None:
    """Member, actuator, pulley and end effector of one body."""
    link = body.link
    tip = link.tip
    if link.member is not None:
        _member(element, body, link.member, tip)
    if link.motor is not None and body.actuator is not None:
        a = body.actuator
        _cylinder(
            element,
            f"{body.name}_motor",
            "actuator",
            link.motor.center,
            link.motor.axis,
            a.radius,
            a.length,
            a.mass,
        )
    if link.pulley is not None:
        _cylinder(
            element,
            f"{body.name}_pulley",
            "drawn",
            tip,
            link.pulley.axis,
            link.pulley.radius,
            link.pulley.length,
            None,
        )
    if isinstance(link.end, Sphere):
        radius = _f(link.end.radius)
        volume = 4 / 3 * math.pi * radius**3
        element.add(
            "geom",
            name=f"{body.name}_end",
            # An end without a site, such as a head, is not there to touch the ground.
            class_="foot" if link.end.site is not None else "structure",
            type="sphere",
            pos=tip,
            size=(radius,),
            density=_f(body.end_mass) / volume,
        )
        if link.end.site is not None:
            element.add("site", name=body.prefix + link.end.site, pos=tip)
    elif isinstance(link.end, Plate):
        _plate(element, body, link.end, tip)


def _member(element: Element, body: Body, member: Member, tip: Vector) -> None:
    """A member: one rod, or two halves of one, heavier on the side of its centre of mass."""
    name, share = f"{body.name}_link", _f(body.member_centre)
    halves = [(name, MIDDLE, 1.0, 1.0)]
    if share != MIDDLE:
        # Halves balance at 1/4 and 3/4 of the length: these masses put the whole's centre there.
        halves = [
            (name, 0.25, 0.5, 1.5 - 2.0 * share),
            (f"{name}_far", 0.75, 0.5, 2.0 * share - 0.5),
        ]
    for geom, middle, length, mass in halves:
        _cylinder(
            element,
            geom,
            "structure",
            g.scale(tip, middle),
            member.axis,
            body.member_radius,
            member.length * length,
            body.member_mass * mass,
        )


def _plate(element: Element, body: Body, plate: Plate, tip: Vector) -> None:
    length, width, thickness = (_f(x) for x in plate.size)
    center = g.add(tip, (plate.offset, 0.0, thickness / 2))
    density = _f(body.end_mass) / (length * width * thickness)
    element.add(
        "geom",
        name=f"{body.name}_end",
        class_="foot",
        type="box",
        pos=center,
        size=(length / 2, width / 2, thickness / 2),
        density=density,
    )
    site = body.prefix + plate.site
    corners = plate_corners(body, plate)
    sole = g.add(tip, (plate.offset, 0.0, 0.0))
    element.add("site", name=site, pos=sole)
    # Left and right are the robot's: the same on both feet, and so not mirrored.
    for suffix, corner in zip(SITES, corners, strict=True):
        element.add("site", name=site + suffix, pos=corner)
    element.add("site", name=f"{site}_toe", pos=g.add(sole, (length / 2, 0.0, 0.0)))


def _cylinder(
    element: Element,
    name: str,
    kind: str,
    center: Vector,
    axis: Vector,
    radius: Any,
    length: Any,
    mass: Any,
) -> None:
    """A cylinder with the density that gives its mass; no mass where it is only drawn."""
    density = None if mass is None else mass / (math.pi * radius * radius * length)
    element.add(
        "geom",
        name=name,
        class_=kind,
        pos=center,
        quat=_toward(axis),
        size=(radius, length / 2),
        density=density,
    )


_AXIS_QUATERNIONS: dict[Vector, tuple[float, ...] | None] = {
    (0.0, 0.0, 1.0): None,
    (0.0, 0.0, -1.0): None,
    (1.0, 0.0, 0.0): (1, 0, 1, 0),
    (-1.0, 0.0, 0.0): (1, 0, 1, 0),
    (0.0, 1.0, 0.0): (1, 1, 0, 0),
    (0.0, -1.0, 0.0): (1, 1, 0, 0),
}


def _toward(axis: Vector) -> tuple[float, ...] | None:
    """Rotation (w, x, y, z) that lays the z axis along the line of a unit vector.

    A cylinder does not change when it is turned about, so a vector and its opposite are one line.
    """
    if axis in _AXIS_QUATERNIONS:
        return _AXIS_QUATERNIONS[axis]
    x, y, z = (_f(c) for c in axis)
    if z < 0:
        x, y, z = -x, -y, -z
    w = math.sqrt((1 + z) / 2)
    return (w, -y / (2 * w), x / (2 * w), 0.0)


def _quaternion(body: Body) -> tuple[float, ...] | None:
    return None if body.rotation is None else g.quaternion(body.rotation)


def body_masses(design: Design) -> np.ndarray:
    """Mass of every body of the design [kg], in MuJoCo's order after the world, shape (bodies,)."""
    return np.array([_f(mass) for mass in design.body_masses().values()])
