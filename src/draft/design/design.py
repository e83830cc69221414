"""The Design: a robot with every number resolved, for one set of parameters or for N at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from draft import geometry as g
from draft.design.actuators import Actuator
from draft.design.parts import Joint, Link
from draft.design.solids import Pose, lowest
from draft.errors import DraftError, counted
from draft.geometry import Frame, Rotation, Vector
from draft.laws.structure import MIDDLE
from draft.lazy import verb
from draft.spec.primitives.base import Geom
from draft.spec.primitives.root import TrunkPart
from draft.spec.primitives.shape import ShapePart
from draft.values import Mask, Value, brief, either, negate, some

if TYPE_CHECKING:
    from draft.design.bands import Band
    from draft.design.findings import Finding
    from draft.model import Model
    from draft.model.batch import ModelBatch
    from draft.spec import Spec

Index = int | np.integer | slice | NDArray[np.integer] | NDArray[np.bool_] | list[int]


class Body(NamedTuple):
    """A body of a design; a tuple because many are made. Vectors are in its own (mirrored) frame.

    Attributes:
        name: unique name.
        prefix: prefix of the names of its joint and sites.
        parent: index of its parent; None for the trunk.
        link: its numbers, mirrored.
        position: origin in the frame of the parent [m].
        rotation: its frame in that of the parent; None for parallel frames.
        member_mass: mass of its structural member [kg].
        end_mass: mass of the end of its link [kg].
        member_centre: centre of mass of its member, as a share of the length from its origin.
        member_radius: drawn radius of its member [m]; 0 without one.
        actuator: actuator at its tip.
        segment: label of the structural segment it belongs to.
    """

    name: str
    prefix: str
    parent: int | None
    link: Link
    position: Vector
    rotation: Rotation
    member_mass: Value
    end_mass: Value
    member_centre: Value
    member_radius: Value
    actuator: Actuator | None
    segment: str | None

    @property
    def joint(self) -> Joint | None:
        """Its joint."""
        return self.link.joint

    @property
    def joint_axis(self) -> Vector:
        """Axis of its joint in its own frame; zero without a joint."""
        return self.link.joint.axis if self.link.joint else g.ZERO

    @property
    def mass(self) -> Value:
        """Mass of the body [kg], without the loft of the trunk."""
        motor = self.actuator.mass if self.actuator is not None else 0.0
        return self.member_mass + self.end_mass + motor

    @property
    def member_com(self) -> Vector:
        """Centre of mass of its member, or of the part in its place [m]."""
        shape = self.link.shape
        return g.scale(self.link.tip, self.member_centre) if shape is None else shape.com

    @property
    def motor_com(self) -> Vector:
        """Centre of mass of its actuator, or of the part in its place [m]."""
        motor, a = self.link.motor, self.actuator
        if motor is None or a is None or (solid := self.motor_geom) is None:
            return g.ZERO
        if a.shape is None:
            return solid.center
        at, turn = motor.frame
        return g.add(at, g.rotate(turn, a.shape.com))

    @property
    def shapes(self) -> tuple[tuple[str, ShapePart], ...]:
        """Parts that it has in place of its own solid and of its actuator, each with the place."""
        parts = ("link", self.link.shape), ("motor", self.actuator and self.actuator.shape)
        return tuple((place, part) for place, part in parts if part is not None)

    @property
    def carries(self) -> bool:
        """Whether the end of its link is carried, not part of a segment."""
        end = self.link.end
        return self.parent is not None and end is not None and not end.of_segment

    @property
    def motor_geom(self) -> Geom | None:
        """Its actuator as a solid."""
        motor, a = self.link.motor, self.actuator
        if motor is None or a is None:
            return None
        if a.is_box:
            return motor.box(a.width, a.height, a.length, a.mass)
        return motor.cylinder(a.radius, a.length, a.mass)

    @property
    def end_geom(self) -> Geom | None:
        """The end of its link as a solid."""
        end = self.link.end
        return None if end is None else end.geom(self.link.tip, self.end_mass)

    def solids(self) -> Iterator[Geom]:
        """Solids that occupy space: actuator, member and end."""
        if (motor := self.motor_geom) is not None:
            yield motor
        yield from self.link_solids()

    def link_solids(self) -> Iterator[Geom]:
        """Solids of the link itself: member and end."""
        return (geom for geom, _ in self.replaced())

    def replaced(self) -> Iterator[tuple[Geom, ShapePart | None]]:
        """Solids of the link itself, each with the part in its place, if any."""
        if (member := self.link.member) is not None:
            rod = member.geom(self.link.tip, self.member_radius, self.member_mass)
            yield rod, self.link.shape
        if (end := self.end_geom) is not None:
            yield end, None

    def geoms(self) -> Iterator[Geom]:
        """Solids of a model: member, actuator, pulley and end, or parts in place of the former.

        A member whose centre of mass is not in its middle is two halves of different densities;
        for N designs, if that holds for any of them.
        """
        link, mass, radius = self.link, self.member_mass, self.member_radius
        if link.member is not None and link.shape is not None:
            yield from link.shape.geoms(link.member.geom(link.tip, radius, mass))
        elif link.member is not None and some(self.member_centre != MIDDLE):
            yield from link.member.halves(link.tip, radius, mass, self.member_centre)
        elif link.member is not None:
            yield link.member.geom(link.tip, radius, mass)
        if (motor := self.motor_geom) is not None and link.motor is not None:
            shape = self.actuator and self.actuator.shape
            yield from (motor,) if shape is None else shape.geoms(motor, *link.motor.frame)
        if link.pulley is not None:
            yield link.pulley.geom(link.tip)
        if (end := self.end_geom) is not None:
            yield end

    def placed(self, parent: Frame, home: bool = True) -> Frame:
        """Frame of the body, from that of its parent.

        Args:
            parent: origin [m] and rotation of the parent.
            home: whether its joint is in the home pose; else it is at zero.
        """
        origin, rotation = parent
        here = g.add(origin, g.rotate(rotation, self.position))
        frame = (here, g.compose(rotation, self.rotation))
        return self.moved(frame, self.joint.home) if home and self.joint is not None else frame

    def moved(self, frame: Frame, by: Value) -> Frame:
        """Frame with the joint at a value [rad or m], from the frame with the joint at zero."""
        if self.joint is None or not some(by != 0):
            return frame
        origin, rotation = frame
        if self.joint.slide:
            return g.add(origin, g.rotate(rotation, g.scale(self.joint_axis, by))), rotation
        return origin, g.compose(rotation, g.about(self.joint_axis, by))


@dataclass(frozen=True, slots=True)
class SegmentMass:
    """Structural mass of a rigid segment and its copies.

    Attributes:
        label: its class, or its link if the mass is stated.
        trend: class whose trend predicts its mass; None if it is stated.
        kind: its class, whether or not its mass is stated; None without a class.
        length: joint-to-joint length [m].
        mass: structural mass of one copy [kg], including its end.
        member_centre: centre of mass of its only member, as a share of the length, such that the
            segment has the centre of its class; None if that is unknown.
        bodies: names of the members of the first copy.
        copies: number of copies.
        of_parts: share of its mass that parts of one's own state, of one copy [kg].
    """

    label: str
    trend: str | None
    kind: str | None
    length: Value
    mass: Value
    member_centre: Value | None
    bodies: tuple[str, ...]
    copies: int
    of_parts: Value = 0.0


@dataclass(frozen=True, repr=False)
class Design:
    """A robot with every number resolved. Frozen.

    With arrays among the parameters it is N designs of one topology: every number that depends
    on them is an array of shape (N,), `findings` hold masks, `len(design)` is N, and
    `design[i]`, a slice or a mask selects some of them.

        >>> draft.load("quadruped").resolve("cheetah")
        Design('quadruped:cheetah', 33.6 kg, 12 joints, accepted)
        >>> many = draft.load("quadruped").resolve({"thigh_length": np.linspace(0.2, 0.4, 5)})
        >>> many
        Design('quadruped', 5 designs, 32.3..38.4 kg, 12 joints, 5 accepted)
        >>> many[0]
        Design('quadruped', 32.3 kg, 12 joints, accepted)
        >>> many[many.mass < 34]
        Design('quadruped', 2 designs, 32.3..33.6 kg, 12 joints, 2 accepted)

    Attributes:
        spec: the spec that it was resolved from.
        label: name of the named design, "default" or "custom".
        values: the values that override those of the spec.
        count: None for a single design, N for many.
        parameters: value of every parameter, by name.
        actuators: every actuator class, by name.
        bodies: the tree, depth first; body 0 is the trunk.
        lofted: the trunk; None for a fixed base.
        segments: structural masses by segment.
        findings: findings of the design filter.
        battery_stated: stated energy [Wh] and mass [kg] of the battery, by name.
        electronics_stated: stated power of computers, sensors and idle drives [W].
    """

    spec: Spec
    label: str
    values: Mapping[str, Value | str | None]
    count: int | None
    parameters: Mapping[str, Value]
    actuators: Mapping[str, Actuator]
    bodies: tuple[Body, ...]
    lofted: TrunkPart | None
    segments: tuple[SegmentMass, ...]
    findings: tuple[Finding, ...]
    battery_stated: Mapping[str, Value] = field(default_factory=dict)
    electronics_stated: Value | None = None

    def __repr__(self) -> str:
        joints = f"{len(self.joints)} joint{'' if len(self.joints) == 1 else 's'}"
        if self.count is None:
            refusals = [f.id for f in self.findings if f.severity == "error"]
            reasons = ", ".join(dict.fromkeys(refusals))
            verdict = "accepted" if self.accepted else f"refused: {reasons}"
            return f"Design('{self.reference}', {brief(self.mass)} kg, {joints}, {verdict})"
        count, mass = counted(self.count, "design"), f"{brief(self.mass)} kg"
        accepted = f"{np.count_nonzero(self.accepted)} accepted"
        return f"Design('{self.reference}', {count}, {mass}, {joints}, {accepted})"

    def __bool__(self) -> bool:
        """Return True: a design is never empty, although only N designs have a length."""
        return True

    def __len__(self) -> int:
        """Number of designs.

        Raises:
            TypeError: this is a single design.
        """
        return self._count_of_many()

    def __getitem__(self, index: Index) -> Design:
        """Select one of N designs, or some of them.

        Args:
            index: an integer gives the single design; a slice, a mask of shape (N,) or an array
                of integers gives N designs again.

        Returns:
            The design, resolved again from its own values.

        Raises:
            TypeError: this is a single design, or the index is of another type.
            IndexError: the index is out of range, or selects nothing.
            ResolveError: a value of this design is invalid.
        """
        from draft.design.resolve import resolve

        rows = np.arange(self._count_of_many())[index]
        if np.ndim(rows) > 1:
            raise TypeError(f"an index of {np.ndim(rows)} dimensions; N designs have one")
        if not np.size(rows):
            raise IndexError("the index selects no design")
        values = dict(self.values)
        for key, value in values.items():
            if isinstance(value, np.ndarray) and value.ndim:
                values[key] = value[rows] if np.ndim(rows) else float(value[rows])
        return resolve(self.spec, values, label=self.label)

    def __iter__(self) -> Iterator[Design]:
        """Iterate over N designs, each resolved alone.

        Raises:
            TypeError: this is a single design.
        """
        return (self[i] for i in range(self._count_of_many()))

    def _count_of_many(self) -> int:
        if self.count is None:
            raise TypeError("a single Design has no length and no index: resolve arrays for many")
        return self.count

    @property
    def name(self) -> str:
        """Name of the robot."""
        return self.spec.name

    @property
    def reference(self) -> str:
        """Name of the robot with that of the named design, such as "quadruped:cheetah"."""
        own = self.label not in ("default", "custom")
        return f"{self.name}:{self.label}" if own else self.name

    @property
    def floating(self) -> bool:
        """Whether its base floats; else it is bolted to the world."""
        return self.spec.floating

    @property
    def trunk(self) -> TrunkPart:
        """The lofted trunk.

        Raises:
            DraftError: the base is fixed, and has none.
        """
        if self.lofted is None:
            raise DraftError(f"{self.reference} has no trunk: its base is fixed", "use `base_mass`")
        return self.lofted

    @cached_property
    def feet(self) -> tuple[int, ...]:
        """Indices of the bodies on whose ends it may stand; a fixed base has none."""
        if not self.floating:
            return ()
        ends = ((i, body.link.end) for i, body in enumerate(self.bodies))
        return tuple(i for i, end in ends if end is not None and end.is_foot)

    @property
    def base_mass(self) -> Value:
        """Mass of the trunk, or of the fixed base [kg], without what is attached to it."""
        return self.bodies[0].end_mass if self.lofted is None else self.lofted.mass

    @cached_property
    def structure_mass(self) -> Value:
        """Mass of the base, the members, and the ends that are part of a segment [kg]."""
        return self.base_mass + g.total(s.mass * s.copies for s in self.segments)

    @cached_property
    def actuator_mass(self) -> Value:
        """Mass of all actuators [kg]."""
        count: dict[str, int] = {}
        for body in self.bodies:
            if body.actuator is not None:
                count[body.actuator.name] = count.get(body.actuator.name, 0) + 1
        return g.total(self.actuators[name].mass * n for name, n in count.items())

    @cached_property
    def carried_mass(self) -> Value:
        """Mass of carried parts: ends that are not part of a segment [kg]."""
        return g.total(body.end_mass for body in self.bodies if body.carries)

    @property
    def payload_mass(self) -> Value:
        """Mass of the payload that was put on its trunk [kg]; part of the carried mass."""
        return 0.0 if self.spec.payload is None else self.bodies[self.spec.payload].end_mass

    @cached_property
    def mass(self) -> Value:
        """Total mass [kg], boxes and a payload included."""
        return self.structure_mass + self.actuator_mass + self.carried_mass

    def mass_band(self, share: float = 0.9) -> Band:
        """Band of the total mass that contains a share of such machines, once built [kg].

        All actuators of a class share one error; see `draft.design.bands`.
        """
        from draft.design.bands import mass_band

        return mass_band(self, share)

    def actuator_bands(self, share: float = 0.9) -> dict[str, dict[str, Band]]:
        """Bands of the numbers that depend on trends, by actuator class and quantity; SI units."""
        from draft.design.bands import actuator_bands

        return {name: actuator_bands(a, share) for name, a in self.actuators.items()}

    @property
    def leg_length(self) -> Value | None:
        """Length of thigh plus shank, joint to joint [m]; None without a thigh and a shank."""
        lengths = {segment.kind: segment.length for segment in self.segments}
        if "thigh" not in lengths or "shank" not in lengths:
            return None
        return lengths["thigh"] + lengths["shank"]

    @property
    def judged(self) -> bool:
        """Whether the trends of the survey apply: those of robots with legs."""
        return not any(finding.id == "no_legs" for finding in self.findings)

    @cached_property
    def accepted(self) -> Mask:
        """Whether the design filter accepts it; a mask of shape (N,) for many designs."""
        refused: Mask = False if self.count is None else np.zeros(self.count, dtype=bool)
        for finding in self.findings:
            if finding.severity == "error":
                refused = either(refused, finding.mask)
        return negate(refused)

    @property
    def joints(self) -> dict[str, Joint]:
        """Joints by full name, in the order of the tree."""
        return {
            body.prefix + body.joint.name: body.joint
            for body in self.bodies
            if body.joint is not None
        }

    def drive(self, joint: Joint) -> Actuator | None:
        """Actuator of a joint as the joint sees it, behind its transmission; None without one."""
        if joint.actuator is None:
            return None
        actuator = self.actuators[joint.actuator]
        return actuator.through(*joint.transmission) if joint.transmission else actuator

    def body_masses(self) -> dict[str, Value]:
        """Mass of every body [kg]."""
        masses = {body.name: body.mass for body in self.bodies}
        if self.lofted is not None:
            masses[self.bodies[0].name] = masses[self.bodies[0].name] + self.lofted.mass
        return masses

    def frames(self, home: bool = False) -> list[Frame]:
        """Origin [m] and rotation of every body in the frame of the trunk; of the world if fixed.

        Args:
            home: whether the joints are in the home pose; else all are at zero.
        """
        pose = Pose(self, home)
        return [pose.frame(i) for i in range(len(self.bodies))]

    def lowest(self, home: bool = False) -> Value:
        """Height of the base's origin above the floor [m]: standing on its feet, or as bolted.

        A floating robot without feet stands on its lowest solid.

        Args:
            home: whether the joints are in the home pose; else all are at zero.
        """
        return lowest(self, home) if self.floating else self.bodies[0].position[2]

    @verb
    def build(self) -> Model:
        """Compile the design to MJCF, which MuJoCo loads and checks.

        Raises:
            RefusedError: the design filter found errors.
            ModelError: MuJoCo rejects the model, or its masses differ from those of the design.
            DraftError: this is N designs; select one first.
        """
        from draft.model import build

        if self.count is not None:
            remedy = "call build_batch() for all, or design[0].build() for one"
            raise DraftError(f"this is {counted(self.count, 'design')}", remedy)
        return build(self)

    @verb
    def build_batch(self, rows: NDArray[np.intp] | None = None) -> ModelBatch:
        """Compile N designs at once: a template, and arrays of the fields in which they differ.

        Args:
            rows: which of them, increasing; all where None.

        Raises:
            DraftError: this is one design, or none of them compiles.
        """
        from draft.model.batch import build_batch

        return build_batch(self, rows)
