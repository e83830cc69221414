"""Shadow of a robot on the floor of the studio, without a browser."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import draft

pytest.importorskip("viser", reason="needs the extra 'view'")

from draft.model.scene import home_position
from draft.studio.scene3d import shadow
from draft.studio.skins import outline, skins


def test_a_point_on_the_floor_is_its_own_shadow_and_higher_ones_lie_farther() -> None:
    points = np.array([[1.0, 2.0, 0.0], [1.0, 2.0, 0.5], [1.0, 2.0, 1.0]], np.float32)
    flat = shadow(points)
    assert flat[0, :2] == pytest.approx([1.0, 2.0])
    assert np.ptp(flat[:, 2]) == 0.0
    assert 0.0 < flat[0, 2] < 0.005
    away = flat[:, :2] - points[:, :2]
    assert away[2] == pytest.approx(2 * away[1])
    assert np.linalg.norm(away[1]) > 0.1


def test_the_coarse_shadow_is_that_of_the_robot_and_has_less_than_half_of_its_triangles() -> None:
    model = draft.load("quadruped").resolve().build()
    data = mujoco.MjData(model.mujoco)
    data.qpos[:] = home_position(model.design)
    mujoco.mj_kinematics(model.mujoco, data)
    fine, coarse = skins(model).values(), outline(model)
    assert len(coarse.faces) < 0.5 * sum(len(skin.faces) for skin in fine)
    exact = shadow(np.concatenate([skin.placed(data) for skin in fine]))
    drawn = shadow(coarse.placed(data))
    assert drawn.min(axis=0) == pytest.approx(exact.min(axis=0), abs=0.005)
    assert drawn.max(axis=0) == pytest.approx(exact.max(axis=0), abs=0.005)
