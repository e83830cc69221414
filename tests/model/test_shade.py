"""Shade on the floor under robots, and pictures with it."""

from __future__ import annotations

import inspect
from pathlib import Path

import mujoco
import numpy as np
import pytest

from draft.errors import DraftError
from draft.model.picture import Exhibit, Pixels, draw
from draft.model.shade import shade, surface, triangles

ROOT = Path(__file__).resolve().parents[2]
DOWN = np.array([[0.0, 0.0, -1.0]])
TABLE = """
<mujoco><worldbody><body name="table"><freejoint name="base"/>
<geom type="box" size="0.3 0.2 0.01" pos="0 0 0.5" rgba="0 0 0 1"/>
<geom type="box" size="0.01 0.01 0.25" pos="0 0 0.25" rgba="0 0 0 1"/>
</body></worldbody></mujoco>
"""


def scene(geom: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{geom}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


AREAS = {
    '<geom type="box" size="1 2 3"/>': 88.0,
    '<geom type="sphere" size="0.5"/>': np.pi,
    '<geom type="ellipsoid" size="0.5 0.5 0.5"/>': np.pi,
    '<geom type="cylinder" size="0.5 1"/>': 2.5 * np.pi,
    '<geom type="capsule" size="0.5 1"/>': 3.0 * np.pi,
    '<geom type="plane" size="1 1 1"/>': 0.0,
}


@pytest.mark.parametrize("geom", AREAS)
def test_the_triangles_cover_the_surface_of_a_geom(geom: str) -> None:
    found = triangles(*scene(geom))
    sides = found[:, 1:] - found[:, :1]
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2
    assert area == pytest.approx(AREAS[geom], rel=0.02)


def test_points_are_spread_over_triangles_by_area() -> None:
    corners = np.array([[(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(5, 0, 0), (8, 0, 0), (5, 3, 0)]])
    points = surface(corners.astype(float), 1e-4)
    small = points[:, 0] < 2
    assert small.sum() == pytest.approx(5_000, abs=1)
    assert (~small).sum() == pytest.approx(45_000, abs=1)
    assert points[small].mean(axis=0) == pytest.approx((1 / 3, 1 / 3, 0), abs=0.01)


def test_a_box_shades_the_floor_below_it_and_nothing_else() -> None:
    found = shade(*scene('<geom type="box" size="0.3 0.2 0.1" pos="1 2 0.5"/>'), DOWN, 0.01)
    below = np.stack(np.meshgrid(np.linspace(0.72, 1.28, 30), np.linspace(1.82, 2.18, 30)), -1)
    assert found.at(below).min() > 0.95
    beside = np.array([(0.67, 2.0), (1.33, 2.0), (1.0, 1.77), (1.0, 2.23), (50.0, 0.0)])
    assert found.at(beside).max() == 0


def test_a_shadow_falls_where_the_ray_meets_the_floor() -> None:
    model = scene('<geom type="box" size="0.1 0.1 0.005" pos="0 0 1"/>')
    found = shade(*model, np.array([[0.5, -0.25, -1.0]]), 0.01)
    assert found.at(np.array((0.5, -0.25))) > 0.95
    assert found.at(np.zeros(2)) == 0


def test_half_the_lamps_give_half_the_shade() -> None:
    model = scene('<geom type="box" size="0.1 0.1 0.005" pos="0 0 1"/>')
    found = shade(*model, np.array([[0.0, 0.0, -1.0], [1.0, 0.0, -1.0]]), 0.01)
    assert found.at(np.array([(0.0, 0.0), (1.0, 0.0)])) == pytest.approx(0.5, abs=0.03)


def picture(width: int = 300, elevation: float = -25) -> Pixels:
    exhibit = Exhibit(mujoco.MjSpec.from_string(TABLE), "base", 0.0, {})
    try:
        return draw([exhibit], (180, elevation), (width, 200))
    except DraftError as error:
        pytest.skip(f"no pictures here: {error}")


def test_the_shadow_of_a_table_has_no_steps() -> None:
    pixels = picture().astype(int)
    lit = pixels[:, :, 0] > 60
    floor = lit.copy()
    for axis in (0, 1):
        for by in (-2, -1, 1, 2):
            floor &= np.roll(lit, by, axis)
    bright = pixels[:, :, 0][floor]
    assert bright.max() - bright.min() > 60
    steps = np.abs(np.diff(pixels[:, :, 0], axis=1))[floor[:, 1:] & floor[:, :-1]]
    # The post's foot has a hard edge.
    assert np.quantile(steps, 0.99) <= 5
    assert np.quantile(steps, 0.9995) <= 8


def test_the_floor_far_from_a_robot_has_the_colour_of_the_background() -> None:
    pixels = picture(width=1000, elevation=-5)
    # Above the horizon, and on the floor to the left of the shadow.
    assert (pixels[0, 0] == pixels[-1, 0]).all()
    assert (pixels[0] == pixels[0, 0]).all()


def test_all_pictures_have_the_same_lamps() -> None:
    assert list(inspect.signature(draw).parameters) == ["exhibits", "view", "size", "flat"]
    files = [*(ROOT / "src").rglob("*.py"), *(ROOT / "docs").rglob("*.py")]
    own = {path.stem for path in files if "mujoco.Renderer(" in path.read_text(encoding="utf-8")}
    # The doctor tries a renderer in a process of its own.
    assert own == {"picture", "doctor"}
