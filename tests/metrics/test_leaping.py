"""The push-off behind the jump, against its equation of motion and by the laws of energy."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.design.legs import count, legs
from draft.metrics import leaping
from tests.metrics.test_physics import tuned
from tests.metrics.test_registry import SHIPPED, shipped


def simulated(design: draft.Design, step: float = 2e-5) -> tuple[float, float]:
    """Height and power of the push-off from the equation of motion in time (Runge, Kutta)."""
    (kind,) = legs(design)
    knee: Any = kind.knee.actuator
    a, b, mass, g = float(kind.thigh), float(kind.shank), float(design.mass), 9.81
    start = math.acos(((leaping.SQUAT * (a + b)) ** 2 - a * a - b * b) / (2 * a * b))

    def span(x: float) -> float:
        return math.sqrt(a * a + b * b + 2 * a * b * math.cos(start - x))

    def lean(x: float) -> float:
        bend = start - x
        return math.atan2(b * math.sin(bend), a + b * math.cos(bend))

    def slope(f: Callable[[float], float], x: float, h: float = 1e-5) -> float:
        return (f(x + h) - f(x - h)) / (2 * h)

    def inertia(x: float) -> float:
        turned = kind.hip_armature * slope(lean, x) ** 2
        return float(mass * slope(span, x) ** 2 + knee.armature + turned)

    def torque(w: float) -> float:
        free, corner = knee.no_load_speed, knee.corner_speed
        return float(knee.peak_torque * min(1.0, max(0.0, (free - w) / (free - corner))))

    def rate(x: float, w: float) -> tuple[float, float]:
        push = torque(w) - mass * g * slope(span, x) - slope(inertia, x, 1e-4) * w * w / 2
        return w, push / inertia(x)

    x, w, apex, power = 0.0, 0.0, span(0.0), 0.0
    while x < start - 1e-3:
        k1 = rate(x, w)
        k2 = rate(x + step / 2 * k1[0], w + step / 2 * k1[1])
        k3 = rate(x + step / 2 * k2[0], w + step / 2 * k2[1])
        k4 = rate(x + step * k3[0], w + step * k3[1])
        x += step * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0]) / 6
        w += step * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1]) / 6
        rise = slope(span, x) * w
        apex = max(apex, span(x) + rise * rise / (2 * g))
        power = max(power, torque(w) * w / mass)
    return apex - (a + b), power


@pytest.mark.parametrize("corner", [0.0, 5.0, "trend"])
def test_the_push_off_is_that_of_the_equation_of_motion(
    corner: float | str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def hopper() -> draft.Design:
        return draft.load("hopper").resolve({"actuators.leg.corner_speed": corner})

    height, power = simulated(hopper())
    rough = leaping.push_off(hopper())
    assert rough.height == pytest.approx(height, rel=0.005)
    assert rough.power == pytest.approx(power, rel=0.005)
    monkeypatch.setattr(leaping, "STEPS", 2000)
    fine = leaping.push_off(hopper())
    assert fine.height == pytest.approx(height, rel=2e-4)
    assert fine.power == pytest.approx(power, rel=2e-4)


@pytest.mark.parametrize(("name", "label"), SHIPPED)
def test_with_the_ideal_motor_all_work_is_height(
    name: str, label: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(leaping, "STEPS", 2000)
    ideal = tuned(shipped(name, label), no_load_speed=1e9, armature=0.0, peak_torque=3.0)
    kind, n = legs(ideal)[0], count(ideal)
    a, b = kind.thigh, kind.shank
    span = leaping.SQUAT * (a + b)
    bend = math.acos((span**2 - a**2 - b**2) / (2 * a * b))
    work = n * kind.knee.actuator.peak_torque * bend  # type: ignore[union-attr]
    expected = work / (9.81 * ideal.mass) - (a + b - span)
    # The apex is looked for in the middle of each step: half a step's work is missing.
    missing = work / leaping.STEPS / 2 / (9.81 * ideal.mass)
    assert leaping.jump_height(ideal) == pytest.approx(expected - missing, rel=1e-5)


@given(st.floats(1.0, 3.0))
def test_a_faster_or_lighter_geared_motor_jumps_higher(by: float) -> None:
    design = draft.load("hopper").resolve()
    height = leaping.jump_height(design)
    assert leaping.jump_height(tuned(design, no_load_speed=by)) >= height
    assert leaping.jump_height(tuned(design, peak_torque=by)) >= height
    assert leaping.jump_height(tuned(design, armature=by)) <= height


@pytest.mark.parametrize(("name", "label"), SHIPPED)
def test_power_stays_below_the_motors_peak(name: str, label: str | None) -> None:
    design = shipped(name, label)
    knees = [kind.knee.actuator for kind in legs(design)]
    most = max(knee.peak_power for knee in knees if knee is not None)
    assert 0 < leaping.squat_power(design) <= count(design) * most / design.mass * (1 + 1e-12)


def test_a_knee_too_weak_to_rise_does_not_jump() -> None:
    weak = tuned(draft.load("hopper").resolve(), peak_torque=0.02)
    assert leaping.jump_height(weak) == 0.0
