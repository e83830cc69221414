"""Policies with random weights, as files that a training would have exported."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from draft.design import Design
from draft.learn.bodies.legged import legged_robot
from draft.learn.policy.matching import structure_of
from draft.learn.policy.onnx_file import of_layers
from draft.learn.policy.onnx_write import of_policy
from draft.learn.policy.policy import Policy

SEEN = ("base_ang_vel", "projected_gravity", "joint_pos", "joint_vel", "actions", "command")


def policy_file(
    file: Path, design: Design, terms: Sequence[str] = SEEN, delay: float = 0.0, history: int = 1
) -> Path:
    """Write a policy with these terms for a design; the test skips without ONNX."""
    pytest.importorskip("onnx", reason="needs the extra learn")
    model, random = design.build(), np.random.default_rng(0)
    member = legged_robot(design, model)
    count = len(member.joints)
    rolls = np.array(member.rolls or (False,) * count)
    lengths = dict.fromkeys(terms, 3) | {"joint_vel": count, "actions": count}
    lengths |= {"joint_pos": count - int(rolls.sum())}
    frames = {name: 1 if name == "command" else history for name in terms}
    lengths = {name: lengths[name] * frames[name] for name in terms}
    entries = sum(lengths.values())
    sizes = (entries, 24, 16, count)
    layers = [
        (random.normal(0, one**-0.5, (other, one)), random.normal(0, 0.1, other))
        for one, other in itertools.pairwise(sizes)
    ]
    mean, divisor = random.normal(0, 0.1, entries), random.uniform(0.5, 2, entries)
    peak = np.array(member.peak_torque)
    policy = Policy(
        file=file,
        network=of_layers(mean, divisor, layers, {}),
        design=member.name,
        stage="base",
        iterations=1,
        seed=0,
        joints=member.joints,
        structure=structure_of(member, model.mujoco),
        sign=np.ones(count),
        rolls=rolls,
        home=np.array(member.home),
        action_scale=np.where(rolls, 4.5, 0.175),
        stiffness=np.where(rolls, 0.0, 1.43 * peak),
        damping=0.071 * peak,
        servo_torque=peak,
        support=0.0,
        peak_torque=peak,
        stall_torque=np.array(member.stall_torque),
        no_load_speed=np.array(member.no_load_speed),
        control_period=0.02,
        timestep=0.005,
        contact_time=(0.01, 0.01),
        delay=(0.0, delay),
        velocity_noise=0.5,
        terms=tuple((name, lengths[name]) for name in terms),
        history=tuple(frames.values()),
        scan_points=np.zeros((0, 2)),
        scan_range=1.0,
        commands=(1.0, 0.6, 0.5),
        features=np.zeros(0),
        known=np.zeros((2, 0)),
        leg_length=member.leg_length,
        action_std=np.zeros(0),
    )
    file.write_bytes(of_policy(policy, member, policy.commands))
    return file
