"""One push-off straight up from a squat, by the torque-speed lines of the knees. Closed form.

The trunk rises above feet that stay where they are, hips above ankles. All knees give
tau = tau_peak (1 - w / w_no_load), never less than zero, and the work goes into height, speed, and
the rotors of knees and hips. The squat spans half of thigh plus shank, or as much more as the
knee's range asks for; the push ends as straight as the knee gets. The robot leaves the floor where
its height plus v^2 / 2g is largest: from there on the floor would have to pull.

Neglected: what the hips, ankles and arms give, the inertia of the legs' own links (all mass moves
with the trunk), friction, and limits of battery and current.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from draft.design import Design
from draft.design.actuators import Actuator
from draft.design.cached import once
from draft.design.crouch import bend_at
from draft.design.legs import GRAVITY, Leg, count, legs
from draft.metrics.registry import metric
from draft.values import Value, both, clip, cos, divide, maximum, minimum, sin, sqrt, where

SQUAT = 0.5
# Against a thousand steps: within 1 % of the height for the shipped robots.
STEPS = 24


class PushOff(NamedTuple):
    """Height above standing straight [m], largest power of all knees per mass [W/kg]."""

    height: Value
    power: Value


@once
def push_off(design: Design) -> PushOff:
    """The push-off; of several kinds of leg, each with its share of the mass, the worst."""
    n = count(design)
    found = [
        _push_off(leg, leg.knee.actuator, design.mass / n)
        for leg in legs(design)
        if leg.knee.actuator is not None
    ]
    if not found or len(found) < len(legs(design)):
        return PushOff(math.nan, math.nan)
    return PushOff(minimum(*(f.height for f in found)), minimum(*(f.power for f in found)))


@metric(
    unit="m",
    formula="max of z + v^2 / 2g of a push-off with tau_peak (1 - w / w_no_load) at the knees",
    source="energy balance over the knees' bend; torque-speed line as in arXiv 2609.38405",
    better="more",
)
def jump_height(design: Design) -> Value:
    """Rise of the trunk above standing straight, from a squat of L / 2 [m].

    0 where the knees cannot lift it.
    """
    return push_off(design).height


@metric(
    unit="W/kg",
    formula="max of n tau_peak (1 - w / w_no_load) w / M",
    source="as jump_height",
    better="more",
)
def squat_power(design: Design) -> Value:
    """Largest power of the knees during that push-off, per mass [W/kg]."""
    return push_off(design).power


def _push_off(leg: Leg, knee: Actuator, mass: Value) -> PushOff:
    """Integrate over the bend of the knee, by the implicit midpoint rule.

    With the bend as the variable and not time, the work is the state: dW/dbend = tau. The energy
    (A = half the inertia about the knee) is A w^2 = W - m g rise, and w in the middle of a step
    solves a quadratic, as the torque falls with w on a straight line.
    """
    a, b, low = leg.thigh, leg.shank, leg.bend[0]
    start = clip(bend_at(SQUAT * (a + b), a, b), *leg.bend)
    step = (start - low) / STEPS
    squares, twice = a * a + b * b, 2.0 * a * b
    floor = span = sqrt(squares + twice * cos(start))
    weight, slope = GRAVITY * mass, 1.0 / knee.no_load_speed
    gain = knee.peak_torque * step
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
        left = work + 0.5 * gain - weight * (span - floor)
        alive = both(alive, left > 0)
        drop = 0.5 * gain * slope
        speed = divide(2.0 * left, drop + sqrt(maximum(drop * drop + 4.0 * half * left, 0.0)))
        torque_share = clip(1.0 - speed * slope, 0.0, 1.0)
        rise = lever * speed
        apex = where(alive, maximum(apex, span + rise * rise / (2.0 * GRAVITY)), apex)
        power = where(alive, maximum(power, torque_share * speed), power)
        work = work + gain * torque_share
        c, s = c * turn_c + s * turn_s, s * turn_c - c * turn_s
    top = sqrt(squares + twice * cos(low))
    height = maximum(apex - top, 0.0)
    return PushOff(height, power * divide(knee.peak_torque, mass))
