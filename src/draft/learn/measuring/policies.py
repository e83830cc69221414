"""Policies that bodies can be measured with: that of a run, of an ONNX file, or the shipped one."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from draft.errors import DraftError
from draft.learn.bodies.features import family_features, features
from draft.learn.policy.matching import Match, Structure, match, structure_of, trained_structure
from draft.learn.policy.policy import CLIMBING_FAMILY, FAMILY, Policy, open_policy
from draft.learn.policy.region import Region, departures, sentence
from draft.learn.policy.validity import FAMILY_NAME
from draft.learn.task.config import Config
from draft.learn.task.constants import scaled
from draft.learn.task.recipes import LAPTOP
from draft.learn.task.stages import is_like
from draft.learn.training.reached import commanded
from draft.learn.training.run import Plan, Run, file_digest, is_run, open_run

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv

    from draft.learn.bodies.legged import LeggedRobot
    from draft.learn.training.ppo.loaded import Policy as Actor

_ROUNDED = 1e-4  # Relative difference of numbers that a file has rounded.
_REMEDY = "train one on a family with `vary`, `bodies` and `see_design`"


@dataclass(frozen=True)
class Source:
    """A policy, and what a measurement of bodies with it needs.

    Attributes:
        name: folder of the run, ONNX file, or name of the shipped policy.
        file: its file.
        iteration: iterations of its stage of training.
        digest: digest of its file; equal ones give equal measurements.
        plan: what it was trained with; without members if only its file is known.
        joints: names of the joints of the robot that it was trained with.
        structure: their structure; None if it is unknown.
        region: region of validity.
        forward: largest forward speed that it was commanded [m/s]; of a family, the mean over its
            bodies.
        leg_length: leg length of the robot that it was trained with [m]; of a family, the mean.
        network: function from a device to one that makes the policy for an environment of its own
            robots.
        line: its iteration and whether its training is finished, in one line.
    """

    name: str
    file: Path
    iteration: int
    digest: str
    plan: Plan
    joints: tuple[str, ...]
    structure: Structure | None
    region: Region
    forward: float
    leg_length: float
    network: Callable[[str], Callable[[ManagerBasedRlEnv], Actor]]
    line: str

    def warning(self, member: LeggedRobot) -> str:
        """Sentence that says what of a robot lies outside the region; "" for nothing.

        Raises:
            DraftError: the policy does not drive the robot.
        """
        outside = departures(self.region, member, features(member), self.match(member))
        return sentence(self.region.name, outside)

    def forward_for(self, member: LeggedRobot) -> float:
        """Largest forward speed that the policy was commanded, at the size of a robot [m/s]."""
        return self.forward * math.sqrt(member.leg_length / self.leg_length)

    def actor(self, device: str) -> Callable[[ManagerBasedRlEnv], Actor]:
        """Return a function that makes the policy for an environment of any robots it drives.

        Args:
            device: device of the environment.
        """
        from draft.learn.measuring.rollout.matched import matched

        return matched(self.network(device), self.match, (self.region.low, self.region.high))

    def match(self, member: LeggedRobot) -> Match:
        """Match the joints of the policy with those of a robot.

        Raises:
            DraftError: the policy does not drive the robot.
        """
        found = match(self.joints, self.structure, member.joints, structure_of(member))
        if isinstance(found, str):
            cause = f"{self.name} does not drive the joints of {member.name}: {found}"
            raise DraftError(cause, f"{_REMEDY}, and name it: `policy=RUN`")
        return found


def open_source(name: str | Path | None = None, blind: bool = False) -> Source:
    """Open a policy to measure bodies with.

    Args:
        name: folder of a run or ONNX file; None for the policy that ships.
        blind: whether it may be one that does not observe its design.

    Raises:
        DraftError: it cannot be read, or does not observe its design.
    """
    if name is None:
        return _of_file(open_policy(FAMILY), FAMILY_NAME)
    path = Path(name)
    if path.suffix == ".onnx" and not is_run(path):
        return _of_file(open_policy(path), str(path), blind)
    return of_run(open_run(path), blind)


def climbing_family() -> Source:
    """The policy that ships for climbing."""
    return _of_file(open_policy(CLIMBING_FAMILY), FAMILY_NAME)


def of_run(run: Run, blind: bool = False) -> Source:
    """Return the last policy of a run.

    Args:
        run: the run.
        blind: whether the policy may be one that does not observe its design.

    Raises:
        DraftError: it has none, or the policy does not observe its design.
    """
    plan = run.plan
    iteration, file = run.checkpoint()
    if not plan.see_design and not blind:
        cause = f"the policy of {run.folder} does not see its design"
        raise DraftError(cause, _REMEDY)
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
    robot = first.joints, structure_of(first)
    of_file = file, iteration, file_digest(file)
    line = f"{run.folder}: {run.policy_line(iteration)}"
    length = sum(member.leg_length for member in plan.members) / len(plan.members)
    return Source(str(run.folder), *of_file, plan, *robot, region, forward, length, network, line)


def _of_file(policy: Policy, name: str, blind: bool = False) -> Source:
    if not len(policy.features) and not blind:
        raise DraftError(f"the policy of {name} does not see its design", _REMEDY)
    plan = Plan(
        members=(),
        stage=policy.stage,
        seed=policy.seed,
        config=config_of(policy),
        ground="flat",
        see_design=bool(len(policy.features)),
        see_ground=bool(len(policy.scan_points)),
    )

    def network(device: str) -> Callable[[ManagerBasedRlEnv], Actor]:
        from draft.learn.measuring.rollout.evaluate import exported

        return exported(policy, device)

    region = Region.of(name, policy.known, policy)
    robot = policy.joints, trained_structure(policy)
    of_file = policy.file, policy.iterations, file_digest(policy.file)
    line = f"{name}: policy: iteration {policy.iterations}"
    reach = policy.forward, policy.leg_length
    return Source(name, *of_file, plan, *robot, region, *reach, network, line)


def config_of(policy: Policy) -> Config:
    """Numbers of the task of an exported policy: those of recipe laptop, but for what it states."""
    own = {
        "physics.timestep": policy.timestep,
        "physics.decimation": float(round(policy.control_period / policy.timestep)),
        "actuation.action_scale": float(np.median(policy.action_scale)),
        "actuation.stiffness": float(np.median(policy.stiffness / policy.peak_torque)),
        "actuation.damping": float(np.median(policy.damping / policy.peak_torque)),
    }
    usual = LAPTOP.config
    changed: dict[str, object] = {
        "episodes.contact_time": policy.contact_time,
        "episodes.delay": policy.delay,
    }
    for name, value in own.items():
        group, _, number = name.partition(".")
        if not math.isclose(value, getattr(getattr(usual, group), number), rel_tol=_ROUNDED):
            changed[name] = value
    return usual.with_values(changed)
