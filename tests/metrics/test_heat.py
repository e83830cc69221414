"""What the actuators can sustain: by hand, against MuJoCo, and for N designs at once."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.cli import main
from draft.design.legs import legs
from draft.design.loads import home_loads, loads
from draft.explore.where import condition
from draft.laws import limits
from draft.metrics import Carry, carry, find, of_design, overload, payload_for
from draft.metrics.heat import LIMITS, hold_time_fold
from draft.metrics.statics import payload_at, payload_peak
from draft.values import scalar
from tests.helpers import parameter, robot
from tests.metrics.test_physics import PLANAR, tuned
from tests.metrics.test_registry import SHIPPED, shipped

QUADRUPED = draft.load("quadruped")


@pytest.mark.parametrize(("name", "label"), SHIPPED)
def test_standing_takes_the_share_of_its_worst_joint(name: str, label: str | None) -> None:
    design = shipped(name, label)
    worst = max(abs(x.torque) / x.actuator.rated_torque for x in home_loads(design))
    assert of_design(design, ["standing_torque_rated"])["standing_torque_rated"] == worst


@pytest.mark.parametrize(("name", "label"), SHIPPED)
@pytest.mark.parametrize("share", [1.0, 1.5, None], ids=["rated", "1.5 rated", "peak"])
def test_with_its_payload_one_joint_is_at_its_share_of_the_torque(
    name: str, label: str | None, share: float | None
) -> None:
    design = shipped(name, label)
    payload = payload_peak(design) if share is None else payload_at(design, share)
    found = []
    for x in loads(design):
        most = x.actuator.peak_torque if share is None else share * x.actuator.rated_torque
        found.append(abs(x.torque + payload * x.per_mass) / most)
    assert max(found) == pytest.approx(1)
    if share == 1.0:
        assert of_design(design, ["payload_rated"])["payload_rated"] == payload


def test_the_old_name_of_the_payload_is_an_error_that_names_the_new_ones() -> None:
    with pytest.raises(draft.DraftError, match=r"'payload' was renamed.*\n.*payload_peak"):
        find("payload")
    with pytest.raises(draft.DraftError, match="payload_rated"):
        condition(QUADRUPED, "mass < 40 and payload > 100")


def test_a_parameter_may_be_called_payload() -> None:
    spec = robot(parameters={"payload": parameter(0.5)})
    assert condition(spec, "payload > 0.2").metrics == ()


# --- time ----------------------------------------------------------------------------------


@given(st.floats(1, 3000), st.floats(0.2, 5))
def test_the_torque_for_a_time_is_held_for_that_time(seconds: float, fold: float) -> None:
    share = limits.torque_for(seconds, fold)
    assert limits.hold_time(share, fold) == pytest.approx(seconds, rel=1e-6)


@given(st.floats(0.74, 4), st.floats(1.01, 2))
def test_more_torque_is_held_for_a_shorter_time(share: float, by: float) -> None:
    assert limits.hold_time(share * by) < limits.hold_time(share)


def test_a_torque_below_the_continuous_one_is_held_without_end() -> None:
    stall = limits.limits().stall_share.coefficient
    assert limits.hold_time(0.99 * stall) == math.inf
    assert 0.65 <= stall <= 0.75
    found = of_design(QUADRUPED.resolve("cheetah"), ["hold_time"])
    assert found["hold_time"] == math.inf


def test_twice_the_continuous_torque_is_held_for_about_half_a_minute() -> None:
    stall = limits.limits().stall_share.coefficient
    assert 22 <= limits.hold_time(2 * stall) <= 51  # median 33 s of seven modules


def test_a_weak_robot_stands_for_the_time_of_its_worst_joint() -> None:
    weak = tuned(QUADRUPED.resolve("cheetah"), rated_torque=0.2)
    found = of_design(weak, ["hold_time", "standing_torque_rated"])
    assert found["hold_time"] == limits.hold_time(found["standing_torque_rated"])
    assert math.isfinite(float(found["hold_time"]))


def test_a_payload_for_longer_is_smaller_and_its_band_spans_it() -> None:
    design = QUADRUPED.resolve("cheetah")
    hour, ten, moment = (payload_for(design, seconds) for seconds in (3600, 10, 1e-3))
    assert hour.mass < ten.mass < moment.mass
    assert moment.mass == of_design(design, ["payload_peak"])["payload_peak"]
    for found in (hour, ten):
        assert found.low < found.mass < found.high
    # A part's own rating leaves the error of the time alone.
    own = payload_for(QUADRUPED.resolve("bear"), 3600)
    share = limits.torque_for(3600, 1 / hold_time_fold())
    assert own.low == pytest.approx(payload_at(QUADRUPED.resolve("bear"), share))


@pytest.mark.parametrize("seconds", [0.0, -1.0, math.inf, math.nan])
def test_a_payload_for_no_time_is_refused(seconds: float) -> None:
    with pytest.raises(draft.DraftError, match="give a time above zero"):
        payload_for(QUADRUPED.resolve(), seconds)


# --- carrying ------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "label"), SHIPPED)
def test_standing_it_carries_just_its_rated_payload(name: str, label: str | None) -> None:
    design = shipped(name, label)
    payload = float(of_design(design, ["payload_rated"])["payload_rated"])
    if payload < 0:
        assert not carry(design, 0.0).accepted
        return
    found = carry(design, payload)
    assert found.margin == pytest.approx(1)
    assert found.limit == "rated torque"
    assert carry(design, 0.99 * payload).accepted
    assert not carry(design, 1.01 * payload).accepted


def test_a_walking_planar_leg_by_hand() -> None:
    design = PLANAR.resolve()
    mass, speed = 2.0, 0.4
    (kind,) = legs(design)
    hip, knee = kind.joints
    # Two joints move the foot in a plane: no lift, and backwards at the speed.
    columns = np.array([[hip.sweep, knee.sweep], [hip.lift, knee.lift]], dtype=float)
    rates = np.linalg.solve(columns, np.array([speed, 0.0]))
    margins: list[float] = []
    for load, rate in zip(loads(design), rates, strict=True):
        swing = 9.81 * float(load.joint.hang)
        held = swing - 2 * (design.mass + mass) * 9.81 * float(load.joint.lift)
        a = load.actuator
        margins += [
            a.rated_torque / math.sqrt((held**2 + swing**2) / 2),
            a.peak_torque * (1 - abs(rate) / a.no_load_speed) / abs(held),
        ]
    margins.append(float(of_design(design, ["top_speed"])["top_speed"]) / speed)
    assert carry(design, mass, speed).margin == pytest.approx(min(margins))


@given(st.floats(0, 50), st.floats(0, 2), st.floats(0, 20), st.floats(0, 1))
def test_more_mass_or_speed_never_helps(mass: float, speed: float, more: float, on: float) -> None:
    design = QUADRUPED.resolve("bear")
    before = carry(design, mass, speed)
    assert carry(design, mass + more, speed).margin <= before.margin * (1 + 1e-12)
    assert carry(design, mass, speed + on).margin <= before.margin * (1 + 1e-12)


def test_a_speed_beyond_the_top_speed_is_refused_for_that() -> None:
    found = carry(QUADRUPED.resolve("cheetah"), 0.0, 4.0)
    assert (found.accepted, found.limit) == (False, LIMITS[2])


def test_many_designs_carry_what_each_of_them_does() -> None:
    torques = np.array([20.0, 40.0, 72.0, 110.0])
    many = QUADRUPED.resolve({"actuators.leg.peak_torque": torques})
    together = carry(many, np.array([0.0, 10.0, 30.0, 5.0]), 1.0)
    for i, mass in enumerate((0.0, 10.0, 30.0, 5.0)):
        one: Carry = carry(many[i], mass, 1.0)
        assert np.asarray(together.margin)[i] == pytest.approx(one.margin)
        assert together.joint[i] == one.joint
        assert together.limit[i] == one.limit
        assert np.asarray(together.accepted)[i] == one.accepted
    same = carry(QUADRUPED.resolve({"crouch": np.array([1.0, 1.0])}), 5.0)
    assert np.shape(same.margin) == (2,)


@pytest.mark.parametrize(("mass", "speed"), [(-1.0, 0.0), (1.0, -0.5), (math.nan, 0.0)])
def test_a_negative_mass_or_speed_is_refused(mass: float, speed: float) -> None:
    with pytest.raises(draft.DraftError, match="give zero or more"):
        carry(QUADRUPED.resolve(), mass, speed)


# --- the finding ---------------------------------------------------------------------------


def test_standing_above_the_rated_torque_is_a_warning_at_each_such_joint() -> None:
    assert "thermal" not in {f.id for f in QUADRUPED.resolve("cheetah").findings}
    design = QUADRUPED.resolve({"actuators.leg.rated_torque": 5.0})
    found, rear = (f for f in design.findings if f.id == "thermal")
    assert (found.where, found.severity) == ("FL_knee", "warning")
    assert rear.where == "RL_knee"
    assert found.limit == 5.0
    assert "above the rated torque 5 N m of 'leg'" in found.message
    assert design.accepted


def test_a_payload_below_zero_is_a_joint_above_its_rated_torque_alone() -> None:
    humanoid = draft.load("humanoid").resolve()
    found = overload(humanoid)
    assert found is not None
    assert (found.joint, found.torque > found.rated) == ("left_knee", True)
    numbers = of_design(humanoid, ["payload_rated", "standing_torque_rated"])
    rated, share = (scalar(number) for number in numbers.values())
    knee = next(x for x in loads(humanoid) if x.joint.names[0] == found.joint)
    # The mass that would have to go for the knee to be at its rated torque.
    assert rated == pytest.approx((found.rated - found.torque) / abs(scalar(knee.per_mass)))
    assert rated < 0
    assert share < 1  # the home pose is straighter
    stronger = humanoid.spec.resolve({"actuators.large.rated_torque": found.torque * 1.01})
    assert overload(stronger) is None
    assert scalar(of_design(stronger, ["payload_rated"])["payload_rated"]) > 0


@pytest.mark.parametrize("command", ["metrics", "show"])
def test_a_payload_below_zero_is_said_as_what_it_is(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    def said(*words: str) -> str:
        main([command, *words])
        return " ".join(capsys.readouterr().out.split())

    words = "the robot cannot hold its own weight at rated torque in the crouch. It is 2.45 kg too"
    assert f"{words} heavy: left_knee needs 29.6 of 28.1 N m." in said("humanoid")
    assert "cannot hold" not in said("cheetah")
    assert "cannot hold its own weight and its payload" in said("cheetah", "--payload", "60")
