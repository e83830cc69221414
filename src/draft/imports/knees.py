"""Location of a quadruped's knee motors: at the knee, or at the hip with a linkage or belt.

Geometry decides. A motor at the knee needs a thigh, or a shank, that is as wide there as the motor
and reaches beyond the knee by its radius. The surveyed quadrupeds with shapes there are told apart
so: the five with motors at the knee measure 0.9 to 2.4 motor diameters, the others mostly half a
one. Without shapes, the way sideways from hip to knee decides: none for the 15 robots with motors
at the hip; 98 mm and more, and 1.26 motor lengths and more, for the others.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from draft.imports.drives import Drive
from draft.imports.options import KneeDrive, Options
from draft.imports.reduce import Body, Reduced
from draft.imports.shapes import Shapes
from draft.laws.actuators import laws
from draft.values import Array

# Width across the knee, over the motor's diameter, and reach beyond it, over its radius.
WIDE, BEYOND = 0.8, 0.6
# Way sideways from hip to knee without shapes to look at [m], and in motor lengths.
ASIDE, ASIDE_LENGTHS = 0.085, 1.25
# Points along the edges of a primitive's triangles.
GRID = 7


@dataclass(frozen=True, slots=True)
class Knees:
    """Place of the knees' motors, and why there; `place` is None for a robot without knees."""

    place: KneeDrive | None
    why: str


def knee_drives(
    reduced: Reduced,
    shapes: Shapes,
    drives: Mapping[str, Drive],
    population: str,
    options: Options,
    carried: Mapping[str, Sequence[str]] | None = None,
) -> Knees:
    """Decide where the knees' motors sit.

    Args:
        reduced: the robot.
        shapes: its shapes.
        drives: torque and speed of every driven hinge.
        population: "humanoid" or "quadruped".
        options: what a person decides.
        carried: drives on linkages, by the joints that they move.
    """
    knees = [body for body in reduced.root.all() if body.role == "knee" and not body.slides]
    knees = [body for body in knees if body.parent is not None and body.joint is not None]
    if not knees:
        return Knees(None, "it has no knees")
    if options.knee_drive is not None:
        return Knees(options.knee_drive, "as stated by `knee_drive`")
    if population != "quadruped":
        return Knees("knee", "as humanoids have them")
    for knee in knees:
        cranks = (carried or {}).get(knee.joint.name if knee.joint else "")
        if cranks:
            return _by_crank(knee, cranks[0], reduced)
        found = _by_shapes(knee, shapes, drives)
        if found is not None:
            return found
    return _by_place(knees[0], drives)


def _by_crank(knee: Body, crank: str, reduced: Reduced) -> Knees:
    """Judge by where the crank turns that moves a knee through its linkage."""
    joint = reduced.description.joints[crank]
    at, turn = reduced.poses[joint.child]
    place = at + turn @ np.array(joint.anchor)
    assert knee.parent is not None
    gaps = [float(np.linalg.norm(place - end)) for end in (knee.anchor, knee.parent.anchor)]
    return Knees("knee" if gaps[0] < gaps[1] else "hip", f"that is where its crank '{crank}' turns")


def _by_shapes(knee: Body, shapes: Shapes, drives: Mapping[str, Drive]) -> Knees | None:
    """Judge by what surrounds the knee; None where no shape reaches it."""
    thigh = knee.parent
    assert thigh is not None
    radius, _ = _motor(knee, drives)
    widths: list[float] = []
    place: KneeDrive = "hip"
    for body, sense in ((thigh, 1.0), (knee, -1.0)):
        points = _points(shapes, body.links)
        width, reach = _around(points, knee, thigh, sense * radius) if len(points) else (0.0, 0.0)
        widths.append(width)
        if width >= WIDE * 2 * radius and reach >= BEYOND * radius:
            place = "knee"
    if not any(widths):
        return None
    why = f"the leg is {1000 * max(widths):.0f} mm wide there, and a motor of that torque measures "
    why += f"{2000 * radius:.0f} mm"
    return Knees(place, why)


def _around(points: Array, knee: Body, thigh: Body, radius: float) -> tuple[float, float]:
    """Width of points around a knee, across the thigh, and their reach beyond it [m].

    Beyond the knee is away from the thigh, or with a negative radius away from the shank.
    """
    way = points - knee.anchor
    along = knee.anchor - thigh.anchor
    along = along - (along @ knee.axis) * knee.axis
    length = float(np.linalg.norm(along))
    if length < 1e-6:
        return 0.0, 0.0
    along /= length
    near = np.abs(way @ along) < 0.3 * abs(radius)
    if not near.any():
        return 0.0, 0.0
    return float(np.ptp((way @ np.cross(knee.axis, along))[near])), float(
        (np.sign(radius) * (way @ along)).max()
    )


def _by_place(knee: Body, drives: Mapping[str, Drive]) -> Knees:
    """Judge by how far beside its hip a knee lies."""
    thigh = knee.parent
    assert thigh is not None
    aside = abs(float((knee.anchor - thigh.anchor) @ knee.axis))
    _, length = _motor(knee, drives)
    far = aside >= ASIDE and aside >= ASIDE_LENGTHS * length
    why = f"no shape is there; the knee lies {1000 * aside:.0f} mm beside its hip, as with "
    why += "surveyed motors at the knee" if far else "most surveyed motors at the hip"
    return Knees("knee" if far else "hip", why)


def _motor(knee: Body, drives: Mapping[str, Drive]) -> tuple[float, float]:
    """Radius and length of the motor that a knee would have [m]."""
    drive = drives[knee.joint.name if knee.joint is not None else ""]
    trends = laws().trends
    reduction = float(trends["gear_ratio"](drive.speed))
    volume = float(trends["volume"](drive.torque, reduction))
    aspect = float(trends["aspect_ratio"](reduction))
    radius = (volume / (2 * math.pi * aspect)) ** (1 / 3)
    return radius, 2 * aspect * radius


def _points(shapes: Shapes, links: list[str]) -> Array:
    """Points on the surfaces of links' meshes, else of their primitives [m], shape (n, 3)."""
    triangles = shapes.triangles(links)
    if len(triangles):
        return np.concatenate([triangles.reshape(-1, 3), triangles.mean(axis=1)])
    triangles = shapes.primitives(links)
    shares = [
        (i / GRID, j / GRID, (GRID - i - j) / GRID)
        for i in range(GRID + 1)
        for j in range(GRID + 1 - i)
    ]
    return np.einsum("sk,nkc->nsc", np.array(shares), triangles).reshape(-1, 3)
