"""Which policy drives a design, and whether the design lies in the policy's region of validity.

A policy drives every design with the legs of its own robot, whatever its joints are called
(`matching`). The region is the range of each feature (`features`) of the
bodies that the policy was trained with: one body, or those of a family. A design outside the region
may still be driven: the policy then gets the joints, motors and servo gains of the design, as
training would have given them, observes features at the nearest end of their range, and whoever
shows the result names what lies outside.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike

from draft.design import Design
from draft.errors import DraftError
from draft.learn.bodies.features import features
from draft.learn.bodies.legged import LeggedRobot, legged_robot
from draft.learn.bodies.slots import describe, servo_torque, slots_of
from draft.learn.policy import policy as shipped
from draft.learn.policy.matching import (
    Match,
    Structure,
    match,
    match_of,
    structure_of,
    trained_structure,
)
from draft.learn.policy.policy import Policy
from draft.learn.policy.reduced import AnyPolicy, LegsPolicy, any_legs
from draft.learn.policy.region import SAME, Departure, Region, departures, limited, sentence
from draft.learn.task.constants import scaled
from draft.learn.task.recipes import LAPTOP
from draft.model import Model
from draft.spec import load
from draft.values import scalar

FAMILY_NAME, ANY_NAME = f"the family of {shipped.ROBOT}s", "any legs"
# Factor by which a design may have more friction than the training, where motors lost about 1 % of
# their torque to it; the cheetah then still walks at five sixths of its speed.
_FAR = 5.0
# How a policy of a skill is trained, where not by the command alone.
_RECIPES = {"machine": ', with `recipe="machine"`, from a policy that can run'}
_OF_ANY_LEGS = ("walk", "run", "push")  # Skills of the policy of all legs.


@dataclass(frozen=True)
class Fit:
    """A policy for a design.

    Attributes:
        policy: the policy with the names and numbers of the design's joints and motors.
        name: what its region of validity is called: a design, a family or any legs.
        outside: numbers of the design outside the region; none inside it.
        height: trunk's origin above the ground in the home pose [m].
    """

    policy: Policy
    name: str
    outside: tuple[Departure, ...]
    height: float

    @property
    def inside(self) -> bool:
        """Whether the design lies in the region of validity."""
        return not self.outside

    @cached_property
    def warning(self) -> str:
        """Sentence that says what lies outside the region; "" inside it."""
        return sentence(self.name, self.outside)


def fit(model: Model, skill: str = "walk", policies: Sequence[AnyPolicy] = ()) -> Fit:
    """Return the policy whose region is nearest to a design.

    The policy of all legs drives robots that no other one does. It has not learnt to climb, and
    observes the velocity.

    Args:
        model: the robot; the filter may have refused it.
        skill: "walk", "run", "climb", "push" or "machine".
        policies: policies of one's own. Where one drives the robot, those that ship are not used.

    Raises:
        DraftError: no policy drives its joints; the message says why, and names the command that
            trains one.
    """
    return fits([model], skill, policies)[0]


def fits(
    models: Sequence[Model], skill: str = "walk", policies: Sequence[AnyPolicy] = ()
) -> list[Fit]:
    """Return the one policy whose region is nearest to all of some designs, for each of them.

    Args:
        models: the robots.
        skill: see `fit`.
        policies: see `fit`.

    Raises:
        DraftError: no policy drives the joints of them all.
    """
    robots = [_Robot.of(model) for model in models]
    found: list[tuple[Policy, Region, list[tuple[Match, tuple[Departure, ...]]]]] = []
    legs = [(one, str(one.file)) for one in policies if isinstance(one, LegsPolicy)]
    given = [
        (one, Region.of(_title(one), one.known, one))
        for one in policies
        if not isinstance(one, LegsPolicy)
    ]
    reason, undriven = "", models[0]
    for known in (given, () if legs else _regions(skill)):
        for one, region in () if found else known:
            rows = []
            for robot in robots:
                chosen = match(one.joints, trained_structure(one), robot.member.joints, robot.own)
                if isinstance(chosen, str):
                    if not reason:
                        reason, undriven = chosen, robot.model
                    break
                outside = _outside(one, region, robot.member, robot.seen, chosen)
                rows.append((chosen, (*outside, *_rubbing(region, robot.model.design))))
            else:
                found.append((one, region, rows))
    if not found:
        if not legs and skill in _OF_ANY_LEGS:
            legs = [(any_legs(), ANY_NAME)]
        try:
            return [_by_slots(*legs[0], robot.model, robot.member, skill) for robot in robots]
        except (DraftError, IndexError) as error:
            if isinstance(error, DraftError):
                reason = error.problems[0].cause
            remedy = f"train one: {train_command(undriven.design)}{_RECIPES.get(skill, '')}"
            raise DraftError(f"{_undriven(undriven)}: {reason}", remedy) from None
    policy, region, rows = min(
        found, key=lambda one: sum(gap.size for _, outside in one[2] for gap in outside)
    )
    fitted = []
    for robot, (chosen, outside) in zip(robots, rows, strict=True):
        adapted = _adapted(policy, robot.member, robot.seen, chosen)
        # The family's policy can also run.
        if skill == "walk" and not any(policy is one for one in policies):
            adapted = _slow(adapted, robot.member)
        fitted.append(Fit(adapted, region.name, outside, robot.member.height))
    return fitted


def check_used(models: Sequence[Model], policies: Sequence[AnyPolicy]) -> None:
    """Refuse a policy of one's own that drives none of some robots.

    Raises:
        DraftError: there is one; the message says why it does not drive the first robot.
    """
    for one in policies:
        if isinstance(one, LegsPolicy):
            continue
        reasons = [reason for model in models if (reason := _misfit(one, model))]
        if reasons and len(reasons) == len(models):
            cause = f"the policy {one.file} drives no robot here: {reasons[0]}"
            raise DraftError(cause, "omit it: a policy that ships walks where one drives the robot")


def _misfit(policy: Policy, model: Model) -> str:
    """Why a policy does not drive a robot; "" if it does."""
    try:
        robot = _Robot.of(model)
    except DraftError as error:
        return error.problems[0].cause
    found = match(policy.joints, trained_structure(policy), robot.member.joints, robot.own)
    return found if isinstance(found, str) else ""


@dataclass(frozen=True)
class _Robot:
    """A robot that is to be driven.

    Attributes:
        model: its model.
        member: it as learning uses it.
        own: places and axes of its joints.
        seen: its features.
    """

    model: Model
    member: LeggedRobot
    own: Structure
    seen: tuple[float, ...]

    @staticmethod
    def of(model: Model) -> _Robot:
        try:
            member = legged_robot(model.design, model)
        except DraftError as error:
            (problem,) = error.problems
            cause = f"{_undriven(model)}: {problem.cause}"
            raise DraftError(replace(problem, cause=cause)) from None
        own = structure_of(member, model.mujoco)
        return _Robot(model, member, own, features(member, model.mujoco))


def _undriven(model: Model) -> str:
    return f"no policy drives the joints of {model.design.reference}"


def _by_slots(legs: LegsPolicy, name: str, model: Model, member: LeggedRobot, skill: str) -> Fit:
    """The policy of all legs for a robot.

    Raises:
        DraftError: a leg has more joints than there are slots.
    """
    policy, own = legs.of_robot(member, model.mujoco), describe(member, model.mujoco)[1]
    if skill == "walk":
        policy = _slow(policy, member)
    return Fit(policy, name, legs.departures(member, own), member.height)


def _slow(policy: Policy, member: LeggedRobot) -> Policy:
    """Policy that is asked to walk."""
    slow = scaled(LAPTOP.config.commands, "forward").at(member.scale)
    forward, *others = policy.commands
    return replace(policy, commands=(min(forward, slow), *others))


def check_drives(policies: Sequence[AnyPolicy], model: Model) -> None:
    """Check that policies of one's own drive a robot.

    Args:
        policies: the policies.
        model: the robot; the filter may have refused it.

    Raises:
        DraftError: one does not; the message says why.
    """
    if not policies:
        return
    member = legged_robot(model.design, model)
    own = structure_of(member, model.mujoco)
    for one in policies:
        if isinstance(one, LegsPolicy):
            slots_of(member, model.mujoco)
            continue
        reason = match(one.joints, trained_structure(one), member.joints, own)
        if isinstance(reason, str):
            cause = f"the policy {one.file} does not drive the joints of {model.design.reference}"
            raise DraftError(f"{cause}: {reason}", "omit it, or train one")


def check_policy(policy: Policy, members: Sequence[LeggedRobot]) -> None:
    """Check that the training of robots can start from a policy.

    A policy that observes its design starts with any quadruped that it drives, others only with the
    robot that they were trained with.

    Args:
        policy: the policy.
        members: the robots.

    Raises:
        DraftError: it cannot.
    """
    sees_design = bool(len(policy.features))
    for member in members:
        cause = f"{policy.file} does not drive the joints of {member.name}"
        remedy = 'start from a policy of the same joints, or with `origin="scratch"`'
        if sees_design and member.is_quadruped:
            found = match_of(policy, member)
            if isinstance(found, str):
                raise DraftError(f"{cause}: {found}", remedy)
            continue
        if member.joints != policy.joints or sees_design:
            raise DraftError(cause, remedy)
        region = Region.of(policy.design, policy.known, policy)
        seen = features(member) if region.low else ()
        gaps = _outside(policy, region, member, seen, Match.of_equals(len(policy.joints)))
        if gaps:
            cause = f"{policy.file} is of another design than {member.name}: {gaps[0]}"
            remedy = "name a policy of the same design, or one that was trained with `see_design`"
            raise DraftError(cause, remedy)


def _outside(
    policy: Policy, region: Region, member: LeggedRobot, seen: ArrayLike, match: Match
) -> tuple[Departure, ...]:
    """Features outside the region, and motors of another shape of torque over speed.

    Without features, leg length and motors that differ.
    """
    if region.low:
        return departures(region, member, seen, match)
    rows = [("leg length", member.leg_length, policy.leg_length, "m")]
    for i, j in enumerate(match.joints):
        joint = member.joints[j]
        torque = (member.peak_torque[j], policy.peak_torque[i], "N m")
        speed = (member.no_load_speed[j], policy.no_load_speed[i], "rad/s")
        rows.append((f"peak torque of {joint}", *torque))
        rows.append((f"no-load speed of {joint}", *speed))
    found = [
        Departure(name, float(value), float(at), float(at), unit)
        for name, value, at, unit in rows
        if abs(value - at) > SAME * abs(at)
    ]
    return (*found, *limited(region, member, match))


def _rubbing(region: Region, design: Design) -> Iterator[Departure]:
    """Friction of the joint with most of it, if that is far beyond that of the training."""
    joint, share = max(_frictions(design).items(), key=lambda one: one[1])
    if share > _FAR * region.friction:
        motor = design.drive(design.joints[joint])
        peak = 0.0 if motor is None else scalar(motor.peak_torque)
        known = region.friction * peak
        yield Departure(f"friction of {joint}", share * peak, known, known, "N m")


def _frictions(design: Design) -> dict[str, float]:
    """Friction loss, and damping at the no-load speed, over the peak torque, by joint."""
    motors = {name: design.drive(joint) for name, joint in design.joints.items()}
    return {
        name: scalar((a.friction_loss + a.damping * a.no_load_speed) / a.peak_torque)
        for name, a in motors.items()
        if a is not None
    }


def _title(policy: Policy) -> str:
    """What a policy of one's own is called: by its design, or by its file if that is a family."""
    return str(policy.file) if len(policy.features) else policy.design


def train_command(design: Design) -> str:
    """Command that trains a policy of a design, with the values that were changed."""
    spec, label = design.spec, design.label
    named = label if label in spec.designs else label.removesuffix("custom").rstrip("_")
    known = spec.designs[named].values if named in spec.designs else {}
    changed = [f"{k}={value}" for k, value in design.values.items() if known.get(k) != value]
    words = [f"{spec.name}:{named}" if named in spec.designs else spec.name]
    return f"draft train {shlex.join([*words, *(['--set', *changed] if changed else [])])}"


@lru_cache(maxsize=8)
def _regions(skill: str) -> tuple[tuple[Policy, Region], ...]:
    """Shipped policies of a skill with their regions, those of one design first."""
    spec = load(shipped.ROBOT)
    found = []
    for name in (one for one in shipped.designs() if shipped.has(one, skill)):
        design = spec.resolve(name)
        model = design.build()
        robot = legged_robot(design, model)
        policy = shipped.policy(name, skill)
        region = Region.of(robot.name, [features(robot, model.mujoco)], policy)
        found.append((policy, replace(region, friction=max(_frictions(design).values()))))
    family = shipped.open_policy(shipped.FAMILIES[skill])
    region = Region.of(FAMILY_NAME, family.known, family)
    # Its bodies have the friction of the default.
    friction = max(_frictions(spec.resolve()).values())
    return *found, (family, replace(region, friction=friction))


def _adapted(policy: Policy, member: LeggedRobot, own: ArrayLike, match: Match) -> Policy:
    """Policy with the joints, home pose, motors and gains of a design, and the features of it.

    Training gives servos a stiffness and a damping per peak torque or per what the weight asks, so
    both scale with it; targets of wheels scale with their no-load speed.
    """
    peak, fastest = match.taken(member.peak_torque), match.taken(member.no_load_speed)
    servo = peak
    if policy.support:
        servo = match.taken(servo_torque(member, slots_of(member), policy.support).tolist())
    stronger = servo / policy.servo_torque
    faster = np.where(policy.rolls, fastest / policy.no_load_speed, 1.0)
    return replace(
        policy,
        joints=tuple(member.joints[j] for j in match.joints),
        sign=np.array(match.sign),
        home=match.taken(member.home),
        servo_torque=servo,
        peak_torque=peak,
        stall_torque=match.taken(member.stall_torque),
        no_load_speed=fastest,
        action_scale=policy.action_scale * faster,
        stiffness=policy.stiffness * stronger,
        damping=policy.damping * stronger,
        features=np.clip(own, *policy.known) if len(policy.features) else policy.features,
    )
