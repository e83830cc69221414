"""Numbers of a legged design for learning, found by its structure and not by names.

Legs are those of `draft.design.legs`: serial chains with a knee that end in a foot. Everything
else that has a driven joint, such as arms and a waist, moves by the same policy.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import takewhile
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from draft.design import Design
from draft.design.battery import battery
from draft.design.legs import crouch, legs
from draft.errors import DraftError
from draft.laws.actuators import laws
from draft.laws.limits import copper_loss
from draft.laws.torque_speed import stall_torque
from draft.learn.bodies.topology import foot_of, mirrored_joints, mirrored_legs, topology, upper_of
from draft.metrics.rolling import driven_wheels, rolling_speed
from draft.metrics.speed import top_speed
from draft.model import pose
from draft.model.texts import Text, with_template
from draft.spec.payload import USUAL_DENSITY
from draft.values import Value, scalar

REFERENCE_LEG = 0.48  # Thigh plus shank of the cheetah [m]; scale s = L / 0.48 m (paper).

if TYPE_CHECKING:
    from draft.model import Model

# Classes of joints of a quadruped with three joints on every leg.
CLASSES = ("hip roll", "hip pitch", "knee")


@dataclass(frozen=True)
class LeggedRobot:
    """A legged robot as plain numbers, with joints and legs in the model's order.

    Attributes:
        name: name of robot and design.
        text: MJCF of the robot.
        trunk: name of the trunk.
        joints: names of the joints.
        leg_joints: indices of the joints of each leg, from the trunk outwards.
        feet: names of the feet's sites.
        foot_geoms: names of the feet's spheres, plates or wheels.
        upper_legs: names of the geoms of each leg's thigh, between the knee and the joint above it.
        home: joint angles of the home pose [rad].
        ranges: joint ranges [rad].
        peak_torque: peak torque of each joint [N m].
        no_load_speed: no-load speed of each joint [rad/s].
        leg_length: thigh plus shank of the longest leg [m].
        foot_radius: radius of the smallest foot or wheel, or half the width of a plate [m].
        height: trunk's origin above the ground in the home pose [m].
        top_speed: estimated top speed [m/s].
        mass: total mass [kg].
        leg_mirror: index of the opposite leg, for each leg.
        mirror: index of the opposite joint, for each joint.
        mirror_sign: for each joint, -1 if the mirrored motion has the opposite sign there.
        corner_speed: highest speed of each joint with full peak torque [rad/s]; () if no motor has
            a corner.
        battery: energy of a stated battery, and the ends of its 90 % band [Wh]; () if the design
            states none.
        rated_torque: rated torque of each joint [N m]; () if all are those of the trend.
        motor_heat: heat of each motor per torque squared [W/(N m)^2]; () for that of its line.
        electronics: stated power of computers, sensors and idle drives [W]; () if the design states
            none.
        block: half side and middle of a payload [m], which is not in the text; () without one.
        rolls: for each joint, whether it drives a wheel: a policy sets its speed, and its angle
            means nothing. Others are driven to an angle. () without driven wheels.
    """

    name: str
    text: Text = field(hash=False)
    trunk: str
    joints: tuple[str, ...]
    leg_joints: tuple[tuple[int, ...], ...]
    feet: tuple[str, ...]
    foot_geoms: tuple[str, ...]
    upper_legs: tuple[tuple[str, ...], ...]
    home: tuple[float, ...]
    ranges: tuple[tuple[float, float], ...]
    peak_torque: tuple[float, ...]
    no_load_speed: tuple[float, ...]
    leg_length: float
    foot_radius: float
    height: float
    top_speed: float
    mass: float
    leg_mirror: tuple[int, ...]
    mirror: tuple[int, ...]
    mirror_sign: tuple[float, ...]
    corner_speed: tuple[float, ...] = ()
    battery: tuple[float, ...] = ()
    electronics: tuple[float, ...] = ()
    rated_torque: tuple[float, ...] = ()
    motor_heat: tuple[float, ...] = ()
    block: tuple[float, ...] = ()
    rolls: tuple[bool, ...] = ()

    @property
    def xml(self) -> str:
        """MJCF of the robot as one string."""
        return str(self.text)

    @property
    def own_mass(self) -> float:
        """Total mass without the payload of an evaluation [kg]."""
        return self.mass - (USUAL_DENSITY * (2 * self.block[0]) ** 3 if self.block else 0.0)

    @property
    def stall_torque(self) -> tuple[float, ...]:
        """Torque of each motor at standstill without its current limit [N m]."""
        if not self.corner_speed:
            return self.peak_torque
        return tuple(scalar(stall_torque(*of)) for of in self._motors(self.corner_speed))

    @property
    def copper_loss(self) -> tuple[float, ...]:
        """Heat of each motor per torque squared [W/(N m)^2], see `draft.laws.limits`."""
        if self.motor_heat:
            return self.motor_heat
        speeds = self.corner_speed or (0.0,) * len(self.joints)
        return tuple(scalar(copper_loss(*of)) for of in self._motors(speeds))

    def _motors(self, corner_speed: Sequence[float]) -> Iterator[tuple[float, float, float]]:
        """Peak torque, no-load speed and corner speed of each joint."""
        return zip(self.peak_torque, self.no_load_speed, corner_speed, strict=True)

    @property
    def turned(self) -> tuple[int, ...]:
        """Indices of the joints that are driven to an angle: all but those of wheels."""
        return tuple(j for j in range(len(self.joints)) if not (self.rolls and self.rolls[j]))

    @property
    def is_quadruped(self) -> bool:
        """Whether it has four legs of three joints, as the robots of the published study."""
        legs = [len(leg) for leg in self.leg_joints]
        return len(self.joints) == 12 and legs == [3] * 4 and not self.rolls

    @property
    def classes(self) -> tuple[str, ...]:
        """Names of the classes of joints: those that are mirror images or copies of each other."""
        return CLASSES if self.is_quadruped else tuple(dict.fromkeys(self._kinds()))

    @property
    def joint_classes(self) -> tuple[int, ...]:
        """Index of the class of each joint."""
        if self.is_quadruped:
            places = {joint: i for leg in self.leg_joints for i, joint in enumerate(leg)}
            return tuple(places[joint] for joint in range(len(self.joints)))
        return tuple(self.classes.index(kind) for kind in self._kinds())

    def _kinds(self) -> list[str]:
        """Class of each joint: the end of the name that its class shares."""
        groups: dict[int, list[int]] = {}
        for leg in self.leg_joints:
            for place, joint in enumerate(leg):
                alike = [one[place] for one in self.leg_joints if len(one) == len(leg)]
                groups[joint] = alike
        return [
            _shared_end([self.joints[k] for k in groups.get(j, [j, self.mirror[j]])])
            for j in range(len(self.joints))
        ]

    @property
    def scale(self) -> float:
        """Scale s = L / 0.48 m."""
        return self.leg_length / REFERENCE_LEG

    def as_dict(self, text: bool = True) -> dict[str, Any]:
        """Return plain data, with the MJCF or not, without what is at its default: see `_LATER`."""
        data = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "text"}
        data = {name: x for name, x in data.items() if name not in _LATER or x != _LATER[name]}
        return {"xml": self.xml, **data} if text else data

    @staticmethod
    def from_dict(data: dict[str, Any], text: Text | None = None) -> LeggedRobot:
        """Return the robot of data from `as_dict`, read back from JSON, and of a text they lack.

        Raises:
            KeyError: an entry is missing.
        """
        data = _LATER | data | {"text": text or Text(str(data["xml"]))}
        return LeggedRobot(**{one.name: _frozen(data[one.name]) for one in fields(LeggedRobot)})


# Defaults of the fields that were added later: older records lack them.
_LATER: dict[str, Any] = dict.fromkeys(
    ("corner_speed", "battery", "electronics", "rated_torque", "motor_heat", "block", "rolls"), ()
)


def legged_robot(design: Design, model: Model | None = None) -> LeggedRobot:
    """Return the numbers of a design for learning.

    Args:
        design: one design.
        model: its model; None to build it.

    Raises:
        RefusedError: no model is given and the design filter refuses it.
        DraftError: it has fewer than two legs, a joint without an actuator, or no mirror image.
    """
    if design.count is not None:
        raise DraftError("learning needs single designs", "resolve them one by one")
    name, chains = topology(design)
    sides = mirrored_legs(chains, name)
    other, sign = mirrored_joints(design, sides, chains, name)
    model = model or design.build()
    joints = tuple(design.joints)
    index = {joint: i for i, joint in enumerate(joints)}
    home = _home(design, name)
    sites = [foot_of(design, chain) for chain in chains]
    return LeggedRobot(
        name=name,
        text=Text(model.xml),
        trunk=design.bodies[0].name,
        joints=joints,
        leg_joints=tuple(tuple(index[joint] for joint in chain.joints) for chain in chains),
        feet=tuple(site for site, _ in sites),
        foot_geoms=tuple(geom for _, geom in sites),
        upper_legs=tuple(upper_of(design, chain) for chain in chains),
        home=home,
        ranges=tuple(
            (float(joint.range[0]), float(joint.range[1])) for joint in design.joints.values()
        ),
        peak_torque=_of_actuators(design, "peak_torque"),
        no_load_speed=_of_actuators(design, "no_load_speed"),
        leg_length=max(float(leg.length) for leg in legs(design)),
        foot_radius=min(radius_of_foot(model.mujoco, geom) for _, geom in sites),
        height=_height(model, home, [geom for _, geom in sites]),
        top_speed=scalar(estimated_speed(design)),
        mass=scalar(design.mass),
        leg_mirror=sides,
        mirror=tuple(index[other[joint]] for joint in joints),
        mirror_sign=tuple(sign[joint] for joint in joints),
        corner_speed=corners(_of_actuators(design, "corner_speed")),
        battery=tuple(map(scalar, stated_battery(design))),
        electronics=tuple(map(scalar, stated_electronics(design))),
        rated_torque=known_ratings(
            _of_actuators(design, "rated_torque"), _of_actuators(design, "peak_torque")
        ),
        motor_heat=_of_actuators(design, "copper_loss"),
        rolls=driven_by_speed(design),
    )


def driven_by_speed(design: Design) -> tuple[bool, ...]:
    """Whether each joint drives a wheel; () if none does."""
    rolls = tuple(joint.rolls for joint in design.joints.values())
    return rolls if any(rolls) else ()


def estimated_speed(design: Design) -> Value:
    """Estimate of the top speed [m/s]: of rolling if all feet are driven wheels, else of legs."""
    wheels = len(driven_wheels(design))
    return rolling_speed(design) if wheels and wheels == len(design.feet) else top_speed(design)


def corners(speeds: tuple[float, ...]) -> tuple[float, ...]:
    """Corner speed of each joint [rad/s]; () if all are zero."""
    return speeds if any(speeds) else ()


def known_ratings(rated: tuple[float, ...], peak: tuple[float, ...]) -> tuple[float, ...]:
    """Rated torque of each joint [N m]; () if all are those of the trend for their peak torques."""
    by_trend = usual_ratings(peak)
    alike = all(math.isclose(*pair, rel_tol=1e-6) for pair in zip(rated, by_trend, strict=True))
    return () if alike else rated


def usual_ratings(peak: tuple[float, ...]) -> tuple[float, ...]:
    """Rated torques that the shipped trend gives for peak torques [N m]."""
    law = laws().law("rated_torque")
    return tuple(float(law(torque)) for torque in peak)


def stated_battery(design: Design) -> tuple[Value, ...]:
    """Energy of a stated battery and the ends of its 90 % band [Wh]; () if none is stated."""
    if not design.battery_stated:
        return ()
    found = battery(design)
    return found.energy, *found.band


def stated_electronics(design: Design) -> tuple[Value, ...]:
    """Stated power of the electronics [W]; () if none is stated."""
    return () if design.electronics_stated is None else (design.electronics_stated,)


def with_one_template(members: Sequence[LeggedRobot]) -> tuple[LeggedRobot, ...]:
    """Return a family whose texts have one template, as far as they differ in numbers only."""
    texts = with_template([member.text for member in members])
    return tuple(replace(member, text=text) for member, text in zip(members, texts, strict=True))


_SHARES = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4)  # Of the crouch.
_TOPOLOGY = (
    *("trunk", "joints", "rolls", "leg_joints", "feet", "foot_geoms", "upper_legs", "mirror"),
)


def by_topology(members: Sequence[LeggedRobot]) -> list[tuple[LeggedRobot, ...]]:
    """Divide robots into those that can share a simulation, in the order of the first of each."""
    found: dict[tuple[object, ...], list[LeggedRobot]] = {}
    for member in members:
        found.setdefault(tuple(getattr(member, what) for what in _TOPOLOGY), []).append(member)
    return [tuple(group) for group in found.values()]


def kind_of(members: Sequence[LeggedRobot]) -> str:
    """Name of the robot that members of one topology are designs of."""
    return members[0].name.rpartition(":")[0] or members[0].name


def check_family(members: Sequence[LeggedRobot]) -> None:
    """Check that quadrupeds can share one simulation.

    Raises:
        DraftError: one has other joints, feet or bodies than the first.
    """
    first = members[0]
    for other in members[1:]:
        for what in _TOPOLOGY:
            if getattr(other, what) != getattr(first, what):
                cause = (
                    f"{other.name} has another topology than {first.name}: its "
                    f"{what.replace('_', ' ')} differ"
                )
                remedy = "train them separately; a family varies the numbers of one tree"
                raise DraftError(cause, remedy)


def _home(design: Design, name: str) -> tuple[float, ...]:
    """Home pose; if the spec gives none to the legs, their crouch, or what the ranges allow of it.

    The feet stay level and nearly below the hips: all angles of a leg have the same share.
    """
    home = {joint: scalar(one.home) for joint, one in design.joints.items()}
    angles = {name: float(angle) for name, angle in crouch(design).items()}
    if not any(home[name] for name in angles):
        shares = (home | {n: share * x for n, x in angles.items()} for share in _SHARES)
        home = next((one for one in shares if _beyond(design, one) is None), home | angles)
    joint = _beyond(design, home)
    if joint is not None:
        low, high = (scalar(x) for x in design.joints[joint].range)
        raise DraftError(
            f"{name} cannot crouch: {joint} at {home[joint]:.2f} rad is outside its range "
            f"{low:.2f} to {high:.2f}",
            "add `home` to its joints in tree.yaml",
        )
    return tuple(home[joint] for joint in design.joints)


def _beyond(design: Design, home: Mapping[str, float]) -> str | None:
    """First joint whose angle is outside its range; None for none."""
    for joint, angle in home.items():
        low, high = (scalar(x) for x in design.joints[joint].range)
        if not low <= angle <= high:
            return joint
    return None


def _height(model: Model, home: Sequence[float], geoms: Sequence[str]) -> float:
    """Trunk's origin above the lowest foot [m]."""
    robot = model.mujoco
    data = mujoco.MjData(robot)
    pose.put(robot, data, home)
    return -min(lowest_point(robot, data, name) for name in geoms)


def _of_actuators(design: Design, number: str) -> tuple[float, ...]:
    """Attribute of the actuator of each joint, by name."""
    return tuple(
        math.nan if motor is None else float(getattr(motor, number))
        for motor in map(design.drive, design.joints.values())
    )


def radius_of_foot(model: mujoco.MjModel, geom: str) -> float:
    """Radius of a sphere or a wheel, or half the width of a plate [m]."""
    size = model.geom(geom).size
    return float(min(size[:2]) if model.geom(geom).type == mujoco.mjtGeom.mjGEOM_BOX else size[0])


def _shared_end(names: Sequence[str]) -> str:
    """Words at the end of all names, such as "hip pitch" of left_hip_pitch and right_hip_pitch."""
    words = [name.split("_")[::-1] for name in names]
    ends = takewhile(lambda same: len(set(same)) == 1, zip(*words, strict=False))
    return " ".join([same[0] for same in ends][::-1]) or names[0]


def lowest_point(model: mujoco.MjModel, data: mujoco.MjData, geom: str) -> float:
    """Height of the lowest point of a sphere, a box or a wheel [m]."""
    i = model.geom(geom).id
    height, size = float(data.geom_xpos[i][2]), model.geom_size[i]
    up = np.abs(data.geom_xmat[i].reshape(3, 3)[2])
    if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_BOX:
        return height - float(up @ size)
    if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return height - float(np.hypot(up[0], up[1]) * size[0] + up[2] * size[1])
    return height - float(size[0])


def _frozen(value: Any) -> Any:
    """Value of JSON with lists as tuples."""
    return tuple(_frozen(item) for item in value) if isinstance(value, list) else value
