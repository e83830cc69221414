"""Payload of an evaluation: a block on the trunk of a robot that was trained without it.

It is the block of `draft.spec.payload`: a cube on the highest point of the trunk, over the middle
of its outline. MuJoCo adds it to the robot's MJCF, because a run keeps the bodies that were trained
and not their spec, whose laws may have changed since. Policy, commands and gains are those of the
training.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np

from draft.errors import DraftError
from draft.learn.bodies.legged import LeggedRobot
from draft.model.decimals import rounded
from draft.model.xml import parse
from draft.spec.payload import MASS, USUAL_DENSITY
from draft.spec.primitives.box import BoxPart


def with_payload(members: Sequence[LeggedRobot], mass: float) -> tuple[LeggedRobot, ...]:
    """Return robots with a block on the trunk; the robots themselves if it weighs nothing.

    Args:
        members: the robots.
        mass: mass of the block [kg].

    Raises:
        DraftError: a robot's model is not as Draft writes it.
    """
    if mass == 0:
        return tuple(members)
    return tuple(replace(one, mass=one.mass + mass, block=_block(one, mass)) for one in members)


def _block(member: LeggedRobot, mass: float) -> tuple[float, ...]:
    try:
        (mesh,) = next(x for x in parse(member.xml).children if x.tag == "asset").children
        points = np.array(mesh.attributes["vertex"].split(), dtype=np.float64).reshape(-1, 3)
    except (ValueError, KeyError, StopIteration):
        cause = f"the model of {member.name} is not as this version of Draft writes it"
        raise DraftError(cause, "train it again, or evaluate it without a payload") from None
    low, high = points.min(axis=0), points.max(axis=0)
    half = (mass / USUAL_DENSITY) ** (1 / 3) / 2
    middle = [*(low[:2] + high[:2]) / 2, high[2] + half]
    return tuple(rounded(np.array([half, *middle])).tolist())


def model_spec(member: LeggedRobot) -> mujoco.MjSpec:
    """Return the robot's model for MuJoCo to edit, with the block on its trunk."""
    spec = mujoco.MjSpec.from_string(member.xml)
    if member.block:
        name = MASS
        while spec.body(name) is not None:
            name += "_"
        spec.body(member.trunk).add_body(name=name).add_geom(
            name=f"{name}_box",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=member.block[1:],
            size=member.block[:1] * 3,
            density=USUAL_DENSITY,
            group=2,
            contype=0,
            rgba=BoxPart.colors["carried"],
        )
    return spec
