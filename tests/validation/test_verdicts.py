"""The rule by which predictions are judged, and the published figures."""

from __future__ import annotations

import math

import pytest

from draft.validation.capabilities import Estimate
from draft.validation.published import UNITS, best, figures, of_robot
from draft.validation.verdicts import verdicts, walking_power


def judged(key: str, **values: float) -> dict[str, str]:
    found = {name: Estimate.exact(value) for name, value in values.items()}
    return {one.quantity: one.word for one in verdicts(key, 0.4, found)}


def test_the_figures_are_those_of_the_sources() -> None:
    assert {one.quantity for one in figures()} <= set(UNITS)
    assert {one.confidence for one in figures()} == {"A", "B", "C"}
    assert all(0 < one.low <= one.high and one.source for one in figures())
    fastest = best(of_robot("spot", "top_speed"))
    assert fastest is not None
    assert (fastest.high, fastest.confidence, fastest.condition) == (5.2, "A", "measured in paper")


@pytest.mark.parametrize(
    ("speed", "word"), [(3.29, "below"), (3.3, "right"), (9.0, "right"), (math.nan, "not measured")]
)
def test_a_limit_is_wrong_only_below_the_best_published_figure(speed: float, word: str) -> None:
    assert judged("unitree_a1", top_speed=speed)["top_speed"] == word


def test_a_speed_below_that_of_walking_is_a_claim_on_a_product() -> None:
    (slow,) = (x for x in verdicts("unitree_aliengo", 0.5, {}) if x.quantity == "top_speed")
    (fast,) = (x for x in verdicts("unitree_b2", 0.7, {}) if x.quantity == "top_speed")
    assert (slow.physical, fast.physical) == (False, True)


@pytest.mark.parametrize(
    ("watts", "word"), [(166, "outside"), (167, "within"), (374, "within"), (376, "outside")]
)
def test_energy_is_right_within_a_factor(watts: float, word: str) -> None:
    # X2 Ultra: 500 Wh over 2 h of walking.
    assert judged("agibot_x2_ultra", walking_power=watts)["walking_power"] == word


def test_a_time_that_is_not_of_walking_is_no_power_of_a_walk() -> None:
    # CyberDog 2: a mix of lying, standing and walking; H1: of what is not stated.
    for key in ("xiaomi_cyberdog2", "h1"):
        assert of_robot(key, "battery_energy")
        assert of_robot(key, "endurance")
        assert walking_power(key) is None


@pytest.mark.parametrize(("watts", "word"), [(100, "within"), (674, "within"), (676, "outside")])
def test_a_time_of_at_least_so_long_is_a_power_of_at_most_so_much(watts: float, word: str) -> None:
    # B2: 2250 Wh over more than 5 h of walking.
    found = walking_power("unitree_b2")
    assert found is not None
    assert (found[0].bound, found[1]) == ("most", 450.0)
    assert judged("unitree_b2", walking_power=watts)["walking_power"] == word


def test_a_bound_holds_for_all_below_it() -> None:
    # ANYmal: less than 280 W at full speed.
    assert judged("anymal_b", walking_power=100)["walking_power"] == "within"
    assert judged("anymal_b", walking_power=500)["walking_power"] == "outside"


def test_a_payload_without_a_definition_is_not_judged() -> None:
    assert judged("unitree_a1", payload_rated=1.0)["payload_walking"] == "not judged"
    assert judged("unitree_b2", payload_peak=119.0)["payload_peak"] == "below"


def test_a_robot_without_figures_has_no_verdicts() -> None:
    assert judged("nobody", top_speed=1.0) == {}
