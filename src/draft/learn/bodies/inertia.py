"""Errors of a quadruped's masses and inertias, as large as those of twins of real robots.

A draw gives every group of links three errors: a ratio of masses, a ratio of radii of gyration and
a shift of the centre of mass. They act on the pseudo-inertia J of each body of the group, the 4 x 4
moments of its mass of order zero, one and two (Wensing, Kim and Slotine, RA-L 2018):

    J' = mass T J T',    T = [[gyration 1, (1 - gyration) centre + shift], [0, 1]]

A dilation about the centre of the bodies that are welded together gives the whole the drawn radius
of gyration, for any number of motors and members. J' is a congruence of J, so that a body of
positive mass density remains one. As the dilation is isotropic, the principal axes are unchanged,
and mass, centre and principal moments follow without an eigen-decomposition.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

import draft.mujoco_log  # noqa: F401 - before anything is simulated
from draft.errors import DraftError, suggest
from draft.laws.residuals import ErrorSource, Residual, residuals
from draft.learn.bodies.legged import LeggedRobot
from draft.values import Array

GROUPS: tuple[str, ...] = ("trunk", "hip_link", "thigh", "shank")
SOURCES: tuple[ErrorSource, ...] = ("twins", "survey", "paper")
TWINS = ("go2", "b2")  # The twins with meshes, as in arXiv 2609.38405.
Range = tuple[float, float]
Index = NDArray[np.int64]


class Extent(NamedTuple):
    """Ranges of the errors of one group: real robot relative to its model.

    Attributes:
        mass: ratio of masses.
        gyration: ratio of radii of gyration about the centre of mass.
        fore, outboard, up: shift of the centre of mass per leg length (thigh plus shank); outboard
            is to the left for the trunk.
    """

    mass: Range
    gyration: Range
    fore: Range
    outboard: Range
    up: Range


# Released code of arXiv 2609.38405: Go2 and B2 against the twins of that work.
PAPER = {
    "trunk": Extent(
        (1.007, 1.360), (1.139, 1.142), (0.0335, 0.0473), (0.0, 0.0065), (-0.0120, 0.0163)
    ),
    "hip_link": Extent(
        (1.020, 1.143), (0.826, 1.107), (0.0, 0.0), (-0.0136, 0.0040), (-0.0002, 0.0002)
    ),
    "thigh": Extent(
        (0.976, 1.017), (1.163, 1.167), (-0.0085, -0.0081), (-0.0390, -0.0388), (-0.0128, -0.0121)
    ),
    "shank": Extent(
        (0.697, 0.833), (1.195, 1.582), (0.0102, 0.0113), (-0.0018, 0.0), (-0.0095, 0.0278)
    ),
}


class Links(NamedTuple):
    """Links of designs of one topology, with joints at zero, in the trunk's axes.

    Attributes:
        names: names of the bodies.
        group: index in GROUPS of each body, shape (bodies,).
        side: +1 for the trunk and the left legs, -1 for the right ones, shape (designs, bodies).
        turn: axes of each body, as columns, shape (designs, bodies, 3, 3).
        arm: vector from the centre of mass of the welded bodies to that of the body [m], shape
            (designs, bodies, 3).
        length: leg length [m], shape (designs,).
    """

    names: tuple[str, ...]
    group: Index
    side: Array
    turn: Array
    arm: Array
    length: Array


class Draw(NamedTuple):
    """Errors of a population, for every individual and group.

    Attributes:
        mass, gyration: ratios, shape (count, groups).
        shift: fore, outboard and up per leg length, shape (count, groups, 3).
    """

    mass: Array
    gyration: Array
    shift: Array


class Change(NamedTuple):
    """Changes of bodies by a draw; principal axes are unchanged.

    Attributes:
        mass, inertia: factors of mass and principal moments, shape (count, bodies).
        shift: shift of the centre of mass, in the body's axes [m], shape (count, bodies, 3).
    """

    mass: Array
    inertia: Array
    shift: Array


def extents(source: str) -> dict[str, Extent]:
    """Return the ranges of the errors of each group.

    Args:
        source: "twins" for the residuals of Go2 and B2, the quadrupeds whose twins have meshes;
            "survey" for those of all surveyed quadrupeds, each held out of the trends; "paper" for
            the published ranges.

    Raises:
        DraftError: there is no such source.
    """
    if source == "paper":
        return PAPER
    if source not in SOURCES:
        cause = f"there are no inertia errors called '{source}'"
        raise DraftError(cause, suggest(source, SOURCES, "inertia errors"))
    robots = [
        real.groups
        for name, real in residuals().items()
        if real.population == "quadruped"
        and (name in TWINS if source == "twins" else name.startswith("survey/"))
    ]
    return {
        group: _extent([groups[group] for groups in robots if group in groups]) for group in GROUPS
    }


def _extent(rows: Sequence[Residual]) -> Extent:
    """Smallest and largest residuals of a group over robots."""
    gyration = [row.gyration for row in rows if row.gyration is not None]
    columns = (
        [row.mass for row in rows],
        gyration,
        *zip(*(row.com_shift for row in rows), strict=True),
    )
    return Extent(*((min(column), max(column)) for column in columns))


def draw(ranges: Mapping[str, Extent], count: int, rng: np.random.Generator) -> Draw:
    """Draw a population: uniform in the logarithms of both ratios and in each shift.

    Args:
        ranges: ranges of the errors of each group.
        count: number of individuals.
        rng: random number generator.
    """
    bounds = np.array([ranges[group] for group in GROUPS])  # (groups, 5, 2)
    bounds[:, :2] = np.log(bounds[:, :2])
    low, high = bounds[..., 0], bounds[..., 1]
    drawn = low + (high - low) * rng.random((count, *low.shape))
    return Draw(np.exp(drawn[..., 0]), np.exp(drawn[..., 1]), drawn[..., 2:])


def links(members: Sequence[LeggedRobot]) -> Links:
    """Return the links of designs of one topology.

    Raises:
        DraftError: one has other bodies than the first.
    """
    each = [_links(member) for member in members]
    for member, one in zip(members, each, strict=True):
        if one.names != each[0].names or not np.array_equal(one.group, each[0].group):
            cause = f"{member.name} has other bodies than {members[0].name}"
            remedy = "evaluate them separately; a family varies the numbers of one tree"
            raise DraftError(cause, remedy)
    stacked = (np.stack([getattr(one, name) for one in each]) for name in Links._fields[2:])
    return Links(each[0].names, each[0].group, *stacked)


def _links(member: LeggedRobot) -> Links:
    """Links of one design, without a leading axis."""
    model = mujoco.MjModel.from_xml_string(member.xml)
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    data.qpos[3] = 1.0
    mujoco.mj_kinematics(model, data)
    group, side = _groups(model, data, member)
    mass, at, weld = model.body_mass, data.xipos, model.body_weldid[1:]
    whole = np.bincount(weld, mass[1:], model.nbody)[weld]
    moment = [np.bincount(weld, mass[1:] * x, model.nbody)[weld] for x in at[1:].T]
    return Links(
        names=tuple(model.body(i).name for i in range(1, model.nbody)),
        group=group[weld],
        side=side[weld],
        turn=data.xmat[1:].reshape(-1, 3, 3).copy(),
        arm=at[1:] - np.stack(moment, axis=1) / whole[:, None],
        length=np.array(member.leg_length),
    )


def _groups(model: mujoco.MjModel, data: mujoco.MjData, member: LeggedRobot) -> tuple[Index, Array]:
    """Group and side of the bodies with joints, shape (all bodies,); the trunk's for the others."""
    group, side = np.zeros(model.nbody, dtype=np.int64), np.ones(model.nbody)
    hip, thigh, shank = (GROUPS.index(name) for name in ("hip_link", "thigh", "shank"))
    for i, (joints, foot) in enumerate(zip(member.leg_joints, member.feet, strict=True)):
        outboard = 1.0 if data.site(foot).xpos[1] > 0 else -1.0
        bodies = [int(model.joint(member.joints[joint]).bodyid[0]) for joint in joints]
        above = [model.geom(name).bodyid[0] for name in member.upper_legs[i]]
        knee = sum(body <= max(above, default=0) for body in bodies)
        for place, body in enumerate(bodies):
            group[body] = shank if place >= knee else thigh if place == knee - 1 else hip
            side[body] = outboard
    return group, side


def change(links: Links, member: Index, drawn: Draw) -> Change:
    """Return the changes of the bodies of designs by a population's errors.

    Args:
        links: links of the designs.
        member: index of each individual's design, shape (count,).
        drawn: errors of each individual; the four legs share them, mirrored on the right side.
    """
    mass, gyration, shift = (values[:, links.group] for values in drawn)
    shift = shift * links.length[member][:, None, None]
    shift[..., 1] *= links.side[member]
    shift += (gyration - 1.0)[..., None] * links.arm[member]
    return Change(
        mass=mass,
        inertia=mass * gyration**2,
        shift=np.einsum("nbji,nbj->nbi", links.turn[member], shift),
    )
