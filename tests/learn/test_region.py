"""Which policy drives a design, and what is said outside its region of validity."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.errors import DraftError
from draft.learn.policy import designs, policy
from draft.learn.region import Region, fit, numbers
from draft.model.model import preview
from draft.values import scalar


@pytest.fixture(scope="module")
def spec() -> draft.Spec:
    return draft.load("quadruped")


@pytest.mark.parametrize("name", designs())
def test_a_design_with_a_policy_gets_it_unchanged(spec: draft.Spec, name: str) -> None:
    found = fit(preview(spec.resolve(name)))
    assert found.inside
    assert found.warning == ""
    assert found.policy.file == policy(name).file
    np.testing.assert_array_equal(found.policy.stiffness, policy(name).stiffness)


@given(st.floats(0.26, 0.6))
def test_a_changed_length_is_outside_and_named_with_its_value(length: float) -> None:
    design = draft.load("quadruped").resolve({"thigh_length": length})
    found = fit(preview(design))
    assert not found.inside
    assert [one.name for one in found.outside] == ["thigh_length"]
    assert f"thigh_length {length:.4g} m (trained at " in found.warning
    assert found.region.name in ("quadruped:cheetah", "quadruped:bear")


def test_the_region_of_a_family_holds_what_lies_between_its_ends(spec: draft.Spec) -> None:
    ranges = {name: (x, x) for name, x in numbers(spec.resolve("cheetah")).items()}
    family = Region("family", ranges | {"thigh_length": (0.2, 0.3)})
    assert not family.outside(preview(spec.resolve({"thigh_length": 0.3})))
    (gap,) = family.outside(preview(spec.resolve({"thigh_length": 0.33})))
    assert str(gap) == "thigh_length 0.33 m (trained at 0.2 to 0.3)"
    assert gap.size == pytest.approx(0.1)


def test_stated_numbers_are_named_and_not_those_that_follow(spec: draft.Spec) -> None:
    found = fit(preview(spec.resolve({"actuators.leg.peak_torque": 60.0})))
    assert [one.name for one in found.outside] == ["actuators.leg.peak_torque"]


def test_outside_the_region_the_motors_and_home_are_those_of_the_design(spec: draft.Spec) -> None:
    values = {"actuators.leg.peak_torque": 60.0, "actuators.leg.no_load_speed": 30.0, "crouch": 1.2}
    design = spec.resolve(values)
    found, trained = fit(preview(design)).policy, policy("cheetah")
    assert found.peak_torque == pytest.approx(60.0)
    assert found.no_load_speed == pytest.approx(30.0)
    # Training gives servos a stiffness per peak torque.
    assert found.stiffness == pytest.approx(trained.stiffness * 60.0 / 72.0)
    assert found.home == pytest.approx([scalar(joint.home) for joint in design.joints.values()])
    assert found.file == trained.file


def test_the_nearest_policy_is_chosen(spec: draft.Spec) -> None:
    assert fit(preview(spec.resolve("giraffe"))).region.name == "quadruped:bear"
    assert fit(preview(spec.resolve({"thigh_length": 0.3}))).region.name == "quadruped:cheetah"


def test_a_robot_that_no_policy_drives_names_the_command_that_trains_one() -> None:
    with pytest.raises(DraftError, match=r"no policy drives .* humanoid\n.*draft train humanoid"):
        fit(draft.load("humanoid").resolve().build())
