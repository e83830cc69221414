"""Which policy drives a design, and what is said outside its region of validity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from draft.errors import DraftError
from draft.learn.bodies.features import FEATURES, UNITS, features, readable
from draft.learn.bodies.legged import REFERENCE_LEG, LeggedRobot, legged_robot
from draft.learn.policy.policy import FAMILY, designs, open_policy, policy
from draft.learn.policy.region import Region
from draft.learn.policy.validity import ANY_NAME, Fit, fit, train_command
from draft.learn.policy.walk import Walk
from draft.model.model import preview
from draft.values import scalar

# Ranges of the training of the shipped family.
TRAINED = {
    "thigh_length": (0.2, 0.36),
    "shank_length": (0.2, 0.36),
    "payload": (0.5, 12.0),
    "actuators.leg.peak_torque": (60.0, 180.0),
    "actuators.leg.no_load_speed": (15.0, 45.0),
}
FAMILY_NAME = "the family of quadrupeds"
Values = Mapping[str, float] | str


SPEC = draft.load("quadruped")


def fitted(values: Values, skill: str = "walk") -> Fit:
    return fit(preview(SPEC.resolve(values)), skill)


def robot(values: Values = "cheetah") -> LeggedRobot:
    return legged_robot(SPEC.resolve(values))


@pytest.mark.parametrize("name", designs())
def test_a_design_with_a_policy_gets_it_unchanged(name: str) -> None:
    found = fitted(name)
    assert found.inside
    assert found.warning == ""
    assert found.policy.file == policy(name).file
    np.testing.assert_allclose(found.policy.stiffness, policy(name).stiffness, rtol=1e-6)


@settings(max_examples=20)
@given(st.fixed_dictionaries({name: st.floats(0.1, 0.9) for name in TRAINED}))
def test_a_body_between_the_ends_of_the_training_gets_the_policy_of_the_family(
    shares: Mapping[str, float],
) -> None:
    values = {name: low + shares[name] * (high - low) for name, (low, high) in TRAINED.items()}
    found = fitted(values, "run")
    # A corner of the box can lack accepted designs, so a feature can be just outside.
    assert found.name == FAMILY_NAME
    assert all(gap.size < 0.1 for gap in found.outside)
    assert found.policy.file == FAMILY


def test_a_longer_thigh_is_inside_the_family_which_observes_it() -> None:
    found = fitted({"thigh_length": 0.3})
    assert found.inside
    expected = features(robot({"thigh_length": 0.3}))
    np.testing.assert_allclose(found.policy.features, expected, rtol=1e-9)


def test_outside_the_family_it_observes_the_nearest_end_and_names_the_number() -> None:
    found = fitted({"actuators.leg.peak_torque": 400.0})
    assert not found.inside
    assert "peak torque 400 N m (trained at " in found.warning
    assert found.warning.count("peak torque") == 1  # Motors of all joints are the same.
    low, high = found.policy.known
    assert ((found.policy.features >= low) & (found.policy.features <= high)).all()
    named = [FEATURES.index(gap.name) for gap in found.outside]
    ends = found.policy.features[named]
    assert ((ends == low[named]) | (ends == high[named])).all()


@pytest.mark.parametrize(
    ("values", "friction"), [({"friction_loss": 60.0}, 60.5), ({"damping": 1.0}, 40.1)]
)
@pytest.mark.parametrize("skill", ["walk", "climb"])
def test_far_more_friction_than_in_the_training_is_outside(
    values: Mapping[str, float], friction: float, skill: str
) -> None:
    found = fitted({f"actuators.leg.{name}": value for name, value in values.items()}, skill)
    (gap,) = found.outside
    assert gap.name.startswith("friction of ")
    assert gap.value == pytest.approx(friction, abs=0.05)
    assert gap.high == pytest.approx(0.127 + 0.0127 * 40.0)  # that of the cheetah
    assert "friction" in found.warning
    assert "(trained at 0.635)" in found.warning


def test_somewhat_more_friction_is_inside() -> None:
    assert fitted({"actuators.leg.friction_loss": 1.0, "actuators.leg.damping": 0.05}).inside
    weakest = {"actuators.leg.peak_torque": 60.0, "actuators.leg.no_load_speed": 45.0}
    assert "friction" not in fitted({**weakest, "thigh_length": 0.28}).warning


def test_a_load_that_no_policy_knew_is_outside() -> None:
    found = fitted({"payload": 120.0}, "climb")
    assert not found.inside
    assert any(gap.name == "mass" and gap.unit == "kg" for gap in found.outside)


def test_the_region_of_bodies_holds_what_lies_between_them() -> None:
    short, middle, long = (robot({"thigh_length": x}) for x in (0.22, 0.26, 0.3))
    region = Region.of("family", [features(short), features(long)], long)
    known = dict(zip(FEATURES, region.holds(features(middle)), strict=True))
    assert known["leg length"]
    assert known["peak torque of knee"]
    assert region.holds(features(long)).all()
    far = robot({"thigh_length": 0.36})
    assert region.includes(long, features(long), range(12))
    assert not region.includes(far, features(far), range(12))
    limited = robot({"thigh_length": 0.3, "actuators.leg.corner_speed": 20.0})
    assert region.holds(features(limited)).all()  # No feature shows a limit of the current.
    assert not region.includes(limited, features(limited), range(12))
    both = Region.of("family", [features(long)], long, limited)
    assert both.includes(
        limited, features(limited), range(12)
    )  # Some bodies of the training had a limit.
    gap = {one.name: one for one in region.outside(far, features(far))}["leg length"]
    assert str(gap) == "leg length 0.59 m (trained at 0.45 to 0.53)"
    assert gap.size == pytest.approx(np.log(0.59 / 0.53))


def test_the_ends_of_a_feature_are_said_to_be_for_the_size_of_the_design() -> None:
    (gap,) = (one for one in fitted({"thigh_length": 0.4, "shank_length": 0.2}).outside[:1])
    assert gap.name == "thigh"
    assert str(gap).endswith(" for its size)")


def test_the_page_of_learning_tells_the_lengths_that_the_family_is_valid_for() -> None:
    known = open_policy(FAMILY).known
    ends = dict(zip(FEATURES, np.exp(np.transpose(known)).tolist(), strict=True))
    page = " ".join((Path(__file__).parents[3] / "docs/learning.md").read_text("utf-8").split())
    legs = [f"{REFERENCE_LEG * end:.3f}" for end in ends["leg length"]]
    assert f"its legs are {legs[0]} to {legs[1]} m long" in page
    low, high = ends["thigh"]
    assert f"its thighs {low:.3f} to {high:.3f} of that" in page
    assert f"legs of 0.68 m thighs of {0.68 * low:.3f} to {0.68 * high:.3f} m" in page


def test_features_are_readable_in_units_of_the_body() -> None:
    one = robot({"thigh_length": 0.3, "actuators.leg.peak_torque": 60.0})
    found = dict(zip(FEATURES, readable(features(one), one).tolist(), strict=True))
    assert len(UNITS) == len(FEATURES)
    assert found["leg length"] == pytest.approx(one.leg_length)
    assert found["mass"] == pytest.approx(one.mass)
    assert found["height"] == pytest.approx(one.height)
    assert found["thigh"] == pytest.approx(0.3)
    assert found["peak torque of knee"] == pytest.approx(60.0)
    assert found["no-load speed of knee"] == pytest.approx(one.no_load_speed[2])


def test_the_motors_and_home_are_those_of_the_design() -> None:
    values = {"actuators.leg.peak_torque": 60.0, "actuators.leg.no_load_speed": 30.0, "crouch": 1.2}
    design = SPEC.resolve(values)
    found, trained = fit(preview(design)).policy, open_policy(FAMILY)
    assert found.peak_torque == pytest.approx(60.0)
    assert found.no_load_speed == pytest.approx(30.0)
    # Training gives servos a stiffness per peak torque.
    assert found.stiffness == pytest.approx(trained.stiffness * 60.0 / trained.peak_torque)
    assert found.home == pytest.approx([scalar(joint.home) for joint in design.joints.values()])


@pytest.mark.parametrize("length", [0.22, 0.34])
def test_the_family_walks_bodies_of_its_region(length: float) -> None:
    model = preview(SPEC.resolve({"thigh_length": length}))
    walk = Walk(model, fit(model), (1.0, 0.0, 0.0))
    walk.advance(2.0)
    start = walk.data.qpos[0]
    walk.advance(4.0)
    assert walk.falls == 0
    assert (walk.data.qpos[0] - start) / 4.0 == pytest.approx(1.0, abs=0.2)


def test_a_robot_that_no_policy_drives_names_the_command_that_trains_one() -> None:
    many = draft.load("humanoid").resolve().build()
    with pytest.raises(DraftError, match=r"no policy .* humanoid: .*\n.*draft train humanoid"):
        fit(many, "climb")


WEAK = {
    "hexapod": {"actuators.leg.peak_torque": 1.0},
    "biped": {"actuators.hip.peak_torque": 5.0},
    "humanoid": {"actuators.large.peak_torque": 5.0},
}


@pytest.mark.parametrize("robot", WEAK)
def test_the_policy_of_all_legs_drives_robots_that_no_other_drives(robot: str) -> None:
    design = draft.load(robot).resolve()
    found = fit(design.build())
    assert (found.name, found.outside) == (ANY_NAME, ())
    assert found.policy.joints == legged_robot(design).joints
    weak = fit(preview(design.spec.resolve({**design.values, **WEAK[robot]})))
    assert weak.outside[0].name.startswith("peak torque of the ")
    assert weak.outside[0].unit == "N m"
    assert weak.outside[0].value < weak.outside[0].low
    assert "outside the region of the policy of any legs: peak torque " in weak.warning


@pytest.mark.parametrize(
    ("words", "command"),
    [
        (("bear",), "quadruped:bear"),
        (("bear", {"thigh_length": 0.4}), "quadruped:bear --set thigh_length=0.4"),
        (({"payload": 5.0},), "quadruped --set payload=5.0"),
    ],
)
def test_the_command_that_trains_a_changed_design_has_its_changes(
    words: tuple, command: str
) -> None:
    assert train_command(SPEC.resolve(*words)) == f"draft train {command}"


def test_a_policy_of_ones_own_drives_before_those_that_ship_if_its_joints_fit() -> None:
    own, cheetah = policy("bear", "walk"), preview(SPEC.resolve("cheetah"))
    found = fit(cheetah, policies=[own])
    assert found.policy.file == own.file
    assert found.name == "quadruped:bear"
    # Its file was written before features were part of it: leg length and motors are compared.
    assert "leg length 0.48 m (trained at 0.74)" in found.warning
    assert not found.inside
    other = replace(own, joints=("a", "b"))
    assert fit(cheetah, policies=[other]).name == "quadruped:cheetah"
