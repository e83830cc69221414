"""Slots of joints: the same for all legs, whatever joints are called or which way they turn."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest
import yaml

import draft
from draft.errors import DraftError
from draft.learn.bodies.generated import KINDS, generate, generate_kind
from draft.learn.bodies.legged import LeggedRobot, by_topology, legged_robot
from draft.learn.bodies.padding import LAYOUTS, mirror_image, places, size
from draft.learn.bodies.payload import model_spec
from draft.learn.bodies.slots import (
    FEATURES,
    LEGS,
    OF_JOINT,
    ROLES,
    SLOTS,
    describe,
    feature_names,
    feature_units,
    mirrored_features,
    mirrored_slots,
    readable_slots,
    servo_torque,
    slot_features,
    slots_of,
    traits,
)
from draft.model import pose

ROBOTS = {name: legged_robot(draft.load(name).resolve()) for name in ("quadruped", "humanoid")}
ROBOTS |= {name: generate_kind(name, 1).members[0] for name in KINDS}


def named(member: LeggedRobot) -> dict[str, str]:
    """Slot of each joint in words, by its name."""
    slots = slots_of(member).joints
    return {
        joint: f"{LEGS[slot // len(ROLES)]} {ROLES[slot % len(ROLES)]}"
        for joint, slot in zip(member.joints, slots, strict=True)
        if slot >= 0
    }


def test_joints_have_the_slots_of_their_place_and_role() -> None:
    quadruped, hexapod = named(ROBOTS["quadruped"]), named(ROBOTS["hexapod"])
    assert quadruped["FL_hip_roll"] == "left front roll"
    assert quadruped["RR_knee"] == "right rear knee"
    assert hexapod["LM_swing"] == "left middle yaw"
    assert hexapod["RF_lift"] == "right front pitch"
    four = named(ROBOTS["biped_of_four"])
    assert list(four.values())[:4] == [
        f"left middle {role}" for role in ("roll", "pitch", "knee", "ankle pitch")
    ]
    humanoid = named(ROBOTS["humanoid"])  # Pitch, roll and yaw, from the trunk outwards.
    assert humanoid["left_hip_yaw"] == "left middle yaw"
    assert humanoid["right_ankle_roll"] == "right middle ankle roll"
    assert not any("shoulder" in name or "waist" in name for name in humanoid)


@pytest.mark.parametrize("name", ROBOTS)
def test_no_two_joints_share_a_slot_and_mirrored_joints_have_mirrored_slots(name: str) -> None:
    member = ROBOTS[name]
    slots = slots_of(member)
    used = [slot for slot in slots.joints if slot >= 0]
    assert len(set(used)) == len(used)
    mirror = mirrored_slots()
    for joint, slot in enumerate(slots.joints):
        other = member.mirror[joint]
        assert slots.joints[other] == (mirror[slot] if slot >= 0 else -1)
        if slot >= 0:
            assert slots.signs[joint] * member.mirror_sign[joint] == slots.signs[other]


@pytest.mark.parametrize("name", ROBOTS)
def test_a_body_that_is_its_own_mirror_image_has_mirrored_numbers(name: str) -> None:
    (own,) = np.array(slot_features([ROBOTS[name]]))
    assert own.shape == (FEATURES,)
    assert own == pytest.approx(own[mirrored_features()], abs=1e-9)


def test_the_order_of_joints_does_not_matter() -> None:
    member = ROBOTS["quadruped"]
    rng = np.random.default_rng(0)
    order = rng.permutation(len(member.joints))
    place = np.argsort(order)

    def taken(values: tuple) -> tuple:
        return tuple(values[i] for i in order)

    joints = ("joints", "ranges", "peak_torque", "no_load_speed", "mirror_sign", "motor_heat")
    other = replace(
        member,
        leg_joints=tuple(tuple(int(place[j]) for j in leg) for leg in member.leg_joints),
        mirror=tuple(int(place[member.mirror[i]]) for i in order),
        **{name: taken(getattr(member, name)) for name in joints},
    )
    # The model keeps its order: positions of joints are those of its text.
    slots, known = slots_of(member), named(member)
    assert tuple(slots_of(other).joints) == taken(slots.joints)
    assert named(other) == known


def test_numbers_of_a_family_are_those_of_each_body_alone() -> None:
    first, second = generate_kind("quadruped", 2).members
    numbers = np.array(slot_features([first, second]))
    assert numbers == pytest.approx(np.array([describe(one)[1] for one in (first, second)]))


def test_a_leg_with_too_many_joints_is_refused() -> None:
    member = ROBOTS["biped"]
    # Both legs as one: six joints above the last knee.
    wrong = replace(member, leg_joints=(tuple(sum(member.leg_joints, ())),) * 2)
    with pytest.raises(DraftError, match="more than"):
        slots_of(wrong)


@pytest.mark.parametrize("group", LAYOUTS)
def test_the_mirror_image_of_the_mirror_image_is_the_observation(group: str) -> None:
    source, sign = mirror_image(group)
    values = np.random.default_rng(0).normal(size=size(group))
    once = values[source] * sign
    assert once[source] * sign == pytest.approx(values)
    assert sorted(source) == list(range(size(group)))


def test_entries_of_joints_without_a_slot_go_nowhere() -> None:
    member = ROBOTS["humanoid"]
    terms = [("joint_pos", len(member.joints)), ("base_lin_vel", 3)]
    where = places("actor", terms, slots_of(member))
    arm = member.joints.index("left_elbow")
    assert where.entry[arm] == -1
    assert where.entry[-3:].tolist() == [0, 1, 2]
    source = where.sources("actor")
    assert (source < len(where.entry)).sum() == 12 + 3


def test_generated_bodies_are_of_all_kinds_and_stand() -> None:
    kinds = generate(20)
    assert [len(one.members) for one in kinds] == [8, 2, 3, 2, 4, 2]
    members = [member for one in kinds for member in one.members]
    assert [len(group) for group in by_topology(members)] == [8, 2, 3, 2, 4, 2]
    for one in kinds:
        for text in one.texts:
            assert one.spec.resolve(yaml.safe_load(text)["values"]).accepted


@pytest.mark.parametrize("kind", [name for name in KINDS if "biped" in name or name == "humanoid"])
def test_drawn_bodies_on_two_legs_stand_on_level_feet(kind: str) -> None:
    """Also where the axis of the hip pitch slants, and no foot or knee looks aside."""
    for member in generate_kind(kind, 12, seed=2).members:
        model = model_spec(member).compile()
        data = mujoco.MjData(model)
        pose.put(model, data, member.home)
        mujoco.mj_forward(model, data)
        for foot in member.feet:
            turned = data.site(foot).xmat.reshape(3, 3)
            np.testing.assert_allclose(turned, np.eye(3), atol=1e-6)
        for joint in member.joints:
            if joint.endswith("knee"):
                np.testing.assert_allclose(data.joint(joint).xaxis, (0.0, 1.0, 0.0), atol=1e-6)


def test_equal_seeds_draw_equal_bodies_and_others_do_not() -> None:
    first, again, other = (generate_kind("biped", 2, seed).members for seed in (3, 3, 4))
    assert first == again
    assert first[0] != other[0]


def test_knees_away_from_each_other_are_kept_for_tests() -> None:
    members = generate_kind("quadruped", 40).members
    bends = {
        tuple(np.sign([member.home[member.joints.index(f"{leg}_knee")] for leg in ("FL", "RL")]))
        for member in members
    }
    assert bends == {(-1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)}
    assert SLOTS == 36


def test_a_positive_knee_bends_further_whichever_way_it_bends() -> None:
    bends = []
    for member in generate_kind("quadruped", 12).members:
        slots, own = describe(member)
        model = model_spec(member).compile()
        data = mujoco.MjData(model)
        for leg, foot in zip(member.leg_joints, member.feet, strict=True):
            knee, lengths = leg[-1], []
            for more in (0.0, 0.1):
                home = np.array(member.home)
                home[knee] += slots.signs[knee] * more
                pose.put(model, data, home)
                hip = data.xanchor[model.joint(member.joints[leg[1]]).id]
                lengths.append(np.linalg.norm(data.site_xpos[model.site(foot).id] - hip))
            assert lengths[1] < lengths[0]
            bends.append(own[len(OF_JOINT[:-1]) * SLOTS + slots.joints[knee]])
    assert min(bends) < 0 < max(bends)


def test_gains_of_hip_pitch_and_knee_are_for_what_the_weight_asks_of_weak_motors() -> None:
    member = ROBOTS["quadruped"]
    slots = slots_of(member)
    least = 0.6 * member.mass * 9.81 * member.leg_length
    weak = replace(member, peak_torque=(0.5 * least,) * len(member.joints))
    asked = [0.5 * least if name.endswith("roll") else least for name in member.joints]
    assert {round(x / least, 3) for x in asked} == {0.5, 1.0}
    assert servo_torque(weak, slots, 0.6) == pytest.approx(np.array(asked))
    strong = replace(member, peak_torque=(2 * least,) * len(member.joints))
    assert servo_torque(strong, slots, 0.6).tolist() == list(strong.peak_torque)
    assert servo_torque(weak, slots, 0.0).tolist() == list(weak.peak_torque)


def test_more_legs_share_the_weight() -> None:
    member = ROBOTS["hexapod"]
    weak = replace(member, peak_torque=(1e-3,) * len(member.joints))
    least = 4 / 6 * 0.6 * member.mass * 9.81 * member.leg_length
    assert servo_torque(weak, slots_of(member), 0.6).max() == pytest.approx(least)


def test_gains_on_two_legs_are_for_the_motors_alone() -> None:
    member = ROBOTS["biped"]
    assert servo_torque(member, slots_of(member), 9.0).tolist() == list(member.peak_torque)


def test_traits_are_torque_width_over_height_speed_and_size() -> None:
    """By a calculation of its own, from the model."""
    for name in ("quadruped", "hexapod"):
        member = ROBOTS[name]
        (found,) = traits(np.array(slot_features([member])))
        model = mujoco.MjModel.from_xml_string(member.xml)
        data = mujoco.MjData(model)
        pose.put(model, data, member.home)
        mujoco.mj_comPos(model, data)
        feet = np.array([data.site(name).xpos for name in member.feet])
        centre = data.subtree_com[0]
        hips = [leg[1] for leg in member.leg_joints]
        torque = np.mean([member.peak_torque[j] for j in hips])
        speed = np.mean([member.no_load_speed[j] for j in hips])
        weight = 9.81 * member.mass * member.leg_length
        assert found == pytest.approx(
            [
                np.log(torque / weight),
                np.abs(feet[:, 1]).mean() / (centre[2] - feet[:, 2].mean()),
                np.log(speed * np.sqrt(member.leg_length / 9.81)),
                np.log(member.scale),
            ],
            rel=1e-6,
        )


def test_yaw_joints_that_lean_with_the_thigh_have_one_sign() -> None:
    members = generate_kind("biped_slanting", 24).members
    leaning = []
    for member in members:
        model = model_spec(member).compile()
        data = mujoco.MjData(model)
        pose.put(model, data, member.home)
        axis = data.xaxis[model.joint("left_hip_yaw").id]
        sign = slots_of(member).signs[member.joints.index("left_hip_yaw")]
        assert sign * axis[2] > 0
        leaning.append(sign * axis @ (1.0, 0.8, 0.5))
    assert min(leaning) < 0 < max(leaning)  # Some lean so far that another rule parts them.


@pytest.mark.parametrize("name", ["cheetah", "humanoid", "hexapod"])
def test_the_numbers_of_a_body_are_read_back_in_their_units(name: str) -> None:
    member = legged_robot(draft.load("quadruped" if name == "cheetah" else name).resolve())
    slots, own = describe(member)
    names = dict(zip(feature_names(), readable_slots(own, member), strict=True))
    assert len(names) == len(feature_units()) == len(own)
    for joint, slot in enumerate(slots.joints):
        if slot < 0:
            continue
        place = f"{LEGS[slot // len(ROLES)]} {ROLES[slot % len(ROLES)]}"
        assert names[f"{place} joints"] == 1.0
        assert names[f"peak torque of the {place}"] == pytest.approx(member.peak_torque[joint])
        assert names[f"no-load speed of the {place}"] == pytest.approx(member.no_load_speed[joint])
        bend, told = np.sin(member.home[joint]), np.sin(names[f"bend of the {place}"])
        if place.endswith("knee"):  # Which way it bends is told; its slot has it always positive.
            assert abs(told) == pytest.approx(abs(bend))
        else:
            assert told == pytest.approx(slots.signs[joint] * bend)
    for number, value in {
        "leg length": member.leg_length,
        "mass": member.mass,
        "legs": len(member.feet),
    }.items():
        assert names[number] == pytest.approx(value)
    model = model_spec(member).compile()
    data = mujoco.MjData(model)
    pose.put(model, data, member.home)
    mujoco.mj_comPos(model, data)
    feet = np.mean([data.site(foot).xpos for foot in member.feet], axis=0)
    ahead, _, above = data.subtree_com[0] - feet
    assert names["centre ahead"] == pytest.approx(ahead, abs=1e-9)
    assert names["centre above"] == pytest.approx(above)


def test_drawn_humanoids_carry_their_mass_ahead_of_their_feet_and_behind_them() -> None:
    """A policy that met one place of the centre of mass leans in all robots with another."""
    numbers = np.array(slot_features(generate_kind("humanoid", 60).members))
    ahead, above = numbers[:, FEATURES - 2], numbers[:, FEATURES - 1]
    assert ahead.min() < -0.04 < 0.04 < ahead.max()
    assert above.max() / above.min() > 1.3
