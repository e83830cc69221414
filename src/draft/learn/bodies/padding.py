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
MOST = 100.0  # Largest padded observation; a robot that falls apart has any.


@dataclass(frozen=True)
class Places:
    """Where the entries of a robot's own observation go in the padded one.

    Attributes:
        entry: index of the padded entry; -1 for joints without a slot, shape (n,).
        sign: sign of each, shape (n,).
        share: how many entries of the robot go there: they count by their mean, shape (n,).
    """

    entry: NDArray[np.intp]
    sign: Array
    share: Array

    def sources(self, group: str) -> NDArray[np.intp]:
        """For each padded entry the index of the robot's own, n for none.

        Args:
            group: "actor" or "critic".
        """
        source = np.full(size(group), len(self.entry))
        for i in np.flatnonzero(self.entry >= 0):
            source[self.entry[i]] = i
        return source


def places(group: str, terms: Sequence[tuple[str, int]], slots: Slots) -> Places:
    """Return where the entries of a robot's own observation go.

    Args:
        group: "actor" or "critic".
        terms: names and lengths of the terms of the robot's own observation, in order; those that
            the padded one lacks are left out.
        slots: slots of the robot.
    """
    first, of = starts(group), {"joints": slots.joints, "legs": slots.legs}
    entry, sign = [], []
    for name, length in terms:
        part = LAYOUTS[group].get(name)
        own: Sequence[int] = [-1] * length
        if part is not None:
            own = [first[name] + i if i >= 0 else -1 for i in of.get(part.of, range(length))]
        entry += own
        sign += slots.signs if part is not None and part.of == "joints" else [1.0] * length
    at = np.array(entry)
    share = np.array([entry.count(i) if i >= 0 else 1 for i in entry], float)
    return Places(at, np.array(sign), share)


def powers(group: str) -> Array:
    """Powers of sqrt(g L) and of sqrt(L / g) that padded entries are divided by, (2, entries)."""
    of_all = [part.powers * (_length(part) // len(part.powers)) for part in LAYOUTS[group].values()]
    return np.concatenate(of_all).T


def units(group: str, length: float) -> Array:
    """Factor of each padded entry from a robot's units, for its leg length L [m]."""
    sizes = np.log([math.sqrt(GRAVITY * length), math.sqrt(length / GRAVITY)])
    return np.exp(-sizes @ powers(group))


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


def of_joints(group: str) -> list[str]:
    """Names of the terms of a padded observation that have an entry for each joint."""
    return [name for name, part in LAYOUTS[group].items() if part.of == "joints"]


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
