"""How a policy drives robots: by the joints of its own robot, or by the slots of all legs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from draft.errors import DraftError
from draft.learn.bodies.features import family_features, features
from draft.learn.bodies.slots import describe, slot_features
from draft.learn.policy.matching import Match, Structure, match, structure_of
from draft.learn.policy.reduced import LegsPolicy
from draft.learn.policy.region import SAME, Departure, Region, departures
from draft.values import Array

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv

    from draft.learn.bodies.legged import LeggedRobot
    from draft.learn.training.ppo.loaded import Policy as Actor

REMEDY = (
    'train one on a family: `draft.train(ROBOT, vary=["NAME=LOW:HIGH"], bodies=N, see_design=True)`'
)


class Drive(Protocol):
    """How a policy drives robots."""

    @property
    def name(self) -> str:
        """What its region of validity is called."""
        ...

    def check(self, member: LeggedRobot) -> object:
        """Check that the policy drives a robot.

        Raises:
            DraftError: it does not.
        """
        ...

    def features(self, members: Sequence[LeggedRobot]) -> Array:
        """Numbers of bodies of one topology that the region is of, shape (bodies, numbers)."""
        ...

    def ends(self, member: LeggedRobot) -> tuple[Array, Array]:
        """Lower and upper ends of these numbers for a body like this, shape (numbers,)."""
        ...

    def includes(self, member: LeggedRobot, own: Array) -> bool:
        """Whether a body with these numbers lies in the region."""
        ...

    def departures(self, member: LeggedRobot) -> tuple[Departure, ...]:
        """What of a robot lies outside the region, the largest difference first."""
        ...

    def actor(self, device: str) -> Callable[[ManagerBasedRlEnv], Actor]:
        """Return a function that makes the policy for an environment of any robots it drives.

        Args:
            device: device of the environment.
        """
        ...


@dataclass(frozen=True)
class ByStructure:
    """A policy of one kind of legs, whose joints are matched with those of a robot.

    Attributes:
        policy: name of the policy.
        joints: names of the joints of the robot that it was trained with.
        structure: their structure; None if it is unknown.
        region: region of validity.
        network: function from a device to one that makes the policy for an environment of its own
            robots.
    """

    policy: str
    joints: tuple[str, ...]
    structure: Structure | None
    region: Region
    network: Callable[[str], Callable[[ManagerBasedRlEnv], Actor]]

    @property
    def name(self) -> str:
        """What its region of validity is called."""
        return self.region.name

    def check(self, member: LeggedRobot) -> Match:
        """Check that the policy drives a robot."""
        found = match(self.joints, self.structure, member.joints, structure_of(member))
        if isinstance(found, str):
            cause = f"{self.policy} does not drive the joints of {member.name}: {found}"
            raise DraftError(cause, f"{REMEDY}, and name it: `policy=RUN`")
        return found

    def features(self, members: Sequence[LeggedRobot]) -> Array:
        """Numbers of bodies that the region is of."""
        return np.array(family_features(tuple(members)))

    def ends(self, member: LeggedRobot) -> tuple[Array, Array]:
        """Ends of these numbers."""
        return np.array(self.region.low), np.array(self.region.high)

    def includes(self, member: LeggedRobot, own: Array) -> bool:
        """Whether a body lies in the region."""
        return self.region.includes(member, own, self.check(member).joints)

    def departures(self, member: LeggedRobot) -> tuple[Departure, ...]:
        """What of a robot lies outside the region."""
        return departures(self.region, member, features(member), self.check(member))

    def actor(self, device: str) -> Callable[[ManagerBasedRlEnv], Actor]:
        """Return a function that makes the policy for an environment."""
        from draft.learn.measuring.rollout.matched import matched

        return matched(self.network(device), self.check, (self.region.low, self.region.high))


@dataclass(frozen=True)
class BySlots:
    """The policy of all legs.

    Attributes:
        policy: the policy.
        name: what its region is called.
    """

    policy: LegsPolicy
    name: str

    def check(self, member: LeggedRobot) -> None:
        """Check that the policy drives a robot."""
        describe(member)

    def features(self, members: Sequence[LeggedRobot]) -> Array:
        """Numbers of bodies that the region is of."""
        return np.array(slot_features(members))

    def ends(self, member: LeggedRobot) -> tuple[Array, Array]:
        """Ends of these numbers."""
        return self.policy.ends(len(member.feet))

    def includes(self, member: LeggedRobot, own: Array) -> bool:
        """Whether a body lies in the region."""
        return bool((self.policy.distances(own, len(member.feet)) <= SAME).all())

    def departures(self, member: LeggedRobot) -> tuple[Departure, ...]:
        """What of a robot lies outside the region."""
        return self.policy.departures(member, describe(member)[1])

    def actor(self, device: str) -> Callable[[ManagerBasedRlEnv], Actor]:
        """Return a function that makes the policy for an environment."""
        from draft.learn.measuring.rollout.by_slots import by_slots

        return by_slots(self.policy, device)
