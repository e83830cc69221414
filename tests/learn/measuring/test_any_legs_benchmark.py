"""Roll-outs of a policy of all legs that holds the home pose: it stands, and follows nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mjlab")

import draft
from benchmarks import any_legs, untrained, zero_shot
from benchmarks.roll_outs import Case, Rolled, rolled_out
from draft.learn.bodies.generated import KINDS, generate_kind
from draft.learn.bodies.legged import legged_robot
from draft.learn.bodies.slots import slots_of
from draft.learn.measuring.policies import of_legs
from draft.learn.policy.onnx_file import of_layers
from draft.learn.policy.reduced import LegsPolicy
from draft.learn.policy.reduced import any_legs as any_legs_policy


@pytest.fixture(scope="module")
def legs() -> LegsPolicy:
    """The policy that ships, with actions of zero."""
    shipped = any_legs_policy()
    mean, divisor, layers = shipped.network.layers()
    weight, bias = layers[-1]
    layers[-1] = np.zeros_like(weight), np.zeros_like(bias)
    return replace(shipped, network=of_layers(mean, divisor, layers, shipped.network.metadata))


def test_robots_of_other_sizes_are_asked_by_their_own(legs: LegsPolicy) -> None:
    members = generate_kind("quadruped", 2, seed=5).members
    cases = (Case.ahead(0.5), Case("sideways", (0.0, 0.2, 0.0)), Case("turn", (0.0, 0.0, 0.3)))
    source = of_legs(legs, "legs", members[0])
    found = rolled_out(source, members, cases, replicas=2, seconds=1.0)
    assert found.fell.shape == (3, 2, 2)
    assert found.up(0) == 1.0
    for i, error in enumerate((0.5, 0.2, 0.0)):
        assert found.mean_error(i) == pytest.approx(error, abs=0.03)
        assert found.reached(i) == pytest.approx(0.0, abs=0.05)
        assert found.followed(i) == 0.0
    limit = found.limit(0)
    assert limit is not None
    assert limit["joint"] in members[0].classes


def test_a_strong_push_makes_robots_fall(legs: LegsPolicy) -> None:
    member = legged_robot(draft.load("quadruped").resolve())
    cases = (Case("stand", (0.0, 0.0, 0.0)), Case("push", (0.0, 0.0, 0.0), 5.0))
    source = of_legs(legs, "legs", member)
    found = rolled_out(source, [member], cases, replicas=4, seconds=2.0)
    assert found.up(0) > found.up(1)
    assert not found.fell[0].any()


def test_a_makers_robot_is_measured_and_another_file_is_told(
    legs: LegsPolicy, tmp_path: Path
) -> None:
    vendor = draft.export(draft.load("quadruped").resolve(), tmp_path / "vendor") / "robot.urdf"
    job = zero_shot.Job(legs, zero_shot.Entry("vendor", vendor), 1, 0.6)
    row = zero_shot.measured(job)
    assert (row["legs"], row["joints"], row["notes"]) == (4, 12, [])
    assert row["mass"] == pytest.approx(draft.load("quadruped").resolve().mass, rel=1e-3)
    assert list(row["cases"]) == ["0", "0.25", "0.5", "1", "push"]
    assert (row["outside"] > 0) == bool(row["farthest"])
    assert zero_shot.line(row).startswith("robot: vendor, legs: 4, joints: 12, 0: ")
    # Draft walks it with the policy of all quadrupeds, which stays up, and does not stand still.
    used = zero_shot.as_used(row)
    assert used["cases"] == row["family"]["cases"] != row["cases"]
    assert [*zero_shot.tables({"robots": [row]})] == [
        "quadrupeds",
        "quadrupeds, by the policy of all quadrupeds",
    ]
    nothing = tmp_path / "none.urdf"
    nothing.write_text("<robot name='none'/>")
    row = zero_shot.measured(replace(job, entry=zero_shot.Entry("none", nothing)))
    assert row["reason"]
    assert zero_shot.line(row).startswith("none: not measured: ")


def test_kinds_that_are_never_trained_can_be_drawn(tmp_path: Path) -> None:
    joints = {"knees O": (4, 12), "five joints a leg": (4, 20), "eight legs": (8, 24)}
    kinds = untrained.kinds(tmp_path)
    for name, of in joints.items():
        member = generate_kind(name, 1, 3, kinds).members[0]
        assert (len(member.feet), len(member.joints)) == of
        assert min(slots_of(member).joints) >= 0
    apart = generate_kind("knees O", 1, 3, kinds).members[0]
    bends = dict(zip(apart.joints, apart.home, strict=True))
    assert bends["FL_knee"] > 0 > bends["RL_knee"]


def test_each_kind_of_the_generator_has_a_bar() -> None:
    named = [name for names, *_ in any_legs.GROUPS.values() for name in names]
    assert sorted(named) == sorted(KINDS)


def test_a_top_speed_is_the_highest_at_which_four_of_five_stay_up() -> None:
    """Two robots at three commands, five roll-outs each; the second falls at all but the first."""
    fell = np.zeros((3, 5, 2))
    fell[1, :2, 1] = fell[2, 0, 0] = fell[2, :, 1] = 1
    velocity = np.zeros((3, 5, 2, 3))
    velocity[..., 0] = np.array([0.4, 0.9, 1.3])[:, None, None]
    velocity[2, 0, 0] = 9.0  # As it falls, it is fast.
    found = Rolled(tuple(map(Case.ahead, (0.5, 1.0, 1.5))), fell, velocity, fell, ())
    assert any_legs.top_speeds(found) == pytest.approx([1.3, 0.4])
