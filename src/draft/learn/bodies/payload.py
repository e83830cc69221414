"""Payload of an evaluation: a block on the trunk of a robot that was trained without it.

It is the block of `draft.spec.payload`: a cube on the highest point of the trunk, over the middle
of its outline. It is written into the MJCF of the robot, so that the run needs neither its spec nor
its design, and changes nothing else: policy, commands and gains are those of the training.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np

from draft.learn.bodies.legged import LeggedRobot
from draft.spec.payload import MASS, USUAL_DENSITY
from draft.values import Array

_END = "  </worldbody>"


def with_payload(
    members: Sequence[LeggedRobot], mass: float, density: float = USUAL_DENSITY
) -> tuple[LeggedRobot, ...]:
    """Return robots with a block on the trunk; the robots themselves if it weighs nothing.

    Args:
        members: the robots.
        mass: mass of the block [kg].
        density: its mass over volume [kg/m3].
    """
    if mass == 0:
        return tuple(members)
    return tuple(_loaded(member, mass, density) for member in members)


def _loaded(member: LeggedRobot, mass: float, density: float) -> LeggedRobot:
    model = mujoco.MjModel.from_xml_string(member.xml)
    points = _trunk_points(model, member.trunk)
    low, high = points.min(axis=0), points.max(axis=0)
    half = (mass / density) ** (1 / 3) / 2
    x, y = (low[:2] + high[:2]) / 2
    name = MASS
    names = {model.body(i).name for i in range(model.nbody)}
    while name in names:
        name += "_"
    block = (
        f'      <body name="{name}">\n'
        f'        <geom name="{name}_box" type="box" pos="{x:.10g} {y:.10g} {high[2] + half:.10g}" '
        f'size="{half:.10g} {half:.10g} {half:.10g}" density="{density:.10g}" group="2" '
        'contype="0" conaffinity="1" rgba="0.36 0.55 0.47 1"/>\n'
        "      </body>\n"
    )
    # The trunk is the only body of the world, and ends in the line before the end of the world.
    before, end, after = member.xml.rpartition(_END)
    inside, trunk_end, rest = before.rpartition("    </body>")
    xml = inside + block + trunk_end + rest + end + after
    return replace(member, xml=xml, mass=member.mass + mass)


def _trunk_points(model: mujoco.MjModel, trunk: str) -> Array:
    """Vertices of the trunk's mesh in the frame of the trunk [m], shape (n, 3)."""
    body = model.body(trunk).id
    found = []
    for geom in range(model.ngeom):
        mesh = model.geom_dataid[geom]
        if model.geom_bodyid[geom] != body or mesh < 0:
            continue
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
        points = model.mesh_vert[first : first + count] @ rotation.reshape(3, 3).T
        found.append(points + model.geom_pos[geom])
    return np.concatenate(found)
