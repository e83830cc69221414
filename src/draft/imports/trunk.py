"""The trunk of an imported spec: sections through its meshes, or the box that stands for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from draft.errors import quoted
from draft.imports import names
from draft.imports.ends import Node, extent
from draft.imports.formatting import Parameters, Value, direction, tidy
from draft.imports.reduce import Reduced
from draft.imports.shapes import Shapes, Slice, slices
from draft.laws import joint_roles as roles
from draft.values import Array

NO_MESHES = "the trunk has no meshes to read"
HEAD = {"head", "neck"}
MARGIN = 0.05
THIN = 0.01
# A box around the inertia of all that is bolted to a trunk is not the trunk's if it has so many
# times the volume of the box with the trunk's own inertia.
FAR_LARGER = 2.0
# Primitives bound a trunk if they reach over these shares of the distance between its limbs, along
# its axis and across, and are not slimmer than this [m].
ALONG, ACROSS, SLIM = 0.6, 0.5, 0.03


def trunk_name(reduced: Reduced) -> str:
    """Name of the trunk: the vendor's, unless every model has one of that name."""
    name = names.valid(reduced.root.name, "trunk")
    return "trunk" if name == "world" else name


def fixed_head(reduced: Reduced) -> list[str]:
    """Links of a head that is bolted to the trunk; none where a neck moves it."""
    if any(body.role == "neck" for body in reduced.root.children):
        return []
    root = reduced.root.links
    return [name for name in root if roles.words(name) & HEAD and name != reduced.root.name]


def head(reduced: Reduced, links: list[str], shapes: Shapes, parameters: Parameters) -> Node | None:
    """A bolted head as a sphere on a neck; None where nothing says how large it is."""
    if not len(shapes.points(links)) and not shapes.box(links).any():
        return None
    arms = [body.anchor for body in reduced.root.children if body.role == "shoulder"]
    neck = np.mean(arms, axis=0) if arms else reduced.poses[links[0]][0]
    neck = np.round(neck, 4)
    centre, radius = extent(links, neck, np.array([0.0, 0.0, 1.0]), shapes)
    length = float(np.linalg.norm(centre - neck))
    long = parameters.add("neck_length", length, "Shoulders to the centre of the head.", 4)
    wide = parameters.add("head_radius", radius, "Radius of the head.", 4)
    member: Node = {"axis": direction((centre - neck) / length), "length": long, "segment": "head"}
    at: list[Value] = [tidy(x, 4) for x in neck]
    return {
        "name": "head",
        "type": "sphere",
        "at": at,
        "link": member,
        "sphere": {"radius": wide},
    }


@dataclass(frozen=True, slots=True)
class Trunk:
    """Trunk of an imported spec.

    Attributes:
        axis: loft axis, "x" or "z".
        sections: its sections.
        source: what its size is from.
        slices: its sections as numbers.
        fault: why its meshes are not used; "" where they are.
        instead: what stands in for them; "" for nothing.
    """

    axis: str
    sections: list[Node]
    source: str
    slices: list[Slice]
    fault: str = ""
    instead: str = ""


def trunk(
    reduced: Reduced, without: list[str], shapes: Shapes, parameters: Parameters, population: str
) -> Trunk:
    """Trunk from its meshes, else from its primitives, else from the box with its inertia."""
    links = [name for name in reduced.root.links if name not in without]
    axis = 0 if population == "quadruped" else 2
    triangles = shapes.triangles(links)
    found = slices(triangles, axis) if len(triangles) else []
    source, fault, instead = "its meshes", "", ""
    if len(found) < 2:
        found, source, left = _without_meshes(reduced, links, shapes, axis)
        thin = "the trunk's meshes are too thin to cut"
        fault = thin if len(triangles) else NO_MESHES
        instead = f"{source} {'stand' if source.endswith('primitives') else 'stands'} in"
        if left:
            instead += f", without what reaches far out of it: {quoted(left)}"
    return Trunk("xyz"[axis], _scaled(found, axis, parameters), source, found, fault, instead)


def _core(reduced: Reduced, links: list[str], shapes: Shapes) -> list[str]:
    """Links that the box of a trunk is made of: without a mast or head that is bolted to it.

    Those are the links from which limbs hang, if the inertia of all is that of a far larger box,
    and others have shapes: in a file without any, nothing tells a mast from the trunk.
    """
    ends = {body.joint for body in reduced.root.children if body.joint is not None}
    near = {reduced.root.name, *(name for one in ends for name in (one.parent, one.child))}
    core = [name for name in links if name in near]
    if not len(shapes.points([name for name in links if name not in near])):
        return links
    own, whole = float(shapes.box(core).prod()), float(shapes.box(links).prod())
    return core if 0 < FAR_LARGER * own < whole else links


def _without_meshes(
    reduced: Reduced, links: list[str], shapes: Shapes, axis: int
) -> tuple[list[Slice], str, list[str]]:
    """Sections of a trunk without meshes, what they are from, and the links that are left out."""
    triangles = shapes.primitives(links)
    if len(triangles) and _bounds(reduced, triangles, axis):
        found = slices(triangles, axis)
        if len(found) >= 2:
            return found, "its primitives", []
    core = _core(reduced, links, shapes)
    left = [name for name in links if name not in core and len(shapes.points([name]))]
    links = core
    solid = shapes.box(links).min() >= THIN
    source = "the box with its inertia" if solid else "the extent of its shapes or joints"
    return _box(reduced, links, shapes, axis), source, left


def _bounds(reduced: Reduced, triangles: Array, axis: int) -> bool:
    """Whether primitives are as large as a trunk that carries these limbs."""
    anchors = np.array([body.anchor for body in reduced.root.children])
    apart = np.ptp(anchors, axis=0)
    edges = np.ptp(triangles.reshape(-1, 3), axis=0)
    wide = bool(np.all(edges >= ACROSS * apart))
    return wide and bool(edges[axis] >= ALONG * apart[axis]) and float(edges.min()) >= SLIM


def _box(reduced: Reduced, links: list[str], shapes: Shapes, axis: int) -> list[Slice]:
    """Two sections of the box with the trunk's inertia, between the limbs' first hinges."""
    edges = shapes.box(links)
    anchors = np.array([body.anchor for body in reduced.root.children])
    low, high = anchors.min(axis=0), anchors.max(axis=0)
    middle = (low + high) / 2
    if edges.min() < THIN:
        points = shapes.points(links)
        if len(points):
            low, high = points.min(axis=0), points.max(axis=0)
            middle = (low + high) / 2
        edges = np.maximum(high - low, MARGIN)
    a, b = (axis + 1) % 3, (axis + 2) % 3
    centre, size = (float(middle[a]), float(middle[b])), (float(edges[a]), float(edges[b]))
    half = float(edges[axis]) / 2
    return [Slice(float(middle[axis]) + end * half, centre, size, 0.0) for end in (-1, 1)]


def _scaled(found: list[Slice], axis: int, parameters: Parameters) -> list[Node]:
    """Sections as shares of the trunk's named length and largest sizes."""
    start, span = found[0].at, found[-1].at - found[0].at
    words = {0: ("length", "width", "height"), 2: ("height", "depth", "width")}[axis]
    largest = [max(one.size[i] for one in found) for i in (0, 1)]
    long = parameters.add(f"trunk_{words[0]}", span, f"{words[0].capitalize()} of the trunk.", 4)
    sizes = [
        parameters.add(f"trunk_{word}", value, f"Largest {word} of the trunk.", 4)
        for word, value in zip(words[1:], largest, strict=True)
    ]
    nodes: list[Node] = []
    for one in found:
        share = tidy((one.at - start) / span, 3)
        at: Value = f"{tidy(start, 4):g} + {share:g} * {long}" if share else tidy(start, 4)
        pair: list[Value] = []
        for value, whole, name in zip(one.size, largest, sizes, strict=True):
            part = tidy(value / whole, 3)
            pair.append(name if part == 1 else f"{part:g} * {name}")
        node: Node = {"at": at, "rectangle": pair}
        if one.chamfer > 0.005:
            node["chamfer"] = tidy(one.chamfer, 2)
        if max(map(abs, one.centre)) >= 1e-3:
            node["offset"] = [tidy(x, 4) for x in one.centre]
        nodes.append(node)
    return nodes
