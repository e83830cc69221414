"""Read an MJCF model without compiling it: bodies, joints, inertials and the names of its meshes.

MuJoCo itself needs the meshes; this reader does not, and takes masses from primitive geoms where a
body has no inertial; those of meshes are added by `draft.imports.mesh_masses`. A body with several
joints becomes a chain of massless links. The file shows each joint at its `ref`; the links of a
description are those of joint positions zero.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

from draft.description import includes
from draft.description.description import (
    Axes,
    Description,
    Inertial,
    Joint,
    JointType,
    Link,
    Point,
    displaced,
    root_of,
)
from draft.description.mjcf_actuators import drives_of
from draft.description.mjcf_geoms import geometry, mesh_files, place, solid
from draft.description.mjcf_loops import followed, loops
from draft.description.mjcf_settings import Compiler, Defaults
from draft.description.mjcf_tendons import pulled
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
# Elements from which MuJoCo makes bodies.
GENERATED = ("attach", "replicate")
HERE: Pose = (ZERO, IDENTITY)


def read(path: Path, shown: str | None = None) -> Description:
    """Read an MJCF file and those that it includes.

    Args:
        path: the file.
        shown: its name in messages; default the path.

    Raises:
        DescriptionError: not an MJCF model, or not one robot; the message names the line.
    """
    return from_xml(includes.expand(read_file(path, shown), path))


def from_xml(root: Element, link: str = "") -> Description:
    """Read the root element of an MJCF model, its includes already expanded.

    Args:
        root: the element.
        link: a body of the robot that is read; "" for the one with most joints.

    Raises:
        DescriptionError: not an MJCF model, or not one robot; the message names the line.
    """
    if root.tag != "mujoco":
        raise root.error(f"the root is <{root.tag}>, an MJCF model has <mujoco>")
    return _Reader(root, link).description()


class _Reader:
    """Walks the bodies with an explicit stack and collects links and joints."""

    def __init__(self, root: Element, link: str) -> None:
        self.root, self.link = root, link
        self.compiler = Compiler.read(root)
        self.defaults = Defaults(root)
        self.meshes = mesh_files(root, self.defaults, self.compiler)
        self.drives = drives_of(root, self.defaults)
        self.links: dict[str, Link] = {}
        self.joints: dict[str, Joint] = {}
        self.notes: list[Problem] = []
        self.sites: dict[str, tuple[str, Point]] = {}

    def description(self) -> Description:
        self._refuse_generated()
        worlds = list(self.root.all("worldbody"))
        if not worlds:
            raise self.root.error("it has no <worldbody>")
        body, frame, style = self._robot(worlds)
        upright = _placed(frame, self._pose(body))[1]
        style_inside = body.attributes.get("childclass", style)
        joints = self._flattened(body, style_inside, "joint", "freejoint")
        parent = None
        if any(not self._is_free(joint, own) for joint, _, own in joints):
            # Its base turns against the world, so the world is a link of its own.
            parent, upright = WORLD, IDENTITY
            self.links[WORLD] = Link(WORLD, None, (), worlds[0].where)
        waiting: list[tuple[Element, Pose, str, str | None]] = [(body, frame, style, parent)]
        while waiting:
            body, pose, inherited, parent = waiting.pop()
            style = body.attributes.get("childclass", inherited)
            name = self._body(body, pose, style, parent)
            below = self._flattened(body, style, "body")
            waiting.extend((*child, name) for child in reversed(below))
        top = root_of(self.root.where.file, self.links, self.joints)
        return Description(
            self.root.attributes.get("model", ""),
            self.root.where.file,
            "mjcf",
            self.links,
            pulled(self.root, followed(self.root, self.joints), self.drives.pulls),
            top,
            tuple(self.notes),
            upright,
            loops(self.root, self.links, self.sites),
            bool(joints),
            unweighed=frozenset(
                name
                for name, link in self.links.items()
                if any(shape.weight is not None for shape in link.geometries)
            ),
        )

    def _robot(self, worlds: Sequence[Element]) -> tuple[Element, Pose, str]:
        """Body on the world that is the robot: the only one, or the one with most joints."""
        tops = [top for world in worlds for top in self._flattened(world, "main", "body")]
        tops = [top for top in tops if _holds(top[0], self.link)] or tops
        counts = [_joint_count(top[0]) for top in tops]
        most = max(counts, default=0)
        if not tops or (counts.count(most) > 1 and len(tops) > 1):
            names = ", ".join(top.attributes.get("name", "?") for top, _, _ in tops[:6])
            raise worlds[0].error(
                f"{len(tops)} bodies on the world{': ' + names if names else ''}",
                "name a body of the one to read as `root`, or keep one in a copy of the model",
            )
        robot = tops[counts.index(most)]
        for (top, _, _), count in zip(tops, counts, strict=True):
            if top is not robot[0] and count:
                cause = f"body '{top.attributes.get('name', '?')}' is not part of the robot"
                self.notes.append(Problem(f"{cause}: it is left out", top.where))
        return robot

    def _is_free(self, joint: Element, style: str) -> bool:
        """Whether a joint is free; its type may be that of its default class."""
        if joint.tag == "freejoint":
            return True
        return self.defaults.fill(joint, style).attributes.get("type") == "free"

    def _refuse_generated(self) -> None:
        """Refuse elements that stand for bodies which only MuJoCo can make."""
        waiting = [self.root]
        while waiting:
            element = waiting.pop()
            if element.tag in GENERATED:
                remedy = "write the compiled model and import that: "
                remedy += "mujoco.mj_saveLastXML('flat.xml', mujoco.MjModel.from_xml_path(FILE))"
                raise element.error(f"it uses <{element.tag}>, which is not read", remedy)
            if element.tag == "compiler" and element.attributes.get("coordinate") == "global":
                remedy = "save the model with a MuJoCo before 2.3.4, which makes them local"
                raise element.error("global coordinates are not read", remedy)
            waiting.extend(element.children)

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
            raise body.error(f"body '{name}' occurs twice")
        geoms = self._flattened(body, style, "geom")
        shapes = [(self.defaults.fill(element, own), pose) for element, pose, own in geoms]
        inertial = self._declared_inertial(body)
        weighs = inertial is None and self.compiler.inertia_from_geometry != "false"
        self.links[name] = Link(
            name,
            self._primitives(shapes) if weighs else inertial,
            tuple(
                geometry(e, p, self.compiler, self.meshes, weighs and self.compiler.weighs(e))
                for e, p in shapes
            ),
            body.where,
        )
        for site, within, _ in self._flattened(body, style, "site"):
            at = _placed(within, self._pose(site))[0]
            self.sites[site.attributes.get("name", "")] = name, cast(Point, at)
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
            filled = self.defaults.fill(element, style)
            joint = self._joint(filled, frame, above, child)
            place = _placed(pose if i == 0 else HERE, self._zero(filled, joint))
            self._add(replace(joint, position=cast(Point, place[0]), rotation=place[1]))
            above = child

    def _add(self, joint: Joint) -> None:
        if joint.name in self.joints:
            cause = f"joint '{joint.name}' occurs twice"
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
        return Joint(
            name=name,
            type=TYPES[kind],
            parent=parent,
            child=child,
            position=(0.0, 0.0, 0.0),
            rotation=IDENTITY,
            axis=cast(Point, tuple(x / length for x in rotate(frame[1], axis))),
            limits=self._range(element, kind),
            effort=self.drives.effort(element, name),
            velocity=None,
            where=element.where,
            anchor=cast(Point, add(frame[0], rotate(frame[1], anchor))),
            rest=self._rest(element, kind),
            driven=self.drives.drives(name),
        )

    def _angle(self, element: Element, attribute: str, kind: str) -> float:
        """Position that an attribute of a joint gives [rad or m]; 0 where it has none."""
        factor = self.compiler.angle if kind == "hinge" else 1.0
        return element.number(attribute, 0.0) * factor if kind in ("hinge", "slide") else 0.0

    def _rest(self, element: Element, kind: str) -> float:
        """Position that a joint without a drive has [rad or m]: its spring's, or the file's."""
        sprung = element.number("stiffness", 0.0) > 0
        return self._angle(element, "springref" if sprung else "ref", kind)

    def _zero(self, element: Element, joint: Joint) -> Pose:
        """Pose of the child's frame at joint position zero in its frame as the file shows it.

        In the file the joint is at `ref`.
        """
        kind = element.attributes.get("type", "hinge") if element.tag == "joint" else "free"
        ref = self._angle(element, "ref", kind)
        return displaced(joint, -ref) if ref else HERE

    def _range(self, element: Element, kind: str) -> tuple[float, float] | None:
        limited = element.attributes.get("limited", "auto")
        if "range" not in element.attributes or limited == "false":
            return None
        if limited == "auto" and not self.compiler.autolimits:
            return None
        low, high = element.numbers("range", 2)
        factor = self.compiler.angle if kind in ("hinge", "ball") else 1.0
        return (low * factor, high * factor)

    def _declared_inertial(self, body: Element) -> Inertial | None:
        """Mass properties that a body declares, unless those of its geoms count instead."""
        declared = body.first("inertial")
        if declared is None or self.compiler.inertia_from_geometry == "true":
            return None
        return self._declared(declared)

    def _primitives(self, shapes: list[tuple[Element, Pose]]) -> Inertial | None:
        """Mass properties of a body's primitive geoms; None without any."""
        solids: list[Inertial] = []
        for element, frame in shapes:
            found = solid(element) if self.compiler.weighs(element) else None
            if found is not None and found.mass > 0:
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


def _joint_count(body: Element) -> int:
    """Number of joints of a body and of those below it."""
    found, waiting = 0, [body]
    while waiting:
        element = waiting.pop()
        found += element.tag in ("joint", "freejoint")
        waiting.extend(element.all("body", "frame", "joint", "freejoint"))
    return found


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


def _holds(body: Element, name: str) -> bool:
    """Whether a body has a name, or holds a body that does."""
    waiting = [body]
    while waiting:
        element = waiting.pop()
        if element.tag == "body" and element.attributes.get("name") == name:
            return True
        waiting.extend(element.children)
    return False
