"""Contents of a robot description in either format: links, joints, masses, geometry.

Frames follow URDF: a joint's pose is that of its child link in its parent link, at position zero.
MJCF's joints may lie off their body's frame; `Joint.anchor` holds that offset.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

from draft.description.xmlfile import DescriptionError
from draft.errors import Location, Problem
from draft.geometry import (
    IDENTITY,
    ZERO,
    Matrix,
    Vector,
    about,
    compose,
    rotate,
    scale,
    subtract,
)

JointType = Literal["revolute", "continuous", "prismatic", "ball", "planar", "floating", "fixed"]
MOVING = ("revolute", "continuous", "prismatic", "ball", "planar")
Point = tuple[float, float, float]
Axes = tuple[Point, Point, Point]


@dataclass(frozen=True, slots=True)
class Inertial:
    """Mass [kg], centre of mass [m], and inertia about it [kg m2], both in the link's axes."""

    mass: float
    com: Point
    inertia: Axes


@dataclass(frozen=True, slots=True)
class Geometry:
    """One shape of a link, by name and size only: meshes are never opened.

    Attributes:
        use: "visual" or "collision".
        kind: "mesh", "box", "sphere", "cylinder", "capsule" or another of MJCF's.
        size: box: edges; sphere: radius; cylinder and capsule: radius, length [m].
        mesh: the file as the description names it, or None.
        scale: factor on the mesh's axes.
        position, rotation: pose in the link.
    """

    use: str
    kind: str
    size: tuple[float, ...]
    mesh: str | None = None
    scale: Vector = (1.0, 1.0, 1.0)
    position: Vector = ZERO
    rotation: Matrix = IDENTITY


@dataclass(frozen=True, slots=True)
class Link:
    """A rigid body and its place in the file; `inertial` is None where none is given."""

    name: str
    inertial: Inertial | None
    geometries: tuple[Geometry, ...]
    where: Location


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint from link `parent` to link `child`, and its place in the file.

    Attributes:
        position, rotation: pose of the child's frame in the parent's.
        anchor: a point of the axis, in the child's frame [m]; URDF: zero.
        axis: unit vector in the child's frame.
        limits: lowest and highest position [rad or m]; None where there is none.
        effort: declared effort limit [N m or N]; None where none is given, infinite where an
            actuator drives the joint without a limit.
        velocity: declared velocity limit [rad/s or m/s]; None where none is given.
        mimics: name of the joint it follows.
        rest: position at which to hold it if nothing drives it [rad or m], before its limits are
            applied: zero in a URDF; in MJCF the spring's, else that in which the file shows it.
        driven: whether an actuator may drive it. False in an MJCF model whose actuators drive
            other joints.
    """

    name: str
    type: JointType
    parent: str
    child: str
    position: Point
    rotation: Matrix
    axis: Point
    limits: tuple[float, float] | None
    effort: float | None
    velocity: float | None
    where: Location
    anchor: Point = (0.0, 0.0, 0.0)
    mimics: str | None = None
    rest: float = 0.0
    driven: bool = True

    @property
    def moves(self) -> bool:
        """Whether it moves one part of the robot against another."""
        return self.type in MOVING

    @property
    def held_at(self) -> float:
        """Position to hold it at [rad or m]: `rest`, brought into its limits."""
        if self.limits is None or self.limits[0] > self.limits[1]:
            return self.rest
        return min(max(self.rest, self.limits[0]), self.limits[1])


def displaced(joint: Joint, position: float) -> tuple[Vector, Matrix]:
    """Pose of a joint's child at a position [rad or m], in the child's frame at position zero."""
    if joint.type == "prismatic":
        return scale(joint.axis, position), IDENTITY
    if joint.type not in ("revolute", "continuous"):
        return ZERO, IDENTITY
    turn = about(joint.axis, position)
    return subtract(joint.anchor, rotate(turn, joint.anchor)), turn


@dataclass(frozen=True, slots=True)
class Loop:
    """A closed kinematic loop, cut where it closes.

    Attributes:
        name: name of the joint or equality that closes it, or "".
        links: the two links that it joins.
        where: its place in the file.
        anchor: point at which they are joined, in the first link's frame [m].
        rigid: whether they are joined rigidly, and not only at that point.
        effort: declared effort limit of the joint that closes it [N m or N]; None for none.
    """

    name: str
    links: tuple[str, str]
    where: Location
    anchor: Point = (0.0, 0.0, 0.0)
    rigid: bool = False
    effort: float | None = None


@dataclass(frozen=True)
class Description:
    """A tree of links and joints, by name, in the order of the file.

    Attributes:
        name: what the file calls the robot.
        file: the file's name in messages.
        format: "urdf" or "mjcf".
        root: name of the link that has no parent.
        notes: what the reader skipped or changed, for the summary.
        upright: orientation of the root link in the world, whose z axis points up.
        loops: closed loops, which the tree leaves open.
        floats: whether its base moves freely; None where the file does not say.
        turned: rotation from the file's world to one in which z points up and x forward; a file
            whose robot lies or faces elsewhere has another than the identity.
    """

    name: str
    file: str
    format: str
    links: Mapping[str, Link]
    joints: Mapping[str, Joint]
    root: str
    notes: tuple[Problem, ...] = ()
    upright: Matrix = IDENTITY
    loops: tuple[Loop, ...] = ()
    floats: bool | None = None
    turned: Matrix = IDENTITY

    def turn(self, rotation: Matrix) -> Description:
        """Return the description in a world that is turned."""
        upright, turned = (
            compose(rotation, one) or IDENTITY for one in (self.upright, self.turned)
        )
        return replace(self, upright=upright, turned=turned)

    @cached_property
    def children(self) -> dict[str, list[Joint]]:
        """Joints below each link, in the order of the file."""
        below: dict[str, list[Joint]] = {name: [] for name in self.links}
        for joint in self.joints.values():
            below[joint.parent].append(joint)
        return below

    @cached_property
    def mass(self) -> float:
        """Total mass [kg]."""
        return math.fsum(link.inertial.mass for link in self.links.values() if link.inertial)

    def branches(self, first: str, second: str) -> tuple[list[Joint], list[Joint]]:
        """Joints from each of two links up to the link above both."""
        ways = self._up(first), self._up(second)
        shared = {joint.name for joint in ways[0]} & {joint.name for joint in ways[1]}
        one, other = ([joint for joint in way if joint.name not in shared] for way in ways)
        return one, other

    def between(self, first: str, second: str) -> list[Joint]:
        """Moving joints on the way from one link to another through the tree."""
        one, other = self.branches(first, second)
        return [joint for joint in (*one, *reversed(other)) if joint.moves]

    def _up(self, link: str) -> list[Joint]:
        """Joints from a link up to the root."""
        above = {joint.child: joint for joint in self.joints.values()}
        found: list[Joint] = []
        while link in above:
            found.append(above[link])
            link = above[link].parent
        return found

    @property
    def moving(self) -> list[Joint]:
        """Joints that move one part of the robot against another."""
        return [joint for joint in self.joints.values() if joint.moves]


def root_of(file: str, links: Mapping[str, Link], joints: Mapping[str, Joint]) -> str:
    """Name of the one link without a parent, from which all others hang.

    Raises:
        DescriptionError: no links, a ring, several roots, or a link with two parents.
    """
    if not links:
        raise DescriptionError(Problem("it has no links", Location(file)))
    above: dict[str, Joint] = {}
    for joint in joints.values():
        if joint.child in above:
            first = above[joint.child]
            raise DescriptionError(
                Problem(
                    f"link '{joint.child}' hangs on joint '{first.name}' and on joint "
                    f"'{joint.name}' of separate trees",
                    joint.where,
                    "keep one of these joints",
                )
            )
        above[joint.child] = joint
    roots = [name for name in links if name not in above]
    if not roots:
        joint = next(iter(joints.values()))
        raise DescriptionError(
            Problem(f"cyclic links: every link hangs on another ({_cycle(above)})", joint.where)
        )
    if len(roots) > 1:
        raise DescriptionError(
            Problem(
                f"{len(roots)} links hang on nothing: {', '.join(roots[:6])}",
                links[roots[1]].where,
                "one link is the root; join the others to it",
            )
        )
    _refuse_islands(roots[0], links, joints, above)
    return roots[0]


def _refuse_islands(
    root: str, links: Mapping[str, Link], joints: Mapping[str, Joint], above: Mapping[str, Joint]
) -> None:
    """Refuse links that hang on each other in a ring beside the tree."""
    below: dict[str, list[str]] = {}
    for joint in joints.values():
        below.setdefault(joint.parent, []).append(joint.child)
    reached, waiting = {root}, [root]
    while waiting:
        name = waiting.pop()
        reached.add(name)
        waiting.extend(below.get(name, ()))
    for name in links:
        if name not in reached:
            raise DescriptionError(
                Problem(f"cyclic links ({_cycle(above, name)})", above[name].where)
            )


def _cycle(above: Mapping[str, Joint], start: str | None = None) -> str:
    """Words for a ring of links, such as 'a <- b <- a'."""
    name = start if start is not None else next(iter(above))
    seen: dict[str, int] = {}
    while name not in seen:
        seen[name] = len(seen)
        name = above[name].parent
    ring = [*list(seen)[seen[name] :], name]
    return " <- ".join(ring if len(ring) < 8 else [*ring[:6], "...", name])
