"""Content of a robot description, URDF or MJCF: links, joints, masses, geometry.

Frames follow URDF: the pose of a joint is that of its child link in its parent link, at position
zero. A joint of MJCF may have an offset from the frame of its body, which is `Joint.anchor`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

from draft.description.xmlfile import DescriptionError
from draft.errors import Location, Problem, suggest
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
class MeshMass:
    """How a mesh counts for the mass of its link, in an MJCF model.

    Attributes:
        mass: mass that the file states [kg]; None for that of its volume.
        density: mass per volume [kg/m3], or per area of a shell [kg/m2].
        method: MuJoCo's rule for its volume: "legacy", "exact", "convex" or "shell".
    """

    mass: float | None
    density: float
    method: str


@dataclass(frozen=True, slots=True)
class Geometry:
    """One shape of a link; the file of a mesh is not read.

    Attributes:
        use: "visual" or "collision".
        kind: "mesh", "box", "sphere", "cylinder", "capsule" or another type of MJCF.
        size: box: edges; sphere: radius; cylinder and capsule: radius, length [m].
        mesh: name of the file as in the description; None without a mesh.
        scale: scale of the mesh along its axes.
        position: position in the frame of the link [m].
        rotation: orientation in the frame of the link.
        weight: how a mesh counts for the mass of its link; None where it does not, or where the
            link has its mass from elsewhere.
    """

    use: str
    kind: str
    size: tuple[float, ...]
    mesh: str | None = None
    scale: Vector = (1.0, 1.0, 1.0)
    position: Vector = ZERO
    rotation: Matrix = IDENTITY
    weight: MeshMass | None = None


@dataclass(frozen=True, slots=True)
class Link:
    """A rigid body and its place in the file; `inertial` is None if the file gives none."""

    name: str
    inertial: Inertial | None
    geometries: tuple[Geometry, ...]
    where: Location


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint from link `parent` to link `child`, and its place in the file.

    Attributes:
        position: origin of the child frame in the parent frame [m].
        rotation: orientation of the child frame in the parent frame.
        axis: unit vector of the axis in the child frame.
        limits: lowest and highest position [rad or m]; None without limits.
        effort: declared effort limit [N m or N]; None if the file gives none, infinite for a joint
            with an actuator that has no limit.
        velocity: declared velocity limit [rad/s or m/s]; None if the file gives none.
        where: its place in the file.
        anchor: point of the axis in the child frame [m]; zero in a URDF.
        mimics: name of the joint it follows.
        ratio: motion per motion of that joint; 0 if the file couples them otherwise.
        offset: position with that joint at zero [rad or m].
        rest: position without a drive [rad or m], before the limits are applied: zero in a URDF;
            in MJCF that of its spring, else that in which the file shows the joint.
        driven: whether it may have an actuator. False in an MJCF model whose actuators drive only
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
    ratio: float = 1.0
    offset: float = 0.0
    rest: float = 0.0
    driven: bool = True

    @property
    def moves(self) -> bool:
        """Whether it is a joint between two parts of the robot that move relative to each other."""
        return self.type in MOVING

    @property
    def held_at(self) -> float:
        """Position without a drive [rad or m]: `rest`, clipped to the limits."""
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
        links: names of the two links that it connects.
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
    """A robot as a tree of links and joints.

    Attributes:
        name: name of the robot in the file.
        file: name of the file in messages.
        format: "urdf" or "mjcf".
        links: links by name, in the order of the file.
        joints: joints by name, in the order of the file.
        root: name of the link without a parent.
        notes: omissions and changes by the reader, for the summary.
        upright: orientation of the root link in the world, whose z axis points up.
        loops: closed loops, which are open in the tree.
        floats: whether the base moves freely; None if the file does not say.
        turned: rotation from the world of the file to one in which z points up and x forward.
        unweighed: links of which the file states no mass, or only a part of it.
        unplaced: links of which the file states a mass, but only a missing mesh where it is.
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
    unweighed: frozenset[str] = frozenset()
    unplaced: frozenset[str] = frozenset()

    def turn(self, rotation: Matrix) -> Description:
        """Return the description with its world rotated."""
        upright, turned = (
            compose(rotation, old) or IDENTITY for old in (self.upright, self.turned)
        )
        return replace(self, upright=upright, turned=turned)

    def below(self, link: str) -> Description:
        """Return the part of the robot from a link down, which is bolted to the world there.

        Its axes are those of the world with all joints above it at zero.

        Raises:
            DescriptionError: there is no such link.
        """
        if link == self.root:
            return self
        if link not in self.links:
            remedy = suggest(link, self.links, "links")
            raise DescriptionError(Problem(f"it has no link '{link}'", Location(self.file), remedy))
        kept, waiting = set[str](), [link]
        while waiting:
            kept.add(waiting[-1])
            waiting += [joint.child for joint in self.children[waiting.pop()]]
        upright = self.upright
        for joint in reversed(self._to_root(link)):
            upright = compose(upright, joint.rotation) or IDENTITY
        return replace(
            self,
            links={name: own for name, own in self.links.items() if name in kept},
            joints={name: own for name, own in self.joints.items() if own.parent in kept},
            root=link,
            upright=upright,
            loops=tuple(loop for loop in self.loops if kept.issuperset(loop.links)),
            floats=False,
            unweighed=self.unweighed & kept,
            unplaced=self.unplaced & kept,
        )

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
        ways = self._to_root(first), self._to_root(second)
        shared = {joint.name for joint in ways[0]} & {joint.name for joint in ways[1]}
        one, other = ([joint for joint in way if joint.name not in shared] for way in ways)
        return one, other

    def between(self, first: str, second: str) -> list[Joint]:
        """Moving joints on the path from one link to another through the tree."""
        one, other = self.branches(first, second)
        return [joint for joint in (*one, *reversed(other)) if joint.moves]

    def _to_root(self, link: str) -> list[Joint]:
        """Joints from a link up to the root."""
        above = {joint.child: joint for joint in self.joints.values()}
        path: list[Joint] = []
        while link in above:
            path.append(above[link])
            link = above[link].parent
        return path

    @property
    def moving(self) -> list[Joint]:
        """Joints between parts of the robot that move relative to each other."""
        return [joint for joint in self.joints.values() if joint.moves]


def root_of(file: str, links: Mapping[str, Link], joints: Mapping[str, Joint]) -> str:
    """Name of the root, the only link without a parent.

    Raises:
        DescriptionError: no links, a cycle, several roots, or a link with two parents.
    """
    if not links:
        raise DescriptionError(Problem("it has no links", Location(file)))
    above: dict[str, Joint] = {}
    for joint in joints.values():
        if joint.child in above:
            first = above[joint.child]
            raise DescriptionError(
                Problem(
                    f"link '{joint.child}' is the child of joints '{first.name}' and "
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
            Problem(f"cyclic links: every link has a parent ({_cycle(above)})", joint.where)
        )
    if len(roots) > 1:
        raise DescriptionError(
            Problem(
                f"{len(roots)} links have no parent: {', '.join(roots[:6])}",
                links[roots[1]].where,
                "name one as `root`, or connect the others to it with joints",
            )
        )
    _refuse_cycles(roots[0], links, joints, above)
    return roots[0]


def _refuse_cycles(
    root: str, links: Mapping[str, Link], joints: Mapping[str, Joint], above: Mapping[str, Joint]
) -> None:
    """Refuse links that form a cycle apart from the tree."""
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
    """Text of a cycle of links, such as 'a <- b <- a'."""
    name = start if start is not None else next(iter(above))
    seen: dict[str, int] = {}
    while name not in seen:
        seen[name] = len(seen)
        name = above[name].parent
    cycle = [*list(seen)[seen[name] :], name]
    return " <- ".join(cycle if len(cycle) < 8 else [*cycle[:6], "...", name])
