"""End primitives of imported limbs: feet, hands, heads and wheels, by their dimensions."""

from __future__ import annotations

import numpy as np

from draft.imports.formatting import Parameters, Value, direction, tidy
from draft.imports.reduce import Body
from draft.imports.shapes import Shapes
from draft.values import Array

Node = dict[str, Value]
DOWN = np.array([0.0, 0.0, -1.0])
FOOT = np.array([0.2, 0.08, 0.05])
# Longest over shortest edge of a foot: surveyed ones have 2.8 or more. Below, its inertia is a
# placeholder with three equal moments, as that of noetix_n2.
OBLONG = 1.5
BALL = 0.02
THINNEST = 0.005
FINGER = "finger"  # role, link class and name of the limbs of a hand
_HAND, _FINGERTIP = 0.08, 0.02  # edges of a hand, and of a fingertip, without shapes [m]
ROUND = ("cylinder", "sphere", "capsule", "ellipsoid")
SOLE = 0.01
# Mass of a wheel over its cylinder [kg/m3]: the median of the surveyed wheels, n = 2 robots with
# four each, DEEP Robotics M20 and M20S. That is one maker and one wheel, 0.638 kg, radius 90 mm,
# width 54 mm: too few for a law. Nothing is taken off for the drive. It is not in the wheel, of
# which it would leave 0.13 kg, but in the shank, which weighs 1.26 kg and has its centre of mass
# at 0.7 of the way down.
WHEEL_DENSITY = 464.0


def sphere_foot(body: Body, name: str, site: str, shapes: Shapes, parameters: Parameters) -> Node:
    """Member and sphere from a shank's hinge to its foot."""
    at, radius = _ball(body, shapes)
    way = at - body.anchor
    length = float(np.linalg.norm(way))
    if length < BALL:  # The foot is at its own joint, such as a slide's.
        length, way = BALL, BALL * _onward(body)
    long = parameters.add(f"{name}_length", length, "Hinge to the centre of the foot.")
    wide = parameters.add("foot_radius", radius, "Radius of the foot.", 4)
    member: Node = {"axis": direction(way / length), "length": long, "segment": body.kind}
    return {"type": "sphere", "link": member, "sphere": {"radius": wide, "site": site}}


def _ball(body: Body, shapes: Shapes) -> tuple[Array, float]:
    """Centre and radius of a foot [m]: its sphere, the furthest frame, or the end of its mesh."""
    reach = 0.05
    spheres = [s for s in shapes.spheres(body.links) if np.linalg.norm(s[0] - body.anchor) > reach]
    if spheres:
        return max(spheres, key=lambda s: float(np.linalg.norm(s[0] - body.anchor)))
    above = body.parent.anchor if body.parent is not None else [*body.anchor, 0, 0, 0.2]
    usual = max(float(np.linalg.norm(body.anchor - above)), 0.05)
    places = [shapes.reduced.poses[name][0] for name in body.links]
    far = max(places, key=lambda at: float(np.linalg.norm(at - body.anchor)))
    if np.linalg.norm(far - body.anchor) > 0.5 * usual:
        return np.round(far, 5), max(BALL, 0.08 * usual)
    points = shapes.points(body.links)
    if len(points):
        low = float(points[:, 2].min())
        near = points[points[:, 2] < low + 0.02]
        radius = float(np.clip(np.ptp(near, axis=0)[:2].min() / 2, 0.01, 0.06))
        return np.array([*near.mean(axis=0)[:2], low + radius]), radius
    return body.anchor + usual * DOWN, BALL


def plate_foot(body: Body, site: str, shapes: Shapes, parameters: Parameters) -> Node:
    """Member and sole from the last ankle hinge to the ground."""
    points = shapes.points(body.links)
    if len(points):
        low, high = points.min(axis=0) - body.anchor, points.max(axis=0) - body.anchor
    else:
        edges = shapes.box(body.links)
        size = edges if edges.min() > SOLE and edges.max() > OBLONG * edges.min() else FOOT
        size = np.array([size[:2].max(), size[:2].min(), min(size[2], size[0])])
        low, high = size * [-0.3, -0.5, -1.0], size * [0.7, 0.5, 0.0]
    size = np.maximum(high - low, 0.03)
    height = max(float(-low[2]), 1.5 * SOLE)
    plate: Node = {
        "length": parameters.add("foot_length", float(size[0]), "Length of the sole.", 4),
        "width": parameters.add("foot_width", float(size[1]), "Width of the sole.", 4),
        "thickness": SOLE,
        "offset": tidy(float(low[0] + high[0]) / 2, 4),
        "site": site,
    }
    tall = parameters.add("foot_height", height, "Last ankle hinge to the sole.", 4)
    member: Node = {"axis": "-z", "length": tall, "segment": body.kind}
    return {"type": "foot", "link": member, "plate": plate}


def ball_end(body: Body, name: str, shapes: Shapes, parameters: Parameters) -> Node:
    """Member and sphere of a hand or a head."""
    edge = _FINGERTIP if body.role == FINGER else _HAND
    at, radius = extent(body.links, body.anchor, _onward(body), shapes, edge)
    way = at - body.anchor
    length = float(np.linalg.norm(way))
    long = parameters.add(f"{name}_length", length, f"Last hinge to the centre of the {name}.", 4)
    wide = parameters.add(f"{name}_radius", radius, f"Radius of the {name}.", 4)
    member: Node = {"axis": direction(way / length), "length": long, "segment": body.kind}
    return {"type": "sphere", "link": member, "sphere": {"radius": wide}}


def extent(
    links: list[str], anchor: Array, onward: Array, shapes: Shapes, edge: float = _HAND
) -> tuple[Array, float]:
    """Centre [m] and radius [m] of the sphere that stands for links beyond an anchor.

    Without shapes, the links fill a cube of an edge [m].
    """
    points = shapes.points(links)
    if len(points):
        low, high = points.min(axis=0), points.max(axis=0)
        centre, edges = (low + high) / 2, high - low
    else:
        edges = shapes.box(links)
        if edges.min() < 0.01:
            edges = np.full(3, edge)
        centre = anchor + onward * float(edges.max()) / 2
    if np.linalg.norm(centre - anchor) < 0.02:
        centre = anchor + onward * max(float(edges.max()) / 2, 0.02)
    radius = float(np.clip(np.sort(edges)[1] / 2, 0.01, 0.15))
    return np.round(centre, 5), radius


def _onward(body: Body) -> Array:
    """Direction in which a limb comes to its last hinge."""
    here = body
    while here.parent is not None and here.parent.joint is not None:
        way = body.anchor - here.parent.anchor
        length = float(np.linalg.norm(way))
        if length > 0.02:
            return way / length
        here = here.parent
    return DOWN


def wheel(body: Body, site: str | None, shapes: Shapes, parameters: Parameters) -> Node:
    """A wheel: a cylinder about its joint of `WHEEL_DENSITY`; without a site it bears nothing."""
    size = _disc(body, shapes)
    if size.min() < THINNEST:
        size = np.array([0.075, 0.04])
    round_ = parameters.add("wheel_radius", float(size[0]), "Radius of the wheel.", 4)
    broad = parameters.add("wheel_width", float(size[1]), "Width of the wheel.", 4)
    doc = "Mass of the wheel over its cylinder: that of DEEP Robotics' M20 and M20S."
    dense = parameters.add("wheel_density", WHEEL_DENSITY, doc, 1, "kg/m3")
    axis = direction(body.axis, shapes.reduced.digits + 1)
    disc: Node = {"radius": round_, "width": broad, "axis": axis, "density": dense}
    return {"type": "wheel", "wheel": disc | ({"site": site} if site else {})}


def _disc(body: Body, shapes: Shapes) -> Array:
    """Radius and width of a wheel [m], from its meshes, primitives or inertia, shape (2,)."""
    points = shapes.points(body.links) - body.anchor
    if len(shapes.triangles(body.links)):
        along = points @ body.axis
        across = np.linalg.norm(points - np.outer(along, body.axis), axis=1)
        return np.array([across.max(), np.ptp(along)])
    if len(points):
        links = [shapes.reduced.description.links[name] for name in body.links]
        round_ = [one for link in links for one in link.geometries if one.kind in ROUND]
        sizes = [one.size[0] for one in round_] or [np.ptp(points, axis=0).max() / 2]
        return np.array([max(sizes), np.ptp(points @ body.axis)])
    edges = np.sort(shapes.box(body.links))
    return np.array([edges[2] / 2, edges[0]])
