"""Observations of a robot in the slots of all legs, without units.

With leg length L and gravity g, velocities are per sqrt(g L), rates times sqrt(L / g), heights per
L, and times per sqrt(L / g); angles have the signs of their slots. Entries of slots without a joint
are zero.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from draft.learn.bodies.features import GRAVITY
from draft.learn.bodies.legged import REFERENCE_LEG
from draft.learn.bodies.slots import (
    FEATURES,
    LEGS,
    SLOTS,
    Slots,
    mirrored_features,
    mirrored_slots,
)
from draft.values import Array


class _Part(NamedTuple):
    """A term of an observation.

    Attributes:
        of: "body", "joints", "legs" or "design": what has an entry each.
        powers: powers of sqrt(g L) and of sqrt(L / g) that an entry is divided by.
        image: signs of the mirror image of the entries, of a body.
    """

    of: str
    powers: tuple[tuple[float, float], ...] = ((0.0, 0.0),)
    image: tuple[float, ...] = ()


_SPEED, _RATE = (1.0, 0.0), (0.0, -1.0)
_POLAR, _AXIAL = (1.0, -1.0, 1.0), (-1.0, 1.0, -1.0)
_ACTOR = {
    "base_lin_vel": _Part("body", (_SPEED,) * 3, _POLAR),
    "base_ang_vel": _Part("body", (_RATE,) * 3, _AXIAL),
    "projected_gravity": _Part("body", ((0.0, 0.0),) * 3, _POLAR),
    "command": _Part("body", (_SPEED, _SPEED, _RATE), (1.0, -1.0, -1.0)),
    "joint_pos": _Part("joints"),
    "joint_vel": _Part("joints", (_RATE,)),
    "actions": _Part("joints"),
    "design": _Part("design"),
}
_CRITIC = {
    **_ACTOR,
    "foot_height": _Part("legs", ((1.0, 1.0),)),
    "foot_air_time": _Part("legs", ((0.0, 1.0),)),
    "foot_contact": _Part("legs"),
}
LAYOUTS = {"actor": _ACTOR, "critic": _CRITIC}


@dataclass(frozen=True)
class Padding:
    """Where the entries of a padded observation come from.

    Attributes:
        source: index of the entry of the robot's own observation; its length for none, shape
            (entries,).
        sign: sign of each entry, shape (entries,).
        powers: powers of sqrt(g L) and of sqrt(L / g) that each is divided by, shape (2, entries).
    """

    source: NDArray[np.intp]
    sign: Array
    powers: Array

    def factor(self, scale: float) -> Array:
        """Factor from a robot's own entries to the padded ones, shape (entries,).

        Args:
            scale: s = L / 0.48 m of the robot.
        """
        length = scale * REFERENCE_LEG
        units = np.log([math.sqrt(GRAVITY * length), math.sqrt(length / GRAVITY)])
        return self.sign * np.exp(-units @ self.powers)


def padding(group: str, terms: Sequence[tuple[str, int]], slots: Slots) -> Padding:
    """Return where the entries of an observation's padded form come from.

    Args:
        group: "actor" or "critic".
        terms: names and lengths of the terms of the robot's own observation, in order.
        slots: slots of the robot.

    Raises:
        KeyError: the robot's observation lacks a term.
    """
    start, starts = 0, {}
    for name, length in terms:
        starts[name] = start
        start += length
    source, sign, powers = [], [], []
    places = {"joints": slots.joints, "legs": slots.legs}
    for name, part in LAYOUTS[group].items():
        count = _length(part)
        at = np.full(count, start)
        own = np.ones(count)
        if part.of in places:
            for i, place in enumerate(places[part.of]):
                if place >= 0:
                    at[place] = starts[name] + i
                    own[place] = slots.signs[i] if part.of == "joints" else 1.0
        else:
            at = starts[name] + np.arange(count)
        source.append(at)
        sign.append(own)
        powers += list(part.powers) * (count // len(part.powers))
    return Padding(np.concatenate(source), np.concatenate(sign), np.array(powers).T)


def size(group: str) -> int:
    """Number of entries of a padded observation."""
    return sum(map(_length, LAYOUTS[group].values()))


def starts(group: str) -> dict[str, int]:
    """Index of the first entry of each term of a padded observation."""
    found, start = {}, 0
    for name, part in LAYOUTS[group].items():
        found[name] = start
        start += _length(part)
    return found


def mirror_image(group: str) -> tuple[NDArray[np.intp], Array]:
    """Mirror image of a padded observation: index of the mirrored entry, and sign, of each."""
    swapped = {
        "joints": mirrored_slots(),
        "legs": np.arange(len(LEGS)).reshape(-1, 2)[:, ::-1].ravel(),
        "design": mirrored_features(),
    }
    source, sign, start = [], [], 0
    for part in LAYOUTS[group].values():
        count = _length(part)
        source.append(start + swapped.get(part.of, np.arange(count)))
        sign.append(np.array(part.image or (1.0,) * count))
        start += count
    return np.concatenate(source), np.concatenate(sign)


def _length(part: _Part) -> int:
    lengths = {"joints": SLOTS, "legs": len(LEGS), "design": FEATURES}
    return lengths.get(part.of, len(part.powers))
