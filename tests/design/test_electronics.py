"""Power of computers, sensors and idle drives: stated, or usual for the robot's mass."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import draft
from draft.design.electronics import electronics
from draft.errors import DraftError
from draft.laws.limits import limits
from draft.metrics import of_design, travel
from tests.written import edit, write_robot


def stated(folder: Path, value: str) -> draft.Design:
    robot = write_robot(folder)
    edit(robot, "parameters.yaml", "actuators:", f"electronics_power: {value}\nactuators:")
    return draft.load(robot).resolve()


def test_the_law_is_the_median_power_per_mass_of_robots_that_stand() -> None:
    # By hand from the table: 202/32.5, 186/50, 360/95, 180/43 and 311/57.12 W/kg.
    assert limits().electronics_power.coefficient == pytest.approx(180 / 43, rel=1e-3)
    assert limits().electronics_power.n == 5


def test_without_a_statement_it_is_usual_for_the_mass_without_the_payload() -> None:
    robot = draft.load("quadruped")
    plain, loaded = robot.resolve("cheetah"), robot.resolve("cheetah", {"payload": 10})
    assert electronics(plain).power == pytest.approx(
        limits().electronics_power.coefficient * plain.mass
    )
    assert electronics(loaded).power == pytest.approx(electronics(plain).power)
    low, high = electronics(plain).band
    assert low < electronics(plain).power < high


def test_a_stated_power_is_taken_and_may_be_an_expression(tmp_path: Path) -> None:
    assert electronics(stated(tmp_path / "a", "120")).power == 120
    found = electronics(stated(tmp_path / "b", "2 * 30"))
    assert (found.power, found.law, tuple(found.band)) == (60, None, (60, 60))


@pytest.mark.parametrize("value", ["0", "-5"])
def test_a_power_that_is_not_above_zero_is_refused_at_its_place(tmp_path: Path, value: str) -> None:
    with pytest.raises(DraftError) as error:
        stated(tmp_path, value)
    assert error.value.problems[0].where is not None
    assert "the power of the electronics" in str(error.value)


def test_it_is_part_of_what_the_battery_feeds(tmp_path: Path) -> None:
    less, more = (stated(tmp_path / name, name) for name in ("100", "300"))
    powers = [of_design(one, ["standing_power"])["standing_power"] for one in (less, more)]
    assert powers[1] - powers[0] == pytest.approx(200)
    hours = [of_design(one, ["endurance_standing"])["endurance_standing"] for one in (less, more)]
    assert hours[0] / hours[1] == pytest.approx(powers[1] / powers[0])
    moving = [travel(one, power=400, speed=1.0) for one in (less, more)]
    assert moving[1].cost_of_transport / moving[0].cost_of_transport == pytest.approx(700 / 500)


def test_many_designs_have_the_power_of_each() -> None:
    robot = draft.load("quadruped")
    many = robot.resolve("cheetah", {"thigh_length": np.array([0.2, 0.3])})
    each = [robot.resolve("cheetah", {"thigh_length": x}) for x in (0.2, 0.3)]
    expected = [float(electronics(one).power) for one in each]
    np.testing.assert_allclose(electronics(many).power, expected, rtol=1e-12)
