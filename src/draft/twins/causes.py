"""Causes of a twin's error in M(q): groups of links, and the location of the knee motors.

Groups are told by giving the vendor's own model the twin's masses one group at a time.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from draft.imports.options import KneeDrive
from draft.twins.dynamics import Errors, Machine
from draft.twins.links import Pair
from draft.twins.vendor import BASE, body_name, vendor_spec
from draft.values import Array

if TYPE_CHECKING:
    from draft.twins.compare import Comparison

# Median error of M(q) from which its cause is named, and change of M(q) by the knees' motors from
# which both of their places are reported [%].
LARGE, MOVES = 40.0, 10.0
FEW_POSES = 40


@dataclass(frozen=True, slots=True)
class Cause:
    """Error of M(q) that one group of links causes by itself.

    Attributes:
        group: class of its segments.
        links: its links, by the vendor's names.
        inertia: median error of M(q) with only this group's masses the twin's [%].
        vendor_mass, twin_mass: mass of the group [kg].
    """

    group: str
    links: tuple[str, ...]
    inertia: float
    vendor_mass: float
    twin_mass: float


@dataclass(frozen=True, slots=True)
class OtherKnees:
    """The same twin with the knees' motors in their other place.

    Attributes:
        place: that place.
        change: median change of M(q) between both places [%].
        inertia, gravity: errors of M(q) and g(q) there.
    """

    place: KneeDrive
    change: float
    inertia: Errors
    gravity: Errors


def causes(found: Comparison, machine: Machine, q: Array) -> tuple[Cause, ...]:
    """Errors of M(q) by group of links, largest first.

    Args:
        found: the comparison.
        machine: the vendor's robot.
        q: poses, shape (poses, n); the first few are used.
    """
    q = q[:FEW_POSES]
    turn, bodies = found.files.reduced.base[1], _bodies(found)
    true = [machine.inertia_and_gravity(angles)[0] for angles in q]
    groups: dict[str, list[Pair]] = {}
    for pair in found.links:
        groups.setdefault(pair.group, []).append(pair)
    table: list[Cause] = []
    for name, pairs in groups.items():
        changed = _with_twins_masses(machine, found.vendor, bodies, pairs, turn)
        errors = [_relative(m, changed, angles) for m, angles in zip(true, q, strict=True)]
        links = tuple(pair.name for pair in pairs)
        masses = sum(p.vendor.mass for p in pairs), sum(p.twin.mass for p in pairs)
        table.append(Cause(name, links, float(np.median(errors)), *masses))
    return tuple(sorted(table, key=lambda cause: -cause.inertia))


def _relative(true: Array, machine: Machine, angles: Array) -> float:
    norm = float(np.linalg.norm(true))
    own = machine.inertia_and_gravity(angles)[0]
    return 100 * float(np.linalg.norm(own - true)) / norm if norm else 0.0


def _with_twins_masses(
    machine: Machine,
    vendor: mujoco.MjModel,
    bodies: Mapping[str, int],
    pairs: Sequence[Pair],
    turn: Array,
) -> Machine:
    """The vendor's robot with the twin's masses, centres and radii of gyration of some bodies."""
    model = copy.copy(vendor)
    for pair in pairs:
        body = bodies[pair.name]
        scale = (pair.twin.gyration / pair.vendor.gyration) ** 2 if pair.vendor.gyration else 1.0
        ratio = pair.twin.mass / pair.vendor.mass if pair.vendor.mass else 1.0
        model.body_mass[body] = pair.twin.mass
        model.body_inertia[body] *= scale * ratio
        model.body_ipos[body] += turn.T @ (pair.twin.com - pair.vendor.com)
    return machine.of(model)


def _bodies(found: Comparison) -> dict[str, int]:
    """Index of the vendor's body that a link belongs to."""
    _, root, _ = vendor_spec(found.files.reduced.description, found.joints)
    return {
        link: found.vendor.body(BASE if body.parent is None else body_name(body.name)).id
        for body in root.all()
        for link in body.links
    }


def change(first: Machine, second: Machine, q: Array) -> float:
    """Median relative change of M(q) from one model to another [%]."""
    return float(
        np.median(
            [
                _relative(first.inertia_and_gravity(angles)[0], second, angles)
                for angles in q[:FEW_POSES]
            ]
        )
    )
