"""Reading of URDF: links, joints, inertials and the names of meshes; no other file is read."""

from __future__ import annotations

import math
from pathlib import Path
from typing import cast, get_args

from draft.description.description import (
    Axes,
    Description,
    Geometry,
    Inertial,
    Joint,
    JointType,
    Link,
    Loop,
    Point,
    root_of,
)
from draft.description.rigid import rotated
from draft.description.xmlfile import Element, read_file
from draft.errors import Problem
from draft.geometry import IDENTITY, ZERO, Matrix, Vector, from_rpy

TYPES = {name: name for name in get_args(JointType)}


def read(path: Path, shown: str | None = None) -> Description:
    """Read a URDF file; `shown` is its name in messages, default the path.

    Raises:
        DescriptionError: not a URDF, or not a tree of links; the message gives the line.
    """
    return from_xml(read_file(path, shown))


def from_xml(root: Element, within: str = "") -> Description:
    """Read the root element of a URDF.

    Args:
        root: the element.
        within: a link of the tree that is read, where there are several; "" for one tree.

    Raises:
        DescriptionError: not a URDF, or not a tree of links; the message gives the line.
    """
    if root.tag != "robot":
        raise root.error(f"the root element is <{root.tag}>; a URDF has <robot>")
    notes: list[Problem] = []
    links: dict[str, Link] = {}
    for element in root.all("link"):
        link = _link(element, notes)
        if link.name in links:
            raise element.error(f"link '{link.name}' occurs twice")
        links[link.name] = link
    joints: dict[str, Joint] = {}
    for element in root.all("joint"):
        joint = _joint(element, links)
        if joint.name in joints:
            raise element.error(f"joint '{joint.name}' occurs twice")
        joints[joint.name] = joint
    file = root.where.file
    joints, loops = _without_loops(joints)
    if within in links:
        links = _tree(within, links, joints)
        joints = {name: joint for name, joint in joints.items() if joint.child in links}
    top = root_of(file, links, joints)
    return Description(
        root.attributes.get("name", ""),
        file,
        "urdf",
        links,
        joints,
        top,
        tuple(notes),
        loops=loops,
        floats=True if any(joint.type == "floating" for joint in joints.values()) else None,
    )


def _tree(within: str, links: dict[str, Link], joints: dict[str, Joint]) -> dict[str, Link]:
    """Links that joints connect with one of them, in the order of the file."""
    beside: dict[str, list[str]] = {name: [] for name in links}
    for joint in joints.values():
        beside[joint.parent].append(joint.child)
        beside[joint.child].append(joint.parent)
    found, waiting = {within}, [within]
    while waiting:
        new = [name for name in beside[waiting.pop()] if name not in found]
        found.update(new)
        waiting += new
    return {name: link for name, link in links.items() if name in found}


def _without_loops(joints: dict[str, Joint]) -> tuple[dict[str, Joint], tuple[Loop, ...]]:
    """Cut closed loops: of several joints with one child, keep one.

    The end of a rod is cut first. Of the others, the joint furthest from the root is kept; for a
    tie, the first in the file.
    """
    above: dict[str, list[Joint]] = {}
    for joint in joints.values():
        above.setdefault(joint.child, []).append(joint)
    kept, loops = dict(joints), []
    for child, several in above.items():
        if len(several) > 1:
            depths = {joint.name: _depth(joint, above) for joint in several}
            bars = {joint.name for joint in several if _ends_rod(joint, above, joints)}
            best = max(several, key=lambda joint: (joint.name not in bars, depths[joint.name][1]))
            if len({root for root, depth in depths.values() if depth >= 0}) > 1:
                continue  # The joints are in separate trees: not a loop; `root_of` refuses it.
            for joint in several:
                if joint is not best:
                    del kept[joint.name]
                    links = joint.parent, child
                    loops.append(
                        Loop(joint.name, links, joint.where, joint.position, False, joint.effort)
                    )
    return kept, tuple(loops)


def _ends_rod(joint: Joint, above: dict[str, list[Joint]], joints: dict[str, Joint]) -> bool:
    """Whether a joint is the far end of a rod: a link that two joints without a drive hold."""
    held = above.get(joint.parent, ())
    others = [one for one in joints.values() if one.parent == joint.parent and one.moves]
    return len(held) == 1 and len(others) == 1 and not (_drives(joint) or _drives(held[0]))


def _drives(joint: Joint) -> bool:
    """Whether a joint that moves has an effort, or a fixed one is as good as one."""
    return not joint.moves or bool(joint.effort)


def _depth(joint: Joint, above: dict[str, list[Joint]]) -> tuple[str, int]:
    """Root above a joint, and the number of joints from the root to it, itself included.

    A link with several joints is followed through the first of them. A joint below its own child
    has depth -1.
    """
    seen, here = {joint.child}, joint.parent
    while here in above:
        if here in seen:
            return here, -1
        seen.add(here)
        here = above[here][0].parent
    return here, len(seen)


def pose(element: Element | None) -> tuple[Vector, Matrix]:
    """Position [m] and rotation of an <origin>; the identity for None."""
    if element is None:
        return ZERO, IDENTITY
    position = cast(Point, element.numbers("xyz", 3, (0.0, 0.0, 0.0)))
    rpy = element.numbers("rpy", 3, (0.0, 0.0, 0.0))
    return position, from_rpy(*rpy) if any(rpy) else IDENTITY


def _link(element: Element, notes: list[Problem]) -> Link:
    shapes: list[Geometry] = []
    for use in ("visual", "collision"):
        for shape in element.all(use):
            geometry = _geometry(use, shape)
            if geometry:
                shapes.append(geometry)
            else:
                notes.append(Problem(f"<{use}> without a known shape", shape.where))
    inertial = element.first("inertial")
    return Link(
        element.text("name"),
        None if inertial is None else _inertial(inertial),
        tuple(shapes),
        element.where,
    )


def _inertial(element: Element) -> Inertial | None:
    """Mass properties, with the inertia in the axes of the link."""
    weight = element.first("mass")
    if weight is None:
        raise element.error("<inertial> has no <mass>")
    mass = weight.number("value")
    if mass < 0:
        raise weight.error(f"mass {mass:g} kg is below zero")
    position, rotation = pose(element.first("origin"))
    tensor = element.first("inertia")
    xx, xy, xz, yy, yz, zz = (
        (tensor.number(key, 0.0) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
        if tensor is not None
        else (0.0,) * 6
    )
    inertia: Axes = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    turned = inertia if rotation is IDENTITY else rotated(inertia, cast(Axes, rotation))
    return Inertial(mass, cast(Point, position), turned)


def _geometry(use: str, element: Element) -> Geometry | None:
    """Read one shape; None for an unknown type."""
    position, rotation = pose(element.first("origin"))
    holder = element.first("geometry")
    shape = holder.children[0] if holder is not None and holder.children else None
    if shape is None:
        return None
    if shape.tag == "mesh":
        scale = cast(Vector, shape.numbers("scale", 3, (1.0, 1.0, 1.0)))
        name = shape.attributes.get("filename", "")
        return Geometry(use, "mesh", (), name, scale, position, rotation)
    if shape.tag == "box":
        return Geometry(use, "box", shape.numbers("size", 3), position=position, rotation=rotation)
    if shape.tag == "sphere":
        size: tuple[float, ...] = (shape.number("radius"),)
    elif shape.tag in ("cylinder", "capsule"):
        size = (shape.number("radius"), shape.number("length"))
    else:
        return None
    return Geometry(use, shape.tag, size, position=position, rotation=rotation)


def _joint(element: Element, links: dict[str, Link]) -> Joint:
    name, kind = element.text("name"), element.text("type")
    if kind not in TYPES:
        raise element.error(
            f"joint '{name}' has the unknown type '{kind}'", f"types: {', '.join(TYPES)}"
        )
    ends: list[str] = []
    for tag in ("parent", "child"):
        end = element.first(tag)
        if end is None:
            raise element.error(f"joint '{name}' has no <{tag}>")
        if end.text("link") not in links:
            raise end.error(f"joint '{name}' names link '{end.text('link')}', which does not exist")
        ends.append(end.text("link"))
    position, rotation = pose(element.first("origin"))
    limit, follows = element.first("limit"), element.first("mimic")
    return Joint(
        name=name,
        type=cast(JointType, kind),
        parent=ends[0],
        child=ends[1],
        position=cast(Point, position),
        rotation=rotation,
        axis=_axis(element, name, kind),
        limits=_range(limit, kind),
        effort=_limit(limit, "effort"),
        velocity=_limit(limit, "velocity"),
        where=element.where,
        mimics=None if follows is None else follows.attributes.get("joint"),
        ratio=1.0 if follows is None else follows.number("multiplier", 1.0),
        offset=0.0 if follows is None else follows.number("offset", 0.0),
    )


def _axis(element: Element, name: str, kind: str) -> Point:
    axis = element.first("axis")
    vector = (1.0, 0.0, 0.0) if axis is None else axis.numbers("xyz", 3)
    length = math.hypot(*vector)
    if length == 0:
        if axis is not None and kind in ("revolute", "continuous", "prismatic"):
            raise axis.error(f"axis of joint '{name}' has no direction")
        return (1.0, 0.0, 0.0)
    return cast(Point, tuple(x / length for x in vector))


def _range(limit: Element | None, kind: str) -> tuple[float, float] | None:
    if limit is None or kind not in ("revolute", "prismatic"):
        return None
    return (limit.number("lower", 0.0), limit.number("upper", 0.0))


def _limit(limit: Element | None, attribute: str) -> float | None:
    """Read a limit; it may be zero, negative or infinite, which the caller checks."""
    if limit is None or attribute not in limit.attributes:
        return None
    try:
        return float(limit.attributes[attribute])
    except ValueError:
        raise limit.error(
            f'{attribute}="{limit.attributes[attribute][:60]}" of <limit> is not a number'
        ) from None
