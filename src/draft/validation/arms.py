"""A real robot twice: with the masses of its maker, and with those that Draft predicts.

Both have the kinematics, feet, motors and rotors of the twin (`draft.twins`), so that they differ
in the mass, the centre of mass and the inertia of each rigid body only.
"""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import mujoco
import numpy as np

from draft.design.battery import battery
from draft.design.electronics import electronics
from draft.learn.bodies.legged import LeggedRobot, legged_robot
from draft.model.texts import Text
from draft.twins.compare import Comparison
from draft.twins.links import counterparts
from draft.twins.vendor import rigid
from draft.values import Array, scalar

MASS, CENTRE, INERTIA = "mass", "centre", "inertia"
ALL = (MASS, CENTRE, INERTIA)


def predicted(found: Comparison) -> LeggedRobot:
    """The robot as Draft predicts it; both have its battery and electronics.

    Raises:
        DraftError: it has fewer than two legs, a joint without a motor, or no mirror image.
    """
    design = found.design
    power = battery(design)
    return replace(
        legged_robot(design, found.model),
        battery=tuple(map(scalar, (power.energy, *power.band))),
        electronics=(scalar(electronics(design).power),),
    )


def by_maker(
    found: Comparison, what: Collection[str] = ALL, groups: Collection[str] | None = None
) -> LeggedRobot:
    """The robot with the masses of its maker.

    A body of which the maker's file states no mass keeps the predicted one. MuJoCo raises inertias
    that no solid has.

    Args:
        found: the twin.
        what: which of `ALL` are the maker's; the others are predicted. A predicted inertia scales
            with the maker's mass.
        groups: groups of links that are the maker's, such as "trunk"; None for all.

    Raises:
        DraftError: as `predicted`.
    """
    member = predicted(found)
    spec = mujoco.MjSpec.from_string(member.xml)
    spec.compiler.balanceinertia = True
    model = found.model.mujoco
    data = mujoco.MjData(model)
    data.qpos[:], data.qpos[3] = 0.0, 1.0
    mujoco.mj_forward(model, data)
    reduced = found.files.reduced
    group = {pair.name: pair.group for pair in found.links}
    total = 0.0
    for body, index in counterparts(reduced, model, found.joints):
        welded = np.flatnonzero(model.body_weldid == model.body_weldid[index]).tolist()
        own = _combined(model, data, welded)
        chosen = body.name not in found.unstated
        if chosen and (groups is None or group[body.name] in groups):
            theirs = rigid(reduced.description, body.links, reduced.poses)
            own = _mixed(own, (theirs.mass, np.array(theirs.com), np.array(theirs.inertia)), what)
        total += own[0]
        for i in welded:
            _set(spec.body(model.body(i).name), model, data, i, own if i == index else None)
    return replace(member, text=Text(spec.to_xml()), mass=total)


Rigid = tuple[float, Array, Array]  # Mass [kg], centre [m] and inertia about it [kg m2].


def _combined(model: mujoco.MjModel, data: mujoco.MjData, bodies: list[int]) -> Rigid:
    """Mass properties of welded bodies in the world's frame."""
    masses, centres = model.body_mass[bodies], data.xipos[bodies]
    mass = float(masses.sum())
    centre = masses @ centres / mass
    inertia = np.zeros((3, 3))
    for i, m, c in zip(bodies, masses, centres, strict=True):
        turn = data.ximat[i].reshape(3, 3)
        offset = c - centre
        inertia += turn @ np.diag(model.body_inertia[i]) @ turn.T
        inertia += m * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    return mass, centre, inertia


def _mixed(own: Rigid, theirs: Rigid, what: Collection[str]) -> Rigid:
    mass = theirs[0] if MASS in what else own[0]
    centre = theirs[1] if CENTRE in what else own[1]
    source = theirs if INERTIA in what else own
    return mass, centre, source[2] * (mass / source[0])


def _set(
    body: mujoco.MjsBody, model: mujoco.MjModel, data: mujoco.MjData, i: int, own: Rigid | None
) -> None:
    """State the inertia of a body; that of all welded ones is with the first."""
    body.explicitinertial = True
    if own is None:
        body.mass, body.inertia, body.fullinertia[0] = 0.0, np.zeros(3), np.nan
        return
    turn, place = data.xmat[i].reshape(3, 3), data.xpos[i]
    inertia = turn.T @ own[2] @ turn
    body.mass, body.ipos = own[0], turn.T @ (own[1] - place)
    body.iquat = (1.0, 0.0, 0.0, 0.0)
    body.fullinertia = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
