"""The policy of all legs, and the ordinary small network that it becomes for one robot.

The policy observes and moves joints by their slots (`draft.learn.bodies.slots`), without units, and
the numbers of its body. For one body these numbers are constants, slots without a joint drop out,
and units and signs are part of the weights: what is left takes the robot's own observations and
gives the actions of its own joints, in its own order.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import mujoco
import numpy as np

from draft.errors import DraftError
from draft.learn.bodies.features import GRAVITY
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.bodies.padding import places, size, starts, units
from draft.learn.bodies.slots import FEATURES, SLOTS, Slots, describe
from draft.learn.policy.matching import structure_of
from draft.learn.policy.onnx_file import Network, of_layers, read
from draft.learn.policy.policy import Policy, open_policy
from draft.values import Array

LAYOUT = "slots"  # Value of the metadata's key `layout` of such a policy.
# Largest divisor of an observation that is constant in the training, with the epsilon of rsl-rl.
_CONSTANT = 1.01e-2


@dataclass(frozen=True, repr=False)
class LegsPolicy:
    """A policy of all legs.

    Attributes:
        file: file that it was read from.
        network: network from padded observations to actions of the slots.
        low, high: ends of each feature of the bodies of the training, shape (FEATURES,).
        forward: largest |vx| that was commanded, per sqrt(g L), by number of legs.
    """

    file: Path
    network: Network
    low: Array
    high: Array
    forward: Mapping[int, float]

    def outside(self, member: LeggedRobot, model: mujoco.MjModel | None = None) -> Array:
        """How far the numbers of a robot lie outside those of the training, shape (FEATURES,).

        Zero inside; else the distance to the nearer end, per the width of the range or one tenth,
        whichever is larger.
        """
        _, own = describe(member, model)
        return (own - np.clip(own, self.low, self.high)) / np.maximum(self.high - self.low, 0.1)

    def of_robot(self, member: LeggedRobot, model: mujoco.MjModel | None = None) -> Policy:
        """Return the policy of one robot; its numbers count as the nearest of the training.

        Args:
            member: the robot.
            model: its model; None to compile it.

        Raises:
            DraftError: a leg has more joints than there are slots.
        """
        slots, own = describe(member, model)
        texts = self.network.metadata
        count = len(member.joints)
        terms = (
            *(("base_lin_vel", 3), ("base_ang_vel", 3), ("projected_gravity", 3)),
            *(("joint_pos", count), ("joint_vel", count), ("actions", count), ("command", 3)),
        )
        peak = np.array(member.peak_torque)
        timestep = float(texts["physics_timestep"])
        number = len(member.feet)
        forward = self.forward.get(number, min(self.forward.values()))
        return Policy(
            file=self.file,
            network=self._network(
                slots, member.leg_length, np.clip(own, self.low, self.high), terms
            ),
            design=member.name,
            stage=texts["stage"],
            iterations=int(texts["iteration"]),
            seed=int(texts["seed"]),
            joints=member.joints,
            structure=structure_of(member, model),
            sign=np.ones(count),
            home=np.array(member.home),
            action_scale=np.full(count, float(texts["action_scale"])),
            stiffness=float(texts["stiffness"]) * peak,
            damping=float(texts["damping"]) * peak,
            peak_torque=peak,
            stall_torque=np.array(member.stall_torque),
            no_load_speed=np.array(member.no_load_speed),
            control_period=1.0 / float(texts["control_rate"]),
            timestep=timestep,
            contact_time=_ends(texts["contact_time"]),
            delay=_ends(texts["delay"]),
            terms=terms,
            scan_points=np.zeros((0, 2)),
            scan_range=1.0,
            forward=forward * math.sqrt(GRAVITY * member.leg_length),
            features=np.zeros(0),
            known=np.zeros((2, 0)),
            leg_length=member.leg_length,
            action_std=self._noise(slots),
        )

    def _noise(self, slots: Slots) -> Array:
        """Standard deviation of a robot's actions, with the mean one for joints without a slot."""
        if "action_std" not in self.network.metadata:
            return np.zeros(0)
        known = np.array(self.network.metadata["action_std"].split(","), float)
        at = np.array(slots.joints)
        return np.where(at >= 0, known[at], known[at[at >= 0]].mean())

    def _network(
        self, slots: Slots, length: float, features: Array, terms: Sequence[tuple[str, int]]
    ) -> Network:
        mean, divisor, layers = self.network.layers()
        weight, bias = layers[0]
        own = places("actor", terms, slots)
        moving = np.unique(own.entry[own.entry >= 0])
        # Entries that are constant for this robot: its numbers, and slots without a joint.
        values = np.zeros(len(mean))
        first = starts("actor")["design"]
        values[first : first + FEATURES] = features
        fixed = np.setdiff1d(np.arange(len(mean)), moving)
        bias = bias + weight[:, fixed] @ ((values - mean) / divisor)[fixed]
        entry = np.maximum(own.entry, 0)
        unit = units("actor", length)[entry]
        # Entries that no body of the training had have no say, but a training may go on from here.
        driven = (own.entry >= 0) & (divisor[entry] > _CONSTANT)
        used = driven * own.sign / own.share
        middle, spread = np.where(driven, own.sign * mean[entry] / unit, 0.0), divisor[entry] / unit
        start = 0
        for _, count in terms:
            term = slice(start, start := start + count)
            spread[term][~driven[term]] = spread[term][driven[term]].mean()
        at = starts("actor")["joint_pos"] + np.array(slots.joints)
        moved = (np.array(slots.joints) >= 0) & (divisor[at] > _CONSTANT)
        turned = np.array(slots.signs) * moved
        chosen = np.maximum(slots.joints, 0)
        last, offset = layers[-1]
        return of_layers(
            middle,
            spread,
            [
                (weight[:, entry] * used, bias),
                *layers[1:-1],
                (last[chosen] * turned[:, None], offset[chosen] * turned),
            ],
            self.network.metadata,
        )


def open_legs_policy(path: str | Path) -> LegsPolicy:
    """Read a policy of all legs.

    Args:
        path: ONNX file, as `draft.learn.training.ppo.legs_onnx` writes it.

    Raises:
        DraftError: it cannot be read, or is another kind of policy.
    """
    file = Path(path)
    network = read(file)
    texts = network.metadata
    try:
        if "layout" not in texts:
            raise ValueError("it drives the joints of one kind of robot")
        if texts["layout"] != LAYOUT:
            raise ValueError(f"its layout is '{texts['layout']}', and '{LAYOUT}' is known")
        low, high = (
            np.array(texts[f"features_{end}"].split(","), float) for end in ("low", "high")
        )
        if network.size != size("actor") or len(low) != FEATURES or len(high) != FEATURES:
            raise ValueError(f"it has {network.size} inputs, and {size('actor')} are known")
        if len(network.layers()[2][-1][1]) != SLOTS:
            raise ValueError(f"it has not {SLOTS} outputs")
        mean, divisor, layers = network.layers()
        if not all(np.isfinite(x).all() for x in (low, high, mean, divisor, *chain(*layers))):
            raise ValueError("its numbers are not finite")
        pairs = (pair.split(";") for pair in texts["forward"].split(","))
        forward = {int(legs): float(speed) for legs, speed in pairs}
    except (KeyError, ValueError) as error:
        cause = f"{file} is no policy of all legs: {str(error).strip(chr(39))}"
        raise DraftError(cause, "use the one that ships, or one of 'draft train any'") from None
    return LegsPolicy(file, network, low, high, forward)


def open_for(path: str | Path, members: Sequence[LeggedRobot]) -> Policy:
    """Read a policy for the training of robots: one of all legs becomes that of its robot.

    Args:
        path: ONNX file.
        members: the robots.

    Raises:
        DraftError: it cannot be read, or it is of all legs and there are several robots.
    """
    file = Path(path)
    if "layout" not in read(file).metadata:
        return open_policy(file)
    legs = open_legs_policy(file)
    if len(members) > 1:
        cause = f"{file} becomes the policy of one robot, and this training has {len(members)}"
        raise DraftError(cause, 'train one design, or start with `origin="scratch"`')
    return legs.of_robot(members[0])


def _ends(text: str) -> tuple[float, float]:
    low, high = map(float, text.split(","))
    return low, high
