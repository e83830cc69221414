"""Vertical push-off from a squat, driven by the knees along their torque-speed lines.

The trunk rises above fixed feet, with the hips above the ankles. The torque of each knee is
min(tau_peak, tau_stall (1 - w / w_no_load)), at least zero, with tau_stall = tau_peak unless its
class states a corner. Its work becomes potential energy, kinetic energy, and energy of the rotors
of knees and hips. In the squat, the hip is half of thigh plus shank above the ankle, or higher if
the range of the knee requires it; the push-off ends at the straightest knee. The robot takes off
where its height plus v^2 / 2g is largest: beyond it the floor would pull.

Neglected are the work of hips, ankles and arms, the inertia of the links of the legs (all mass
moves with the trunk), friction, and the limits of battery and current.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from draft.design import Design
from draft.design.actuators import Actuator
from draft.design.cached import once
from draft.design.crouch import bend_at
from draft.design.legs import GRAVITY, Leg, count, legs
from draft.metrics.limiting import Limit, at_joint
from draft.metrics.registry import metric
from draft.values import Value, both, clip, cos, divide, maximum, minimum, sin, sqrt, where

SQUAT = 0.5
# The height is within 1 % of that with a thousand steps for the shipped robots.
STEPS = 24


class PushOff(NamedTuple):
    """Height above standing straight [m], and largest total power of the knees per mass [W/kg]."""

    height: Value
    power: Value


@once
def push_off(design: Design) -> PushOff:
    """Push-off of the worst kind of leg, each with its share of the mass; NaN without knees."""
    return push_off_of(design, design.mass)


def push_off_of(design: Design, mass: Value) -> PushOff:
    """Push-off of a design with another mass.

    Args:
        design: one design, or N.
        mass: mass that is moved [kg].
    """
    found = _of_each(design, mass)
    if not found or len(found) < len(legs(design)):
        return PushOff(math.nan, math.nan)
    return PushOff(minimum(*(f.height for _, f in found)), minimum(*(f.power for _, f in found)))


def _of_each(design: Design, mass: Value) -> list[tuple[Leg, PushOff]]:
    """Push-off of each kind of leg whose knee is driven, with its share of the mass."""
    share = mass / count(design) if legs(design) else mass
    return [
        (leg, _push_off(leg, leg.knee.actuator, share))
        for leg in legs(design)
        if leg.knee.actuator is not None
    ]


def _limits(design: Design) -> Iterator[Limit]:
    for leg, found in _of_each(design, design.mass):
        if leg.knee.actuator is not None:
            yield at_joint(leg.knee, leg.knee.actuator, "torque-speed line", found.height)


@metric(
    unit="m",
    formula="max of z + v^2 / 2g of a push-off with min(tau_peak, tau_stall (1 - w / w_no_load)) "
    "at the knees",
    source="energy balance over the knees' bend; torque-speed line as in arXiv 2609.38405",
    better="more",
    limits=_limits,
    base="floating",
)
def jump_height(design: Design) -> Value:
    """Rise of the trunk above standing straight, from a squat of L / 2 [m].

    0 if the knees cannot lift the robot.
    """
    return push_off(design).height


@metric(
    unit="W/kg",
    formula="max of n min(tau_peak, tau_stall (1 - w / w_no_load)) w / M",
    source="as jump_height",
    better="more",
    base="floating",
)
def squat_power(design: Design) -> Value:
    """Largest power of the knees during that push-off, per mass [W/kg]."""
    return push_off(design).power


def _push_off(leg: Leg, knee: Actuator, mass: Value) -> PushOff:
    """Integrate over the bend of the knee by the implicit midpoint rule.

    The variable is the bend instead of time, and the state is the work: dW/dbend = tau. The energy
    balance (A = half the inertia about the knee) is A w^2 = W - m g rise. In the middle of a step w
    solves a quadratic where the torque falls linearly with w, and is a square root below a corner.
    """
    a, b, low = leg.thigh, leg.shank, leg.bend[0]
    start = clip(bend_at(SQUAT * (a + b), a, b), *leg.bend)
    step = (start - low) / STEPS
    squares, twice = a * a + b * b, 2.0 * a * b
    floor = span = sqrt(squares + twice * cos(start))
    weight, slope = GRAVITY * mass, 1.0 / knee.no_load_speed
    # Work of a step at peak torque, and on the line from the stall torque.
    gain, line = knee.peak_torque * step, knee.stall_torque * step
    steep = knee.stall_torque / knee.peak_torque if knee.has_corner else 1.0
    work: Value = 0.0
    apex, power = span, 0.0 * mass
    alive = step > 0
    c, s = cos(start - step / 2), sin(start - step / 2)
    turn_c, turn_s = cos(step), sin(step)
    for _ in range(STEPS):
        span = sqrt(squares + twice * c)
        lever = twice * s / (2.0 * span)
        lean = (b * b + 0.5 * twice * c) / (span * span)
        inertia = knee.armature + leg.hip_armature * lean * lean
        half = 0.5 * (mass * lever * lever + inertia)
        lift = weight * (span - floor)
        left = work + 0.5 * gain - lift
        alive = both(alive, left > 0)
        speed = _middle(work + 0.5 * line - lift, 0.5 * line * slope, half)
        torque_share = clip(steep * (1.0 - speed * slope), 0.0, 1.0)
        if knee.has_corner:
            flat = _middle(left, 0.0, half)
            speed = where(flat < knee.corner_speed, flat, speed)
            torque_share = where(flat < knee.corner_speed, 1.0, torque_share)
            # A knee that turns faster has passed the corner, at full torque.
            passed = both(alive, flat >= knee.corner_speed)
            power = where(passed, maximum(power, knee.corner_speed), power)
        rise = lever * speed
        apex = where(alive, maximum(apex, span + rise * rise / (2.0 * GRAVITY)), apex)
        power = where(alive, maximum(power, torque_share * speed), power)
        work = work + gain * torque_share
        c, s = c * turn_c + s * turn_s, s * turn_c - c * turn_s
    top = sqrt(squares + twice * cos(low))
    height = maximum(apex - top, 0.0)
    return PushOff(height, power * divide(knee.peak_torque, mass))


def _middle(left: Value, drop: Value, half: Value) -> Value:
    """Speed w in the middle of a step: half w^2 = left - drop w."""
    return divide(2.0 * left, drop + sqrt(maximum(drop * drop + 4.0 * half * left, 0.0)))
