"""Measures of how a walk looks: what slides, what rolls, what vibrates."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

pytest.importorskip("PIL")
pytest.importorskip("imageio_ffmpeg")

from benchmarks import looks

_BALL = """
<mujoco>
  <option timestep="0.001"/>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1" friction="{friction} 0 0"/>
    <body name="ball" pos="0 0 0.1">
      <freejoint/>
      <geom name="foot" type="sphere" size="0.1" mass="2" friction="{friction} 0 0"/>
    </body>
  </worldbody>
</mujoco>
"""
_SPEED, _WEIGHT = 0.5, 2 * 9.81


def _contacts(friction: float, turning: float) -> tuple[float, float]:
    """Load [N] and speed of the contact [m/s] of a ball that moves along x and turns about y."""
    model = mujoco.MjModel.from_xml_string(_BALL.format(friction=friction))
    data = mujoco.MjData(model)
    for _ in range(500):  # It comes to rest on the ground.
        mujoco.mj_step(model, data)
    data.qvel[0], data.qvel[4] = _SPEED, turning
    mujoco.mj_forward(model, data)
    foot, floor = model.geom("foot").id, model.geom("floor").id
    (found,) = looks.contacts(model, data, {foot}, floor)
    assert looks.contacts(model, data, set(), floor) == []
    return found


def test_the_contact_of_a_ball_that_slides_has_its_speed() -> None:
    load, speed = _contacts(friction=1e-5, turning=0.0)
    assert load == pytest.approx(_WEIGHT, rel=1e-3)
    assert speed == pytest.approx(_SPEED, rel=1e-3)


def test_the_contact_of_a_ball_that_rolls_stands() -> None:
    _, speed = _contacts(friction=1.0, turning=_SPEED / 0.1)
    assert speed < 0.01 * _SPEED


@pytest.mark.parametrize(("frequency", "share"), [(3.0, 0.0), (20.0, 1.0)])
def test_vibration_is_the_share_of_the_power_above_its_frequency(
    frequency: float, share: float
) -> None:
    times = np.arange(0, 5, 0.005)
    wave = 0.7 + np.sin(2 * np.pi * frequency * times)
    assert looks.vibration(wave[:, None], 0.005) == pytest.approx(share, abs=1e-3)


def test_vibration_weighs_signals_by_their_power() -> None:
    times = np.arange(0, 5, 0.005)
    waves = [np.sin(2 * np.pi * 3 * times), 0.5 * np.sin(2 * np.pi * 20 * times)]
    assert looks.vibration(np.stack(waves, axis=1), 0.005) == pytest.approx(0.2, abs=1e-3)


def test_a_row_has_the_median_and_the_range_of_the_robots_that_stay_up() -> None:
    seen = [looks.Looks(0.4, 0.1 * k, 0.3, 0.02, -1.0, None) for k in (1, 2, 6)]
    row = looks.row_of("a", [*seen, None])
    assert (row["robots"], row["fell"]) == (4, 1)
    assert row["median"]["skating"] == pytest.approx(0.2)
    assert looks.cells(row)[:5] == ["a", "4", "1", "0.4 (0.4 to 0.4)", "0.2 (0.1 to 0.6)"]
    assert looks.cells(row)[-1] == ""  # No joints outside the legs.
