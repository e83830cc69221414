"""Rolling: against MuJoCo on a floor and a slope, and in closed form."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from draft.design.machine import machine
from draft.errors import DraftError
from draft.metrics import METRICS, limits, of_design
from draft.metrics.rolling import RESISTANCE, driven_wheels, rolling_power_at
from draft.values import scalar
from tests.helpers import parameter, robot, wheeled

OWN = [name for name, one in METRICS.items() if one.base == "wheels"]


def test_only_robots_on_driven_wheels_have_them() -> None:
    assert OWN == ["rolling_speed", "slope_peak", "slope_rated", "rolling_power"]
    found = of_design(wheeled().resolve())
    assert all(0 < scalar(found[name]) < math.inf for name in OWN)
    walking = robot().resolve()
    assert not {*OWN} & {*of_design(walking)}
    with pytest.raises(DraftError, match="robots on driven wheels; this one has none"):
        of_design(walking, ["rolling_speed"])


def test_the_machine_is_called_by_its_wheels() -> None:
    assert machine(wheeled().resolve()) == "robot on 4 legs with wheels"
    assert machine(robot().resolve()) == "robot on 1 leg"


def test_the_speed_is_where_the_line_meets_the_resistance() -> None:
    """12 N m and 40 rad/s on 0.09 m; a quarter of 0.015 of the weight on each wheel."""
    design = wheeled().resolve()
    torque = RESISTANCE * scalar(design.mass) * 9.81 * 0.09 / 4
    wanted = 0.09 * 40.0 * (1 - torque / 12.0)
    assert scalar(of_design(design, ["rolling_speed"])["rolling_speed"]) == pytest.approx(wanted)
    first = limits(design, ["rolling_speed"])["rolling_speed"][0]
    assert first.quantity == "torque-speed line"
    assert len(first.joints) == 4


@pytest.mark.parametrize(("quantity", "name"), [("peak", "slope_peak"), ("rated", "slope_rated")])
def test_a_slope_takes_the_torques_that_mujoco_needs_to_hold_there(
    quantity: str, name: str
) -> None:
    """The work of the weight for a small motion along the slope is that of the wheels' torques."""
    design = wheeled().resolve()
    angle = scalar(of_design(design, [name])[name])
    model = design.build().mujoco
    model.opt.gravity[:] = 9.81 * np.array([-math.sin(angle), 0.0, -math.cos(angle)])
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    wheels = driven_wheels(design)
    own = sum(scalar(getattr(w.actuator, f"{quantity}_torque")) / 0.09 for w in wheels)
    if own >= 9.81 * scalar(design.mass):
        assert angle == pytest.approx(math.pi / 2)
    else:
        assert data.qfrc_bias[0] == pytest.approx(own, rel=1e-6)


def test_the_power_is_that_of_standing_and_of_the_wheels() -> None:
    design = wheeled().resolve()
    motor = design.actuators["wheel"]
    torque = RESISTANCE * scalar(design.mass) * 9.81 * 0.09 / 4
    for speed in (0.0, 1.0, 2.0):
        wheel = torque * speed / 0.09 + scalar(motor.copper_loss) * torque**2
        standing = scalar(of_design(design, ["standing_power"])["standing_power"])
        assert scalar(rolling_power_at(design, speed)) == pytest.approx(standing + 4 * wheel)
    assert np.isnan(rolling_power_at(design, 5.0))


def test_many_designs_have_the_numbers_of_each() -> None:
    disc = {"radius": "tyre", "width": 0.04, "axis": "y", "mass": 0.6, "site": "foot"}
    spec = wheeled({"wheel": disc}, parameters={"tyre": parameter(0.09, 0.05, 0.2)})
    many = spec.resolve({"tyre": np.array([0.07, 0.11])})
    together = of_design(many, OWN)
    for row in range(2):
        alone = of_design(many[row], OWN)
        for name in OWN:
            assert np.asarray(together[name])[row] == pytest.approx(scalar(alone[name]))
