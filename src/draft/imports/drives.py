"""Torque and speed of every driven hinge: declared, stated, or that of surveyed joints.

A declared torque is held against surveyed joints of the same role on legs of the same length, and
against the strongest module of the catalogue: placeholders such as 1000 N m would weigh as much as
a drive of that torque does. No mass of the maker is used.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from draft.description.segments import CLOSE
from draft.description.xmlfile import DescriptionError
from draft.errors import Location, Problem, listed
from draft.imports.anatomy import SPINE
from draft.imports.options import Options
from draft.imports.reduce import Body, Reduced
from draft.imports.shapes import Shapes
from draft.imports.speeds import FASTEST, SLOWEST, surveyed_speed
from draft.laws.actuators import laws
from draft.laws.catalogue import extremes
from draft.laws.joint_torques import TorqueLaw, torque_laws

# Standard deviations of ln(torque) beyond which a declared torque is no drive of such a joint. All
# 49 robots of the fits stay below 2.6.
DEVIATIONS = 3.0
LEAST_FOLD = 3.0
# Small robots with hobby servos have a sixth of the usual torque: less than a twelfth is no drive.
WEAKEST_FOLD = 12.0
# Torque of a joint without a role, for its reach: the elbow's law, with this sigma.
UNKNOWN_SIGMA = 1.0
SIGMA_FLOOR = 0.3
# Powers beyond this many times the catalogue's best are no drive's; those between are reported.
POWER_FOLD = 2.0
# Steps in which a guessed torque is lowered until its drive fits, and where that ends [N m].
FINER, LEAST_GUESS = 0.97, 0.05
LISTED = 6
# Sources of torques that are not the maker's and not stated.
GUESSED = ("replaced", "assumed")


@dataclass(frozen=True, slots=True)
class Drive:
    """Torque [N m] and speed [rad/s] of one hinge.

    Attributes:
        joint: the vendor's name of the hinge.
        torque, speed: values to use.
        torque_from, speed_from: "declared", "stated", "replaced" (the declared value is
            implausible) or "assumed" (there is none).
        declared: torque in the file [N m]; None for none.
        sigma: standard deviation of ln(torque) where it is replaced or assumed, else 0.
        slim: whether the torque is below a third of that of surveyed joints, and the limb too slim
            for such a drive.
    """

    joint: str
    torque: float
    speed: float
    torque_from: str
    speed_from: str
    declared: float | None
    sigma: float
    slim: bool = False

    @property
    def guessed(self) -> bool:
        """Whether the torque is that of surveyed joints."""
        return self.torque_from in GUESSED


def drives(
    reduced: Reduced, population: str, options: Options, shapes: Shapes | None = None
) -> dict[str, Drive]:
    """Torque and speed of every driven hinge by its name, with notes on those that are replaced.

    Args:
        reduced: the robot.
        population: "humanoid" or "quadruped".
        options: what a person decides.
        shapes: its shapes: a torque that is guessed is that of no drive wider than its limb.

    Raises:
        DescriptionError: `options.strict` and a declared torque is implausible.
        DraftError: a stated name means no joint.
    """
    bodies = [one for one in reduced.root.all() if one.driven]
    named = {body.joint.name: body.role for body in bodies if body.joint}
    options.torque.check(named, "`torque`")
    options.speed.check(named, "`speed`")
    expected = Expected(reduced, population, options, shapes)
    doubted = _doubted(bodies, expected, options)
    if doubted and options.strict:
        raise DescriptionError([_refusal(body, expected) for body in doubted[:LISTED]])
    found: dict[str, Drive] = {}
    for body in bodies:
        one = _torque(body, expected, options, body in doubted)
        found[one.joint] = _speed(body, one, population, options)
    _tell(reduced, bodies, found, expected)
    return found


class Expected:
    """Torque that surveyed joints of a body's role have on a robot of this size."""

    def __init__(
        self, reduced: Reduced, population: str, options: Options, shapes: Shapes | None = None
    ) -> None:
        self.leg = leg_length(reduced)
        self.population, self.shapes = population, shapes
        # Widest link so far of each limb [m], and its bodies that were not measured yet.
        self._widths: dict[Body, tuple[float, list[Body]]] = {}
        self.laws = torque_laws(population, frozenset(options.without))
        self.elbow = torque_laws("humanoid", frozenset(options.without))["elbow"]

    def torque(self, body: Body) -> float:
        """Torque of such joints [N m], to two digits."""
        law = self._law(body)
        value = self.elbow(self.reach(body)) if law is None or not self.leg else law(self.leg)
        return float(f"{value:.2g}")

    def reach(self, body: Body) -> float:
        """Longest way from a hinge to the last one beyond it [m].

        A joint of the trunk carries what is on either side of it.
        """
        if body.role not in (SPINE, "waist"):
            return _reach(body)
        root = body
        while root.parent is not None:
            root = root.parent
        return max(float(np.linalg.norm(one.anchor - body.anchor)) for one in root.all())

    def sigma(self, body: Body) -> float:
        """Standard deviation of its logarithm; more for legs of lengths that were not surveyed."""
        law = self._law(body)
        if law is None or not self.leg:
            return UNKNOWN_SIGMA
        low, high = law.legs
        beyond = max(math.log(low / self.leg), math.log(self.leg / high), 0.0)
        return max(law.sigma, SIGMA_FLOOR) + 0.5 * beyond

    def guess(self, body: Body) -> float:
        """The same, but of no drive that is wider than the widest link of its limb [N m]."""
        torque = self.torque(body)
        width = self.width(body, self.diameter(torque))
        while width and torque > LEAST_GUESS and self.diameter(torque) > width:
            torque *= FINER
        return float(f"{torque:.2g}")

    def diameter(self, torque: float) -> float:
        """Diameter of a drive of a torque [m], at the speed of surveyed joints of that torque."""
        trends = laws().trends
        reduction = float(trends["gear_ratio"](surveyed_speed(torque, self.population)))
        aspect = float(trends["aspect_ratio"](reduction))
        return 2 * (float(trends["volume"](torque, reduction)) / (2 * math.pi * aspect)) ** (1 / 3)

    def width(self, body: Body, enough: float = math.inf) -> float:
        """Breadth of the widest link of a body's limb [m], by visible meshes; 0 without any.

        Links beyond the first that is wide enough are not measured: that would read their meshes.
        """
        first = body
        while first.parent is not None and first.parent.joint is not None:
            first = first.parent
        width, rest = self._widths.get(first) or (0.0, first.all() if self.shapes else [])
        while rest and width < enough and self.shapes:
            width = max(width, _breadth(rest[0], self.shapes))
            rest = rest[1:]
        self._widths[first] = width, rest
        return width

    def slim(self, body: Body, torque: float) -> bool:
        """Whether a drive has less than a third of the usual torque in a limb too slim for it.

        Without legs there is no usual torque.
        """
        third = self.torque(body) / LEAST_FOLD
        if not self.leg or torque >= third:
            return False
        enough = self.diameter(third)
        return 0.0 < self.width(body, enough) < enough

    def _law(self, body: Body) -> TorqueLaw | None:
        return self.laws.get(body.role)

    def words(self, body: Body) -> str:
        """Surveyed joints that a guessed torque is taken from, in words."""
        if self._law(body) is None or not self.leg:
            return f"joints that carry {self.reach(body):.2g} m"
        return f"{body.role} joints of surveyed robots with legs of {self.leg:.2g} m"

    def why(self, body: Body) -> str:
        """Why a body's guess is what it is, in words."""
        if self.guess(body) >= self.torque(body):
            return f", as {self.words(body)} have"
        width = f"{1000 * self.width(body):.0f} mm"
        why = f", the most of a drive no wider than the limb, {width}; {self.words(body)} have"
        return f"{why} {self.torque(body):g}"


def leg_length(reduced: Reduced) -> float:
    """Thigh and shank of the robot's legs [m], median over the legs; 0 without a knee."""
    found: list[float] = []
    for knee in reduced.root.all():
        if knee.role != "knee" or knee.parent is None:
            continue
        hip = knee.parent
        while hip.parent is not None and (
            hip.merged or float(np.linalg.norm(knee.anchor - hip.anchor)) < CLOSE
        ):
            hip = hip.parent
        thigh = float(np.linalg.norm(knee.anchor - hip.anchor))
        ends = [child.anchor for child in knee.children]
        ends = ends or [reduced.poses[name][0] for name in knee.links]
        shank = max(float(np.linalg.norm(end - knee.anchor)) for end in ends)
        if hip.joint is not None and thigh > 0:
            found.append(thigh + (shank if shank > 0.4 * thigh else thigh))
    return float(np.median(found)) if found else 0.0


def _breadth(body: Body, shapes: Shapes) -> float:
    """Smaller extent of a body's meshes across its hinge [m]; 0 without meshes."""
    points = shapes.triangles(body.links).reshape(-1, 3)
    if not len(points):
        return 0.0
    flat = points - points.mean(axis=0)
    flat = flat - np.outer(flat @ body.axis, body.axis)
    along = np.linalg.eigh(np.einsum("ni,nj->ij", flat, flat))[1][:, 1:]
    return float(np.ptp(flat @ along, axis=0).min())


def _reach(body: Body) -> float:
    """Longest way from a hinge to the last one beyond it [m], at least 5 cm."""
    reach = 0.05
    for child in body.children:
        reach = max(reach, float(np.linalg.norm(child.anchor - body.anchor)) + _reach(child))
    return reach


def declared(body: Body) -> float | None:
    """Torque that the file gives [N m]; None where there is none or it has no limit."""
    effort = body.joint.effort if body.joint is not None else None
    usable = effort is not None and math.isfinite(effort) and effort > 0
    return effort if usable else None


def _doubted(bodies: Sequence[Body], expected: Expected, options: Options) -> list[Body]:
    """Bodies whose declared torque is implausible.

    Where that holds for half of the joints with one value, the value is a placeholder, also on
    joints that it would suit. Torques that are too low are believed where most are not: weak
    wrists and necks are built.
    """
    asked = [body for body in bodies if declared(body) is not None]
    asked = [b for b in asked if b.joint and options.torque.value(b.joint.name, b.role) is None]
    odd = [body for body in asked if not _plausible(body, expected)]
    low = [body for body in odd if (declared(body) or 0.0) < expected.torque(body)]
    if 2 * len(low) < len(asked):
        odd = [body for body in odd if body not in low]
    of_value = Counter(declared(body) for body in asked)
    odd_of_value = Counter(declared(body) for body in odd)
    placeholders = {
        value for value, count in odd_of_value.items() if count > 2 and 2 * count >= of_value[value]
    }
    return [body for body in asked if body in odd or declared(body) in placeholders]


def _plausible(body: Body, expected: Expected) -> bool:
    torque, usual = declared(body) or 0.0, expected.torque(body)
    strongest = extremes()[0].torque.peak_torque
    fold = max(math.exp(DEVIATIONS * expected.sigma(body)), LEAST_FOLD)
    return usual / max(WEAKEST_FOLD, fold) <= torque <= min(usual * fold, strongest)


def _refusal(body: Body, expected: Expected) -> Problem:
    joint = body.joint
    name, where = (joint.name, joint.where) if joint is not None else ("", None)
    cause = f"joint '{name}' declares {declared(body):g} N m, where {expected.words(body)} have "
    cause += f"about {expected.torque(body):g}"
    return Problem(cause, where, f"state it, `torque` {name}=VALUE, or import without `strict`")


def _torque(body: Body, expected: Expected, options: Options, doubted: bool) -> Drive:
    """Drive of a body, with the speed that the file gives."""
    joint = body.joint
    assert joint is not None
    own = declared(body)
    stated = options.torque.value(joint.name, body.role)
    if stated is None and (own is None or doubted):
        stated = options.torque.every
    speed = joint.velocity if joint.velocity is not None else math.nan
    start = Drive(joint.name, 0.0, speed, "stated", "declared", own, 0.0)
    if stated is not None:
        one = replace(start, torque=_round(stated))
    elif own is not None and not doubted:
        one = replace(start, torque=_round(own), torque_from="declared")
    else:
        source, usual = "assumed" if own is None else "replaced", expected.guess(body)
        one = replace(start, torque=usual, torque_from=source, sigma=expected.sigma(body))
    return replace(one, slim=expected.slim(body, one.torque))


def _speed(body: Body, drive: Drive, population: str, options: Options) -> Drive:
    """Give a drive its speed."""
    stated = options.speed.value(drive.joint, body.role)
    if stated is not None:
        return replace(drive, speed=_round(stated), speed_from="stated")
    usable = SLOWEST <= drive.speed <= FASTEST
    if usable and _power_fits(drive):
        return replace(drive, speed=_round(drive.speed))
    if options.speed.every is not None:
        return replace(drive, speed=_round(options.speed.every), speed_from="stated")
    source = "assumed" if math.isnan(drive.speed) else "replaced"
    speed = surveyed_speed(drive.torque, population)
    return replace(drive, speed=_round(speed), speed_from=source)


def _power_fits(drive: Drive) -> bool:
    """Whether some module of the catalogue has such a power for the mass of such a drive."""
    most = extremes()[0].power_density.power_density
    mass = float(laws().trends["mass"](drive.torque))
    return drive.torque * drive.speed / 4 / mass <= POWER_FOLD * most


def _tell(
    reduced: Reduced, bodies: Sequence[Body], found: dict[str, Drive], expected: Expected
) -> None:
    """Note drives whose numbers are not the file's."""
    where = Location(reduced.description.file)
    replaced = [one for one in found.values() if one.torque_from == "replaced"]
    by_name = {body.joint.name: body for body in bodies if body.joint}
    by_value: dict[tuple[float | None, float, str], list[str]] = {}
    for one in replaced:
        key = (one.declared, one.torque, by_name[one.joint].role)
        by_value.setdefault(key, []).append(one.joint)
    for (was, now, _), joints in by_value.items():
        body = by_name[joints[0]]
        cause = f"{_joints(joints)}: {was:g} N m is implausible and replaced by {now:g}"
        cause += expected.why(body)
        at = body.joint.where if body.joint is not None else where
        remedy = f"state it, `torque` {joints[0]}=VALUE, or refuse such files with `strict`"
        reduced.notes.append(Problem(cause, at, remedy))
    assumed = [one for one in found.values() if one.torque_from == "assumed"]
    if assumed:
        torques: dict[str, None] = {}
        for one in assumed:
            torques[f"{by_name[one.joint].role or 'other'} {one.torque:g}"] = None
        cause = f"{len(assumed)} of {len(found)} drives declare no torque: they get that of "
        cause += f"surveyed joints of their role and size, {', '.join(list(torques)[:LISTED])} N m"
        own = [one.joint for one in assumed]
        remedy = f"state them, {example('`torque`', 17, reduced, own)}"
        reduced.notes.append(Problem(cause, where, remedy))
    _tell_speeds(reduced, by_name, found)


def _tell_speeds(reduced: Reduced, by_name: dict[str, Body], found: dict[str, Drive]) -> None:
    """Note declared speeds that are not used, those of one value together."""
    by_value: dict[float, list[Drive]] = {}
    for one in found.values():
        joint = by_name[one.joint].joint
        if one.speed_from == "replaced" and joint is not None and joint.velocity is not None:
            by_value.setdefault(joint.velocity, []).append(one)
    for value, own in by_value.items():
        joint = by_name[own[0].joint].joint
        cause = f"{_joints([one.joint for one in own])} declare{'s' * (len(own) == 1)} a speed of "
        cause += f"{value:g} rad/s: it is not used"
        remedy = f"usable: {SLOWEST} to {FASTEST:g} rad/s, at a power that modules have; "
        remedy += f"{own[0].speed:g} is usual for {own[0].torque:g} N m; state it with `speed`"
        reduced.notes.append(Problem(cause, joint.where if joint else None, remedy))


def example(option: str, value: float, reduced: Reduced, joints: Collection[str]) -> str:
    """How to state a value for drives of this robot: for all, and for one role or joint of it."""
    bodies = [one for one in reduced.root.all() if one.joint and one.joint.name in joints]
    words = dict.fromkeys(one.role or (one.joint.name if one.joint else "") for one in bodies)
    named = " ".join(f"{word}={value + 3 * k:g}" for k, word in enumerate([*words][:2], start=1))
    return f"{option} {value:g} or {option} {named}" if named else f"{option} {value:g}"


def _joints(names: Sequence[str]) -> str:
    """Joints by name, the first few."""
    if len(names) == 1:
        return f"joint '{names[0]}'"
    return f"joints {listed(names, LISTED)}"


def _round(value: float) -> float:
    return float(f"{value:.5g}")
