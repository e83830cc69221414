"""Policies that bodies can be measured with: that of a run, of an ONNX file, or the shipped one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from draft.design import Design
from draft.errors import DraftError
from draft.learn.bodies.features import family_features
from draft.learn.bodies.legged import LeggedRobot, legged_robot
from draft.learn.bodies.legged_batch import legged_robots
from draft.learn.measuring.drives import REMEDY, BySlots, ByStructure, Drive
from draft.learn.policy.matching import match_of, structure_of, trained_structure
from draft.learn.policy.policy import CLIMBING_FAMILY, FAMILY, Policy, open_policy
from draft.learn.policy.reduced import LegsPolicy, any_legs, open_any
from draft.learn.policy.region import Region, sentence
from draft.learn.policy.validity import ANY_NAME, FAMILY_NAME
from draft.learn.task.config import Config
from draft.learn.task.constants import scaled
from draft.learn.task.recipes import LAPTOP
from draft.learn.task.stages import is_like
from draft.learn.training.reached import commanded
from draft.learn.training.run import Plan, Run, file_digest, is_run, open_run
from draft.model.model import preview

if TYPE_CHECKING:
    from collections.abc import Callable

    from mjlab.envs import ManagerBasedRlEnv

    from draft.learn.training.ppo.loaded import Policy as Actor

_ROUNDED = 1e-4  # Relative difference of numbers that a file has rounded.


@dataclass(frozen=True)
class Source:
    """A policy, and what a measurement of bodies with it needs.

    Attributes:
        name: folder of the run, ONNX file, or name of the shipped policy.
        file: its file.
        iteration: iterations of its stage of training.
        digest: digest of its file; equal ones give equal measurements.
        plan: what it was trained with; without members if only its file is known.
        drive: how it drives robots.
        forward: largest forward speed that it was commanded [m/s]; of a family, the mean over its
            bodies.
        leg_length: leg length of the robot that it was trained with [m]; of a family, the mean.
        line: its iteration and whether its training is finished, in one line.
    """

    name: str
    file: Path
    iteration: int
    digest: str
    plan: Plan
    drive: Drive
    forward: float
    leg_length: float
    line: str

    @property
    def of_any_legs(self) -> bool:
        """Whether it is a policy of all legs."""
        return isinstance(self.drive, BySlots)

    def warning(self, member: LeggedRobot) -> str:
        """Sentence that says what of a robot lies outside the region; "" for nothing.

        Raises:
            DraftError: the policy does not drive the robot.
        """
        return sentence(self.drive.name, self.drive.departures(member))

    def forward_for(self, member: LeggedRobot) -> float:
        """Largest forward speed that the policy was commanded, at the size of a robot [m/s]."""
        return self.forward * math.sqrt(member.leg_length / self.leg_length)


def open_source(
    name: str | Path | None = None, blind: bool = False, robot: LeggedRobot | None = None
) -> Source:
    """Open a policy to measure bodies with.

    Args:
        name: folder of a run or ONNX file; None for the policy that ships.
        blind: whether it may be one that does not observe its design.
        robot: a robot that it is to drive. The policy of all legs is opened for as many legs as it
            has, and ships for those that the family of quadrupeds does not drive.

    Raises:
        DraftError: it cannot be read, does not observe its design, or needs a robot.
    """
    if name is None:
        family = open_policy(FAMILY)
        if robot is None or not isinstance(match_of(family, robot), str):
            return _of_file(family, FAMILY_NAME)
        return of_legs(any_legs(), ANY_NAME, robot)
    path = Path(name)
    if path.suffix == ".onnx" and not is_run(path):
        opened = open_any(path)
        if isinstance(opened, LegsPolicy):
            return of_legs(opened, str(path), robot)
        return _of_file(opened, str(path), blind)
    return of_run(open_run(path), blind, robot)


def source_for(name: str | Path | None, design: Design) -> Source:
    """Open a policy to measure a design, or N designs of one robot, with.

    Args:
        name: folder of a run or ONNX file; None for the policy that ships for its legs.
        design: the design; the filter may have refused it.

    Raises:
        DraftError: as `open_source`, or it is no robot with legs.
    """
    if design.count is None:
        return open_source(name, robot=legged_robot(design, preview(design)))
    accepted = np.flatnonzero(np.broadcast_to(np.asarray(design.accepted), design.count))
    found = [*legged_robots(design, accepted[:1]).values()]
    robots = [one for one in found if not isinstance(one, DraftError)]
    return open_source(name, robot=robots[0] if robots else None)


def climbing_family() -> Source:
    """The policy that ships for climbing."""
    return _of_file(open_policy(CLIMBING_FAMILY), FAMILY_NAME)


def of_run(run: Run, blind: bool = False, robot: LeggedRobot | None = None) -> Source:
    """Return the last policy of a run.

    Args:
        run: the run.
        blind: whether the policy may be one that does not observe its design.
        robot: see `open_source`.

    Raises:
        DraftError: it has none, or the policy does not observe its design.
    """
    plan = run.plan
    if plan.mixed:
        from draft.learn.training.ppo.legs_onnx import legs_of

        return of_legs(legs_of(run), str(run.folder), robot)
    iteration, file = run.checkpoint()
    if not plan.see_design and not blind:
        cause = f"the policy of {run.folder} does not see its design"
        raise DraftError(cause, REMEDY)
    slowest = min(member.scale for member in plan.members)
    forward = scaled(plan.config.commands, "forward").at(slowest)
    if is_like(plan.stage, "velocity"):
        forward = max(forward, commanded(run) or 0.0)

    def network(device: str) -> Callable[[ManagerBasedRlEnv], Actor]:
        from draft.learn.measuring.rollout.evaluate import trained

        return trained(run, iteration, device)

    known = family_features(plan.members)
    region = Region.of(f"the family of {run.folder}", known, *plan.members)
    first = plan.members[0]
    name = str(run.folder)
    drive = ByStructure(name, first.joints, structure_of(first), region, network)
    of_file = file, iteration, file_digest(file)
    line = f"{run.folder}: {run.policy_line(iteration)}"
    length = sum(member.leg_length for member in plan.members) / len(plan.members)
    return Source(name, *of_file, plan, drive, forward, length, line)


def _of_file(policy: Policy, name: str, blind: bool = False) -> Source:
    if not len(policy.features) and not blind:
        raise DraftError(f"the policy of {name} does not see its design", REMEDY)

    def network(device: str) -> Callable[[ManagerBasedRlEnv], Actor]:
        from draft.learn.measuring.rollout.evaluate import exported

        return exported(policy, device)

    region = Region.of(name, policy.known, policy)
    drive = ByStructure(name, policy.joints, trained_structure(policy), region, network)
    return _with_drive(policy, name, drive)


def of_legs(policy: LegsPolicy, name: str, robot: LeggedRobot | None) -> Source:
    """Return the policy of all legs for robots with the joints of one.

    Args:
        policy: the policy.
        name: what it is called.
        robot: the robot.

    Raises:
        DraftError: no robot is named, or a leg of it has more joints than there are slots.
    """
    if robot is None:
        cause = f"{name} is a policy of all legs, and what it can do depends on the robot"
        raise DraftError(cause, "name a robot")
    return _with_drive(policy.of_robot(robot), name, BySlots(policy, name))


def _with_drive(policy: Policy, name: str, drive: Drive) -> Source:
    plan = Plan(
        members=(),
        stage=policy.stage,
        seed=policy.seed,
        config=config_of(policy),
        ground="flat",
        see_design=bool(len(policy.features)),
        see_ground=bool(len(policy.scan_points)),
    )
    return Source(
        name=name,
        file=policy.file,
        iteration=policy.iterations,
        digest=file_digest(policy.file),
        plan=plan,
        drive=drive,
        forward=policy.forward,
        leg_length=policy.leg_length,
        line=f"{name}: policy: iteration {policy.iterations}",
    )


def config_of(policy: Policy) -> Config:
    """Numbers of the task of an exported policy: those of recipe laptop, but for what it states."""
    turned = ~policy.rolls
    own = {
        "physics.timestep": policy.timestep,
        "physics.decimation": float(round(policy.control_period / policy.timestep)),
        "actuation.action_scale": float(np.median(policy.action_scale[turned])),
        "actuation.stiffness": float(np.median((policy.stiffness / policy.servo_torque)[turned])),
        "actuation.damping": float(np.median(policy.damping / policy.servo_torque)),
        "actuation.support": policy.support,
        "observations.linear_velocity_noise": policy.velocity_noise,
    }
    if policy.rolls.any():
        shares = (policy.action_scale / policy.no_load_speed)[policy.rolls]
        own["actuation.wheel_scale"] = float(np.median(shares))
    usual = LAPTOP.config
    changed: dict[str, object] = {
        "episodes.contact_time": policy.contact_time,
        "episodes.delay": policy.delay,
        "observations.linear_velocity": "base_lin_vel" in dict(policy.terms),
        "observations.history": max(policy.history),
    }
    for name, value in own.items():
        group, _, number = name.partition(".")
        if not math.isclose(value, getattr(getattr(usual, group), number), rel_tol=_ROUNDED):
            changed[name] = value
    return usual.with_values(changed)
