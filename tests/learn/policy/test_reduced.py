"""The policy of all legs as a small network of one robot, which does not limit what it observes."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

import draft
from draft.learn.bodies.legged import legged_robot
from draft.learn.bodies.padding import MOST, places, units
from draft.learn.bodies.slots import slots_of
from draft.learn.policy.controller import Controller
from draft.learn.policy.reduced import any_legs


@pytest.mark.parametrize("name", ["quadruped", "hexapod", "biped", "humanoid"])
def test_what_robots_observe_is_far_below_the_limit_of_the_training(name: str) -> None:
    """Also of one that is thrown, six times as fast as pushes of evaluations, and falls."""
    member = legged_robot(draft.load(name).resolve())
    policy = any_legs().of_robot(member)
    spec = mujoco.MjSpec.from_string(member.xml)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0, 0, 1))
    model = spec.compile()
    data = mujoco.MjData(model)
    controller = Controller(policy, model)
    controller.reset(data)
    data.qpos[2] = member.height
    entry = places("actor", policy.terms, slots_of(member)).entry
    unit = units("actor", member.leg_length)[entry[entry >= 0]]
    rate = math.sqrt(9.81 / member.leg_length)
    most = 0.0
    for step in range(round(3.0 / policy.timestep)):
        if step == round(1.0 / policy.timestep):
            data.qvel[:6] += np.array([3, 3, 1, 0, 0, 0]) * rate * member.leg_length
            data.qvel[3:6] += 4 * rate
        command = np.array([0.3, 0.0, 0.3]) * (rate * member.leg_length, 1.0, rate)
        seen = controller.observe(data, command)[entry >= 0]
        most = max(most, float(np.abs(seen * unit).max()))
        controller.step(data, command)
    assert 5.0 < most < MOST / 2
