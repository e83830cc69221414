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
from functools import lru_cache
from pathlib import Path

import mujoco
import numpy as np

from draft.errors import DraftError
from draft.learn.bodies.features import GRAVITY
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.bodies.padding import places, size, starts, units
from draft.learn.bodies.slots import (
    FEATURES,
    SLOTS,
    Slots,
    describe,
    feature_names,
    feature_units,
    owned,
    readable_slots,
    servo_torque,
)
from draft.learn.policy.matching import structure_of
from draft.learn.policy.onnx_file import Network, of_layers, read
from draft.learn.policy.policy import ANY, Policy, velocity_noise, with_network
from draft.learn.policy.region import SAME, Departure
from draft.learn.policy.trim import Trim
from draft.values import Array

_REMEDY = "use the one that ships, or one of 'draft train any'"
_NARROW = 0.1  # Width of a range of features below which it counts as this wide.
# Value of the metadata's key `layout` of such a policy.
LAYOUT = "slots, knees by their bend, centre of mass"
# Largest divisor of an observation that is constant in the training, with the epsilon of rsl-rl.
_CONSTANT = 1.01e-2
# Trims on two legs and on more, chosen on generated bodies, without units: rates, largest states,
# and largest vx, vy and wz that are observed, over those of the training. On two legs a speed that
# is shifted toward zero lets the policy stand, and fall; beyond the fastest sidestep robots fall.
_BY_LEAN = (
    np.array([0.0, 0.0, 0.1, 0.05, 0.05]),
    np.array([0.0, 0.0, 0.2, 0.15, 0.15]),
    np.array([1.0, 1.0, 1.0]),
)
_BY_COMMAND = (
    np.array([0.1, 0.1, 0.1, 0.0, 0.0]),
    np.array([0.2, 0.2, 0.15, 0.0, 0.0]),
    np.array([1.0, 1.0, 1.6]),
)


@dataclass(frozen=True, repr=False)
class LegsPolicy:
    """A policy of all legs.

    Attributes:
        file: file that it was read from.
        network: network from padded observations to actions of the slots.
        known: ends of each feature of the bodies of the training, by number of legs, each of
            shape (2, FEATURES).
        commands: largest |vx| and |vy| that were commanded, per sqrt(g L), and |wz|, times
            sqrt(L / g), by number of legs.
    """

    file: Path
    network: Network
    known: Mapping[int, Array]
    commands: Mapping[int, tuple[float, ...]]

    @property
    def iterations(self) -> int:
        """Iterations of the training."""
        return int(self.network.metadata["iteration"])

    @property
    def action_std(self) -> Array:
        """Standard deviation of the action of each slot; empty if the file does not state it."""
        text = self.network.metadata.get("action_std")
        return np.zeros(0) if text is None else np.array(text.split(","), float)

    def ends(self, legs: int) -> tuple[Array, Array]:
        """Lower and upper ends of the features of bodies with this number of legs.

        Of all bodies where none had as many.
        """
        if legs in self.known:
            low, high = self.known[legs]
            return low, high
        every = np.array([*self.known.values()])
        return every[:, 0].min(axis=0), every[:, 1].max(axis=0)

    def commands_for(self, member: LeggedRobot) -> Array:
        """Largest |vx|, |vy| [m/s] and |wz| [rad/s] that were commanded, at the size of a robot."""
        return self._commands(len(member.feet)) * speed_units(member)

    def trim(self, legs: int) -> Trim:
        """Trim of a robot with this number of legs, in units of sqrt(L / g) and sqrt(g L)."""
        rate, most, beyond = _BY_LEAN if legs == 2 else _BY_COMMAND
        return Trim(rate, most, beyond * self._commands(legs))

    def _commands(self, legs: int) -> Array:
        least = np.min([*self.commands.values()], axis=0)
        return np.array(self.commands.get(legs, least))

    def nearest(self, own: Array, legs: int) -> Array:
        """Features of a robot as the nearest of the training, shape (FEATURES,).

        Joints that it lacks stay absent.
        """
        lacks = np.zeros(len(own), bool)
        lacks[:SLOTS] = own[:SLOTS] == 0
        return np.where(owned(own) & ~lacks, np.clip(own, *self.ends(legs)), own)

    def distances(self, own: Array, legs: int) -> Array:
        """How far features of a robot lie outside the training, shape (FEATURES,).

        The measure is the distance to the nearer end, per the width of the range or one tenth,
        whichever is larger.
        """
        low, high = self.ends(legs)
        width = np.maximum(high - low, _NARROW)
        return np.abs(own - np.clip(own, low, high)) / width * owned(own)

    def departures(self, member: LeggedRobot, own: Array) -> tuple[Departure, ...]:
        """What of a robot lies outside the training, the farthest by `distances` first.

        Args:
            member: the robot.
            own: its features, shape (FEATURES,).
        """
        low, high = self.ends(len(member.feet))
        distance = self.distances(own, len(member.feet))
        shown = readable_slots(np.array((own, low, high)), member).T.tolist()
        names, units = feature_names(), feature_units()
        found = []
        for i in np.argsort(-distance, kind="stable")[: np.count_nonzero(distance > SAME)]:
            value, least, most = shown[i]
            found.append(Departure(names[i], value, least, most, units[i]))
        return tuple(found)

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
        peak, most = np.array(member.peak_torque), self.commands_for(member)
        timestep, support = float(texts["physics_timestep"]), float(texts.get("support", "0"))
        servo = servo_torque(member, slots, support)
        return Policy(
            file=self.file,
            network=self._network(
                slots, member.leg_length, self.nearest(own, len(member.feet)), terms
            ),
            design=member.name,
            stage=texts["stage"],
            iterations=self.iterations,
            seed=int(texts["seed"]),
            joints=member.joints,
            structure=structure_of(member, model),
            sign=np.ones(count),
            rolls=np.zeros(count, bool),
            home=np.array(member.home),
            action_scale=np.full(count, float(texts["action_scale"])),
            stiffness=float(texts["stiffness"]) * servo,
            damping=float(texts["damping"]) * servo,
            servo_torque=servo,
            support=support,
            peak_torque=peak,
            stall_torque=np.array(member.stall_torque),
            no_load_speed=np.array(member.no_load_speed),
            control_period=1.0 / float(texts["control_rate"]),
            timestep=timestep,
            contact_time=_ends(texts["contact_time"]),
            delay=_ends(texts["delay"]),
            velocity_noise=velocity_noise(texts),
            terms=terms,
            history=(1,) * len(terms),
            scan_points=np.zeros((0, 2)),
            scan_range=1.0,
            commands=(float(most[0]), float(most[1]), float(most[2])),
            features=np.zeros(0),
            known=np.zeros((2, 0)),
            leg_length=member.leg_length,
            action_std=self._noise(slots),
            trim=_sized(self.trim(len(member.feet)), member),
        )

    def _noise(self, slots: Slots) -> Array:
        """Standard deviation of a robot's actions, with the mean one for joints without a slot."""
        known = self.action_std
        if not len(known):
            return known
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
        driven = (own.entry >= 0) & np.isfinite(divisor[entry])
        used = driven * own.sign / own.share
        # Observations of other joints have no say, but a training may go on from here.
        middle, spread = np.where(driven, own.sign * mean[entry] / unit, 0.0), divisor[entry] / unit
        start = 0
        for _, count in terms:
            term = slice(start, start := start + count)
            spread[term][~driven[term]] = spread[term][driven[term]].mean()
        chosen = np.maximum(slots.joints, 0)
        turned = np.array(slots.signs) * (np.array(slots.joints) >= 0)
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


AnyPolicy = Policy | LegsPolicy


@lru_cache(maxsize=1)
def any_legs() -> LegsPolicy:
    """The policy of all legs that ships."""
    return open_legs_policy(ANY)


def open_any(path: str | Path) -> AnyPolicy:
    """Read a policy of one kind of robot or of all legs.

    Args:
        path: ONNX file.

    Raises:
        DraftError: it cannot be read, or was written by another tool.
    """
    file = Path(path)
    network = read(file)
    if "layout" in network.metadata:
        return _legs(file, network)
    return with_network(file, network)


def open_legs_policy(path: str | Path) -> LegsPolicy:
    """Read a policy of all legs.

    Args:
        path: ONNX file, as `draft.learn.training.ppo.legs_onnx` writes it.

    Raises:
        DraftError: it cannot be read, or is another kind of policy.
    """
    found = open_any(path)
    if isinstance(found, LegsPolicy):
        return found
    cause = f"{path} is no policy of all legs: it drives the joints of one kind of robot"
    raise DraftError(cause, _REMEDY)


def _legs(file: Path, network: Network) -> LegsPolicy:
    texts = network.metadata
    try:
        if texts["layout"] != LAYOUT:
            raise ValueError(f"its layout is '{texts['layout']}', and '{LAYOUT}' is known")
        # Which may be wrong.
        velocity_noise(texts)
        if not 0 <= float(texts.get("support", "0")) < math.inf:
            raise ValueError(f"its support is {texts['support']}, and a share is 0 or more")
        rows = (row.split(";") for row in texts["commands"].split(","))
        commands = {int(legs): (float(x), float(y), float(z)) for legs, x, y, z in rows}
        known = {
            legs: np.array(texts[f"features_of_{legs}"].split(","), float).reshape(2, -1)
            for legs in commands
        }
        counts = {values.shape[1] for values in known.values()}
        if network.size != size("actor") or counts != {FEATURES}:
            raise ValueError(f"it has {network.size} inputs, and {size('actor')} are known")
        if len(network.layers()[2][-1][1]) != SLOTS:
            raise ValueError(f"it has not {SLOTS} outputs")
        mean, divisor, layers = network.layers()
        arrays = [mean, divisor, *(one for layer in layers for one in layer), *known.values()]
        if not all(np.isfinite(values).all() for values in arrays):
            raise ValueError("its numbers are not finite")
    except (KeyError, ValueError) as error:
        cause = f"{file} is no policy of all legs: {str(error).strip(chr(39))}"
        raise DraftError(cause, _REMEDY) from None
    return LegsPolicy(file, _without_constants(network), known, commands)


def _without_constants(network: Network) -> Network:
    """A network in which joints that no body of its training had have no say, and hold still."""
    mean, divisor, layers = network.layers()
    constant, first = divisor <= _CONSTANT, starts("actor")["joint_pos"]
    still = constant[first : first + SLOTS]
    *others, (weight, bias) = layers
    last = np.where(still[:, None], 0.0, weight), np.where(still, 0.0, bias)
    divisor = np.where(constant, np.inf, divisor)
    return of_layers(mean, divisor, [*others, last], network.metadata)


def open_for(path: str | Path, members: Sequence[LeggedRobot]) -> Policy:
    """Read a policy for the training of robots: one of all legs becomes that of its robot.

    Args:
        path: ONNX file.
        members: the robots.

    Raises:
        DraftError: it cannot be read, or it is of all legs and there are several robots.
    """
    found = open_any(path)
    if isinstance(found, Policy):
        return found
    if len(members) > 1:
        cause = f"{path} becomes the policy of one robot, and this training has {len(members)}"
        raise DraftError(cause, 'train one design, or start with `origin="scratch"`')
    return found.of_robot(members[0])


def _sized(trim: Trim, member: LeggedRobot) -> Trim:
    """A trim without units in those of a robot."""
    speeds = speed_units(member)
    states = np.array([*speeds, 1.0, 1.0])
    errors = np.array([*speeds, *speeds[:2]])
    rate = trim.rate * states / errors * math.sqrt(GRAVITY / member.leg_length)
    return Trim(rate, trim.most * states, trim.ends * speeds)


def speed_units(member: LeggedRobot) -> Array:
    """Units of vx, vy [m/s] and wz [rad/s] of a robot, shape (3,)."""
    rate = math.sqrt(GRAVITY / member.leg_length)
    speed = rate * member.leg_length
    return np.array([speed, speed, rate])


def _ends(text: str) -> tuple[float, float]:
    low, high = map(float, text.split(","))
    return low, high
