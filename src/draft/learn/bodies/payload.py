"""Payload of an evaluation: a block on the trunk of a robot that was trained without it.

It is the block of `draft.spec.payload`: a cube on the highest point of the trunk, over the middle
of its outline. It is added to the elements of the robot's MJCF, so that the run needs neither its
spec nor its design, and changes nothing else: policy, commands and gains are those of the training.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from draft.errors import DraftError
from draft.learn.bodies.legged import LeggedRobot, with_one_template
from draft.model.texts import Text
from draft.model.xml import parse
from draft.spec.payload import MASS, USUAL_DENSITY
from draft.spec.primitives.box import BoxPart


def with_payload(
    members: Sequence[LeggedRobot], mass: float, density: float = USUAL_DENSITY
) -> tuple[LeggedRobot, ...]:
    """Return robots with a block on the trunk; the robots themselves if it weighs nothing.

    Args:
        members: the robots.
        mass: mass of the block [kg].
        density: its mass over volume [kg/m3].

    Raises:
        DraftError: a robot's model is not as Draft writes it.
    """
    if mass == 0:
        return tuple(members)
    return with_one_template([_loaded(member, mass, density) for member in members])


def _loaded(member: LeggedRobot, mass: float, density: float) -> LeggedRobot:
    try:
        root = parse(member.xml)
        parts = {part.tag: part for part in root.children}
        (trunk,), (mesh,) = parts["worldbody"].children, parts["asset"].children
        points = np.array(mesh.attributes["vertex"].split(), dtype=np.float64).reshape(-1, 3)
    except (ValueError, KeyError):
        cause = f"the model of {member.name} is not as this version of Draft writes it"
        raise DraftError(cause, "train it again, or evaluate it without a payload") from None
    low, high = points.min(axis=0), points.max(axis=0)
    half = (mass / density) ** (1 / 3) / 2
    x, y = (low[:2] + high[:2]) / 2
    name = MASS
    while f'<body name="{name}"' in member.xml:
        name += "_"
    trunk.add("body", name=name).add(
        "geom",
        name=f"{name}_box",
        type="box",
        pos=(float(x), float(y), float(high[2]) + half),
        size=(half, half, half),
        density=density,
        group=2,
        contype=0,
        conaffinity=1,
        rgba=BoxPart.colors["carried"],
    )
    return replace(member, text=Text(root.text()), mass=member.mass + mass)
