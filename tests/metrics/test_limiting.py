"""What limits a capability: its terms, by name, and what a change of them does."""

from __future__ import annotations

import math

import numpy as np
import pytest

import draft
from draft.errors import DraftError
from draft.metrics import METRICS, Limit, limits, of_design
from draft.metrics.limiting import where
from draft.values import scalar
from tests.metrics.test_registry import SHIPPED, shipped

STATED = (
    *("peak_torque", "no_load_speed", "rated_torque", "mass", "gear_ratio", "rotor_inertia"),
    *("radius", "length"),
)
# Quantity of an actuator that a limit is about.
QUANTITY = {
    "rated torque": "rated_torque",
    "peak torque": "peak_torque",
    "no-load speed": "no_load_speed",
    "torque-speed line": "peak_torque",
}


def value(design: draft.Design, name: str) -> float:
    return scalar(of_design(design, [name])[name])


@pytest.mark.parametrize(("name", "label"), SHIPPED)
def test_the_limit_that_binds_is_the_metric(name: str, label: str | None) -> None:
    for load in ({}, {"payload": 2.0}):
        base = shipped(name, label)
        design = base.spec.resolve(base.values, load)
        found = limits(design)
        assert {"payload_rated", "jump_height", "top_speed"} <= {*found}
        for metric, own in found.items():
            values = [one.value for one in own]
            assert values == sorted(values, reverse=METRICS[metric].better == "less")
            if metric != "endurance_standing":
                assert own[0].value == pytest.approx(value(design, metric), rel=1e-12)
        # All consumers of the battery together, but for the heat of joints that hold nothing.
        draws = sum(1 / one.value for one in found["endurance_standing"])
        assert 1 / draws == pytest.approx(value(design, "endurance_standing"), rel=1e-6)


@pytest.mark.parametrize(
    "metric",
    ["payload_rated", "payload_peak", "torque_margin", "standing_torque_rated", "jump_height"],
)
def test_more_of_what_limits_helps_and_more_of_another_does_not(metric: str) -> None:
    spec = draft.load("humanoid")
    usual = spec.resolve()
    base = {  # All numbers of the actuators are stated, so that one changes alone.
        f"actuators.{name}.{quantity}": scalar(getattr(one, quantity))
        for name, one in usual.actuators.items()
        for quantity in STATED
    } | {"actuators.large.no_load_speed": 20.0}
    design = spec.resolve(base)
    first = limits(design)[metric][0]
    assert first.joints == ("left_knee", "right_knee")
    for actuator in design.actuators:
        key = f"actuators.{actuator}.{QUANTITY[first.quantity]}"
        after = value(spec.resolve(base, {key: 1.1 * float(base[key])}), metric)
        gain = (after - value(design, metric)) * (-1 if metric == "standing_torque_rated" else 1)
        assert gain > 1e-6 if actuator == first.actuator else gain == pytest.approx(0.0, abs=1e-9)


def test_a_leg_that_is_too_short_limits_the_speed_and_a_faster_knee_does_not_help() -> None:
    spec = draft.load("quadruped")
    cheetah, bear = (spec.resolve(name) for name in ("cheetah", "bear"))
    assert limits(cheetah, ["top_speed"])["top_speed"][0].quantity == "leg length"
    assert limits(bear, ["top_speed"])["top_speed"][0].quantity == "no-load speed"
    for design, helps in ((cheetah, False), (bear, True)):
        speed = scalar(design.actuators["leg"].no_load_speed)
        faster = spec.resolve(design.values, {"actuators.leg.no_load_speed": 1.01 * speed})
        assert (value(faster, "top_speed") > value(design, "top_speed")) == helps


def test_with_a_payload_the_torque_at_speed_limits_too() -> None:
    loaded = draft.load("quadruped").resolve("cheetah", {"payload": 100.0})
    first, *_ = limits(loaded, ["top_speed"])["top_speed"]
    assert (first.quantity, first.actuator) == ("torque-speed line", "leg")


def test_legs_that_are_copies_are_one_limit_and_share_a_word() -> None:
    own = limits(draft.load("quadruped").resolve("bear"), ["payload_rated"])["payload_rated"]
    assert own[0].joints == ("FL_knee", "FR_knee", "RL_knee", "RR_knee")
    assert where(own[0], own) == "knee"
    front, hind = (Limit(1.0, "torque", (f"{leg}L_knee", f"{leg}R_knee")) for leg in "FR")
    assert where(front, (front, hind)) == "FL_knee, FR_knee"
    assert where(Limit(1.0, "torque", ("knee_left", "hip_right")), ()) == "knee_left, hip_right"
    assert where(Limit(1.0, "leg length"), own) == ""


def test_what_has_no_leg_has_no_limits_and_several_designs_are_refused() -> None:
    crane = draft.load("quadruped")
    many = crane.resolve({"thigh_length": np.array([0.2, 0.3])})
    with pytest.raises(DraftError, match="limits are those of one design"):
        limits(many)
    assert limits(crane.resolve(), ["mass"]) == {}


def test_a_joint_without_a_lever_arm_limits_nothing() -> None:
    own = limits(draft.load("humanoid").resolve())["payload_rated"]
    assert all(math.isfinite(one.value) and abs(one.value) < 1e9 for one in own)
    assert len(own) == 1  # All but the knee are above the foot.
