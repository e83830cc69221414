"""Read an MJCF model without compiling it: bodies, joints, inertials and the names of its meshes.

MuJoCo itself needs the meshes; this reader does not, and takes masses from primitive geoms where a
body has no inertial. A body with several joints becomes a chain of massless links.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import cast

from draft.description.description import (
    Axes,
    Description,
    Inertial,
    Joint,
    JointType,
    Link,
    Point,
    root_of,
)
from draft.description.mjcf_actuators import limits_of
from draft.description.mjcf_geoms import geometry, mesh_files, place, solid
from draft.description.mjcf_settings import Compiler, Defaults
from draft.description.rigid import combined, moved, rotated
from draft.description.xmlfile import DescriptionError, Element, read_file
from draft.errors import Problem
from draft.geometry import IDENTITY, ZERO, Matrix, Vector, add, compose, rotate

TYPES: dict[str, JointType] = {
    "hinge": "revolute",
    "slide": "prismatic",
    "ball": "ball",
    "free": "floating",
}
Pose = tuple[Vector, Matrix]
WORLD = "world"
HERE: Pose = (ZERO, IDENTITY)


def read(path: Path, shown: str | None = None) -> Description:
    """Read an MJCF file; `shown` is its name in messages, default the path.

    Raises:
        DescriptionError: not an MJCF model, or not one robot; the message names the line.
    """
    return from_xml(read_file(path, shown))


def from_xml(root: Element) -> Description:
    """Read the root element of an MJCF model.

    Raises:
        DescriptionError: not an MJCF model, or not one robot; the message names the line.
    """
    if root.tag != "mujoco":
        raise root.error(f"the root is <{root.tag}>, an MJCF model has <mujoco>")
    return _Reader(root).description()


class _Reader:
    """Walks the bodies with an explicit stack and collects links and joints."""

    def __init__(self, root: Element) -> None:
        self.root = root
        self.compiler = Compiler.read(root)
        self.defaults = Defaults(root)
        self.meshes = mesh_files(root, self.defaults, self.compiler)
        self.limits = limits_of(root, self.defaults)
        self.links: dict[str, Link] = {}
        self.joints: dict[str, Joint] = {}
        self.notes: list[Problem] = []

    def description(self) -> Description:
        self._refuse_includes()
        world = self.root.first("worldbody")
        if world is None:
            raise self.root.error("it has no <worldbody>")
        tops = self._flattened(world, "main", "body")
        moving = [top for top in tops if _has_joint(top[0])] or tops
        if len(moving) != 1:
            names = ", ".join(top.attributes.get("name", "?") for top, _, _ in moving[:6])
            raise world.error(
                f"{len(moving)} bodies on the world{': ' + names if names else ''}",
                "the survey reads models of one robot",
            )
        body, _, style = moving[0]
        joints = self._flattened(body, body.attributes.get("childclass", style), "joint")
        parent = None
        if any(joint.attributes.get("type") != "free" for joint, _, _ in joints):
            # Its base turns against the world, so the world is a link of its own.
            parent = WORLD
            self.links[WORLD] = Link(WORLD, None, (), world.where)
        waiting: list[tuple[Element, Pose, str, str | None]] = [(*moving[0], parent)]
        while waiting:
            body, pose, inherited, parent = waiting.pop()
            style = body.attributes.get("childclass", inherited)
            name = self._body(body, pose, style, parent)
            below = self._flattened(body, style, "body")
            waiting.extend((*child, name) for child in reversed(below))
        top = root_of(self.root.where.file, self.links, self.joints)
        self._note_loops()
        return Description(
            self.root.attributes.get("model", ""),
            self.root.where.file,
            "mjcf",
            self.links,
            self.joints,
            top,
            tuple(self.notes),
        )

    def _refuse_includes(self) -> None:
        waiting = [self.root]
        while waiting:
            element = waiting.pop()
            if element.tag == "include":
                raise element.error("it includes another file", "save the model as one file")
            waiting.extend(element.children)

    def _note_loops(self) -> None:
        for section in self.root.all("equality"):
            for loop in section.all("connect", "weld"):
                self.notes.append(Problem("a loop is closed by an equality; left open", loop.where))

    def _flattened(
        self, holder: Element, style: str, *tags: str, pose: Pose = HERE
    ) -> list[tuple[Element, Pose, str]]:
        """Children of these tags, through <frame>s: element, pose of its frame, childclass."""
        found: list[tuple[Element, Pose, str]] = []
        for child in holder.children:
            if child.tag == "frame":
                inner = _placed(pose, self._pose(child))
                own = child.attributes.get("childclass", style)
                found += self._flattened(child, own, *tags, pose=inner)
            elif child.tag in tags:
                found.append((child, pose, style))
        return found

    def _pose(self, element: Element) -> Pose:
        position = cast(Vector, element.numbers("pos", 3, (0.0, 0.0, 0.0)))
        return position, self.compiler.rotation(element)

    def _body(self, body: Element, frame: Pose, style: str, parent: str | None) -> str:
        """Add one body and its joints; return its name."""
        name = body.attributes.get("name") or f"body{len(self.links)}"
        if name in self.links:
            raise body.error(f"body '{name}' stands twice")
        geoms = self._flattened(body, style, "geom")
        shapes = [(self.defaults.fill(element, own), pose) for element, pose, own in geoms]
        self.links[name] = Link(
            name,
            self._inertial(body, name, shapes),
            tuple(geometry(e, p, self.compiler, self.meshes) for e, p in shapes),
            body.where,
        )
        pose = _placed(frame, self._pose(body))
        joints = self._flattened(body, style, "joint", "freejoint")
        if parent is not None:
            self._hang(body, name, parent, pose, joints)
        return name

    def _hang(
        self,
        body: Element,
        name: str,
        parent: str,
        pose: Pose,
        joints: list[tuple[Element, Pose, str]],
    ) -> None:
        """Join a body to its parent by its joints, in order, or fix it."""
        if not joints:
            self._add(_fixed(body, name, parent, pose))
            return
        above = parent
        for i, (element, frame, style) in enumerate(joints):
            last = i == len(joints) - 1
            child = name if last else f"{name}:{i + 1}"
            if not last:
                self.links[child] = Link(child, None, (), body.where)
            joint = self._joint(self.defaults.fill(element, style), frame, above, child)
            place = pose if i == 0 else HERE
            self._add(replace(joint, position=cast(Point, place[0]), rotation=place[1]))
            above = child

    def _add(self, joint: Joint) -> None:
        if joint.name in self.joints:
            cause = f"joint '{joint.name}' stands twice"
            raise DescriptionError(Problem(cause, joint.where))
        self.joints[joint.name] = joint

    def _joint(self, element: Element, frame: Pose, parent: str, child: str) -> Joint:
        kind = "free" if element.tag == "freejoint" else element.attributes.get("type", "hinge")
        if kind not in TYPES:
            raise element.error(f"unknown joint type '{kind}'", f"types: {', '.join(TYPES)}")
        name = element.attributes.get("name") or f"joint{len(self.joints)}"
        axis = cast(Vector, element.numbers("axis", 3, (0.0, 0.0, 1.0)))
        length = math.hypot(*element.numbers("axis", 3, (0.0, 0.0, 1.0)))
        if length == 0:
            raise element.error(f"axis of joint '{name}' has no direction")
        anchor = cast(Vector, element.numbers("pos", 3, (0.0, 0.0, 0.0)))
        effort, velocity = self.limits.of(element, name)
        return Joint(
            name=name,
            type=TYPES[kind],
            parent=parent,
            child=child,
            position=(0.0, 0.0, 0.0),
            rotation=IDENTITY,
            axis=cast(Point, tuple(x / length for x in rotate(frame[1], axis))),
            limits=self._range(element, kind),
            effort=effort,
            velocity=velocity,
            where=element.where,
            anchor=cast(Point, add(frame[0], rotate(frame[1], anchor))),
        )

    def _range(self, element: Element, kind: str) -> tuple[float, float] | None:
        limited = element.attributes.get("limited", "auto")
        if "range" not in element.attributes or limited == "false":
            return None
        if limited == "auto" and not self.compiler.autolimits:
            return None
        low, high = element.numbers("range", 2)
        factor = self.compiler.angle if kind in ("hinge", "ball") else 1.0
        return (low * factor, high * factor)

    def _inertial(
        self, body: Element, name: str, shapes: list[tuple[Element, Pose]]
    ) -> Inertial | None:
        """Declared mass properties, or those of the body's primitive geoms."""
        declared = body.first("inertial")
        if declared is not None and self.compiler.inertia_from_geometry != "true":
            return self._declared(declared)
        if self.compiler.inertia_from_geometry == "false":
            return None
        solids: list[Inertial] = []
        for element, frame in shapes:
            found = solid(element)
            if found is None:
                cause = f"body '{name}' takes its mass from a mesh, which is not read"
                self.notes.append(Problem(cause, element.where))
            elif found.mass > 0:
                position, rotation = _placed(frame, place(element, self.compiler))
                solids.append(moved(found, position, rotation))
        return combined(solids) if solids else None

    def _declared(self, element: Element) -> Inertial:
        mass = element.number("mass")
        if mass < 0:
            raise element.error(f"mass {mass:g} kg is below zero")
        position, rotation = self._pose(element)
        if "fullinertia" in element.attributes:
            xx, yy, zz, xy, xz, yz = element.numbers("fullinertia", 6)
        else:
            xx, yy, zz = element.numbers("diaginertia", 3, (0.0, 0.0, 0.0))
            xy = xz = yz = 0.0
        inertia: Axes = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        return Inertial(mass, cast(Point, position), rotated(inertia, cast(Axes, rotation)))


def _placed(frame: Pose, inner: Pose) -> Pose:
    """Pose in the outer frame of something posed in `frame`."""
    at = add(frame[0], rotate(frame[1], inner[0]))
    return at, cast(Matrix, compose(frame[1], inner[1]))


def _has_joint(body: Element) -> bool:
    """Whether anything moves in a body or below it."""
    waiting = [body]
    while waiting:
        element = waiting.pop()
        if element.tag in ("joint", "freejoint"):
            return True
        waiting.extend(element.all("body", "frame", "joint", "freejoint"))
    return False


def _fixed(body: Element, name: str, parent: str, pose: Pose) -> Joint:
    return Joint(
        name=f"{name}:fixed",
        type="fixed",
        parent=parent,
        child=name,
        position=cast(Point, pose[0]),
        rotation=pose[1],
        axis=(1.0, 0.0, 0.0),
        limits=None,
        effort=None,
        velocity=None,
        where=body.where,
    )
